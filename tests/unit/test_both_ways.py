"""One force sensor between two stops: pulses that point either way."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import impactsig

RATE, DURATION, CONTACT = 25_600.0, 6.0, 1.2e-3


def record(seed, share=0.5, noise=0.01):
    """Samples, instants, and the stop of each impact."""
    rng = np.random.default_rng(seed)
    times = 0.1 + np.cumsum(0.05 * (1 + 0.2 * rng.uniform(-1, 1, 200)))
    times = times[times < DURATION - 0.1]
    stops = (rng.random(len(times)) < share).astype(int)
    height = rng.lognormal(0, 0.3, len(times)) * np.where(stops, -1, 1)
    samples = noise * rng.standard_normal(round(DURATION * RATE))
    for time, peak in zip(times, height, strict=True):
        first = int(np.ceil(time * RATE))
        at = np.arange(first, int((time + CONTACT) * RATE) + 1)
        samples[at] += peak * np.sin(np.pi * (at / RATE - time) / CONTACT)
    return samples, times, stops


def found_in(samples, **options):
    return impactsig.detect_impacts(impactsig.Recording(samples, RATE), **options)


def right(found, times, stops):
    """How many impacts are found on their stop, and how many of those found are none."""
    nearest = np.abs(found.time[:, None] - times).argmin(axis=1)
    hit = np.abs(found.time - times[nearest]) < 0.3e-3
    hit &= found.stop_index == stops[nearest]
    return len(np.unique(nearest[hit])), np.count_nonzero(~hit)


@pytest.mark.parametrize("share", [0.5, 0.2])
def test_impacts_on_either_stop_are_found(share):
    samples, times, stops = record(3, share)
    found = found_in(samples, polarity="both")
    hit, false = right(found, times, stops)
    assert hit == len(times)
    assert false <= 1
    assert (found.peak > 0).all()
    assert found.settings["polarity"] == "both"


def test_no_pulse_loses_its_beginning_to_what_is_none_beside_it():
    rate = 50e3
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.006, 0.03, 656))
    height = rng.uniform(0.3, 2, 656) * rng.choice([-1, 1], 656)
    samples = 0.06 * rng.standard_normal(round(12 * rate))
    for time, peak in zip(times, height, strict=True):
        at = np.arange(int(time * rate) + 1, int((time + CONTACT) * rate) + 1)
        samples[at] += peak * np.sin(np.pi * (at / rate - time) / CONTACT) ** 1.5
    found = impactsig.detect_impacts(impactsig.Recording(samples, rate), polarity="both")
    late = np.abs(found.time[:, None] - times).min(axis=1)
    assert np.count_nonzero(late > 0.2e-3) <= 2  # 11 of them with one search less


def test_also_in_hum():
    samples, times, stops = record(4)
    samples += 0.3 * np.sin(2 * np.pi * 50 * np.arange(len(samples)) / RATE)
    hit, false = right(found_in(samples, polarity="both"), times, stops)
    assert hit >= len(times) - 1
    assert false <= 1


def test_a_machine_with_one_stop_has_one():
    samples, times, _ = record(5, share=0.0)
    found = found_in(samples, polarity="both")
    assert right(found, times, np.zeros(len(times), int)) == (len(times), 0)
    assert found.time.tolist() == found_in(samples).time.tolist()


def test_the_swings_of_a_sensor_that_rings_are_not_the_other_stop():
    from scipy import signal

    samples, times, _ = record(6, share=0.0, noise=0.0)
    angular, damping = 2 * np.pi * 2500, 0.1
    poles = [1, 2 * damping * angular, angular**2]
    samples = signal.lfilter(*signal.bilinear([angular**2], poles, RATE), samples)
    samples += 0.01 * np.random.default_rng(6).standard_normal(len(samples))
    found = found_in(samples, polarity="both")
    assert np.count_nonzero(found.stop_index == 0) == len(times)
    # Of the first swings, none; of the noise, that they make look likely, some.
    assert np.count_nonzero(found.stop_index == 1) <= 0.1 * len(times)


def test_the_result_does_not_depend_on_the_cut():
    samples, _, _ = record(7)
    whole = found_in(samples, polarity="both")
    ends = [0, 7, 30_000, 30_001, 77_777, len(samples)]
    blocks = [impactsig.Recording(samples[a:b], RATE, start=a / RATE) for a, b in pairwise(ends)]
    parts = impactsig.detect_impacts(blocks, polarity="both")
    for name in ("time", "contact_time", "peak", "stop_index", "probability"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))


def test_a_search_in_one_direction_says_what_it_misses():
    samples, _, _ = record(8)
    assert any('polarity="both"' in note for note in found_in(samples).notes)
    samples, _, _ = record(8, share=0.0)
    assert not found_in(samples).notes


def test_several_channels_have_one_direction_each():
    samples, _, _ = record(9)
    both = impactsig.Recording(np.stack((samples, samples), 1), RATE, channels=("a", "b"))
    with pytest.raises(impactsig.InvalidInput, match="polarity"):
        impactsig.detect_impacts(both, channel=["a", "b"], polarity="both")


def test_a_structure_that_rings_is_told_from_two_stops():
    """An accelerometer that impacts shake: swings of either sign after each of them."""
    rng = np.random.default_rng(10)
    samples, tone, decay = 0.01 * rng.standard_normal(round(DURATION * RATE)), 900.0, 3e-3
    since = np.arange(400) / RATE
    for first in (0.2 + 0.05 * np.arange(110) + 0.002 * rng.standard_normal(110)) * RATE:
        part = samples[int(first) : int(first) + 400]
        part += np.exp(-since / decay) * np.sin(2 * np.pi * tone * since)
    notes = found_in(samples).notes
    assert any('sensor="sound"' in note for note in notes)
    assert not any('polarity="both"' in note for note in notes)
