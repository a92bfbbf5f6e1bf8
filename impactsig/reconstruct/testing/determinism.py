"""Determinism of the return map: share of variance that the previous interval explains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._arguments import Seed, whole
from ..._showing import Shown
from .prediction import prediction_error
from .surrogate_testing import surrogate_test
from .surrogates import longest_stretch


@dataclass(frozen=True, eq=False, repr=False)
class ReturnMapDeterminism(Shown):
    """Fraction of variance explained by the return map, and that of surrogates.

    Attributes
    ----------
    explained : float
        Fraction of the variance of a value that is explained by the one `lag` before; at most 1,
        and about -1/neighbors for independent values.
    surrogates : ndarray, shape (count,)
        The same for the values in random order.
    p_value : float
        Probability of as large a fraction in random order.
    lag, neighbors : int
        As used.
    warnings : tuple of str
        Warnings about the result.

    See Also
    --------
    return_map_determinism, results.SurrogateTest

    Examples
    --------
    >>> from impactsig import return_map_determinism
    >>> x = [0.4]
    >>> for _ in range(499):
    ...     x.append(4 * x[-1] * (1 - x[-1]))
    >>> found = return_map_determinism(x, count=19, seed=1)
    >>> found.p_value, round(found.explained, 1)
    (0.05, 1.0)
    """

    explained: float
    surrogates: np.ndarray
    p_value: float
    lag: int
    neighbors: int
    warnings: tuple[str, ...] = ()

    def describe(self) -> str:
        """Describe the result in words."""
        words = (
            f"an interval decides {self.explained:.3g} of the variance of the one {self.lag} later "
            f"(in random order {self.surrogates.mean():.2g}, "
            f"at most {self.surrogates.max():.2g}; p = {self.p_value:.2g})"
        )
        return "; but ".join((words, *self.warnings))


def return_map_determinism(
    x: Any, lag: int = 1, *, neighbors: int | None = None, count: int = 99, seed: Seed = None
) -> ReturnMapDeterminism:
    """Share of the variance of x_{i+lag} that nearest neighbours in the return map explain.

    With p_i the mean of x_{j+lag} over the k values x_j nearest to x_i, i itself and those within
    `lag` steps of it left out,

        explained = 1 - <(p_i - x_{i+lag})^2> / var(x),

    that is 1 - E^2 of `prediction_error` in one dimension [Sauer1994]_. It is nearly 1 for a
    one-dimensional map, reduced by the averaging over k neighbours, and -1/k for independent
    values. The same statistic of shuffled values gives its distribution by chance.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s], where the run has
        gaps the longest stretch between two of them.
    lag : int
        Values from one to the other.
    neighbors : int, optional
        k; by default 1 % of the pairs, but at least 5.
    count : int
        Number of shuffled series, 19 or more.
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same result; a Generator is advanced.

    Returns
    -------
    ReturnMapDeterminism
        `explained`, the same of the shuffled series, shape (count,), and the `p_value`.

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, is constant or is too short.

    See Also
    --------
    return_map, surrogate_test

    Examples
    --------
    >>> from impactsig import return_map_determinism
    >>> x = [0.4]
    >>> for _ in range(499):
    ...     x.append(4 * x[-1] * (1 - x[-1]))
    >>> round(return_map_determinism(x, count=19, seed=1).explained, 1)
    1.0
    """
    values, _ = longest_stretch(x)
    lag = whole("lag", lag, 1)
    own = prediction_error(values, 1, 1, lag, neighbors=neighbors)

    def explained(values: np.ndarray) -> float:
        return 1 - prediction_error(values, 1, 1, lag, neighbors=neighbors).value ** 2

    test = surrogate_test(
        x, explained, surrogates="shuffled", count=count, alternative="greater", seed=seed
    )
    return ReturnMapDeterminism(
        test.statistic, test.surrogates, test.p_value, int(lag), own.neighbors, test.warnings
    )
