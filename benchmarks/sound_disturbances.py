"""Sound records with known impacts and one disturbance each, and records without any impact.

Each function is pure: the seed gives the samples, the rate and the start of every impact. Unless
stated otherwise the impacts are those of `recordings.microphone` at 22 kHz, 12 a second: ringing
bursts of height 1 in the median, every tenth followed by a second one after 8 ms, in 1/f noise
20 dB below. Where a record is made slow or coded, the bursts ring below 0.4 times the new rate:
what lies above it is not in the record.

    from benchmarks.sound_disturbances import sound_records
    for case in sound_records():
        truth = case.make(1)      # truth.samples, truth.rate, truth.time
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from .disturbances import Case, chance
from .recordings import Truth, coloured, microphone
from .sound_timing import DECIMATORS, TIMES

DURATION = 12.0
MINUTES = 120.0
RATE = 22_050.0
SLOW = (8000, 11_025, 16_000)
CODECS = {
    "mu-law": {"format": "WAV", "subtype": "ULAW"},
    "MP3": {"format": "MP3", "subtype": "MPEG_LAYER_III"},
    "Vorbis": {"format": "OGG", "subtype": "VORBIS"},
}


def clear(seed, duration=DURATION, *, density=12.0, level=20.0) -> Truth:
    """`density` impacts a second, noise `level` dB below."""
    return microphone(duration=duration, mean_rate=density, noise_db=-level, seed=seed)


def slowed(seed, duration=DURATION, *, rate, decimator) -> Truth:
    """Brought to `rate` by one of the `DECIMATORS`, from several times as much."""
    times = TIMES[rate]
    truth = microphone(
        duration=duration, rate=float(times * rate), tones=(0.1 * rate, 0.4 * rate), seed=seed
    )
    whole = len(truth.samples) // times * times
    return replace(
        truth, samples=DECIMATORS[decimator](truth.samples[:whole], times), rate=float(rate)
    )


def coded(seed, duration=DURATION, *, rate, codec) -> Truth:
    """Brought to `rate`, then through a codec at the quality that libsndfile chooses."""
    import soundfile

    truth = slowed(seed, duration, rate=rate, decimator="sox")
    height = np.abs(truth.samples).max()
    file = io.BytesIO()
    soundfile.write(file, truth.samples / (1.1 * height), rate, **CODECS[codec])
    file.seek(0)
    return replace(truth, samples=1.1 * height * soundfile.read(file)[0])


def gated(seed, duration=DURATION, *, threshold) -> Truth:
    """Exact zeros where nothing within 20 ms before and 5 ms after reaches `threshold`.

    Impacts of whose first 4 ms more than half are zeros are no part of the truth.
    """
    from scipy import ndimage

    truth = clear(seed, duration)
    before, after = round(0.02 * RATE), round(5e-3 * RATE)
    size = before + after + 1
    origin = before - size // 2
    near = ndimage.maximum_filter1d(np.abs(truth.samples), size, origin=origin)
    samples = np.where(near >= threshold, truth.samples, 0.0)
    index = np.round(truth.time * RATE).astype(int)
    first = np.array([samples[i : i + round(4e-3 * RATE)] for i in index])
    passed = np.mean(first == 0.0, axis=1) <= 0.5
    time, amplitude, contact = (
        column[passed] for column in (truth.time, truth.amplitude, truth.contact_time)
    )
    return replace(truth, samples=samples, time=time, amplitude=amplitude, contact_time=contact)


def reverberant(seed, duration=DURATION, *, time, density=12.0) -> Truth:
    """In a room: as much reverberation as direct sound, 60 dB down after `time` seconds."""
    return in_room(clear(seed, duration, density=density), time, seed)


def in_room(truth: Truth, time: float, seed: int) -> Truth:
    """As `reverberant`, of a record."""
    from scipy.signal import fftconvolve

    t = np.arange(round(time * truth.rate)) / truth.rate
    room = chance(seed).standard_normal(len(t)) * 10 ** (-3.0 * t / time)
    room[: round(2e-3 * truth.rate)] = 0.0
    room /= np.sqrt(np.sum(room**2))
    wet = fftconvolve(truth.samples, room)[: len(truth.samples)]
    return replace(truth, samples=truth.samples + wet)


def in_noise(seed, duration=DURATION, *, exponent, level=10.0) -> Truth:
    """Noise of power 1/f**exponent, `level` dB below."""
    truth = clear(seed, duration, level=100.0)
    noise = coloured(chance(seed), len(truth.samples), RATE, exponent)
    return replace(truth, samples=truth.samples + 10 ** (-level / 20) * noise)


def clipped(seed, duration=DURATION, *, limit) -> Truth:
    """The record cut off at `limit` times the median burst."""
    truth = clear(seed, duration)
    return replace(truth, samples=np.clip(truth.samples, -limit, limit))


def only_noise(seed, *, exponent) -> Truth:
    none = np.empty(0)
    samples = coloured(chance(seed), round(MINUTES * RATE), RATE, exponent)
    return Truth(samples, RATE, none, none, none)


def sound_records(duration: float = DURATION) -> list[Case]:
    """Every record, in the order of the table."""
    cases: list[Case] = []

    def put(name: str, make: Callable, **options) -> None:
        cases.append(Case(name, partial(make, duration=duration, **options)))

    for density in (5, 12, 28):
        for level in (20, 10, 6):
            put(f"{density} a second, {level} dB", clear, density=density, level=level)
    for decimator in DECIMATORS:
        for rate in SLOW:
            put(f"{decimator}, {rate / 1000:.0f} kHz", slowed, rate=rate, decimator=decimator)
    for codec in CODECS:
        for rate in SLOW:
            put(f"{codec}, {rate / 1000:.0f} kHz", coded, rate=rate, codec=codec)
    for threshold in (0.3, 0.4, 0.5):
        put(f"gate, {threshold}", gated, threshold=threshold)
    for time in (0.1, 0.3, 1.0):
        put(f"room, {time} s", reverberant, time=time)
    for time in (0.1, 0.3):
        put(f"room, {time} s, 4 a second", reverberant, time=time, density=4)
    for exponent in (0, 1, 2):
        put(f"1/f^k noise at 10 dB, k = {exponent}", in_noise, exponent=exponent)
    for limit in (0.5, 0.2, 0.1):
        put(f"clipped, {limit}", clipped, limit=limit)
    cases += [
        Case(f"nothing, 1/f^{k} noise", partial(only_noise, exponent=k), 1) for k in (0, 1, 2)
    ]
    return cases
