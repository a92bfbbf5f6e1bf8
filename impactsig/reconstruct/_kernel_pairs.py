"""Sums of a Gaussian kernel over pairs of points, at many scales at once, compiled.

Two k-d trees are walked together. A pair of boxes is opened only at the scales at which the kernel
between them is not negligible, and these are the largest ones, because the kernel falls with the
scale.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from .._compiled import njit
from ._neighbors import LEAF, tree

NEGLIGIBLE = 11.0
"""Exponent beyond which a pair of boxes is left out: exp(-11) is 2e-5."""

FARTHEST = np.float32(40.0)
"""Exponents beyond it count as this one, whose exponential is 0 for any purpose."""

LEAST = np.exp(-NEGLIGIBLE)
"""Sum over a pair of leaves from which on smaller scales are left out."""

LANES = 32
"""Pairs are summed in multiples of it."""

C0, C1, C2, C3, C4, C5 = (np.float32(1 / c) for c in (1, -1, 2, -6, 24, -120))


class Forest(NamedTuple):
    """A tree for each block of time."""

    columns: np.ndarray  # (m, n + LEAF)
    order: np.ndarray  # (n,)
    inner: np.ndarray  # (blocks,), nodes that are no leaf
    begin: np.ndarray  # (blocks, nodes)
    end: np.ndarray
    low: np.ndarray  # (blocks, nodes, m)
    high: np.ndarray


def forest(vectors: np.ndarray, places: np.ndarray, starts: np.ndarray) -> Forest:
    """The trees of the blocks vectors[starts[b] : starts[b + 1]]."""
    n, m = vectors.shape
    trees = [tree(vectors[a:b]) for a, b in itertools.pairwise(starts)]
    shape = len(trees), max(len(one.begin) for one in trees)
    columns, order = np.zeros((m, n + LEAF)), np.empty(n, np.int64)
    begin, end = np.zeros(shape, np.int64), np.zeros(shape, np.int64)
    low, high = np.zeros((*shape, m)), np.zeros((*shape, m))
    for b, (start, one) in enumerate(zip(starts, trees, strict=False)):
        nodes, block = len(one.begin), slice(start, start + len(one.order))
        columns[:, block], order[block] = one.points.T, places[start + one.order]
        begin[b, :nodes], end[b, :nodes] = start + one.begin, start + one.end
        low[b, :nodes], high[b, :nodes] = one.low, one.high
    inner = np.array([len(one.begin) // 2 for one in trees])
    return Forest(columns, order, inner, begin, end, low, high)


@njit(nogil=True, fastmath={"reassoc", "contract"})
def _sum_of_exponentials(squares, count, ratios, exponents):
    """Sum of exp(-32 ratios @ squares[:, p]) over all p, in single precision.

    exp(-q) is the 32nd power of a polynomial in q / 32, which runs in lanes; wrong by 4e-6 of
    itself at most where q is below 5, by 1e-4 where it is negligible.
    """
    for p in range(count):
        exponents[p] = ratios[0] * squares[0, p]
    for d in range(1, len(squares)):
        for p in range(count):
            exponents[p] += ratios[d] * squares[d, p]
    total = np.float32(0.0)
    for p in range(count):
        x = min(exponents[p], FARTHEST / np.float32(32))
        e = C0 + x * (C1 + x * (C2 + x * (C3 + x * (C4 + x * C5))))
        e *= e
        e *= e
        e *= e
        e *= e
        total += e * e
    return total


@njit(nogil=True)
def _square_differences(mine, theirs, weights, squares):
    """Weighted squares of differences by coordinate, or their sum where `squares` has one row."""
    for d in range(len(weights)):
        weight = weights[d]
        for i in range(LEAF):
            value = mine[d, i]
            if d < len(squares):
                for j in range(LEAF):
                    squares[d, i, j] = weight * (theirs[d, j] - value) ** 2
            else:
                for j in range(LEAF):
                    squares[0, i, j] += np.float32(weight * (theirs[d, j] - value) ** 2)


@njit(nogil=True)
def kernel_sums(trees: Forest, block, theiler, weights, sums):
    """Add up exp(-sum_d weights[s, d] (p_d - q_d)^2) over pairs of points of a block and others.

    Parameters
    ----------
    trees : Forest
        Pairs that are no more than `theiler` apart in time, by `order`, are left out.
    block : int
        Of one point; the other is in the same block, where each pair counts once, or in a later.
    weights : ndarray, shape (scales, m)
        Falling from scale to scale.
    sums : ndarray, shape (blocks, scales)
        What is added to, by the block of the other point.
    """
    scales, m = weights.shape
    largest = weights[-1]
    # Without noise all coordinates have the same weight, and their squares are added up first.
    rows = 1 if np.all(weights == weights[:, :1]) else m
    ratios = (weights[:, :rows] / (32 * largest[:rows])).astype(np.float32)
    squares = np.empty((rows, LEAF + 4, LEAF), np.float32)
    flat = squares.reshape(rows, -1)
    squares[:] = np.inf
    exponents = np.empty(flat.shape[1], np.float32)
    mine, theirs = np.empty((m, LEAF)), np.empty((m, LEAF))
    nodes, gaps = np.empty((1024, 3), np.int64), np.empty(m)
    low, high = trees.low, trees.high
    times = trees.order[trees.begin[block, 0] : trees.end[block, 0]]
    for other in range(block, len(trees.inner)):
        if trees.end[block, 0] == trees.begin[block, 0] or (
            trees.end[other, 0] == trees.begin[other, 0]
        ):
            continue
        same = block == other
        later = trees.order[trees.begin[other, 0] : trees.end[other, 0]]
        may_be_close = later.min() - times.max() <= theiler
        nodes[0] = 0
        top = 1
        while top > 0:
            top -= 1
            a, b, first = nodes[top, 0], nodes[top, 1], nodes[top, 2]
            for d in range(m):
                gap = max(
                    low[block, a, d] - high[other, b, d], low[other, b, d] - high[block, a, d]
                )
                gaps[d] = max(gap, 0.0) ** 2
            while first < scales:
                least = 0.0
                for d in range(m):
                    least += weights[first, d] * gaps[d]
                if least <= NEGLIGIBLE:
                    break
                first += 1
            if first == scales:
                continue
            opened, other_opened = a < trees.inner[block], b < trees.inner[other]
            if opened or other_opened:
                for i in range(2 if opened else 1):
                    for j in range(2 if other_opened else 1):
                        left = 2 * a + 1 + i if opened else a
                        right = 2 * b + 1 + j if other_opened else b
                        if same and right < left:
                            continue
                        nodes[top, 0], nodes[top, 1], nodes[top, 2] = left, right, first
                        top += 1
                continue
            mine_from, begin = trees.begin[block, a], trees.begin[other, b]
            size, many = trees.end[block, a] - mine_from, trees.end[other, b] - begin
            for d in range(m):
                for i in range(size):
                    mine[d, i] = trees.columns[d, mine_from + i]
                for j in range(many):
                    theirs[d, j] = trees.columns[d, begin + j]
                mine[d, size:], theirs[d, many:] = 0.0, np.inf
            _square_differences(mine, theirs, largest, squares)
            if may_be_close:
                for i in range(size):
                    for j in range(many):
                        p, q = mine_from + i, begin + j
                        if abs(trees.order[p] - trees.order[q]) <= theiler or (same and q <= p):
                            squares[0, i, j] = np.inf
            squares[0, size:] = np.inf
            lanes = -(-size * LEAF // LANES) * LANES
            for s in range(scales - 1, first - 1, -1):
                total = _sum_of_exponentials(flat, lanes, ratios[s], exponents)
                sums[other, s] += total
                if total < LEAST:
                    break
