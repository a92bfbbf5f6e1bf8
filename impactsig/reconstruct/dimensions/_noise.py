"""Noise of a series: given, or estimated from the correlation sum at the smallest scales."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from . import _jackknife
from ._kernel_sum import KernelSum, kernel_sum

EMBEDDINGS = (3, 4, 5)
LARGEST = 0.01
"""K up to which the noise is sought."""

DEMANDED = 4.0
"""Units of the weighted sum of squares by which noise must explain the sums better than none."""

MISFIT = 0.03
"""What a power law may miss ln K by."""

LEVELS = 80

SYSTEMATIC = 0.2
"""Relative error of the level beyond chance: the attractor is no power law (beam: 20 % low)."""

MOST_DOUBT = 0.5


class Noise(NamedTuple):
    """Standard deviations of the noise.

    Attributes
    ----------
    timing : float
        Of the instants between which the values are intervals; neighbouring intervals share one.
    value : float
        Of what is added to each value on its own.
    source : str
        Where they are from, in words.
    other : (float, float) or None
        Timing and value as they may be as well, a standard error higher; None where they are
        stated.
    """

    timing: float
    value: float
    source: str
    other: tuple[float, float] | None = None

    @property
    def of_value(self) -> float:
        """Standard deviation of the noise on one value."""
        return math.hypot(math.sqrt(2) * self.timing, self.value)

    def covariance(self, m: int, delay: int) -> np.ndarray:
        """Covariance of the noise on a delay vector, shape (m, m)."""
        return _covariance(self.timing, self.value, m, delay)


def _covariance(timing: float, value: float, m: int, delay: int) -> np.ndarray:
    found: np.ndarray = (2 * timing**2 + value**2) * np.eye(m)
    if delay == 1:
        found -= timing**2 * (np.eye(m, k=1) + np.eye(m, k=-1))
    return found


def estimated(
    x: np.ndarray, delay: int, theiler: int, floor: float, intervals: bool, workers: int | None
) -> Noise:
    r"""The noise level that best explains the uncorrected sums in several embeddings.

    Gaussian noise of covariance S turns the sum with a kernel of width H into

    .. math:: K_m(H) = A_m \sqrt{\frac{\det H^2 I}{\det(H^2 I + S)}} \, (H^2 + \bar s^2)^{D / 2}

    where the noise-free one is a power law; s-bar is the mean noise of a coordinate [Diks1996]_.
    The level is that of the least weighted squares, with one D for all m; its doubt is a jackknife.
    Of impacts the noise is that of their instants; of other series that or noise of the values,
    whichever fits better.
    """
    sums = [
        kernel_sum(x, m, delay, theiler, np.zeros((m, m)), floor, workers, LARGEST)
        for m in EMBEDDINGS
    ]
    known = [(m, one) for m, one in zip(EMBEDDINGS, sums, strict=True) if one is not None]
    none = Noise(0.0, 0.0, "not seen in the data")
    if len(known) < 2 or sum(len(one.scales) for _, one in known) < 8:
        return none
    low = min(one.scales[0] for _, one in known)
    high = max(one.scales[-1] for _, one in known)
    levels = np.append(0.0, np.geomspace(low / 4, high / 2, LEVELS))
    fits = [
        (structure, *_fit(known, levels, structure, delay))
        for structure in (("timing",) if intervals else ("timing", "value"))
    ]
    structure, found, gain, most = max(fits, key=lambda one: one[2])
    if gain < DEMANDED or not found[0] > 0:
        return Noise(0.0, 0.0, none.source, _as(structure, most))
    logs = np.log(np.where(found[1:] > 0, found[1:], levels[1]))
    jackknife = math.sqrt((len(logs) - 1) / len(logs) * float(((logs - logs.mean()) ** 2).sum()))
    doubt = min(math.hypot(jackknife, SYSTEMATIC), MOST_DOUBT)
    level = float(found[0])
    words = f"estimated from the data, to {100 * doubt:.0f} %"
    return Noise(*_as(structure, level), words, _as(structure, (1 + doubt) * level))


def _as(structure: str, level: float) -> tuple[float, float]:
    return (level, 0.0) if structure == "timing" else (0.0, level)


def _fit(
    known: list[tuple[int, KernelSum]], levels: np.ndarray, structure: str, delay: int
) -> tuple[np.ndarray, float, float]:
    """Best level over all blocks and without each block; its gain; an upper level."""
    of_timing = structure == "timing"
    columns, logs, corrections, weights = [], [], [], []
    for row, (m, one) in enumerate(known):
        sums = _jackknife.without_each(one.parts) / _jackknife.without_each(one.pairs)
        with np.errstate(divide="ignore"):
            logs.append(np.log(sums))
        unit = _covariance(float(of_timing), float(not of_timing), m, delay)
        spread = levels[:, None, None] ** 2 * np.linalg.eigvalsh(unit)
        squares = one.scales[:, None] ** 2
        filled = 0.5 * np.log1p(spread / squares).sum(axis=-1)
        slope = 0.5 * np.log(one.scales**2 + levels[:, None] ** 2 * unit[0, 0])
        corrections.append(filled)
        columns.append(slope)
        weights.append(
            np.column_stack([np.full(len(one.scales), row), 1 / (1 / one.raw + MISFIT**2)])
        )
    rows = np.concatenate(weights)
    y = np.concatenate(logs, axis=1)
    y = np.where(np.isfinite(y), y, y[:1])
    root = np.sqrt(rows[:, 1])
    offsets = (rows[:, :1] == np.arange(len(known))) * root[:, None]
    misfit = np.empty((len(levels), len(y)))
    for at in range(len(levels)):
        filled = np.concatenate([one[at] for one in corrections])
        slope = np.concatenate([one[at] for one in columns])
        target = ((y + filled) * root).T
        design = np.column_stack([offsets, slope * root])
        left = target - design @ np.linalg.lstsq(design, target, rcond=None)[0]
        misfit[at] = (left**2).sum(axis=0)
    best = misfit.argmin(axis=0)
    of_all = misfit[:, 0]
    possible = levels[np.flatnonzero(of_all <= of_all.min() + 1)[-1]]
    return levels[best], float(of_all[0] - of_all.min()), float(possible)
