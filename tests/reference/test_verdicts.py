"""Verdicts on trains whose motion is given by construction: drift, tones, bands, echoes, chance."""

import re

import numpy as np
import pytest

from benchmarks.verdict_trains import ORBITS, PERIOD, Noise, orbit_of, spoilt, steady, train
from impactsig import Impacts, Recording, identify_period, scenes, simulate
from impactsig.errors import InvalidInput

MILD = Noise(0.005, 0.02, 0.02)
T = PERIOD


def seen(cycles, rng, noise=MILD):
    return Impacts.from_times(np.sort(T * spoilt(cycles, noise, rng)))


def orbit(found):
    return found.impacts, found.periods


@pytest.mark.parametrize("size", [0.002, -0.002])
def test_a_ramp_of_the_speed_is_a_drift_of_period_1_1(size):
    n = np.arange(200.0)
    impacts = seen(n + size * n**2 / 400, np.random.default_rng(1))
    found = identify_period(impacts, T)
    assert (found.kind, orbit(found)) == ("drifting", (1, 1))
    # the interval grows by the share `size` through the run, so the speed falls by it
    slope = np.polyfit(found.drift.time, found.drift.speed, 1)[0]
    # the standard error of the best estimate is 2.4 %
    assert slope * 200 * T == pytest.approx(-size, rel=0.1)
    assert found.drift.range == pytest.approx(abs(size), rel=0.3)
    assert re.search(r"the speed drifts by 0\.(1[5-9]|2\d?) %", str(found))


def test_a_sine_of_the_speed_is_a_drift_of_period_1_1():
    n = np.arange(200.0)
    swing = 8e-4 * 200 / (2 * np.pi) * np.cos(2 * np.pi * n / 200)
    found = identify_period(seen(n + swing, np.random.default_rng(2)), T)
    assert (found.kind, orbit(found)) == ("drifting", (1, 1))
    assert found.drift.range == pytest.approx(1.6e-3, rel=0.15)


@pytest.mark.parametrize("name", ORBITS)
def test_any_period_is_found_under_a_ramp(name):
    rng = np.random.default_rng([3, *name])
    cycles = steady(name, 300, rng)
    span = cycles[-1]
    found = identify_period(seen(cycles + 0.005 * cycles**2 / (2 * span), rng), T)
    assert orbit(found) == name
    assert found.kind == "drifting"


@pytest.mark.parametrize("law", ["logistic", "tent", "henon"])
def test_a_phase_modulated_by_chaos_is_banded(law):
    for seed in range(2):
        rng = np.random.default_rng([4, seed])
        cycles = np.arange(300) + 0.02 * orbit_of(law, 300, rng)
        found = identify_period(seen(cycles, rng), T)
        assert (found.kind, orbit(found)) == ("banded", (1, 1))
        assert found.probability["banded"] > 0.95
        assert "banded chaos" in str(found)


@pytest.mark.parametrize("rms", [0.01, 0.04])
def test_a_second_tone_is_quasi_periodic(rms):
    rng = np.random.default_rng(5)
    n = np.arange(300.0)
    cycles = n + rms * np.sqrt(2) * np.sin(2 * np.pi * 0.1618 * n)
    found = identify_period(seen(cycles, rng), T)
    assert (found.kind, orbit(found)) == ("quasi-periodic", (1, 1))
    assert found.tone == pytest.approx(0.1618, abs=5e-4)
    assert found.tone_rms == pytest.approx(rms * T, rel=0.1)


@pytest.mark.parametrize("share", [0.2, 0.5])
def test_an_echo_is_a_satellite_not_a_motion(share):
    rng = np.random.default_rng(6)
    cycles = np.arange(300) + 0.005 * rng.standard_normal(300)
    echoes = cycles[rng.random(300) < share] + 3e-3 / T
    found = identify_period(Impacts.from_times(T * np.sort(np.append(cycles, echoes))), T)
    assert (found.kind, orbit(found)) == ("periodic", (1, 1))
    assert found.satellites == pytest.approx(len(echoes) / 300, abs=0.02)
    assert found.satellite_delay == pytest.approx(3e-3, abs=5e-5)
    assert found.spurious < 0.02


@pytest.mark.parametrize("kind", ["chaotic", "irregular"])
def test_chaos_and_chance_are_told_apart(kind):
    for seed in range(2):
        found = identify_period(train(kind, 300, "worst", [7, seed]).impacts, T)
        assert found.kind == kind
        assert orbit(found) == (None, None)
        assert "nearest" not in str(found)


def test_a_band_that_jitter_hides_is_named_with_even_odds():
    rng = np.random.default_rng(8)
    jitter = 0.025
    found = identify_period(seen(np.arange(300.0), rng, Noise(jitter, 0.1, 0.1)), T)
    assert found.kind == "periodic"
    odds = found.probability["periodic"] / found.probability["banded"]
    assert 0.3 < odds < 20
    assert 0.5 * jitter < found.banded_below / T < jitter
    assert "or banded below" in str(found)


def test_a_slow_tone_is_a_drift_unless_the_forcing_is_given():
    rng = np.random.default_rng(9)
    n = np.arange(400.0)
    wave = 0.03 * np.sqrt(2) * np.sin(2 * np.pi * 0.02 * n)
    impacts = seen(n + wave, rng)
    found = identify_period(impacts, T)
    assert found.kind == "drifting"
    assert found.drift.tone == pytest.approx(0.02, rel=0.05)
    assert "a forcing channel would tell" in str(found)
    instants = T * np.arange(-2.0, 403)
    given = identify_period(impacts, forcing=instants)
    assert (given.kind, orbit(given)) == ("quasi-periodic", (1, 1))
    assert given.tone == pytest.approx(0.02, rel=0.02)
    assert given.drift is None


def test_a_forcing_channel_takes_the_drift_off():
    rng = np.random.default_rng(10)
    turns = np.arange(300.0)
    at = T * (turns + 2e-3 * turns**2 / 60)  # the speed falls by 2 %
    rate = 2000.0
    sample = np.arange(0, at[-1] + 0.2, 1 / rate)
    angle = 2 * np.pi * np.interp(sample, np.append(at, at[-1] + 1), np.append(turns, 321))
    drive = Recording(np.sin(angle) + 0.02 * rng.standard_normal(len(sample)), rate=rate)
    touches = np.interp(np.arange(1, 298, 2) + 0.3, turns, at)
    touches = touches + 2e-4 * rng.standard_normal(len(touches))
    found = identify_period(Impacts.from_times(touches), forcing=drive)
    assert (found.kind, orbit(found)) == ("periodic", (1, 2))
    assert found.jitter < 4e-4


@pytest.mark.parametrize(
    ("forcing", "period"),
    [
        (np.arange(10.0), None),  # ends before the impacts
        (np.arange(0, 100, 0.5), 1.0),  # two pulses in a period
        ([1.0], None),
        ("drive", None),
        (np.cumsum(np.tile([1.0, 0.4], 60)), None),
        (Recording(np.zeros((100, 2)), rate=1.0), None),
        (Recording(np.zeros(100), rate=1.0), None),
    ],
)
def test_a_forcing_that_cannot_be_used_is_named(forcing, period):
    impacts = Impacts.from_times(np.arange(50.0))
    with pytest.raises(InvalidInput) as caught:
        identify_period(impacts, period, forcing=forcing)
    assert caught.value.argument == "forcing"


@pytest.mark.parametrize(("frequency", "name"), [(21.0, (1, 1)), (20.6, (1, 2)), (19.6, (1, 3))])
def test_the_simulated_beam_has_the_period_of_its_stroboscopic_map(frequency, name):
    motion = simulate(scenes.karpodinis(frequency=frequency), periods=300, transient=300)
    # one impact in each n-th period, by counting
    turns = motion.impacts.time * frequency
    assert np.diff(turns) == pytest.approx(np.full(len(turns) - 1, name[1]), abs=1e-4)
    rng = np.random.default_rng(11)
    found = identify_period(Impacts.from_times(spoilt(turns, MILD, rng) / frequency), 1 / frequency)
    assert (found.kind, orbit(found)) == ("periodic", name)
