"""Odd sound records, made from a number, and what must hold of whatever is detected in them.

As `odd_records`, for the kernels of sound::

    NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=/tmp/checked python -m tests.stress.odd_sounds 0 1000
"""

from __future__ import annotations

import itertools
import sys

import numpy as np

import impactsig

from .odd_records import clipped, held, main, single_samples, steps, wandering, whole_numbers

RATES = 4000.0, 8000.0, 11_025.0, 22_050.0, 44_100.0, 96_000.0
SECONDS = (0.0, 0.03), (0.03, 0.5), (0.5, 4.0), (4.0, 20.0)
SHARES = (0.1, 0.3, 0.5, 0.1)


def strikes(x, rng, rate):
    """Some that share modes, which decay in 1 ms to 1 s."""
    x, since = x.copy(), np.arange(round(rng.choice([0.02, 0.2, 2.0]) * rate)) / rate
    frequency = rng.uniform(100.0, 0.49 * rate, rng.integers(1, 8))
    decay = 10.0 ** rng.uniform(-3, 0, len(frequency))
    for start in rng.integers(0, max(len(x), 1), round(len(x) / rate * rng.choice([1, 5, 25]))):
        phase = rng.uniform(0.0, 2.0 * np.pi, len(frequency)) * rng.choice([0.0, 1.0])
        modes = np.exp(-since[:, None] / decay) * np.sin(
            2.0 * np.pi * since[:, None] * frequency + phase
        )
        near = x[start : start + len(since)]
        near += 10.0 ** rng.uniform(-1, 2) * modes.sum(axis=1)[: len(near)]
    return x


def gated(x, rng, rate):
    """Attenuated where it is soft for some time, at once or within 0.1 s."""
    at = np.arange(len(x))
    loud = np.abs(x) > rng.uniform(0.05, 0.5) * np.abs(x).max(initial=0.0)
    since = (at - np.maximum.accumulate(np.where(loud, at, -len(x)))) / rate
    fade = rng.choice([1e-4, 0.1])
    return x * np.clip(1.0 - (since - 0.05) / fade, rng.choice([0.0, 0.01]), 1.0)


def hum(x, rng, rate):
    """Of the mains, with harmonics."""
    phase = 2.0 * np.pi * rng.choice([50.0, 60.0]) / rate * np.arange(len(x))
    return x + 10.0 ** rng.uniform(-1, 2) * sum(np.sin(k * phase) / k for k in (1, 2, 3, 7))


def swelling(x, rng, rate):
    """Its level changes some times a second."""
    return x * (1.0 + 0.9 * np.sin(2.0 * np.pi * rng.uniform(0.5, 80.0) / rate * np.arange(len(x))))


KINDS = (
    clipped, gated, held, hum, single_samples, steps, strikes, strikes, swelling, wandering,
    whole_numbers,
)  # fmt: skip


def odd_sound(number: int) -> tuple[np.ndarray, float]:
    """Samples of any type, some of them perhaps NaN, and their rate."""
    rng = np.random.default_rng(number)
    rate = float(rng.choice(RATES))
    seconds = rng.uniform(*SECONDS[rng.choice(len(SECONDS), p=SHARES)])
    x = rng.choice([0.0, 1.0, 1.0, 30.0]) * rng.standard_normal(round(seconds * rate))
    for kind in rng.choice(len(KINDS), rng.integers(0, 5), replace=False):
        x = KINDS[kind](x, rng, rate)
    if rng.random() < 0.2:
        return np.clip(np.round(x), -32768, 32767).astype(np.int16), rate
    x = x * rng.choice([1.0, 1.0, 1e-150, 1e90])
    if rng.random() < 0.2:
        x[rng.integers(0, max(len(x), 1), rng.integers(0, 5))] = np.nan
    return x, rate


def check(number: int) -> None:
    """Raise AssertionError, or what detection raised, unless what is found in a sound is sound."""
    x, rate = odd_sound(number)
    rng = np.random.default_rng([number, 1])
    least = float(rng.choice([0.1, 0.5, 0.9]))
    options = {"sensor": "sound", "least_probability": least, "gaps": "split"}
    found = impactsig.detect_impacts(impactsig.Recording(x, rate), **options)
    assert np.all(np.diff(found.time) > 0)
    assert np.all((found.time >= 0) & (found.time <= len(x) / rate))
    assert np.all(found.peak > 0)
    assert np.all((found.probability >= least) & (found.probability <= 1))
    assert np.all(np.isfinite(found.time_error) & (found.time_error > 0))
    assert bool(found.reason) == (len(found) == 0)
    # Neither do blocks change it.
    ends = [0, *np.sort(rng.integers(0, len(x) + 1, 3)).tolist(), len(x)]
    blocks = [
        impactsig.Recording(x[begin:end], rate, start=begin / rate)
        for begin, end in itertools.pairwise(ends)
        if end > begin
    ]
    if len(blocks) > 1:
        again = impactsig.detect_impacts(blocks, **options)
        for name in ("time", "peak", "probability", "time_error"):
            np.testing.assert_array_equal(getattr(again, name), getattr(found, name))


if __name__ == "__main__":
    sys.exit(main(check))
