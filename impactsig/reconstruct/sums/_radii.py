"""Radii of a correlation sum: those that are given, and those over all distances of interest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InvalidInput
from .._arguments import finite_range
from .._series import known, series, unbroken

if TYPE_CHECKING:
    from ._point_sums import Norm

PER_OCTAVE = 4
"""Default radii in each octave."""

OCTAVES = 40
"""How far below the greatest distance default radii are sought; beyond is rounding."""

ALL_PAIRS_UP_TO = 30_000
"""Delay vectors up to which the default radii reach to the greatest distance."""

NEIGHBOURS = 200
"""Where there are more, the greatest default radius holds about as many neighbours of each."""


def given_radii(given: Any) -> np.ndarray:
    """Validate given radii."""
    radii = series(given, "radii", least=1)
    if radii[0] <= 0 or np.any(np.diff(radii) <= 0):
        raise InvalidInput("radii", given, "positive numbers, ascending, each once")
    return radii


def radii_of_points(vectors: np.ndarray, norm: Norm) -> np.ndarray:
    """Radii in quarter octaves up to the extent of the vectors."""
    extent = np.ptp(vectors, axis=0)
    greatest = float(extent.max() if norm == "max" else math.hypot(*extent))
    if greatest == 0:
        raise InvalidInput("x", "vectors that are all equal", "vectors that vary, or radii")
    return _quarter_octaves_to(greatest)


def radii_of_series(x: np.ndarray, dimensions: tuple[int, ...], delay: int) -> np.ndarray:
    """Default radii, in quarter octaves over all distances of interest."""
    values = known(finite_range(x))
    greatest = float(np.ptp(values))
    if greatest == 0:
        raise InvalidInput(
            "x",
            f"{len(values)} values that are all {values[0]:g}",
            "a series that varies",
            "Intervals that are all equal are those of a periodic motion, of dimension 0. "
            "With radii given they can be counted",
        )
    lowest = next((m for m in dimensions if m > 1), 1)
    if np.count_nonzero(unbroken(x, (lowest - 1) * delay + 1)) > ALL_PAIRS_UP_TO:
        greatest = _radius_of_neighbours(x, lowest, delay)
    return _quarter_octaves_to(greatest)


def _quarter_octaves_to(greatest: float) -> np.ndarray:
    last = min(np.ceil(PER_OCTAVE * np.log2(greatest)), PER_OCTAVE * 1024 - 1)
    radii = np.exp2(np.arange(last - PER_OCTAVE * OCTAVES, last + 1) / PER_OCTAVE)
    return radii[radii > 0]


def _radius_of_neighbours(x: np.ndarray, m: int, delay: int) -> float:
    """Radius that contains about NEIGHBOURS others, from a sample of pairs."""
    n = len(x) - (m - 1) * delay
    # Drawn, because evenly spaced vectors would beat with a periodic series.
    i, j = np.random.default_rng(0).integers(n, size=(2, 2_000_000))
    i, j = i[i != j], j[i != j]
    d = np.zeros(len(i))
    for k in range(m):
        np.maximum(d, np.abs(x[i + k * delay] - x[j + k * delay]), out=d)
    d = known(d)
    radius = float(np.quantile(d, NEIGHBOURS / n))
    return radius or float(d[d > 0].min(initial=np.ptp(known(x))))


def with_pairs(counts: np.ndarray) -> slice:
    """Slice of the radii between the last with no pairs and the first with all."""
    changes = np.flatnonzero(np.any(np.diff(counts, axis=1), axis=0))
    return slice(int(changes[0]), int(changes[-1]) + 2) if len(changes) else slice(0, None)
