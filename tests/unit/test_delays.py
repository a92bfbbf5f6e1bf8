"""By how much a sweep delays the loss of a motion, and what is taken off for it."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import Impacts, Rig
from impactsig.experiment._delays import delay_of, lost_at, transient_of
from impactsig.experiment._sweep import swept
from impactsig.experiment._transitions import jumps_in_sweeps

LOST, STEEPNESS = 21.0, 1.0
"""Frequency at which period(1,1) is lost downwards [Hz], and k of its exponent [1/Hz]."""


def parabola(rate, first, last, level, error=0.1, points=12):
    """A transient of the exponent k (f* - f): ln|A| = c - k f (f - f*)^2 / 2 rate."""
    f = np.linspace(first, last, points)
    size = level - STEEPNESS * f.mean() / rate * 0.5 * (f - LOST) ** 2
    return rate, np.column_stack([f, size, np.full(points, error)])


def test_two_parabolas_of_one_exponent_give_its_zero():
    growth = parabola(-0.02, 20.78, 20.74, -60.0)
    decay = parabola(0.02, 21.03, 21.1, -3.0)
    # The pace of either is that at its own mean frequency, 0.7 % from that at the mean of both.
    found, error = lost_at([growth, decay])
    assert found == pytest.approx(LOST, abs=0.005)
    assert 0 < error < 0.02
    one, error = lost_at([decay])
    assert one == pytest.approx(LOST, abs=1e-9)
    assert error > 0.005
    assert lost_at([]) is None
    straight = (0.02, np.column_stack([[21.0, 21.1, 21.2, 21.3], [-3.0, -4, -5, -6], [0.1] * 4]))
    assert lost_at([straight]) is None


def test_a_delay_is_told_with_its_error():
    growth = parabola(-0.02, 20.78, 20.74, -60.0)
    decay = parabola(0.02, 21.03, 21.1, -3.0)
    found = delay_of(20.73, -0.02, [growth, decay])
    assert found.value == pytest.approx(20.73 - LOST, abs=0.005)
    # Its own transient alone gives a bound, which holds the truth.
    alone = delay_of(20.73, -0.02, [growth])
    assert alone.value == pytest.approx(20.73 - 20.78, abs=1e-9)
    assert abs(20.73 - alone.value - LOST) < 2 * alone.error
    # 20 forcing periods where nothing is seen, or what is seen lies the other way.
    for seen in ([], [decay]):
        unseen = delay_of(20.73, 0.02, seen)
        assert unseen.value == 0
        assert unseen.error == pytest.approx(0.02 * 20 / 20.73)


def sweep_of(first, last, rate, seed):
    """A train whose phase is doubled below 21 Hz: y -> -exp(k (f* - f)) y / sqrt(1 + (y/a)^2)."""
    rng = np.random.default_rng(seed)
    f, y, begin, times = first, 1e-3, 0.0, []
    while (last - f) * rate > 0:
        size = np.exp(STEEPNESS * (LOST - f))
        y = -size * y / np.sqrt(1 + (y / 0.1) ** 2) + 1e-10 * rng.standard_normal()
        times.append(begin + (0.4 + y) / f)
        begin += 1 / f
        f += rate / f
    times = np.array(times) + 3e-6 * rng.standard_normal(len(times))
    return Impacts(times, start=0.0, duration=begin)


@pytest.mark.parametrize("rate", [0.02, pytest.param(0.04, marks=pytest.mark.slow)])
def test_jumps_of_sweeps_both_ways_meet_where_the_motion_is_lost(rate):
    rows = []
    for branch, first, last, pace in (("up", 20.5, 21.5, rate), ("down", 21.5, 20.5, -rate)):
        rig = Rig(channel=[{"number": 0}], sweep={"from": "law", "start": first, "rate": pace})
        rows.append((swept(sweep_of(first, last, pace, 1), rig, None), branch))
    up, down = jumps_in_sweeps(rows)
    assert up.after == down.before == "period(1,1)"
    assert {up.before, down.after} <= {"period(2,2)", "aperiodic"}
    assert down.value + down.delay < LOST - 0.15  # as it is seen
    for jump in (up, down):
        assert abs(jump.value - LOST) < min(3 * jump.error, 0.05)
    assert "before it is seen" in down.describe("Hz")


def test_what_decays_is_read_off_a_train():
    """Impacts a period apart; one is missed, and a jitter of 1e-4 hides the end."""
    k = np.arange(300.0)
    off = 0.02 * (-0.95) ** k + 1e-4 * np.random.default_rng(3).standard_normal(300)
    cycles = np.delete(k + off, 7)
    value, size, error = np.array(transient_of(cycles, lambda at: 20 + 1e-3 * at, 0, 1, 1)).T
    slope = np.polyfit(1e3 * (value - 20), size, 1, w=1 / error)[0]
    assert slope == pytest.approx(np.log(0.95), rel=0.05)
    assert error[-1] > 3 * error[0]
    still = k + 1e-4 * np.random.default_rng(3).standard_normal(300)
    assert transient_of(still, lambda at: 20 + 1e-3 * at, 0, 1, 1) == []
