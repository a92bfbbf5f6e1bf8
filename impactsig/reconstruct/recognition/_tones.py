"""Whether a series is a sum of a few tones, and their number of independent frequencies."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy import fft
from scipy.special import chdtri

MOST = 16
"""Tones that are tried."""

LEAST_VALUES = 100
LONGEST = 4096
"""Values that are fitted."""

EXACT = 2e-3
"""Share of the standard deviation left over that needs no further question."""

NOISY = 0.1
"""Share left over up to which it may be noise about a sum of tones."""

WORTH = 0.9
"""Share that a tone leaves over beyond which it is one of a broad spectrum."""

LEAST_TURNS = 4
"""Of a tone within the series; what turns less often is a drift."""

HARMONIC = 16
"""Greatest sum of the multiples in which two frequencies make a third."""

NEAR = 0.05
"""Two frequencies are the same that drift apart by less than this many turns over the series."""


class Tones(NamedTuple):
    """A sum of tones: number of independent frequencies (0: more than two), and the residual."""

    independent: int
    scatter: float


def tones(x: np.ndarray, resolution: float) -> Tones | None:
    """The tones of a standardised series; None if it is not a sum of a few.

    Tones are taken out one after the other, the strongest first, and all fitted together each time.
    What is left over must be next to nothing, or small, and noise: no further correlated than
    differences of timing errors are.
    """
    x = x[:LONGEST]
    n = len(x)
    if n < LEAST_VALUES:
        return None
    found, left = np.empty(0), x
    for _ in range(min(MOST, n // 12)):
        before = left.std()
        found = np.append(found, _strongest(left))
        if np.abs(found - np.round(found)).min() < LEAST_TURNS / n:
            return None
        for _ in range(3):
            found, left = _fitted(x, found)
        scatter = float(left.std())
        if scatter < max(EXACT, min(2 * resolution, NOISY)) or (
            scatter < NOISY and _is_noise(left)
        ):
            return Tones(_independent(found, NEAR / n), scatter)
        if scatter > WORTH * before:
            return None
    return None


def _strongest(x: np.ndarray) -> float:
    """Frequency of the strongest tone, in turns per value."""
    size = fft.next_fast_len(8 * len(x), real=True)
    power = np.abs(fft.rfft(x * np.hanning(len(x)), size)) ** 2
    return float(np.argmax(power[1:]) + 1) / size


def _fitted(x: np.ndarray, frequencies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies after one Gauss-Newton step, and the residual of the tones before it."""
    time = np.arange(len(x)) - (len(x) - 1) / 2
    angle = 2 * np.pi * np.outer(time, frequencies)
    cosine, sine = np.cos(angle), np.sin(angle)
    design = np.column_stack([cosine, sine, np.ones(len(x))])
    weights = np.linalg.lstsq(design, x, rcond=None)[0]
    left = x - design @ weights
    k = len(frequencies)
    turn = 2 * np.pi * time[:, None] * (weights[k : 2 * k] * cosine - weights[:k] * sine)
    step = np.linalg.lstsq(np.column_stack([design, turn]), left, rcond=None)[0][-k:]
    return frequencies + np.clip(step, -0.25 / len(x), 0.25 / len(x)), left


def _is_noise(left: np.ndarray) -> bool:
    """Whether lags 2 to 12 are those of a moving average of order 1 [BoxPierce1970]_."""
    n = len(left)
    lagged = np.array([left[k:] @ left[: n - k] for k in range(13)]) / (left @ left)
    total = n * (lagged[2:] ** 2).sum() / (1 + 2 * lagged[1] ** 2)
    return bool(total < chdtri(11, 0.001))


def _independent(frequencies: np.ndarray, tolerance: float) -> int:
    """Number of frequencies that generate all others with integers; 0 if more than 2."""
    for size in (1, 2):
        for base in combinations(frequencies, size):
            grid = np.arange(-HARMONIC, HARMONIC + 1)
            multiples = grid[:, None] if size == 1 else np.argwhere(np.ones((33, 33))) - HARMONIC
            multiples = multiples[np.abs(multiples).sum(axis=1) <= HARMONIC]
            sums = multiples @ np.array(base)
            off = sums[:, None] - frequencies
            if (np.abs(off - np.round(off)).min(axis=0) < tolerance).all():
                return size
    return 0
