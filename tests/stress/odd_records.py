"""Odd force records, made from a number, and what must hold of whatever is detected in them.

Run as a module it goes through many. With NUMBA_BOUNDSCHECK=1, and NUMBA_CACHE_DIR somewhere of its
own, every index of every kernel is checked::

    NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=/tmp/checked python -m tests.stress.odd_records 0 5000
"""

from __future__ import annotations

import sys
import traceback
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import impactsig

SIZES = ((0, 60), (0, 2000), (2000, 60_000), (60_000, 160_000))
SHARES = (0.2, 0.5, 0.25, 0.05)
ERRORS = ("time_error", "contact_time_error", "peak_error", "impulse_error")


def steps(x, rng, rate):
    return x + np.repeat(rng.standard_normal(len(x) // 50 + 1) * 10.0, 50)[: len(x)]


def whole_numbers(x, rng, rate):
    return np.round(x)


def single_samples(x, rng, rate):
    return x + (rng.random(len(x)) < 0.05) * rng.integers(-5, 6, len(x))


def tone(x, rng, rate):
    height, frequency = 10.0 ** rng.uniform(-2, 3), rng.uniform(0.1, 2000.0)
    return x + height * np.sin(2.0 * np.pi * frequency / rate * np.arange(len(x)))


def pulses(x, rng, rate):
    x = x.copy()
    for start in rng.integers(0, max(len(x), 1), rng.integers(1, 60)):
        width = int(rng.choice([1, 2, 3, 6, 15, 60, 300]))
        seen = np.arange(min(width, len(x) - start))
        height = rng.uniform(20.0, 100.0) * rng.choice([1.0, 1.0, -1.0])
        x[start : start + len(seen)] += height * np.sin(np.pi * (seen + 0.5) / width)
    return x


def clipped(x, rng, rate):
    return np.clip(x, -rng.uniform(0.0, 5.0), rng.uniform(0.0, 5.0))


def held(x, rng, rate):
    x = x.copy()
    if len(x):
        first = rng.integers(0, len(x))
        x[first : first + rng.integers(1, len(x) + 1)] = rng.choice([0.0, x[first], 5.0])
    return x


def wandering(x, rng, rate):
    return 0.01 * np.cumsum(x)


KINDS = (steps, whole_numbers, single_samples, tone, pulses, clipped, held, wandering)


def odd_record(number: int) -> tuple[np.ndarray, float, dict[str, Any]]:
    """Samples, rate and options of a record."""
    rng = np.random.default_rng(number)
    count = int(rng.integers(*SIZES[rng.choice(len(SIZES), p=SHARES)]))
    rate = float(rng.choice([1000.0, 22_050.0, 50_000.0, 2e5]))
    x = rng.choice([0.0, 1e-150, 1e-12, 1.0, 1e6]) * rng.standard_normal(count)
    for kind in rng.choice(len(KINDS), rng.integers(0, 4), replace=False):
        x = KINDS[kind](x, rng, rate)
    choices: dict[str, tuple[float, list[Any]]] = {
        "threshold": (0.4, [1.0, "3 sigma", "20 sigma"]),
        "polarity": (0.5, ["both", "positive", "negative"]),
        "contact_level": (0.2, [0.1, "10 %", "50 %"]),
        "merge_within": (0.2, [0.001, 0.01]),
        "least_probability": (0.2, [0.1, 0.9]),
        "contact_time": (0.15, [(1.0 / rate, longest / rate) for longest in (5, 100, 3000)]),
    }
    options = {
        name: values[rng.integers(len(values))]
        for name, (share, values) in choices.items()
        if rng.random() < share
    }
    return x + rng.choice([0.0, 0.0, 1e3]), rate, options


def check(number: int) -> None:
    """Raise AssertionError, or what detection raised, unless what is found in a record is sound."""
    x, rate, options = odd_record(number)
    try:
        found = impactsig.detect_impacts(impactsig.Recording(x, rate), **options)
    except impactsig.InvalidInput as error:
        if error.argument != "threshold":  # in multiples of noise, where there is none
            raise
        return
    assert np.all(np.diff(found.time) >= 0)
    assert np.all((found.time >= 0) & (found.time <= len(x) / rate))
    # What does not reach a level in the unit of the record is no time above it.
    assert isinstance(options.get("contact_level"), float) or np.all(found.contact_time > 0)
    assert np.all(np.abs(found.peak) > 0)
    assert np.all(np.isfinite(found.impulse))
    for name in ERRORS:
        assert np.all(getattr(found, name) >= 0), name
    assert bool(found.reason) == (len(found) == 0)


def main(check: Callable[[int], None]) -> int:
    """Check so many records from one number on, as the command says."""
    first, count = map(int, sys.argv[1:3])
    wrong = 0
    warnings.simplefilter("error", RuntimeWarning)
    for number in range(first, first + count):
        try:
            check(number)
        except Exception:
            wrong += 1
            print(f"record {number}: {traceback.format_exc()}", flush=True)
    print(f"{count} records, {wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(check))
