"""Kernels that sum a Gaussian over pairs of points, at many scales at once.

A k-d tree puts neighbours into leaves of as many points as are summed at once. For each leaf the
tree is searched for the leaves with partners, once for all scales: two leaves are compared at the
scales at which the kernel between their boxes is not negligible, and these are the largest ones,
because the kernel falls with the scale.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import exprel

from ..._compiling.compiled import njit
from .._neighbors import build

NEGLIGIBLE = 17.0
"""Exponent beyond which pairs of leaves are left out: exp(-17) is 4e-8."""

LANES = 64
"""Points of a leaf. Of 16, LLVM made single steps: its loops take 32 numbers at a time."""

SINGLE = 100.0
"""Square of the size of a leaf over that of the reach from which on single precision is not enough.

Differences are taken from the middle of a leaf, and a coordinate is rounded to 6e-8 of its distance
from there: to 5e-6 of a scale at the most.
"""

LOG2_E = np.float32(1 / np.log(2))

TO_WHOLE = np.float32(1.5 * 2**23)
"""What is added to it has no binary digits left behind the point."""

LOWEST = np.float32(-60)
"""Exponent of 2 below which a number is 0 for any purpose; its square is a normal number still."""

LEAST = np.float32(2.0**-60)

SQUARED = 3
"""Times that exponentials are squared before they are worked out anew."""

# (2^x - 1) / x between -1/2 and 1/2, by Chebyshev's nodes. 2^x is wrong by 2e-7 of itself at most,
# and by less the nearer x is to 0: squares of it are no worse where they count.
_CHEBYSHEV = np.polynomial.Chebyshev.interpolate(
    lambda x: np.log(2) * exprel(np.log(2) * x), 4, domain=[-0.5, 0.5]
)
C1, C2, C3, C4, C5 = _CHEBYSHEV.convert(kind=np.polynomial.Polynomial).coef.astype(np.float32)
C0 = np.float32(1)


class Leaves(NamedTuple):
    """A k-d tree; node k has the children 2k + 1 and 2k + 2, and all leaves but one are full."""

    points: np.ndarray  # (m, n), in the order of the tree
    times: np.ndarray  # (n,) of float64
    blocks: np.ndarray  # (n,), of time
    begin: np.ndarray  # (nodes,), where the points of a node begin
    end: np.ndarray  # the same as `begin` where there are none
    low: np.ndarray  # (nodes, m), the box around them
    high: np.ndarray


def leaves(vectors: np.ndarray, times: np.ndarray, blocks: np.ndarray) -> Leaves:
    """The k-d tree of the vectors, shape (n, m), with time and block of each."""
    points, order = np.array(vectors, order="C"), np.arange(len(vectors))
    begin, end, low, high = build(points, order, LANES, True)
    return Leaves(
        np.ascontiguousarray(points.T),
        times[order].astype(np.float64),
        blocks[order],
        begin,
        end,
        low,
        high,
    )


@njit(nogil=True)
def _from_middle(points, begin, end, middle, found):
    """Points of a leaf relative to the centre of another, in the precision of `found`."""
    for d in range(len(points)):
        for i in range(begin, end):
            found[d, i - begin] = points[d, i] - middle[d]


@njit(nogil=True, fastmath={"contract"})
def _square_differences(line, count, lanes, squares):
    """Squared differences in single precision; those of the last column are summed."""
    last, width = len(squares) - 1, lanes.shape[1]
    for d in range(len(lanes)):
        column = min(d, last)
        for r in range(count):
            value, at = line[d, r], r * width
            if d > last:
                for j in range(width):
                    gap = np.float32(lanes[d, j] - value)
                    squares[column, at + j] += gap * gap
            else:
                for j in range(width):
                    gap = np.float32(lanes[d, j] - value)
                    squares[column, at + j] = gap * gap


@njit(nogil=True)
def _leave_out(times, begin, end, own, many, theiler, near_in_time, leaf, squares):
    """Exclude pairs within the Theiler window by infinite distances.

    Few are: `near_in_time` tells for which stretches of time it is to be looked at all.
    """
    width = max(theiler, 1.0)
    for i in range(begin, end):
        time, at = times[i], (i - begin) * LANES
        if near_in_time[int(time / width) + 1] == leaf:
            for j in range(many):
                if abs(own[j] - time) <= theiler:
                    squares[at + j] = np.inf


@njit(nogil=True)
def _mark(times, theiler, leaf, near_in_time):
    """Mark the stretches of time, `theiler` long, at and beside those of a leaf."""
    width = max(theiler, 1.0)
    for time in times:
        at = int(time / width) + 1
        near_in_time[at - 1 : at + 2] = leaf


@njit(nogil=True, fastmath={"contract"})
def _weigh(weight, squares, count, exponents, add):
    for p in range(count):
        exponents[p] = weight * squares[p] + (exponents[p] if add else np.float32(0))


@njit(nogil=True, fastmath={"contract"})
def _add_exponentials(weight, exponents, blocks, sums, s, powers):
    """sums[blocks[r], s] += powers[r] = 2^(weight exponents[r]), in single precision.

    The whole part of the exponent goes where a number has its own, 2 to the rest is a polynomial.
    """
    width = sums.shape[2]
    for r in range(len(blocks)):
        block, at = blocks[r], r * width
        for j in range(width):
            x = max(weight * exponents[at + j], LOWEST)
            whole = x + TO_WHOLE
            x -= whole - TO_WHOLE
            power = np.float32(C0 + x * (C1 + x * (C2 + x * (C3 + x * (C4 + x * C5)))))
            bits = power.view(np.int32) + (np.float32(whole).view(np.int32) << 23)
            power = np.int32(bits).view(np.float32)
            powers[at + j] = power
            sums[block, s, j] += power


@njit(nogil=True)
def _add_squares(powers, blocks, sums, s):
    """sums[blocks[r], s] += powers[r], which are squared before."""
    width = sums.shape[2]
    for r in range(len(blocks)):
        block, at = blocks[r], r * width
        for j in range(width):
            power = powers[at + j]
            power = max(power * power, LEAST)
            powers[at + j] = power
            sums[block, s, j] += power


@njit(nogil=True)
def _add_lanes(added, b, blocks, start, many, sums):
    """Add the sums of the points of a leaf to their blocks."""
    for j in range(many):
        block = blocks[start + j]
        for s in range(added.shape[1]):
            sums[b, block, s] += added[b, s, j]


@njit(nogil=True)
def _partners(tree, leaf, reaches, near, firsts, nodes):
    """Number of leaves, in `near`, that are within reach and do not precede the leaf.

    The first of the scales at which their boxes are within `reaches` goes into `firsts`; `nodes` is
    room to work in.
    """
    begin, end, low, high = tree.begin, tree.end, tree.low, tree.high
    inner = len(begin) // 2
    found, top = 0, 1
    nodes[0] = 0
    while top > 0:
        top -= 1
        k = nodes[top]
        if end[k] <= begin[leaf]:
            continue
        square = 0.0
        for d in range(low.shape[1]):
            square += max(low[k, d] - high[leaf, d], low[leaf, d] - high[k, d], 0.0) ** 2
        if not square <= reaches[-1]:
            continue
        if k < inner:
            nodes[top], nodes[top + 1] = 2 * k + 1, 2 * k + 2
            top += 2
            continue
        s = len(reaches) - 1
        while s > 0 and square <= reaches[s - 1]:
            s -= 1
        near[found], firsts[found] = k, s
        found += 1
    return found


@njit(nogil=True)
def kernel_sums(tree: Leaves, part, parts, theiler, weights, sums):
    """Sum of exp(-sum_d weights[s, d] (p_d - q_d)^2) over pairs of points.

    Parameters
    ----------
    tree : Leaves
        Pairs that are no more than `theiler` apart in time are left out.
    part, parts : int
        Every how many leaves are done, and which; of a pair of leaves the one that comes first.
    weights : ndarray, shape (scales, columns)
        Falling from scale to scale, the last ones 1; one column where all coordinates have the
        same.
    sums : ndarray, shape (blocks, blocks, scales)
        What is added to, by the blocks of both points in no order.
    """
    m, scales = len(tree.points), len(weights)
    begin, end, low, high = tree.begin, tree.end, tree.low, tree.high
    columns = weights.shape[1]
    negative, reaches = np.empty((scales, columns), np.float32), np.empty(scales)
    for s in range(scales):
        least = weights[s, 0]
        for d in range(columns):
            negative[s, d] = -LOG2_E * weights[s, d]
            least = min(least, weights[s, d])
        reaches[s] = NEGLIGIBLE / least
    lanes, line = np.empty((m, LANES)), np.empty((m, LANES))
    lanes_32, line_32 = np.empty((m, LANES), np.float32), np.empty((m, LANES), np.float32)
    middle = np.empty(m)
    latest = 0.0
    for i in range(len(tree.times)):
        latest = max(latest, tree.times[i])
    near_in_time = np.empty(int(latest / max(theiler, 1.0)) + 3, np.int64)
    for i in range(len(near_in_time)):
        near_in_time[i] = -1
    size = LANES * LANES
    squares, exponents = np.empty((columns, size), np.float32), np.empty(size, np.float32)
    powers, doubling = np.empty(size, np.float32), columns == 1
    for s in range(scales - 1):
        doubling &= abs(weights[s, 0] - 2 * weights[s + 1, 0]) < 1e-9 * weights[s, 0]
    near, firsts = np.empty(len(begin), np.int64), np.empty(len(begin), np.int64)
    nodes = np.empty(len(begin) + 2, np.int64)
    added = np.empty((len(sums), scales, LANES), np.float32)
    for leaf in range(len(begin) // 2 + part, len(begin), parts):
        start, many = begin[leaf], end[leaf] - begin[leaf]
        if many == 0:
            continue
        extent = 0.0
        for d in range(m):
            middle[d] = (low[leaf, d] + high[leaf, d]) / 2
            extent += (high[leaf, d] - low[leaf, d]) ** 2
        for d in range(m):
            for j in range(many, LANES):
                lanes[d, j] = np.inf
        _from_middle(tree.points, start, end[leaf], middle, lanes)
        for d in range(len(lanes)):
            for j in range(lanes.shape[1]):
                lanes_32[d, j] = lanes[d, j]
        own = tree.times[start : start + many]
        _mark(own, theiler, leaf, near_in_time)
        for b in range(len(sums)):
            for s in range(scales):
                for j in range(LANES):
                    added[b, s, j] = 0
        for k in range(_partners(tree, leaf, reaches, near, firsts, nodes)):
            first, last = begin[near[k]], end[near[k]]
            if extent > SINGLE * reaches[firsts[k]]:
                _from_middle(tree.points, first, last, middle, line)
                _square_differences(line, last - first, lanes, squares)
            else:
                _from_middle(tree.points, first, last, middle, line_32)
                _square_differences(line_32, last - first, lanes_32, squares)
            _leave_out(tree.times, first, last, own, many, theiler, near_in_time, leaf, squares[0])
            if near[k] == leaf:
                # Each pair once.
                for i in range(many):
                    for j in range(i + 1):
                        squares[0, i * LANES + j] = np.inf
            blocks = tree.blocks[first:last]
            for s in range(scales - 1, firsts[k] - 1, -1):
                if doubling and (scales - 1 - s) % (SQUARED + 1):
                    _add_squares(powers, blocks, added, s)
                    continue
                if columns == 1:
                    _add_exponentials(negative[s, 0], squares[0], blocks, added, s, powers)
                    continue
                for d in range(m):
                    _weigh(negative[s, d], squares[d], len(blocks) * LANES, exponents, d > 0)
                _add_exponentials(np.float32(1), exponents, blocks, added, s, powers)
        for b in range(len(sums)):
            _add_lanes(added, b, tree.blocks, start, many, sums)
