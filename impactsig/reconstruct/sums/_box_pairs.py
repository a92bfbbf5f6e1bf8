"""Kernels that count pairs of boxes at once, by walking a k-d tree against itself.

All pairs of points from two boxes are between the least and the greatest distance of the boxes. A
pair of boxes that no radius divides is counted without a look at its points, any other is opened,
with the radii that divide it [GrayMoore2001]_. The bounds are differences of the numbers that the
distances are differences of, and rounding keeps their order, so the counts are exact.
"""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit
from .._neighbors import LEAF, Tree
from ._boxes import bin_of

COMPARED = 24
"""Radii up to which comparing with each is faster than to look up the bin."""


@njit(nogil=True)
def _distances(columns, first, size, other, many, distances):
    """Distances of each point of one leaf to those of another; infinite for invalid pairs."""
    # No slices: each would count its references.
    for p in range(size):
        for q in range(LEAF):
            distances[p, q] = 0.0
        for d in range(len(columns)):
            value = columns[d, first + p]
            for q in range(LEAF):
                distances[p, q] = max(distances[p, q], abs(columns[d, other + q] - value))
        for q in range(many, LEAF):
            distances[p, q] = np.inf
        if first == other:
            for q in range(p + 1):
                distances[p, q] = np.inf


@njit(nogil=True)
def count_pairs_of_boxes(tree: Tree, columns, boxes, bins, counts, count):
    """counts[k] += pairs in bin k, of one point from each of two boxes.

    Of a box with itself each pair counts once. Returns the number of pairs that had to be compared;
    unless `count`, nothing else is done.

    Parameters
    ----------
    columns : ndarray, shape (m, n + LEAF)
        `columns_of` the tree.
    boxes : ndarray of int, shape (k, 2)
        Pairs of nodes of the tree.
    """
    begin, end, low, high = tree.begin, tree.end, tree.low, tree.high
    radii, cells, least, shift, offset = bins
    inner = len(begin) // 2
    nodes = np.empty((len(boxes) + 256, 4), np.int64)
    for k in range(len(boxes)):
        nodes[k] = boxes[k, 0], boxes[k, 1], 0, len(radii)
    distances = np.empty((LEAF, LEAF))
    flat = distances.ravel()
    compared, top = 0, len(boxes)
    while top > 0:
        top -= 1
        a, b, nearest, farthest = nodes[top]
        gap = reach = 0.0
        for d in range(len(columns)):
            gap = max(gap, low[a, d] - high[b, d], low[b, d] - high[a, d])
            reach = max(reach, high[a, d] - low[b, d], high[b, d] - low[a, d])
        while nearest < farthest and radii[nearest] < gap:
            nearest += 1
        while nearest < farthest and radii[farthest - 1] >= reach:
            farthest -= 1
        size, many = end[a] - begin[a], end[b] - begin[b]
        pairs = size * (size - 1) // 2 if a == b else size * many
        if nearest == farthest:
            counts[nearest] += pairs
            continue
        if a < inner or b < inner:
            for i in range(2 if a < inner else 1):
                for j in range(i if a == b else 0, 2 if b < inner else 1):
                    nodes[top, 0] = 2 * a + 1 + i if a < inner else a
                    nodes[top, 1] = 2 * b + 1 + j if b < inner else b
                    nodes[top, 2], nodes[top, 3] = nearest, farthest
                    top += 1
            continue
        compared += pairs
        if not count:
            continue
        _distances(columns, begin[a], size, begin[b], many, distances)
        if farthest - nearest > COMPARED:
            for i in range(size * LEAF):
                counts[bin_of(flat[i], cells, least, radii, shift, offset)] += 1
            continue
        before = 0
        for k in range(nearest, farthest):
            radius, inside = radii[k], 0
            for i in range(size * LEAF):
                inside += flat[i] <= radius
            counts[k] += inside - before
            before = inside
        counts[farthest] += pairs - before
    return compared
