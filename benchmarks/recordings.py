"""Synthetic recordings with known impacts: the ground truth of tests and benchmarks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

PULSES = {
    "half-sine": lambda u: np.sin(np.pi * u),
    "asymmetric": lambda u: np.sin(np.pi * u**0.7),
    "flat-topped": lambda u: np.minimum(1.0, 1.6 * np.sin(np.pi * u)),
}


@dataclass(frozen=True)
class Truth:
    """Samples and what went into them; `time` is the first touch of each impact [s]."""

    samples: np.ndarray
    rate: float
    time: np.ndarray
    contact_time: np.ndarray
    amplitude: np.ndarray


def add_pulses(samples, rate, time, contact_time, amplitude, pulse):
    """Add ``amplitude * pulse((t - time) / contact_time)`` where the argument is in [0, 1]."""
    for start, contact, peak in zip(time, contact_time, amplitude, strict=True):
        index = np.arange(
            max(int(start * rate), 0), min(int((start + contact) * rate) + 2, len(samples))
        )
        u = (index / rate - start) / contact
        inside = (u >= 0) & (u <= 1)
        samples[index[inside]] += peak * pulse(u[inside])


def load_cell(
    *,
    duration=60.0,
    rate=50_000.0,
    contact=300e-6,
    pulse="half-sine",
    noise=0.1,
    drift=True,
    mean_rate=20.0,
    doubles=True,
    dtype=np.float64,
    seed=0,
):
    """The load-cell recording: 300 us contacts, exponential gaps with an 8 ms floor at about 20/s.

    Every tenth impact is followed by a second hit of 0.6 times its amplitude after 2 ms;
    amplitudes are log-normal (sigma 0.5); noise, slow drift, 50 Hz hum 0.1 and 150 Hz 0.03.
    """
    rng = np.random.default_rng(seed)
    gaps = 0.008 + rng.exponential(1 / mean_rate - 0.008, int(2 * duration * mean_rate) + 20)
    base = 0.02 + np.cumsum(gaps)
    base = base[base < duration - 0.02]
    amplitude = np.exp(0.5 * rng.standard_normal(len(base)))
    second = np.arange(len(base)) % 10 == 9 if doubles else np.zeros(len(base), bool)
    time = np.concatenate((base, base[second] + 0.002))
    amplitude = np.concatenate((amplitude, 0.6 * amplitude[second]))
    order = np.argsort(time)
    time, amplitude = time[order], amplitude[order]
    t = np.arange(round(duration * rate)) / rate
    samples = noise * rng.standard_normal(len(t))
    if drift:
        samples += 0.3 * np.sin(2 * np.pi * t / 37) + 0.01 * t / 6
        samples += 0.1 * np.sin(2 * np.pi * 50 * t + 1) + 0.03 * np.sin(2 * np.pi * 150 * t + 2)
    contacts = np.full(len(time), contact)
    add_pulses(samples, rate, time, contacts, amplitude, PULSES[pulse])
    return Truth(samples.astype(dtype), rate, time, contacts, amplitude)


def microphone(
    *, duration=60.0, rate=22_050.0, mean_rate=12.0, noise_db=-20.0, tones=(2000, 6000), seed=0
):
    """The sound recording: ringing bursts of 2-6 kHz, doubles at 8 ms, pink noise 20 dB below.

    Bursts start at once and decay with a time constant of 2-6 ms; amplitudes are log-normal
    (sigma 0.5); every tenth impact is followed by a second one of 0.6 times its amplitude.
    The noise has an RMS of -20 dB relative to the unit peak.
    """
    rng = np.random.default_rng(seed)
    gaps = 0.03 + rng.exponential(1 / mean_rate - 0.03, int(2 * duration * mean_rate) + 20)
    base = 0.05 + np.cumsum(gaps)
    base = base[base < duration - 0.05]
    amplitude = np.exp(0.5 * rng.standard_normal(len(base)))
    second = np.arange(len(base)) % 10 == 9
    time = np.concatenate((base, base[second] + 0.008))
    amplitude = np.concatenate((amplitude, 0.6 * amplitude[second]))
    order = np.argsort(time)
    time, amplitude = time[order], amplitude[order]
    count = round(duration * rate)
    samples = coloured(rng, count, rate) * 10 ** (noise_db / 20)
    for start, peak in zip(time, amplitude, strict=True):
        tone, phase, decay = (
            rng.uniform(*tones),
            rng.uniform(0, 2 * np.pi),
            rng.uniform(2e-3, 6e-3),
        )
        index = np.arange(int(np.ceil(start * rate)), min(int((start + 12 * decay) * rate), count))
        since = index / rate - start
        samples[index] += peak * np.exp(-since / decay) * np.sin(2 * np.pi * tone * since + phase)
    return Truth(samples, rate, time, np.full(len(time), np.nan), amplitude)


def coloured(rng, count, rate, exponent=1.0):
    """Noise of power 1/f**exponent above 20 Hz and RMS 1."""
    spectrum = np.fft.rfft(rng.standard_normal(count))
    spectrum /= np.maximum(np.fft.rfftfreq(count, 1 / rate), 20.0) ** (0.5 * exponent)
    noise = np.fft.irfft(spectrum, count)
    return noise / noise.std()


def score(found, truth, tolerance=1e-3, delays=(0.0,)):
    """F1, timing RMS after a constant latency, and the pairs (found index, truth index).

    A pair is one to one, nearest first, at most `tolerance` apart after the median latency has
    been removed. That is looked for about each of `delays`; the one with the best F1 counts.
    """
    found, truth = np.asarray(found), np.asarray(truth)
    if not len(found) or not len(truth):
        return 0.0, np.nan, np.empty((0, 2), int)
    return max((paired(found, truth, tolerance, delay) for delay in delays), key=lambda of: of[0])


def paired(found, truth, tolerance, latency):
    """The score with a latency near to the one given."""
    for _ in range(3):
        moved = found - latency
        nearest = np.clip(np.searchsorted(truth, moved), 1, len(truth) - 1)
        nearest -= moved - truth[nearest - 1] < truth[nearest] - moved
        off = moved - truth[nearest]
        near = np.abs(off) <= tolerance
        if not near.any():
            break
        latency += np.median(off[near])
    order = np.argsort(np.abs(off), kind="stable")
    used, pairs = set(), []
    for i in order:
        if abs(off[i]) <= tolerance and nearest[i] not in used:
            used.add(nearest[i])
            pairs.append((i, nearest[i]))
    pairs = np.array(sorted(pairs), int).reshape(-1, 2)
    f1 = 2 * len(pairs) / (len(found) + len(truth))
    error = found[pairs[:, 0]] - truth[pairs[:, 1]]
    return f1, float(np.std(error)) if len(pairs) else np.nan, pairs
