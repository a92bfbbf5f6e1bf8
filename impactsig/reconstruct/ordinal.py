"""Ordinal patterns of delay vectors, and their entropy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np

from .._arguments import whole
from .._showing import Shown
from ..errors import InvalidInput
from ._series import known, series, unbroken

GREATEST = 8  # 8! = 40 320 patterns
MANY_TIED = 0.05


@dataclass(frozen=True, eq=False, repr=False)
class OrdinalPatterns(Shown):
    """Frequencies of the orders of successive values.

    Attributes
    ----------
    patterns : ndarray of int, shape (order!, order)
        The patterns: rank of each value of the vector, 0 for the smallest.
    counts : ndarray of int, shape (order!,)
        Number of vectors with each pattern.
    order, delay : int
        Values of a vector, and steps from one to the next.
    tied : float
        Fraction of the vectors with equal values, of which the earlier counts as the smaller.
    warnings : tuple of str
        Warnings about the result.

    See Also
    --------
    ordinal_patterns

    Examples
    --------
    >>> from impactsig import ordinal_patterns
    >>> found = ordinal_patterns([4, 7, 9, 10, 6, 11, 3], 2)
    >>> found.patterns, found.counts
    (array([[0, 1],
           [1, 0]]), array([4, 2]))
    """

    patterns: np.ndarray
    counts: np.ndarray
    order: int
    delay: int
    tied: float
    warnings: tuple[str, ...] = ()

    @property
    def entropy(self) -> float:
        """Permutation entropy, -sum p ln p over the patterns [nat]."""
        share = self.counts[self.counts > 0] / self.counts.sum()
        return float(-np.sum(share * np.log(share))) + 0.0

    @property
    def normalized_entropy(self) -> float:
        """Permutation entropy over its maximum, ln(order!); 1 for independent values."""
        return self.entropy / math.log(math.factorial(self.order))

    @property
    def missing(self) -> int:
        """Number of patterns that never occur; a map forbids some, noise none."""
        return int(np.count_nonzero(self.counts == 0))

    def describe(self) -> str:
        """Describe the result in words."""
        words = (
            f"permutation entropy {self.entropy:.3g} nat, {self.normalized_entropy:.3g} of the "
            f"greatest; {self.missing} of {len(self.counts)} patterns of {self.order} values "
            f"missing among {self.counts.sum()}"
        )
        return "; but ".join((words, *self.warnings))


def ordinal_patterns(x: Any, order: int = 3, delay: int = 1) -> OrdinalPatterns:
    """Ordinal patterns of a series, and their permutation entropy [BandtPompe2002]_.

    The pattern of (x_i, x_{i+delay}, ..., x_{i+(m-1) delay}) is the order of its values. Of two
    equal values the earlier counts as the smaller, as in the paper. If many values are equal
    because they were rounded, rising patterns are therefore too frequent, and there is a warning.
    No vector spans a gap of the run.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    order : int
        m, values of a vector, 2 to 8.
    delay : int
        Steps from one value to the next.

    Returns
    -------
    OrdinalPatterns
        `counts` of the `patterns`, shape (order!,), and the permutation entropy [nat].

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers or too short for one vector.

    See Also
    --------
    recurrence_quantification, surrogate_test

    Examples
    --------
    >>> from impactsig import ordinal_patterns
    >>> found = ordinal_patterns([4, 7, 9, 10, 6, 11, 3], 2)
    >>> found.counts  # rising, falling
    array([4, 2])
    """
    order, delay = whole("order", order, 2), whole("delay", delay, 1)
    if order > GREATEST:
        raise InvalidInput("order", order, f"{GREATEST} at most")
    values = series(x, least=1, gap=1)
    span = (order - 1) * delay + 1
    usable = unbroken(values, span)
    if not usable.any():
        raise InvalidInput(
            "x", f"{len(known(values))} values", f"{span} in a row for order {order}, delay {delay}"
        )
    vectors = np.lib.stride_tricks.sliding_window_view(values, span)[usable, ::delay]
    code = np.zeros(len(vectors), np.int64)
    tied = np.zeros(len(vectors), bool)
    for k in range(order - 1):
        # Lehmer's code: how many later values are less than this one.
        later = vectors[:, k + 1 :]
        code += np.sum(later < vectors[:, k : k + 1], axis=1) * math.factorial(order - 1 - k)
        tied |= np.any(later == vectors[:, k : k + 1], axis=1)
    counts = np.bincount(code, minlength=math.factorial(order))
    patterns = np.array(list(permutations(range(order))))
    share = float(tied.mean())
    warnings: tuple[str, ...] = ()
    present = known(values)
    if present.min() == present.max():
        warnings = ("the series is constant: every vector counts as rising",)
    elif share > MANY_TIED:
        warnings = (f"{share:.0%} of the vectors hold equal values, which count as rising",)
    for array in (patterns, counts):
        array.flags.writeable = False
    return OrdinalPatterns(patterns, counts, order, delay, share, warnings)
