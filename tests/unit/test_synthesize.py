"""Records made of impacts: sample by sample against a slow twin, then found again by detection."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import impactsig
from benchmarks.recordings import PULSES, add_pulses, score
from impactsig import Impacts, InvalidInput
from impactsig.impacts import CLIPPED
from impactsig.simulation.instruments.sensors import LoadCell, Microphone
from impactsig.simulation.instruments.synthesis import SPEED_OF_SOUND, synthesize


def train(seed, *, duration=60.0, rate=20.0, floor=0.008, after=0.002):
    """Impacts at random, log-normal in strength; a tenth are followed by a second, weaker one."""
    rng = np.random.default_rng(seed)
    gaps = floor + rng.exponential(1 / rate - floor, int(2 * duration * rate) + 20)
    time = 0.02 + np.cumsum(gaps)
    time = time[time < duration - 0.05]
    peak = np.exp(0.5 * rng.standard_normal(len(time)))
    second = np.arange(len(time)) % 10 == 9
    time = np.concatenate((time, time[second] + after))
    peak = np.concatenate((peak, 0.6 * peak[second]))
    return Impacts.from_times(
        time, start=0.0, duration=duration, peak=peak, contact_time=3e-4 * peak**-0.2, unit="N"
    )


def periodic(seed, *, duration=30.0):
    """period(2,1): two impacts in each forcing period of 1/22.1 s, both with a little jitter."""
    rng = np.random.default_rng(seed)
    turn = np.arange(int(duration * 22.1) - 1)
    time = np.concatenate((turn + 0.1, turn + 0.43)) / 22.1 + 2e-5 * rng.standard_normal(
        2 * len(turn)
    )
    peak = np.repeat((1.0, 0.7), len(turn))
    return Impacts.from_times(time, start=0.0, duration=duration, peak=peak)


# -- the load cell, sample by sample ---------------------------------------------------------


def test_pulses_stand_between_samples_at_their_own_instants():
    truth = train(0, duration=2.0)
    made = synthesize(truth, LoadCell(), rate=20_000.0)
    expected = np.zeros(40_000)
    add_pulses(expected, 20_000.0, truth.time, truth.contact_time, truth.peak, PULSES["half-sine"])
    np.testing.assert_allclose(made.samples, expected, atol=1e-9)
    assert (made.rate, made.start, made.unit, made.sensor) == (20_000.0, 0.0, "N", "force")


def test_a_span_of_the_run_is_that_part_of_the_whole():
    truth = train(0, duration=2.0)
    whole = synthesize(truth)
    part = synthesize(truth, start=float(truth.time[3]) + 1e-4, duration=0.5)
    at = part.start + np.arange(25_000) / 50_000
    expected = np.interp(at, whole.time, whole.samples)
    assert part.start > truth.time[3]  # begins inside a pulse, and shows the rest of it
    assert part.samples[0] > 0.5 * truth.peak[3]
    np.testing.assert_allclose(part.samples, expected, atol=0.02 * truth.peak.max())
    assert len(part) == 25_000
    # Before and after the run there is silence, and the clock goes on.
    early = synthesize(truth, start=-1.0, duration=4.0)
    np.testing.assert_allclose(early.samples[50_000:150_000], whole.samples, atol=1e-9)
    assert not early.samples[:50_000].any()


@pytest.mark.parametrize(
    ("known", "peak", "contact"),
    [
        ({}, 2.0, 3e-4),
        ({"contact_time": [1e-3]}, 2.0, 1e-3),
        ({"contact_time": [0.0]}, 2.0, 3e-4),
        ({"peak": [5.0]}, 10.0, 3e-4),
        ({"impulse": [1e-3]}, 2 * np.pi * 1e-3 / (2 * 3e-4), 3e-4),
        ({"impulse": [1e-3], "contact_time": [1e-3]}, np.pi, 1e-3),
        ({"impulse": [1e-3], "peak": [5.0]}, 10.0, 3e-4),
        ({"approach_velocity": [3.0]}, 6.0, 3e-4),
        ({"approach_velocity": [3.0], "peak": [5.0]}, 10.0, 3e-4),
    ],
)
def test_a_pulse_is_what_is_known_of_its_impact(known, peak, contact):
    truth = Impacts([0.01], start=0.0, duration=0.02, **known)
    made = synthesize(truth, LoadCell(gain=2.0), rate=1e6)
    assert made.samples.max() == pytest.approx(peak, rel=1e-4)
    assert np.sum(made.samples > 0) == pytest.approx(contact * 1e6, abs=1)
    assert made.samples.sum() / 1e6 == pytest.approx(2 * peak * contact / np.pi, rel=1e-4)


def test_ringing_follows_the_contact():
    truth = Impacts([0.01], start=0.0, duration=0.05)
    cell = LoadCell(ringing=0.2, ringing_frequency=5000.0, ringing_decay=2e-3)
    made = synthesize(truth, cell, rate=100_000.0)
    bare = synthesize(truth, LoadCell(), rate=100_000.0)
    since = made.time - 0.01 - 3e-4
    tail = 0.2 * np.sin(2 * np.pi * 5000 * since) * np.exp(-since / 2e-3)
    expected = bare.samples + np.where(since >= 0, tail, 0)
    np.testing.assert_allclose(made.samples, expected, atol=1e-6)
    # A tail that the rate cannot show is not there, rather than at a false frequency.
    slow = synthesize(truth, cell, rate=8_000.0)
    np.testing.assert_array_equal(slow.samples, synthesize(truth, rate=8_000.0).samples)


def test_noise_drift_and_hum():
    empty = Impacts([], start=0.0, duration=40.0)
    noise = synthesize(empty, LoadCell(noise=0.3), rate=10_000.0, seed=1).samples
    assert noise.std() == pytest.approx(0.3, rel=5 / np.sqrt(2 * 400_000))
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0, abs=5 / np.sqrt(400_000))
    cell = LoadCell(drift=0.5, drift_period=20.0, hum=0.1, hum_frequency=60.0)
    slow = synthesize(empty, cell, rate=10_000.0, seed=1).samples
    spectrum = 2 * np.abs(np.fft.rfft(slow)) / len(slow)
    assert spectrum[2] == pytest.approx(0.5, rel=1e-9)  # 40 s are two periods of the drift
    assert spectrum[2400] == pytest.approx(0.1, rel=1e-9)
    spectrum[[2, 2400]] = 0
    assert spectrum.max() < 1e-9


def test_overlapping_pulses_add():
    pair = Impacts([0.01, 0.0101], start=0.0, duration=0.02)
    one, other = (synthesize(pair[[i]]).samples for i in range(2))
    np.testing.assert_allclose(synthesize(pair).samples, one + other, atol=1e-12)


# -- the converter ---------------------------------------------------------------------------


def test_the_converter_rounds_and_saturates():
    truth = Impacts([0.01, 0.02], start=0.0, duration=0.03, peak=[0.4, 3.0])
    clean = synthesize(truth, LoadCell(noise=0.05), seed=2).samples
    made = synthesize(truth, LoadCell(noise=0.05), bits=8, full_scale=1.0, seed=2).samples
    step = 2 / 256
    np.testing.assert_array_equal(made / step, np.rint(made / step))
    assert made.max() == 1 - step
    inside = np.abs(clean) < 1 - step
    assert np.abs(made - clean)[inside].max() <= step / 2 + 1e-12
    clipped = synthesize(truth, LoadCell(noise=0.05), full_scale=1.0, seed=2).samples
    np.testing.assert_array_equal(clipped, np.clip(clean, -1, 1))


def test_saturated_pulses_are_found_clipped():
    truth = Impacts.from_times(
        0.02 + 0.05 * np.arange(100), start=0.0, duration=5.0, peak=np.tile([0.5, 1.5], 50)
    )
    made = synthesize(truth, LoadCell(noise=0.005), bits=16, full_scale=1.0, seed=3)
    found = impactsig.detect_impacts(made)
    assert len(found) == 100
    np.testing.assert_array_equal((found.flags & CLIPPED) > 0, truth.peak > 1)


# -- the microphone --------------------------------------------------------------------------


def test_sound_comes_late_and_falls_with_distance():
    truth = Impacts([0.05], start=0.0, duration=0.2, peak=[3.0])
    modes = ((2000.0, 5e-3, 1.0),)
    near, far = (
        synthesize(truth, Microphone(distance, modes, gain=2.0), rate=200_000.0, seed=4)
        for distance in (1.0, 4.0)
    )
    for made, distance in ((near, 1.0), (far, 4.0)):
        since = made.time - 0.05 - distance / SPEED_OF_SOUND
        first = int(np.flatnonzero(made.samples)[0])
        assert since[first] == pytest.approx(0, abs=1 / 200_000)
        # In quadrature and alone, the envelope is the mode's own decay.
        wave = made.samples * np.exp(np.clip(since, 0, None) / 5e-3)
        heard = (since >= 0) & (since < 0.025)
        basis = np.column_stack(
            [np.sin(2 * np.pi * 2000 * since), np.cos(2 * np.pi * 2000 * since)]
        )[heard]
        part, rest, *_ = np.linalg.lstsq(basis, wave[heard], rcond=None)
        assert np.hypot(*part) == pytest.approx(6.0 / distance, rel=1e-9)
        assert rest[0] < 1e-15 * heard.sum() * 36
    assert (near.sensor, near.unit) == ("sound", "")


def test_modes_beyond_half_the_rate_are_left_out_and_change_no_other():
    truth = Impacts([0.05], start=0.0, duration=0.1)
    low, high = (1000.0, 5e-3, 1.0), (5000.0, 5e-3, 1.0)
    both = synthesize(truth, Microphone(modes=(low, high)), rate=8000.0, seed=5).samples
    spectrum = np.abs(np.fft.rfft(both))
    assert np.argmax(spectrum) * 10 == pytest.approx(1000, abs=30)
    assert spectrum[290:310].max() < 0.05 * spectrum.max()  # 5 kHz would fold to 3 kHz
    alone = synthesize(truth, Microphone(modes=(low,)), rate=8000.0, seed=5).samples
    np.testing.assert_array_equal(both, alone)
    with pytest.raises(InvalidInput, match="rate"):
        synthesize(truth, Microphone(modes=(high,)), rate=8000.0)


def test_given_phases_every_impact_sounds_the_same():
    rate, modes = 50_000.0, ((1000.0, 2e-3, 1.0), (3000.0, 1e-3, 0.5))
    truth = Impacts.from_times([0.1, 0.2], start=0.0, duration=0.3)
    away = 343.0 / (2 * rate)  # half a sample
    made = synthesize(truth, Microphone(away, modes, phases=(0.5, 2.0)), rate=rate, seed=1)
    since = (np.arange(1000) + 0.5) / rate
    alone = np.exp(-since / 2e-3) * np.sin(2 * np.pi * 1000 * since + 0.5)
    alone += 0.5 * np.exp(-since / 1e-3) * np.sin(2 * np.pi * 3000 * since + 2.0)
    for first in (5001, 10_001):
        heard = made.samples[first : first + 1000]
        np.testing.assert_allclose(away * heard, alone, atol=1e-5)


@pytest.mark.parametrize("phases", [(1.0,), (1.0, 2.0, np.nan), (1.0, 2.0, 3.0, 4.0)])
def test_there_is_one_finite_phase_a_mode(phases):
    with pytest.raises(InvalidInput, match="phases"):
        Microphone(phases=phases)


@pytest.mark.parametrize("rate", [8000.0, 22_050.0, 48_000.0])
def test_room_noise_is_pink(rate):
    from scipy.signal import welch

    empty = Impacts([], start=0.0, duration=120.0)
    noise = synthesize(empty, Microphone(noise=0.02), rate=rate, seed=6).samples
    # The slowest parts have few independent samples: 20 Hz and 120 s leave 2 % of doubt.
    assert noise.std() == pytest.approx(0.02, rel=0.05)
    frequency, power = welch(noise, rate, nperseg=2**14)
    level = []
    octaves = 40.0 * 2.0 ** np.arange(0, int(np.log2(rate / 5 / 40)) + 1)
    for low in octaves:
        inside = (frequency >= low) & (frequency < 2 * low)
        level.append(10 * np.log10(np.mean(power[inside] * frequency[inside])))
    assert np.ptp(level) < 1.5  # [dB], every octave up to 0.4 of the rate as strong as the next


@pytest.mark.parametrize("rate", [8000.0, 22_050.0, 48_000.0])
def test_room_noise_does_not_fade_in(rate):
    """The mean square of the first 50 ms over 200 records is that of any other 50 ms."""
    empty = Impacts([], start=0.0, duration=0.5)
    begin = []
    for seed in range(200):
        noise = synthesize(empty, Microphone(noise=0.02), rate=rate, seed=seed).samples
        begin.append(np.mean(noise[: round(0.05 * rate)] ** 2) / 0.02**2)
    # 50 ms hold one turn of 20 Hz: one record tells it to a fifth, 200 to a seventieth.
    assert np.std(begin) < 0.3
    assert np.mean(begin) == pytest.approx(1, abs=0.06)


# -- there and back: what was put in is found ------------------------------------------------


RATES = 50_000.0, 60_000.0, 100_000.0


@pytest.mark.parametrize(
    ("seed", "rate"),
    [
        *enumerate(RATES),
        *(
            pytest.param(seed, rate, marks=pytest.mark.slow)
            for k, rate in enumerate(RATES)
            for seed in range(3)
            if seed != k
        ),
    ],
)
def test_a_load_cell_at_20_db_loses_no_impact(seed, rate):
    truth = train(seed)
    cell = LoadCell(noise=0.1, drift=0.3, drift_period=37.0, hum=0.1)
    found = impactsig.detect_impacts(synthesize(truth, cell, rate=rate, seed=seed))
    f1, rms, pairs = score(found.time, truth.time)
    assert f1 >= 0.995
    assert rms < 25e-6
    assert np.median(np.abs(found.time[pairs[:, 0]] - truth.time[pairs[:, 1]])) < 15e-6
    contact = found.contact_time[pairs[:, 0]] / truth.contact_time[pairs[:, 1]] - 1
    given = 2 / np.pi * truth.peak * truth.contact_time
    impulse = found.impulse[pairs[:, 0]] / given[pairs[:, 1]] - 1
    for error in (contact, impulse):
        assert abs(np.median(error)) < 0.02
        assert np.median(np.abs(error)) < 0.05


@pytest.mark.parametrize("noise", [0.1, 0.01, 0.001, 0.0])
def test_a_ringing_sensor_makes_no_impacts_of_its_own(noise):
    truth = train(12, duration=60.0 if noise == 0.01 else 20.0)
    made = synthesize(truth, LoadCell(noise=noise, ringing=0.1), seed=13)
    found = impactsig.detect_impacts(made)
    f1, rms, pairs = score(found.time, truth.time)
    assert len(found) - len(pairs) <= 1  # noise makes one in 2000; six of 1288 were ringing
    assert f1 >= 0.995
    assert rms < 25e-6
    assert not found.notes


@pytest.mark.parametrize("rate", [50_000.0, 20_000.0])
def test_a_quiet_load_cell_measures_what_was_put_in(rate):
    truth = train(3, after=0.004)
    cell = LoadCell(noise=1e-3, drift=0.05, hum=5e-3)
    made = synthesize(truth, cell, rate=rate, bits=16, full_scale=10.0, seed=3)
    found = impactsig.detect_impacts(made)
    f1, rms, pairs = score(found.time, truth.time)
    assert f1 == 1.0
    assert rms < 0.05 / rate
    contact = found.contact_time[pairs[:, 0]] - truth.contact_time[pairs[:, 1]]
    given = 2 / np.pi * truth.peak * truth.contact_time
    impulse = found.impulse[pairs[:, 0]] / given[pairs[:, 1]] - 1
    assert np.median(np.abs(contact)) < 0.06 / rate  # [s]: a twentieth of a sample
    assert np.median(np.abs(impulse)) < 1e-2


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.slow) for s in (1, 2))])
def test_sound_at_20_db_is_found(seed):
    truth = train(seed, rate=12.0, floor=0.03, after=0.008)
    made = synthesize(truth, Microphone(noise=0.1), seed=seed)
    found = impactsig.detect_impacts(made)
    f1, rms, pairs = score(found.time - 1.0 / SPEED_OF_SOUND, truth.time)
    assert f1 >= 0.98
    assert rms < 80e-6
    late = np.median(found.time[pairs[:, 0]] - truth.time[pairs[:, 1]])
    assert late == pytest.approx(1.0 / SPEED_OF_SOUND, abs=50e-6)


@pytest.mark.parametrize("sensor", [LoadCell(noise=0.05), Microphone(noise=0.03)])
def test_the_period_survives_the_way_through_the_instrument(sensor):
    truth = periodic(4)
    found = impactsig.detect_impacts(synthesize(truth, sensor, seed=4))
    period = impactsig.identify_period(found, forcing_period=1 / 22.1)
    assert (period.impacts, period.periods) == (2, 1)
    assert period.missed < 0.01
    assert period.spurious < 0.01


# -- seeds and bad input ---------------------------------------------------------------------


@pytest.mark.parametrize("sensor", [LoadCell(noise=0.1, hum=0.1), Microphone(noise=0.1)])
def test_seeds(sensor):
    truth = train(0, duration=1.0)
    one, same, other = (synthesize(truth, sensor, seed=seed).samples for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_names_stand_for_default_instruments():
    truth = train(0, duration=1.0)
    for name, sensor, rate in (("force", LoadCell(), 50_000), ("sound", Microphone(), 22_050)):
        made = synthesize(truth, name, seed=1)
        assert made.rate == rate
        np.testing.assert_array_equal(made.samples, synthesize(truth, sensor, seed=1).samples)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("sensor", "smell"),
        ("sensor", None),
        ("rate", -1.0),
        ("rate", 0),
        ("rate", np.inf),
        ("start", np.nan),
        ("duration", 0.0),
        ("duration", -1.0),
        ("full_scale", 0.0),
        ("bits", 1),
        ("bits", 12.0),
        ("bits", True),
        ("seed", 1.5),
    ],
)
def test_what_cannot_be_used_is_named(argument, value):
    with pytest.raises(InvalidInput, match=argument):
        synthesize(train(0, duration=1.0), **{argument: value})


def test_bits_need_a_range_and_a_run_needs_a_length():
    with pytest.raises(InvalidInput, match="full_scale"):
        synthesize(train(0, duration=1.0), bits=16)
    with pytest.raises(InvalidInput, match="duration"):
        synthesize(Impacts([]))


@pytest.mark.parametrize(
    ("sensor", "settings"),
    [
        (LoadCell, {"contact_time": 0.0}),
        (LoadCell, {"noise": -0.1}),
        (LoadCell, {"ringing_frequency": np.nan}),
        (Microphone, {"distance": 0.0}),
        (Microphone, {"modes": ()}),
        (Microphone, {"modes": ((2000.0, 1e-3),)}),
        (Microphone, {"modes": ((2000.0, 0.0, 1.0),)}),
        (Microphone, {"noise": "loud"}),
    ],
)
def test_instruments_refuse_what_they_cannot_be(sensor, settings):
    with pytest.raises(InvalidInput, match=next(iter(settings))):
        sensor(**settings)


def test_each_stop_has_a_sensor():
    low, high = Microphone(modes=((1000.0, 5e-3, 1.0),)), Microphone(modes=((3000.0, 2e-3, 1.0),))
    train = Impacts([0.1, 0.2, 0.3], stop_index=[0, 1, 0], start=0.0, duration=0.5)
    both = synthesize(train, (low, high), seed=1).samples
    second = synthesize(train[1], high, seed=2)
    alone = np.abs(second.samples) > 1e-4
    first = synthesize(train[[0, 2]], low, seed=1).samples
    np.testing.assert_array_equal(
        both[~alone & (np.abs(first) > 0)], first[~alone & (np.abs(first) > 0)]
    )
    spectrum = np.abs(np.fft.rfft(both[alone]))
    assert np.argmax(spectrum) * 22_050 / alone.sum() == pytest.approx(3000, abs=150)
    with pytest.raises(InvalidInput, match="stop_index"):
        synthesize(replace(train, stop_index=None), (low, high))
    with pytest.raises(InvalidInput, match="each of 2 stops"):
        synthesize(train, (low,))
    with pytest.raises(InvalidInput, match="sequence of one kind"):
        synthesize(train, (low, LoadCell()))
