"""Force records of random machine, distribution of heights and noise, for the probability.

Every seed draws the rate, the contact time, the pulse, the rate of impacts, the distribution of
their heights (median 1) and the kind of noise. As much longer a pulse is, as much more noise there
is, so that the level says how far the median impact stands above the noise of its response.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .recordings import PULSES, Truth, add_pulses

HEIGHTS: dict[str, Callable[[Any, int], np.ndarray]] = {
    "one height": lambda rng, n: np.exp(0.1 * rng.standard_normal(n)),
    "log-normal": lambda rng, n: np.exp(0.5 * rng.standard_normal(n)),
    "wide log-normal": lambda rng, n: np.exp(rng.standard_normal(n)),
    "uniform": lambda rng, n: rng.uniform(0.0, 2.0, n),
    "exponential": lambda rng, n: rng.exponential(1.0 / np.log(2.0), n),
    "two groups": lambda rng, n: (
        np.where(rng.random(n) < 0.8, 1.0, 0.15) * np.exp(0.15 * rng.standard_normal(n))
    ),
    "grazing": lambda rng, n: 4.0 * rng.random(n) ** 2,
    "Hertz of normal velocities": lambda rng, n: (np.abs(rng.standard_normal(n)) / 0.6745) ** 1.2,
}
"""The heights of a machine near grazing have a density of v^(-1/2)."""
NOISES = ("white", "1/f^0.5", "1/f", "drift and hum", "converter", "band")
PULSE = 15.0
"""Samples of the pulse at whose height the level is meant."""
LOWEST = 20.0
"""Frequency below which the noise is white [Hz]."""


def noise(kind: str, count: int, rate: float, rng: np.random.Generator) -> np.ndarray:
    """Noise of unit standard deviation; drift, hum and the converter's step come later."""
    white = rng.standard_normal(count)
    if kind not in ("1/f^0.5", "1/f", "band"):
        return white
    spectrum, frequency = np.fft.rfft(white), np.fft.rfftfreq(count, 1 / rate)
    if kind == "band":
        centre = rng.uniform(0.02, 0.2) * rate
        spectrum *= 1.0 + 3.0 * np.exp(-(((frequency - centre) / (0.3 * centre)) ** 2))
    else:
        spectrum /= np.maximum(frequency, LOWEST) ** (0.25 if kind == "1/f^0.5" else 0.5)
    coloured = np.fft.irfft(spectrum, count)
    return coloured / coloured.std()


def varied_heights(seed: int, level: float, duration: float = 30.0) -> Truth:
    """One record; the noise lies `level` decibels below the median impact."""
    rng = np.random.default_rng((seed, int(level), 77))
    rate = float(rng.choice([8e3, 10e3, 20e3, 51.2e3]))
    length = float(rng.choice([4, 8, 15, 30]) * rng.uniform(0.8, 1.25))
    contact = length / rate
    pace = float(min(rng.choice([5, 10, 20, 40]), 0.12 / contact))
    heights, kind, shape = (str(rng.choice(list(of))) for of in (HEIGHTS, NOISES, PULSES))
    floor = max(4 * contact, 0.3 / pace)
    gaps = floor + rng.exponential(1 / pace - floor, int(2 * duration * pace) + 20)
    time = 0.05 + np.cumsum(gaps)
    time = time[time < duration - 0.05]
    height = HEIGHTS[heights](rng, len(time))
    sigma = 10 ** (-level / 20) * np.sqrt(length / PULSE)
    samples = sigma * noise(kind, round(duration * rate), rate, rng)
    t = np.arange(len(samples)) / rate
    if kind == "drift and hum":
        samples += 0.3 * np.sin(2 * np.pi * t / 37)
        samples += 0.1 * np.sin(2 * np.pi * 50 * t + 1) + 0.03 * np.sin(2 * np.pi * 150 * t + 2)
    contacts = np.full(len(time), contact)
    add_pulses(samples, rate, time, contacts, height, PULSES[shape])
    if kind == "converter":
        samples = np.round(samples / sigma) * sigma
    return Truth(samples, rate, time, contacts, height)
