"""Mutual information of two series, by nearest neighbours."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arguments import whole
from ..errors import InvalidInput
from ._arguments import varying
from ._series import series

NEIGHBORS = 4


def mutual_information(x: Any, y: Any, *, neighbors: int = NEIGHBORS) -> float:
    """Mutual information of two series of equal length [nat], by nearest neighbours.

    The first estimator of Kraskov et al. [Kraskov2004]_: with e_i the distance from (x_i, y_i) to
    its k-th nearest neighbour (the larger difference of a coordinate), and n_x(i), n_y(i) the
    numbers of other values nearer than e_i in each coordinate,

        I = psi(k) + psi(n) - <psi(n_x + 1) + psi(n_y + 1)>,

    with psi the digamma function. Both series are first replaced by normal scores of their ranks,
    which does not change the information; equal values, due to rounding, are ordered at random
    (reproducibly), which adds none. Unlike histogram estimates it has hardly any bias: for 200
    Gaussian pairs with a correlation of 0.9 the mean is 0.84, and the true value 0.83. For
    independent series it scatters about 0 with a standard deviation of about 0.6/sqrt(n).

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Series of equal length.
    neighbors : int
        k; more neighbours reduce the scatter and the resolution.

    Returns
    -------
    float
        I [nat], which may be slightly negative for independent series.

    Raises
    ------
    InvalidInput
        If `x` or `y` is not a series of finite numbers, is constant, or they differ in length or
        are not longer than `neighbors`.

    See Also
    --------
    embedding_delay

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import mutual_information
    >>> x = np.random.default_rng(1).standard_normal((2, 4000))
    >>> round(mutual_information(x[0], x[0] + x[1]), 1)  # ln(2) / 2
    0.3
    """
    neighbors = whole("neighbors", neighbors, 1)
    first = varying(series(x, "x", neighbors + 1), "x")
    second = varying(series(y, "y", neighbors + 1), "y")
    if len(first) != len(second):
        raise InvalidInput("y", f"{len(second)} values", f"as many as of x, {len(first)}")
    return information(scored(first, 0), scored(second, 1), neighbors)


def scored(x: np.ndarray, seed: int) -> np.ndarray:
    """Normal scores of a series, with ties in random order."""
    from scipy.special import ndtri

    n = len(x)
    scores = np.empty(n)
    order = np.lexsort((np.random.default_rng(seed).random(n), x))
    scores[order] = ndtri((np.arange(n) + 0.5) / n)
    return scores


def information(x: np.ndarray, y: np.ndarray, neighbors: int) -> float:
    """Mutual information of series without ties."""
    from scipy.special import digamma

    from ._mutual_information import neighbor_counts

    each = digamma(neighbor_counts(x, y, neighbors) + 1.0).sum(axis=0)
    return float(digamma(neighbors) + digamma(len(x)) - each.mean())
