"""Choice of the embedding dimension: false nearest neighbours, and Cao's averages."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .._arguments import number, whole
from .._showing import Shown, drawn_by
from ..errors import InvalidInput
from ._arguments import dimensions_of, long_enough, varying
from ._series import known, series, unbroken
from ._theiler import theiler_window
from ._values import rounding_doubt, typical_gap

DISTINCT = 10
"""Fewest different values that make a geometry."""

LEAST = 50
"""Fewest vectors that neighbours are looked for among."""

UNRELATED = 1 / 3
"""Gap of the neighbours' next values, over that of any two values, at which nothing is foretold."""

FLAT = 0.1
"""Change of E1 that is none, and distance of E2 from 1 that is none."""


@dataclass(frozen=True, eq=False)
class FalseNeighbors(Shown):
    """Shares of false nearest neighbours, and the dimension at which they vanish.

    Attributes
    ----------
    dimension : int or None
        Smallest dimension with a fraction of at most `tolerance`; None if there is none.
    dimensions : ndarray, shape (k,)
        Dimensions m.
    share : ndarray, shape (k,)
        Fraction of the neighbours in m dimensions that are false by either criterion.
    by_growth, by_size : ndarray, shape (k,)
        Fraction by the first and by the second criterion.
    foretold : ndarray, shape (k,)
        Median gap between the next values of neighbours, divided by the median gap of any two
        values: near 0 if the vector determines the next value, 1 for noise.
    delay, theiler : int
        As used.
    tolerance : float
        The fraction allowed.
    warnings : tuple of str
        Warnings about the result.

    See Also
    --------
    false_nearest_neighbors, results.AveragedFalseNeighbors, plot.false_neighbors

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import false_nearest_neighbors
    >>> found = false_nearest_neighbors(np.sin(0.3 * np.arange(500)), dimensions=4, delay=5)
    >>> found.dimension
    2
    """

    dimension: int | None
    dimensions: np.ndarray
    share: np.ndarray
    by_growth: np.ndarray
    by_size: np.ndarray
    foretold: np.ndarray
    delay: int
    theiler: int
    tolerance: float
    warnings: tuple[str, ...] = ()

    def describe(self) -> str:
        """Describe the result in words."""
        least = int(np.argmin(self.share))
        if self.dimension is None:
            words = (
                f"no embedding dimension by false nearest neighbours: {self.share[least]:.1%} "
                f"are false at best, in {self.dimensions[least]} dimensions"
            )
        else:
            words = (
                f"embedding dimension {self.dimension} by false nearest neighbours "
                f"(the least with at most {self.tolerance:.0%} false)"
            )
        return "; ".join((words, *self.warnings))

    plot = drawn_by("false_neighbors", "the shares")


@dataclass(frozen=True, eq=False)
class AveragedFalseNeighbors(Shown):
    """Cao's E1 and E2, and the dimension from which E1 is constant.

    Attributes
    ----------
    dimension : int or None
        Smallest dimension from which E1 stays within 0.1 of its last value; None if E1 changes up
        to the end, or E2 shows no determinism.
    deterministic : bool
        Whether E2 deviates from 1 by more than 0.1 anywhere. Linearly correlated noise appears
        deterministic as well: compare with surrogates.
    dimensions : ndarray, shape (k,)
        m = 1, 2, ..., k.
    e1, e2 : ndarray, shape (k,)
        E(m+1)/E(m) and E*(m+1)/E*(m).
    delay, theiler : int
        As used.
    warnings : tuple of str
        Warnings about the result.

    See Also
    --------
    averaged_false_neighbors, results.FalseNeighbors

    Examples
    --------
    >>> from impactsig import averaged_false_neighbors
    >>> x = [0.4]
    >>> for _ in range(999):
    ...     x.append(1 - 1.4 * x[-1] ** 2 + 0.3 * (x[-2] if len(x) > 1 else 0))
    >>> found = averaged_false_neighbors(x, dimensions=5)
    >>> found.dimension, found.deterministic
    (2, True)
    """

    dimension: int | None
    deterministic: bool
    dimensions: np.ndarray
    e1: np.ndarray
    e2: np.ndarray
    delay: int
    theiler: int
    warnings: tuple[str, ...] = ()

    def describe(self) -> str:
        """Describe the result in words."""
        if not self.deterministic:
            words = "no determinism by averaged false neighbours: E2 is 1 in every dimension"
        elif self.dimension is None:
            words = "no embedding dimension by averaged false neighbours"
            if not self.warnings:
                words += f": E1 still changes at {self.dimensions[-1]} dimensions"
        else:
            words = (
                f"embedding dimension {self.dimension} by averaged false neighbours "
                f"(from there on E1 stays within {FLAT} of {self.e1[-1]:.2f})"
            )
        return "; ".join((words, *self.warnings))

    plot = drawn_by("averaged_false_neighbors", "E1 and E2")


def false_nearest_neighbors(
    x: Any,
    dimensions: int | Iterable[int] = 8,
    delay: int = 1,
    theiler: int | None = None,
    *,
    growth: float = 15.0,
    size: float = 2.0,
    tolerance: float = 0.01,
) -> FalseNeighbors:
    """Shares of nearest neighbours that separate when a dimension is added [Kennel1992]_.

    With R_m the Euclidean distance from vector i to its nearest neighbour j in m dimensions, and
    g = abs(x_{i+m delay} - x_{j+m delay}) the gap of their next coordinates, j is false if

        g / R_m > growth,    or    sqrt(R_m^2 + g^2) / R_A > size,

    R_A the standard deviation of x. Neighbours are exact; those within the Theiler window and those
    at distance 0, for which the growth is undefined, are skipped in favour of the next nearest. In
    noise, too, few neighbours are false if they are far away. Therefore no dimension is given if
    the next values of neighbours differ by more than a third of the difference between any two
    values.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    dimensions : int or iterable of int
        Dimensions to try, ascending; a single number stands for all from 1 up to it.
    delay : int
        Between two coordinates; for intervals the natural delay is 1.
    theiler : int, optional
        Vectors i and j with abs(i - j) <= theiler are not neighbours; by default two mean periods,
        as in `correlation_sum`.
    growth, size : float
        Thresholds of the two criteria.
    tolerance : float
        Greatest acceptable fraction of false neighbours.

    Returns
    -------
    FalseNeighbors

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, constant, or too short.

    See Also
    --------
    averaged_false_neighbors, delay_embed

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import false_nearest_neighbors
    >>> found = false_nearest_neighbors(np.sin(0.3 * np.arange(500)), dimensions=4, delay=5)
    >>> found.dimension  # a sine is a closed curve in the plane
    2
    """
    tried, delay = np.array(dimensions_of(dimensions)), whole("delay", delay, 1)
    growth = number("growth", growth, above=0)
    size = number("size", size, above=0)
    tolerance = number("tolerance", tolerance, above=0)
    values, window = _ready(x, tried[-1], delay, theiler)
    scale = known(values).std()
    apart = typical_gap(values)
    rows = []
    for m in tried:
        distance, gap = _pairs(values, m, delay, window, maximum=False)
        far = gap > growth * distance
        wide = np.hypot(distance, gap) > size * scale
        rows.append((np.mean(far | wide), far.mean(), wide.mean(), np.median(gap) / apart))
    share, by_growth, by_size, foretold = np.array(rows).T
    good = np.flatnonzero(share <= tolerance)
    found: int | None = None
    warnings = _doubts(values)
    if len(good) and foretold[good[0]] > UNRELATED:
        warnings.append(
            f"in {tried[good[0]]} dimensions neighbours are followed by values as far apart as "
            f"{foretold[good[0]]:.0%} of any two: noise, or too short a series"
        )
    if len(good) and not warnings:
        found = int(tried[good[0]])
    warnings += _rounding(values)
    return FalseNeighbors(
        found, tried, share, by_growth, by_size, foretold, delay, window, tolerance, tuple(warnings)
    )


def averaged_false_neighbors(
    x: Any, dimensions: int = 8, delay: int = 1, theiler: int | None = None
) -> AveragedFalseNeighbors:
    """Cao's method of averaged false neighbours, E1 and E2 [Cao1997]_.

    With R_m(i) the distance (greatest difference of a coordinate) from vector i to its nearest
    neighbour j in m dimensions, R_{m+1} that of the same two with the next coordinate, and g the
    gap of these coordinates,

        E(m) = mean R_{m+1}/R_m,   E*(m) = mean g,   E1 = E(m+1)/E(m),   E2 = E*(m+1)/E*(m).

    E1 stops changing where the attractor is unfolded; E2 is 1 in every dimension for independent
    numbers. As in the paper, a neighbour at distance 0 is passed over for the next.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    dimensions : int
        Greatest dimension, at least 2; E1 and E2 are computed for all dimensions from 1 up to it.
    delay : int
        Between two coordinates; for intervals the natural delay is 1.
    theiler : int, optional
        Vectors i and j with abs(i - j) <= theiler are not neighbours; by default two mean periods,
        as in `correlation_sum`.

    Returns
    -------
    AveragedFalseNeighbors

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, constant, or too short.

    See Also
    --------
    false_nearest_neighbors, delay_embed

    Examples
    --------
    >>> from impactsig import averaged_false_neighbors
    >>> x = [0.4]
    >>> for _ in range(999):
    ...     x.append(1 - 1.4 * x[-1] ** 2 + 0.3 * (x[-2] if len(x) > 1 else 0))
    >>> averaged_false_neighbors(x, dimensions=5).deterministic
    True
    """
    most, delay = whole("dimensions", dimensions, 2), whole("delay", delay, 1)
    values, window = _ready(x, most + 1, delay, theiler)
    mean_ratio, mean_gap = np.empty(most + 1), np.empty(most + 1)
    for m in range(1, most + 2):
        distance, gap = _pairs(values, m, delay, window, maximum=True)
        mean_ratio[m - 1] = np.mean(np.maximum(distance, gap) / distance)
        mean_gap[m - 1] = gap.mean()
    e1 = mean_ratio[1:] / mean_ratio[:-1]
    e2 = mean_gap[1:] / np.maximum(mean_gap[:-1], np.finfo(float).tiny)
    deterministic = bool(np.any(np.abs(e2 - 1) > FLAT))
    changing = np.flatnonzero(np.abs(e1 - e1[-1]) > FLAT)
    first = int(changing[-1]) + 2 if len(changing) else 1
    warnings = _doubts(values)
    found = first if deterministic and first < most and not warnings else None
    warnings += _rounding(values)
    return AveragedFalseNeighbors(
        found, deterministic, np.arange(1, most + 1), e1, e2, delay, window, tuple(warnings)
    )


def _doubts(values: np.ndarray) -> list[str]:
    different = len(np.unique(known(values)))
    if different >= DISTINCT:
        return []
    return [f"the series takes {different} values only: it is periodic, or too coarsely rounded"]


def _rounding(values: np.ndarray) -> list[str]:
    few = rounding_doubt(values)
    return [f"{few}: neighbours that are equal were passed over"] if few else []


def _ready(x: Any, most: int, delay: int, theiler: int | None) -> tuple[np.ndarray, int]:
    """The series and the Theiler window, if there are enough vectors of the greatest dimension."""
    values = varying(series(x, gap=1))
    window = theiler_window(theiler, values)
    long_enough(values, most * delay, window, LEAST)
    return values, window


def _pairs(
    values: np.ndarray, m: int, delay: int, window: int, maximum: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Distances of nearest neighbours with a next coordinate, and the gaps of that coordinate."""
    from ._neighbors import NOBODY, nearest, tree

    span = int(m) * delay + 1
    vectors = sliding_window_view(values, span)[:, : span - 1 : delay]
    index, distance = nearest(tree(vectors, unbroken(values, span)), window, maximum)
    has = index != NOBODY
    if has.sum() < LEAST:
        raise InvalidInput(
            "x",
            f"{has.sum()} vectors with a neighbour at another value, in {m} dimensions",
            f"at least {LEAST}",
            "The series takes too few different values: it is periodic or coarsely rounded",
        )
    following = values[m * delay :]
    gap = np.abs(following - following[index])
    return distance[has], gap[has]
