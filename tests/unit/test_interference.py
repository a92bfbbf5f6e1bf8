"""Force records with what is no impact: hum, bursts of noise, a sensor that rings, red noise."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import signal

import impactsig

RATE = 25_600.0


def pulses(times, contact, shape=lambda u: np.sin(np.pi * u), *, duration=5.0, rate=RATE):
    """A record of equal pulses of unit height."""
    samples = np.zeros(round(duration * rate))
    for time in times:
        u = (np.arange(len(samples)) / rate - time) / contact
        inside = (u >= 0) & (u <= 1)
        samples[inside] += shape(u[inside])
    return samples


def times_of(rng, count, gap, duration=5.0):
    """Instants about `gap` apart."""
    found = 0.1 + np.cumsum(gap * (1 + 0.1 * rng.standard_normal(count)))
    return found[found < duration - 0.1]


def found_in(samples, rate=RATE, **options):
    return impactsig.detect_impacts(impactsig.Recording(samples, rate, sensor="force"), **options)


def within(found, times, tolerance):
    """How many of the times have an impact near by, and how many impacts are near none."""
    off = np.abs(found.time[:, None] - times)
    return np.count_nonzero(off.min(0) < tolerance), np.count_nonzero(off.min(1) >= tolerance)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("frequency", [50.0, 60.0])
def test_hum_as_strong_as_the_pulses_does_not_turn_them_round(frequency, sign):
    rng = np.random.default_rng(7)
    times = times_of(rng, 60, 0.12)
    samples = pulses(times, 5.6e-3, lambda u: np.sin(np.pi * u**1.5))
    samples += np.sin(2 * np.pi * frequency * np.arange(len(samples)) / RATE + 1)
    samples += 0.15 * rng.standard_normal(len(samples))
    found = found_in(sign * samples)
    assert found.settings["polarity"] == ("positive" if sign > 0 else "negative")
    hit, false = within(found, times, 2.8e-3)
    assert hit == len(times)
    assert false <= 1


@pytest.mark.parametrize("seed", [8, 12, 14])
def test_spikes_in_the_steepest_stretches_do_not_turn_pulses_round(seed):
    """Ten single samples up to sixty times as high: all of the steepest stretches hold one."""
    rng = np.random.default_rng(seed)
    times = times_of(rng, 30, 0.33, 10.0)
    samples = pulses(times, 7e-5, lambda u: np.sin(np.pi * u**1.5), duration=10.0, rate=60e3)
    samples += 0.08 * rng.standard_normal(len(samples))
    at = rng.integers(0, len(samples), 10)
    samples[at] += rng.uniform(5, 60, 10) * rng.choice([-1, 1], 10)
    found = found_in(samples, 60e3)
    assert found.settings["polarity"] == "positive"
    hit, false = within(found, times, 1e-3)
    assert hit == len(times)
    assert false <= 6


@pytest.mark.parametrize("seed", [4, 5, 10])
def test_bursts_in_every_frame_do_not_turn_pulses_round(seed):
    rng = np.random.default_rng(seed)
    times = times_of(rng, 45, 0.12)
    samples = pulses(times, 0.7e-3)
    for start in (0.5, 1.7, 3.1, 4.4):
        part = samples[round(start * RATE) : round((start + 0.01) * RATE)]
        part += 0.7 * rng.standard_normal(len(part))
    samples += 1e-3 * rng.standard_normal(len(samples))
    found = found_in(samples)
    assert found.settings["polarity"] == "positive"
    assert within(found, times, 1e-3)[0] >= len(times) - 1  # one may lie in a burst


def test_pulses_in_step_with_hum_are_not_taken_for_its_harmonics():
    rng = np.random.default_rng(8)
    times = 0.1 + 0.025 * np.arange(192)  # lines at 120, 240, 360 ... Hz as well
    samples = pulses(times, 2.4e-3, lambda u: np.exp(-4 * u) - np.exp(-40 * u), rate=20e3)
    samples += 0.65 * np.sin(2 * np.pi * 60.0 * np.arange(len(samples)) / 20e3 + 1)
    samples += 0.02 * rng.standard_normal(len(samples))
    found = found_in(samples, 20e3)
    assert within(found, times, 1e-3) == (len(times), 0)
    hum = found.settings["hum"]
    assert hum.pop("60 Hz") == pytest.approx(0.65, rel=0.02)
    assert all(amplitude < 0.02 for amplitude in hum.values())


@pytest.mark.parametrize("damping", [0.05, 0.15, 0.3])
def test_ringing_of_a_sensor_is_no_impact(damping):
    rng = np.random.default_rng(9)
    times = times_of(rng, 60, 0.09)
    angular = 2 * np.pi * 1500.0
    second_order = signal.bilinear([angular**2], [1, 2 * damping * angular, angular**2], RATE)
    samples = signal.lfilter(*second_order, pulses(times, 0.6e-3))
    samples += 0.02 * rng.standard_normal(len(samples))
    hit, false = within(found_in(samples), times, 5e-4)
    assert (hit, false) == (len(times), 0)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_burst_of_noise_is_a_disturbance(seed):
    rng = np.random.default_rng(seed)
    times = times_of(rng, 60, 0.09)
    samples = pulses(times, 0.6e-3) + 0.01 * rng.standard_normal(round(5 * RATE))
    starts = times[5::10] + 0.04
    for start in starts:
        a = round(start * RATE)
        samples[a : a + 256] += 0.5 * rng.standard_normal(256)
    found = found_in(samples)
    hit, false = within(found, times, 3e-4)
    assert hit == len(times)
    assert false <= 4 * len(starts)  # of a hundred crests and more
    bursts = [one for one in found.disturbances if one.kind == "burst"]
    inside = [np.min(np.abs(one.start - starts)) < 0.02 for one in bursts]
    assert len(bursts) >= 0.7 * len(starts)
    assert all(inside)
    assert all(0 < one.duration < 0.03 for one in bursts)
    assert any("bursts of noise" in note for note in found.notes)


def test_a_burst_that_hides_most_of_its_crests_is_one():
    """Its noise raises the level, so its crests lie far apart; they are no impacts all the same."""
    rng = np.random.default_rng(16)
    times = times_of(rng, 40, 0.2, 10.0)
    samples = pulses(times, 0.5e-3, duration=10.0, rate=51_200)
    starts = np.array([0.71, 2.93, 5.47, 8.12])
    for start in starts:
        part = samples[round(start * 51_200) : round((start + 0.01) * 51_200)]
        part += 0.7 * rng.standard_normal(len(part))
    samples += 1e-3 * rng.standard_normal(len(samples))
    found = found_in(samples, 51_200)
    hit, false = within(found, times, 1e-3)
    assert hit >= len(times) - 1  # one begins as a burst ends
    assert false <= 2 * len(starts)
    begins = np.array([one.start for one in found.disturbances if one.kind == "burst"])
    lasts = [one.duration for one in found.disturbances if one.kind == "burst"]
    off = begins[:, None] - starts
    assert ((off > -1e-3) & (off < 0.01)).any(0).all()  # each is named
    assert ((off > -1e-3) & (off < 0.01)).any(1).all()
    assert max(lasts) < 0.011


@pytest.mark.parametrize(("seed", "most"), [(6, 1), (22, 2), (26, 0)])
def test_an_event_of_a_burst_leaves_by_its_crest(seed, most):
    """Its pulse may turn out to lie elsewhere; what is beside is judged without it all the same."""
    rng = np.random.default_rng(seed)
    times = times_of(rng, 60, 0.12)
    samples = pulses(times, 1e-3) + 0.02 * rng.standard_normal(round(5 * RATE))
    for start in (1.0, 2.5, 3.7):
        part = samples[int(start * RATE) : int((start + 0.01) * RATE)]
        part += 0.7 * rng.standard_normal(len(part))
    hit, false = within(found_in(samples), times, 5e-4)
    assert hit == len(times)
    assert false <= most


def test_steep_pulses_on_a_random_walk_are_found():
    rng = np.random.default_rng(10)
    times = times_of(rng, 16, 0.3)
    saw = pulses(times, 4e-3, lambda u: np.where(u < 0.15, u / 0.15, (1 - u) / 0.85))
    walk = np.cumsum(rng.standard_normal(len(saw)))
    found = found_in(saw + 2.5 * walk / np.ptp(walk) + 0.01 * rng.standard_normal(len(saw)))
    hit, false = within(found, times, 2e-3)
    assert hit >= 0.9 * len(times)
    assert false <= 1


@pytest.mark.parametrize(("height", "share"), [(0.05, 0.98), (0.1, 0.9)])
def test_a_tone_that_wide_responses_average_out_hides_no_pulse(height, share):
    rng = np.random.default_rng(11)
    times = times_of(rng, 60, 0.04)
    samples = pulses(times, 0.17e-3, lambda u: np.minimum(1, 1.6 * np.sin(np.pi * u)), rate=51_200)
    samples += height * np.sin(2 * np.pi * 8000.0 * np.arange(len(samples)) / 51_200)
    samples += 0.001 * rng.standard_normal(len(samples))
    hit, false = within(found_in(samples, 51_200), times, 1e-4)
    assert hit >= share * len(times)
    assert false == 0


@pytest.mark.parametrize("step", [0.0, 0.2])
def test_a_tail_is_no_second_pulse(step):
    """Pulses that decay by a factor of 50, far from any shape that pulses are fitted with."""
    rng = np.random.default_rng(14)
    times = times_of(rng, 150, 0.025)
    samples = pulses(times, 2.7e-3, lambda u: (np.exp(-4 * u) - np.exp(-40 * u)) / 0.65)
    samples += 1e-3 * rng.standard_normal(len(samples))
    if step:
        samples = np.round(samples / step) * step
    found = found_in(samples)
    assert within(found, times, 5e-4) == (len(times), 0)
    # A pulse that begins in one second and has its tail in the next may still be two.
    assert len(found) - len(times) <= np.count_nonzero(np.mod(times, 1.0) > 0.995)
    if not step:
        assert np.median(found.contact_time) == pytest.approx(2.7e-3, rel=0.05)


def test_a_sensor_that_rings_on_top_of_its_pulses_is_named():
    """No trough tells the second crest from an impact; that all are alike does."""
    rng = np.random.default_rng(15)
    times = times_of(rng, 60, 0.09)
    angular = 2 * np.pi * 450.0
    second_order = signal.bilinear([angular**2], [1, 0.15 * angular, angular**2], RATE)
    samples = np.zeros(round(5.0 * RATE))
    for time, height in zip(times, np.exp(0.3 * rng.standard_normal(len(times))), strict=True):
        samples += height * pulses([time], 5e-3, lambda u: np.sin(np.pi * u**0.6))
    samples = signal.lfilter(*second_order, samples) + 0.01 * rng.standard_normal(len(samples))
    found = found_in(samples)
    (note,) = (one for one in found.notes if "a sensor that rings does so" in one)
    advised = float(re.search(r"merge_within=([0-9.e-]+)", note)[1])
    again = found_in(samples, merge_within=advised)
    assert within(again, times, 1e-3) == (len(times), 0)
    assert not any("rings" in one for one in again.notes)


@pytest.mark.parametrize("pace", [50 / 3, 20.0, 25.0, 30.0])
def test_weak_impacts_of_a_machine_driven_at_a_share_of_the_mains_are_found(pace):
    """Each comes in the same phase of 50 or 60 Hz, but not in every period."""
    rng = np.random.default_rng(17)
    times = 0.1 + np.arange(int(4.8 * pace)) / pace
    samples = pulses(times, 0.4e-3) + 0.25 * rng.standard_normal(round(5.0 * RATE))
    found = found_in(samples)
    hit, false = within(found, times, 5e-4)
    assert hit >= 0.95 * len(times)
    assert false <= 2


def test_weak_pulses_in_every_period_of_the_mains_are_named():
    rng = np.random.default_rng(18)
    times = 0.1 + np.arange(235) / 50.0
    samples = pulses(times, 0.4e-3) + 0.25 * rng.standard_normal(round(5.0 * RATE))
    found = found_in(samples)
    assert len(found) == 0
    (note,) = (one for one in found.notes if "each period of the mains" in one)
    assert "give threshold" in note
    hit, false = within(found_in(samples, threshold=0.7), times, 5e-4)
    assert hit >= 0.95 * len(times)
    assert false <= 5


@pytest.mark.parametrize("strongest", [1.0, 10.0])
def test_weak_impacts_are_found_beside_ones_a_thousand_times_as_strong(strongest):
    """As near grazing: all of them stand clear of the noise."""
    rng = np.random.default_rng(31)
    times = times_of(rng, 60, 0.08)
    height = strongest * 10 ** -rng.uniform(0, 3, len(times))
    samples = sum(h * pulses([time], 0.8e-3) for h, time in zip(height, times, strict=True))
    samples += 4e-5 * strongest * rng.standard_normal(len(samples))
    assert within(found_in(samples), times, 0.4e-3) == (len(times), 0)


@pytest.mark.parametrize("frequency", [49.6, 50.3, 60.5])
@pytest.mark.parametrize("contact", [0.8e-3, 3e-3])
def test_hum_of_a_generator_that_is_off_its_pace_hides_no_pulse(frequency, contact):
    rng = np.random.default_rng(33)
    times = times_of(rng, 50, 0.09)
    t = np.arange(round(5 * RATE)) / RATE
    hum = np.sin(2 * np.pi * frequency * t) + 0.3 * np.sin(2 * np.pi * 3 * frequency * t + 1)
    samples = pulses(times, contact) + 0.5 * hum + 0.02 * rng.standard_normal(len(t))
    hit, false = within(found_in(samples), times, 1e-3)
    assert hit == len(times)
    assert false <= 1


@pytest.mark.parametrize("frequency", [48.43, 50.0, 119.616, 121.166, 180.62])
def test_a_tone_has_no_impacts(frequency):
    """Of the mains, and beside them, in phases that once looked like an impact near the end.

    Half a turn further on is the same record of the other sign.
    """
    t = np.arange(round(10 * RATE)) / RATE
    for phase in np.linspace(0, np.pi, 4, endpoint=False):
        assert not len(found_in(np.sin(2 * np.pi * frequency * t + phase)))


@pytest.mark.parametrize("louder", [7.0, 30.0])
@pytest.mark.parametrize("count", [0, 90])
def test_noise_that_becomes_louder_for_a_while_is_no_impact(louder, count):
    """As beside a drive that runs now and then; most crests stood above the noise of the second."""
    rng = np.random.default_rng(21)
    times = times_of(rng, count, 0.1, 8.0) if count else np.empty(0)
    samples = pulses(times, 1e-3, duration=8.0)
    loud = np.repeat(np.isin(np.arange(20), (3, 4, 9, 15)), round(0.4 * RATE))
    samples += 0.01 * np.where(loud, louder, 1.0) * rng.standard_normal(len(samples))
    found = found_in(samples)
    hit, false = within(found, times, 1e-3) if count else (0, len(found))
    assert hit >= 0.95 * len(times)
    assert false <= 12  # of hundreds where it is 7 times as loud
    assert any("bursts of noise" in note for note in found.notes)


def test_crests_of_noise_among_pulses_make_no_mean_pulse():
    """Their mean pulse had errors that are not finite, or was 25 times as long as the pulses."""
    rng = np.random.default_rng(22)
    times = times_of(rng, 60, 0.1, 6.0)
    samples = pulses(times, 2e-3, duration=6.0)
    loud = np.repeat(np.arange(120) % 10 < 1, round(0.05 * RATE))
    samples += 0.01 * np.where(loud, 7.0, 1.0) * rng.standard_normal(len(samples))
    found = found_in(samples)
    assert within(found, times, 1e-3)[0] == len(times)
    clear = found.peak > 0.5
    assert np.max(found.contact_time[clear]) < 4e-3


def test_dense_pulses_after_which_a_structure_rings_are_no_noise():
    """Most touch, so that their starts are not in order; a third was taken for a burst."""
    rng = np.random.default_rng(23)
    rate, contact = 50_000.0, 1e-3
    times = times_of(rng, 300, contact / 0.55, 1.0)
    samples = pulses(times, contact, duration=1.0, rate=rate)
    for time in times:
        since = np.arange(len(samples)) / rate - time - contact
        rings = 0.2 * np.exp(-since / 4e-3) * np.sin(2 * np.pi * 2200.0 * since)
        samples += np.where(since > 0, rings, 0.0)
    samples += 0.03 * rng.standard_normal(len(samples))
    found = found_in(samples, rate)
    assert not any("bursts of noise" in note for note in found.notes)
    assert within(found, times, 0.5 * contact)[0] > 0.75 * len(times)
