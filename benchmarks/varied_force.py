"""Detection in force records of random rate, contact, shape and train, one disturbance a line.

No constant of the detector was chosen on these records, but the seeds 100 to 113 showed the faults
that `tests/unit/test_interference.py` holds. Impacts that a matched filter would not see count
neither as missed nor as false.

    python -m benchmarks.varied_force --seeds 300:312 [--only ringing bursts]
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import signal

import impactsig

from .recordings import PULSES, add_pulses, score
from .seeds import add_seeds

SHAPES: dict[str, Callable[[Any], Any]] = {
    "half-sine": PULSES["half-sine"],
    "haversine": lambda u: np.sin(np.pi * u) ** 2,
    "Hertz": lambda u: np.sin(np.pi * u) ** 1.5,
    "early": lambda u: np.sin(np.pi * u**0.6),
    "late": lambda u: np.sin(np.pi * u**1.5),
    "saw": lambda u: np.where(u < 0.15, u / 0.15, (1 - u) / 0.85),
    "flat": PULSES["flat-topped"],
    "exponential": lambda u: (np.exp(-4 * u) - np.exp(-40 * u)) / 0.65,
}
DISTURBANCES = (
    "none",
    "ringing",
    "low-pass",
    "AC coupling",
    "hum",
    "harmonics",
    "inverter",
    "walk",
    "steps",
    "converter",
    "spikes",
    "dropouts",
    "pushes",
    "bursts",
)
SEEN = 8.0
"""Height over the noise of a matched filter, from which on an impact counts."""
CODES = 2.0
"""Height in steps of the converter, from which on it does."""


def disturbed(x, rate, contact, height, kind, rng):
    """The record with one disturbance; `height` is the median pulse's."""
    n = len(x)
    t = np.arange(n) / rate
    duration = n / rate
    if kind == "ringing":
        angular = 2 * np.pi * min(rng.uniform(0.8, 3.0) / contact, 0.4 * rate)
        damping = rng.uniform(0.05, 0.3)
        x = signal.lfilter(
            *signal.bilinear([angular**2], [1, 2 * damping * angular, angular**2], rate), x
        )
    elif kind == "low-pass":
        corner = min(0.45 * rate, rng.uniform(1, 4) / contact)
        x = signal.sosfilt(signal.bessel(4, corner, fs=rate, output="sos", norm="mag"), x)
    elif kind == "AC coupling":
        tau = 10 ** rng.uniform(-2, 0)
        x = signal.lfilter(*signal.butter(1, 1 / (2 * np.pi * tau), "high", fs=rate), x)
    elif kind == "hum":
        x = x + height * rng.choice([0.1, 0.3, 1.0]) * np.sin(2 * np.pi * 60 * t + 1)
    elif kind == "harmonics":
        lines = sum(np.sin(2 * np.pi * 50.02 * m * t + m) / m for m in (1, 3, 5, 7))
        x = x + height * rng.choice([0.1, 0.3, 0.6]) * lines
    elif kind == "inverter":
        tone = np.sin(2 * np.pi * min(0.3 * rate, 8000.0) * t)
        x = x + height * rng.choice([0.05, 0.2]) * tone
    elif kind == "walk":
        walk = np.cumsum(rng.standard_normal(n))
        x = x + walk / np.ptp(walk) * height * rng.choice([1, 5])
    elif kind == "steps":
        for start in rng.uniform(0, duration, 3):
            x[int(start * rate) :] += height * rng.uniform(-2, 2)
    elif kind == "spikes":
        at = rng.integers(0, n, max(3, int(duration)))
        x[at] += np.ptp(x) * rng.uniform(1, 30, len(at)) * rng.choice([-1, 1], len(at))
    elif kind == "dropouts":
        for start in rng.uniform(0, duration, 5):
            x[int(start * rate) : int((start + 0.02) * rate)] = 0
    elif kind == "pushes":
        for start in rng.uniform(0.5, duration - 0.5, 3):
            width = rng.uniform(0.1, 0.5)
            x = x + height * rng.uniform(0.5, 3) * np.exp(-(((t - start) / width) ** 2))
    elif kind == "bursts":
        for start in rng.uniform(0.5, duration - 0.5, 4):
            part = x[int(start * rate) : int((start + 0.01) * rate)]
            part += 0.7 * height * rng.standard_normal(len(part))
    return x


def record(seed: int, kind: str):
    """Samples, rate, instants and contact times of one record, and which impacts can be seen."""
    rng = np.random.default_rng(seed)
    rate = float(rng.choice([10e3, 20e3, 25.6e3, 50e3, 51.2e3, 60e3, 100e3]))
    contact = min(rng.choice([5, 8, 15, 30, 60, 150]) * rng.uniform(0.8, 1.25) / rate, 8e-3)
    duration = float(rng.choice([5.0, 10.0]))
    train = rng.choice(["regular", "jittered", "random", "doubles", "grazing", "modulated"])
    pace = float(min(rng.choice([3, 8, 20, 40]), 0.15 / contact))
    count = int(duration * pace) + 5
    if train == "random":
        floor = max(4 * contact, 0.006)
        gaps = floor + rng.exponential(max(1 / pace - floor, 0.2 / pace), count)
    elif train == "regular":
        gaps = np.full(count, 1 / pace)
    else:
        gaps = (1 + 0.1 * rng.standard_normal(count)).clip(0.4, 2) / pace
    time = 0.05 + np.cumsum(gaps)
    height = np.exp(rng.choice([0.05, 0.3, 0.5]) * rng.standard_normal(count))
    if train == "doubles":
        second = np.arange(count) % 3 == 1
        later = max(2.5 * contact, 2e-3) * rng.uniform(1, 2, second.sum())
        time = np.concatenate((time, time[second] + later))
        height = np.concatenate((height, 0.5 * height[second]))
        order = np.argsort(time)
        time, height = time[order], height[order]
    elif train == "grazing":
        height *= np.where(np.arange(count) % 4 == 2, 0.08, 1)
    elif train == "modulated":
        height *= np.exp(1.2 * np.sin(2 * np.pi * time / duration * 1.5))
    inside = (time > 0.03) & (time < duration - 0.05)
    time, height = time[inside], height[inside]
    shape = str(rng.choice(list(SHAPES)))
    contacts = np.full(len(time), contact)
    x = np.zeros(int(duration * rate))
    add_pulses(x, rate, time, contacts, height, SHAPES[shape])
    usual = float(np.median(height))
    noise = usual * 10 ** (-float(rng.choice([15, 20, 30, 40, 60])) / 20)
    x = disturbed(x, rate, contact, usual, kind, rng) + noise * rng.standard_normal(len(x))
    # The energy of a pulse of height 1 in samples is what a matched filter gathers.
    energy = contact * rate * np.mean(SHAPES[shape](np.linspace(0, 1, 1000)) ** 2)
    seen = height * np.sqrt(energy) > SEEN * noise
    if kind == "converter":
        step = usual / rng.choice([5, 20, 300])
        x = np.round(x / step) * step
        seen &= height > CODES * step
    return x, rate, time, contacts, seen


def result(seed: int, kind: str) -> tuple[float, int, int, int, bool]:
    """F1, missed, false, impacts in the record, and whether there was a note."""
    x, rate, time, contacts, seen = record(seed, kind)
    found = impactsig.detect_impacts(impactsig.Recording(x, rate, sensor="force"))
    tolerance = max(1e-3, 0.5 * float(np.median(contacts)))
    _, _, pairs = score(found.time, time, tolerance)
    hit = np.zeros(len(time), bool)
    hit[pairs[:, 1]] = True
    right, missed = np.count_nonzero(hit & seen), np.count_nonzero(seen & ~hit)
    false = len(found) - len(pairs)
    f1 = 2 * right / max(2 * right + missed + false, 1)
    return f1, missed, false, len(time), bool(found.notes)


def main() -> None:
    """Print the mean F1 of each disturbance, and the records below 0.97."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "300:312")
    parser.add_argument("--only", nargs="+", default=DISTURBANCES, choices=DISTURBANCES)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    for kind in given.only:
        results = {seed: result(seed, kind) for seed in given.seeds}
        mean = np.mean([one[0] for one in results.values()])
        print(f"{kind:12} mean F1 {mean:.3f}", flush=True)
        for seed, (f1, missed, false, total, note) in results.items():
            if f1 < 0.97:
                told = "a note" if note else "no note"
                print(f"    {seed}: {f1:.3f}, {missed} missed, {false} false of {total}, {told}")


if __name__ == "__main__":
    main()
