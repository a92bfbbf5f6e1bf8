"""Sums of a Gaussian kernel over pairs of points, at many scales at once, compiled.

Two k-d trees are walked together. A pair of boxes is opened only at the scales at which the kernel
between them is not negligible, and these are the largest ones, because the kernel falls with the
scale.
"""

from __future__ import annotations

import numpy as np

from .._compiled import njit
from ._neighbors import LEAF, Tree

NEGLIGIBLE = 11.0
"""Exponent beyond which a pair of boxes is left out: exp(-11) is 2e-5."""

FARTHEST = 40.0
"""Exponents beyond it count as this one, whose exponential is 0 for any purpose."""


@njit(nogil=True)
def _exponent_between(low, high, other_low, other_high, weights):
    """The least exponent of a pair of points from two boxes."""
    least = 0.0
    for d in range(len(low)):
        gap = max(low[d] - other_high[d], other_low[d] - high[d], 0.0)
        least += weights[d] * gap * gap
    return least


@njit(nogil=True, fastmath={"reassoc", "contract"})
def _add_exponentials(squares, count, weights, first, exponents, sums):
    """sums[s] += exp(-weights[s] @ squares[:, p]) over all p, for the scales from `first` on.

    exp(-q) is the 32nd power of a polynomial in q / 32, which runs in lanes; wrong by 1e-8 where q
    is 1, by 1e-4 of itself where it is negligible.
    """
    for s in range(first, len(sums)):
        for p in range(count):
            exponents[p] = weights[s, 0] * squares[0, p]
        for d in range(1, len(squares)):
            for p in range(count):
                exponents[p] += weights[s, d] * squares[d, p]
        total = 0.0
        for p in range(count):
            x = min(exponents[p], FARTHEST) / 32
            e = 1 - x * (1 - x / 2 * (1 - x / 3 * (1 - x / 4)))
            e *= e
            e *= e
            e *= e
            e *= e
            total += e * e
        sums[s] += total


@njit(nogil=True)
def kernel_sums(one: Tree, other: Tree, same: bool, theiler: int, weights: np.ndarray):
    """Sums of exp(-sum_d weights[s, d] (p_d - q_d)^2) over pairs of points, shape (scales,).

    Parameters
    ----------
    one, other : Tree
        Pairs that are no more than `theiler` apart in time, by `order`, are left out.
    same : bool
        Whether both are the same tree, in which each pair counts once.
    weights : ndarray, shape (scales, m)
        Falling from scale to scale.
    """
    sums = np.zeros(len(weights))
    m = weights.shape[1]
    inner, other_inner = len(one.begin) // 2, len(other.begin) // 2
    squares, exponents = np.empty((m, LEAF * LEAF)), np.empty(LEAF * LEAF)
    nodes = np.empty((1024, 3), np.int64)
    nodes[0] = 0
    top = 1
    while top > 0:
        top -= 1
        a, b, first = nodes[top]
        low, high = one.low[a], one.high[a]
        other_low, other_high = other.low[b], other.high[b]
        while first < len(weights) and (
            _exponent_between(low, high, other_low, other_high, weights[first]) > NEGLIGIBLE
        ):
            first += 1
        if first == len(weights):
            continue
        if a < inner or b < other_inner:
            for i in range(2 if a < inner else 1):
                for j in range(2 if b < other_inner else 1):
                    left = 2 * a + 1 + i if a < inner else a
                    right = 2 * b + 1 + j if b < other_inner else b
                    if same and right < left:
                        continue
                    nodes[top, 0], nodes[top, 1], nodes[top, 2] = left, right, first
                    top += 1
            continue
        count = 0
        for i in range(one.begin[a], one.end[a]):
            for j in range(i + 1 if same and a == b else other.begin[b], other.end[b]):
                if abs(one.order[i] - other.order[j]) <= theiler:
                    continue
                for d in range(m):
                    squares[d, count] = (one.points[i, d] - other.points[j, d]) ** 2
                count += 1
        _add_exponentials(squares, count, weights, first, exponents, sums)
    return sums
