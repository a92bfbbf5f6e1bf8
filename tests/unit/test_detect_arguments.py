"""What `detect_impacts` refuses, and what it says where it finds nothing."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import InvalidInput, Recording, detect_impacts

RATE = 10_000.0


@pytest.mark.parametrize(
    "options",
    [
        {"polarity": ["up"]},
        {"contact_level": "x"},
        {"merge_within": None},
        {"merge_within": "x"},
        {"dead_time": None},
    ],
)
def test_what_is_no_number_is_named(options):
    with pytest.raises(InvalidInput, match=next(iter(options))):
        detect_impacts(Recording(np.zeros(100), RATE), **options)


def test_a_block_that_is_no_recording_is_named():
    with pytest.raises(InvalidInput, match="a block of int"):
        detect_impacts([Recording(np.zeros(100), RATE), 3])


def test_a_step_is_not_said_to_stay_below_the_threshold():
    found = detect_impacts(Recording(np.repeat([0.0, 1.0], 500), RATE, units="N"))
    assert len(found) == 0
    assert "no pulse" in found.reason
    assert "below" not in found.reason


def test_blocks_in_different_units_are_refused():
    force = Recording(np.zeros(100), RATE, units="N")
    volts = Recording(np.zeros(100), RATE, units="V", start=force.stop)
    with pytest.raises(InvalidInput, match="a block in V"):
        detect_impacts([force, volts])


def test_magnitudes_of_sound_that_overflow_are_refused():
    x = 1e300 * np.random.default_rng(0).standard_normal(5000)
    with pytest.raises(InvalidInput, match="1e100"):
        detect_impacts(Recording(x, 22_050.0, sensor="sound"))


def test_rates_beyond_sound_are_refused():
    rec = Recording(np.random.default_rng(0).standard_normal(5000), 1e9, sensor="sound")
    with pytest.raises(InvalidInput, match="1 MHz"):
        detect_impacts(rec)


@pytest.mark.parametrize("samples", [np.zeros(100), np.array(1.0)])
def test_an_array_is_told_to_become_a_recording(samples):
    with pytest.raises(InvalidInput, match=r"source: got an array.*impactsig\.Recording\("):
        detect_impacts(samples)


def test_no_blocks_at_all():
    with pytest.raises(InvalidInput, match="got no blocks"):
        detect_impacts([])


def test_the_threshold_is_of_force():
    rng = np.random.default_rng(0)
    x = 0.01 * rng.standard_normal(44_100)
    x[20_000:20_200] += rng.standard_normal(200) * np.exp(-np.arange(200) / 40)
    sound = Recording(x, 44_100.0, sensor="sound")
    found = detect_impacts(sound, least_probability=0.9)
    assert len(found.time) == 1
    assert found.settings["least_probability"] == 0.9
    with pytest.raises(InvalidInput, match="threshold"):
        detect_impacts(sound, threshold="6 sigma")


@pytest.mark.parametrize("sensor", ["force", "sound"])
@pytest.mark.parametrize("least", [0.0, 1.0, np.nan, -0.5])
def test_the_least_probability_lies_between_0_and_1(sensor, least):
    with pytest.raises(InvalidInput, match="least_probability"):
        detect_impacts(Recording(np.zeros(1000), 44_100.0, sensor=sensor), least_probability=least)
