"""Whether a series is periodic apart from noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import chdtri

CYCLES = 8
"""Cycles that must have been seen for their scatter to mean anything."""

LEAST = 100
"""Equal intervals below which small chaos would pass for jitter."""

LONGEST = 64
"""Values in the longest cycle that is sought beneath noise."""

APART = 0.1
"""Scatter, as a share of the standard deviation of the series, up to which values are apart."""

JITTER = 0.01
"""Scatter of intervals about a single one, as a share of it, up to which they are jitter."""

FORETOLD = 0.8
"""Mean square error of prediction, in units of the variance, below which scatter is no noise.

Of independent values it is 2, of differences of independent values 4/3; of chaos nearly 0.
"""

SCREENED = 4096


class Cycle(NamedTuple):
    """A cycle that a series repeats, and the standard deviation about it."""

    steps: int
    scatter: float


def noisy_cycle(x: np.ndarray, resolution: float, intervals: bool) -> Cycle | None:
    """The shortest cycle about which the series scatters only by noise, or None.

    Every value is compared with the mean of those at its place in the cycle. The scatter must be
    small: a tenth of the standard deviation of the series, so that the cycle visits values that are
    apart; of a single value, 1 % of it, and only intervals are taken so, as other series have no
    zero to be compared with. And it must be noise: either within two steps of the resolution, or
    correlated no further than differences of timing errors are, to the next value, and such that
    the nearest neighbours of the last two deviations do not foretell the next. Chaos in bands that
    are visited in turn is foretold; a modulation and a drift are correlated.
    """
    scale = float(np.abs(x).max())
    x = x / scale
    head = x[:SCREENED]
    single = JITTER * x.mean() if intervals and len(x) >= LEAST else 0.0
    for steps in range(1, min(len(x) // CYCLES, LONGEST) + 1):
        limit = APART * x.std() if steps > 1 else single
        if not _about_cycle(head, steps).std() <= limit:
            continue
        rest = _about_cycle(x, steps)
        scatter = float(rest.std())
        if scatter > limit:
            continue
        resolved = np.abs(rest).max() > 2 * resolution / scale
        if not resolved or (_uncorrelated(rest) and not _foretold(rest, steps)):
            return Cycle(steps, scatter * scale)
    return None


def _about_cycle(x: np.ndarray, steps: int) -> np.ndarray:
    place = np.arange(len(x)) % steps
    mean = np.bincount(place, x) / np.bincount(place)
    rest: np.ndarray = x - mean[place]
    return rest


def _uncorrelated(rest: np.ndarray) -> bool:
    """Whether lags 2 to 12 are insignificant, and lag 1 is neither positive nor below -1/2.

    By the sum of squared autocorrelations, whose variance is (1 + 2 rho_1^2) / n beneath a moving
    average of two [BoxPierce1970]_; wrongly denied to one series of noise in a thousand.
    """
    rest = rest / np.abs(rest).max()
    n, most = len(rest), min(12, len(rest) // 4)
    lagged = np.array([rest[k:] @ rest[: n - k] for k in range(most + 1)]) / (rest @ rest)
    near = 3 / np.sqrt(n)
    if not -0.5 - near < lagged[1] < near:
        return False
    total = n * (lagged[2:] ** 2).sum() / (1 + 2 * lagged[1] ** 2)
    return bool(total < chdtri(most - 1, 0.001))


def _foretold(rest: np.ndarray, steps: int) -> bool:
    """Whether two successive deviations predict the third, at the same place of the cycle."""
    rest = rest[-SCREENED:]
    error, count = 0.0, 0
    for place in range(steps):
        third = np.arange(place, len(rest), steps)
        third = third[third >= 2]
        last = np.column_stack([rest[third - 2], rest[third - 1]])
        spread, target = last.std(axis=0), rest[third]
        if not (spread.all() and target.any()):
            continue
        _, near = cKDTree(last / spread).query(last / spread, k=2)
        other = np.where(near[:, 0] == np.arange(len(third)), near[:, 1], near[:, 0])
        error += float(((target[other] - target) ** 2).sum() / target.var())
        count += len(third)
    return error < FORETOLD * count
