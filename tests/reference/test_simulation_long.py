"""Time does not rot: long runs end as exact as short ones."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import impactsig
from impactsig import Oscillator, Rigid, Stop, scenes
from tests import naive, naive_simulate


def test_the_hundred_millionth_period_is_as_exact_as_the_first():
    """Phase is kept modulo 2 pi, and only the time that is told has the digits of its size."""
    beam = scenes.karpodinis(22.1)
    soon = impactsig.simulate(beam, periods=200, transient=2000)
    quiet = Oscillator(
        damping=beam.damping,
        forces=beam.forces,
        stops=(Stop(50, Rigid(0.2)),),
        time_unit=beam.time_unit,
    )
    x, _, phase = impactsig.simulate(quiet, periods=1e8, keep="counts").final
    ratio = naive.frequency_ratio(22.1)
    response = 0.25 / complex(1 - ratio**2, 0.06 * ratio)
    assert x == pytest.approx(response.real, abs=1e-14 * abs(response))
    assert phase == 0
    late = impactsig.simulate(beam, periods=200, transient=3e5)
    turn = 2 * pi
    at = late.impacts.time * 22.1 % 1 * turn
    was = soon.impacts.time * 22.1 % 1 * turn
    # What is left is the resolution of the printed time itself.
    assert np.median(at) == pytest.approx(np.median(was), abs=4 * turn * np.spacing(3.1e5))
    assert late.impacts.approach_velocity == pytest.approx(
        np.median(soon.impacts.approach_velocity), abs=1e-13
    )


def test_the_strobe_stays_where_it_was_for_a_million_periods():
    early = impactsig.simulate(scenes.karpodinis(22.1), periods=10, transient=3000)
    x, v, phase = early.final
    late = impactsig.simulate(
        scenes.karpodinis(22.1), periods=10, transient=1e6, initial=(x, v), phase=phase
    )
    assert late.final == pytest.approx(early.final, abs=1e-13)


def phase_and_speed(beam, periods):
    """Forcing phase and approach velocity of the first impact after so many periods from rest."""
    x, v, phase = impactsig.simulate(beam, periods=periods, keep="counts").final
    impacts = impactsig.simulate(beam, periods=2, initial=(x, v), phase=phase).impacts
    passed = impacts.time[0] / beam.time_unit * beam.angular_forcing_frequency
    return (phase + passed) % (2 * pi), impacts.approach_velocity[0]


@pytest.mark.parametrize(
    "periods", [1e4, 1e6 + 0.3, pytest.param(1e8, marks=pytest.mark.slow)]
)  # fmt: skip
def test_impacts_stay_at_their_phase(periods):
    """That of Shaw's and Holmes' orbit, whether ten thousand impacts came before or a million."""
    pytest.importorskip("mpmath")
    beam = scenes.karpodinis(22.1)
    speed, phase = naive_simulate.one_impact_orbit(0.03, 0.25, beam.angular_forcing_frequency, 0.2)
    found = phase_and_speed(beam, periods)
    assert abs(found[0] - float(phase)) < 1e-14
    assert abs(found[1] - float(speed)) < 1e-14


@pytest.mark.parametrize("count", [1_000_000, pytest.param(10_000_000, marks=pytest.mark.slow)])
def test_the_millionth_rebound_comes_when_it_must(count):
    """Off a wall at the rest position a free mass is back every half period, whatever its speed."""
    free = Oscillator(stops=(Stop(0, Rigid(1)),))
    motion = impactsig.simulate(free, duration=count * pi + 1, initial=(0, -0.3))
    assert motion.impact_count == count
    expected = pi * np.arange(1, count + 1)
    np.testing.assert_allclose(motion.impacts.time, expected, rtol=4e-16)
