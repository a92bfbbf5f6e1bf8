"""Exact nearest neighbours of delay vectors outside the Theiler window, by a k-d tree.

The tree is balanced and implicit (node k has the children 2k + 1 and 2k + 2), so it takes O(n)
memory however many equal points there are. Distances are squared where the norm is Euclidean. The
distance to a box is worked out term by term as that to a point is, so that rounding cannot make a
box look farther away than a point in it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._compiling.compiled import njit

LEAF = 12  # points in a leaf, at most
NOBODY = -1  # index of a neighbour that does not exist


class Tree(NamedTuple):
    """A k-d tree: node k holds `points[first[k]:first[k + 1]]`; `order` gives their places."""

    points: np.ndarray  # (n, m), in the order of the tree
    order: np.ndarray  # (n,), the place in time of each
    begin: np.ndarray  # (nodes,), where the points of a node begin
    end: np.ndarray
    low: np.ndarray  # (nodes, m), the box around them
    high: np.ndarray
    places: int  # in time, those without a point included


@njit(nogil=True)
def partition(points, order, begin, end, middle, d):
    """Partition the points about `middle` by coordinate d."""
    first, last = begin, end - 1
    while first < last:
        x, y, z = points[first, d], points[(first + last) // 2, d], points[last, d]
        pivot = max(min(x, y), min(max(x, y), z))
        i, j = first, last
        while i <= j:
            while points[i, d] < pivot:
                i += 1
            while points[j, d] > pivot:
                j -= 1
            if i <= j:
                for k in range(points.shape[1]):
                    points[i, k], points[j, k] = points[j, k], points[i, k]
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            last = j
        elif middle >= i:
            first = i
        else:
            return


@njit(nogil=True)
def build(points, order, leaf, full):
    """Sort the points and `order` into tree order; where nodes begin and end, and their boxes.

    A leaf has at most `leaf` points; if `full`, all but one have as many, or none.
    """
    n, m = points.shape
    levels = 0
    while n > (leaf << levels):
        levels += 1
    nodes = (2 << levels) - 1
    inner = (1 << levels) - 1
    begin, end = np.zeros(nodes, np.int64), np.zeros(nodes, np.int64)
    low, high = np.empty((nodes, m)), np.empty((nodes, m))
    end[0] = n
    for k in range(nodes):
        a, b = begin[k], end[k]
        for d in range(m):
            least, most = np.inf, -np.inf
            for i in range(a, b):
                least, most = min(least, points[i, d]), max(most, points[i, d])
            low[k, d], high[k, d] = least, most
        if k < inner:
            widest = 0
            for d in range(1, m):
                if high[k, d] - low[k, d] > high[k, widest] - low[k, widest]:
                    widest = d
            half = (a + b) // 2
            if full:
                leaves = (b - a + leaf - 1) // leaf
                half = min(a + leaf * ((leaves + 1) // 2), b)
            if half < b:
                partition(points, order, a, b, half, widest)
            begin[2 * k + 1], end[2 * k + 1] = a, half
            begin[2 * k + 2], end[2 * k + 2] = half, b
    return begin, end, low, high


def tree(vectors: np.ndarray, usable: np.ndarray | None = None) -> Tree:
    """The tree of the vectors, shape (places, m); by default of all of them."""
    order = np.arange(len(vectors)) if usable is None else np.flatnonzero(usable)
    points = np.array(vectors[order], order="C")
    begin, end, low, high = build(points, order, LEAF, False)
    return Tree(points, order, begin, end, low, high, len(vectors))


def columns_of(tree: Tree) -> np.ndarray:
    """Coordinates of the points as columns, shape (m, n + LEAF).

    A loop over a leaf may then be of the constant length LEAF, which the compiler makes use of.
    """
    n, m = tree.points.shape
    columns = np.zeros((m, n + LEAF))
    columns[:, :n] = tree.points.T
    return columns


@njit(nogil=True)
def _apart(p, q, maximum):
    total = 0.0
    for d in range(len(p)):
        gap = abs(p[d] - q[d])
        total = max(total, gap) if maximum else total + gap * gap
    return total


@njit(nogil=True)
def _from_box(p, low, high, maximum):
    total = 0.0
    for d in range(len(p)):
        gap = max(low[d] - p[d], p[d] - high[d], 0.0)
        total = max(total, gap) if maximum else total + gap * gap
    return total


@njit(nogil=True)
def _across_box(p, low, high):
    """Whether the box holds any point other than p."""
    across = False
    for d in range(len(p)):
        across |= low[d] != p[d] or high[d] != p[d]
    return across


@njit(nogil=True)
def nearest(found, theiler, maximum):
    """Nearest neighbour of every point outside the Theiler window and not equal to it.

    Of several at the same distance any one is taken. Returns, by place in time, the place of the
    neighbour, `NOBODY` where there is none, and the distance (Euclidean, or greatest difference of
    a coordinate if `maximum`).
    """
    points, order, begin, end, low, high, places = found
    n = len(points)
    inner = len(begin) // 2
    index, distance = np.full(places, NOBODY), np.full(places, np.inf)
    nodes, bounds = np.empty(128, np.int64), np.empty(128)
    for at in range(n):
        p, i = points[at], order[at]
        best, who = np.inf, NOBODY
        nodes[0], bounds[0] = 0, 0.0
        top = 1
        while top > 0:
            top -= 1
            k = nodes[top]
            if bounds[top] >= best:
                continue
            if k >= inner:
                for other in range(begin[k], end[k]):
                    j = order[other]
                    if abs(i - j) <= theiler:
                        continue
                    gap = _apart(p, points[other], maximum)
                    if 0.0 < gap < best:
                        best, who = gap, j
                continue
            one, two = 2 * k + 1, 2 * k + 2
            first = _from_box(p, low[one], high[one], maximum)
            second = _from_box(p, low[two], high[two], maximum)
            if first < second:
                one, two, first, second = two, one, second, first
            # The nearer of the two goes on top; a box that is only p again holds no neighbour.
            for child, bound in ((one, first), (two, second)):
                if bound < best and _across_box(p, low[child], high[child]):
                    nodes[top], bounds[top] = child, bound
                    top += 1
        index[i] = who
        distance[i] = best if maximum else np.sqrt(best)
    return index, distance


@njit(nogil=True)
def within(found, places, radius, theiler, maximum, most):
    """Neighbours within `radius` of the points at some `places`, outside the Theiler window.

    Returns the references' places in time, `start` (one longer) and `who`: the neighbours of
    reference r are `who[start[r]:start[r + 1]]`, the first `most` that were met.
    """
    points, order, begin, end, low, high, _ = found
    inner = len(begin) // 2
    limit = radius if maximum else radius * radius
    start = np.zeros(len(places) + 1, np.int64)
    who = np.empty(1024, np.int64)
    count = 0
    nodes = np.empty(128, np.int64)
    for r in range(len(places)):
        p, i = points[places[r]], order[places[r]]
        nodes[0] = 0
        top = 1
        while top > 0 and count - start[r] < most:
            top -= 1
            k = nodes[top]
            if _from_box(p, low[k], high[k], maximum) > limit:
                continue
            if k < inner:
                nodes[top], nodes[top + 1] = 2 * k + 1, 2 * k + 2
                top += 2
                continue
            for other in range(begin[k], end[k]):
                j = order[other]
                if abs(i - j) > theiler and 0.0 < _apart(p, points[other], maximum) <= limit:
                    if count == len(who):
                        who = np.concatenate((who, np.empty_like(who)))
                    who[count] = j
                    count += 1
        start[r + 1] = count
    return order[places], start, who[:count].copy()
