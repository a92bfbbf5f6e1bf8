"""Exact counts of pairs: choice of the kernel and of threads, with identical results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from ..._arguments import thread_count
from ..._running.threads import in_threads
from .._neighbors import Tree, columns_of, tree
from .._series import known, unbroken
from . import _boxes, _pairs
from ._box_pairs import count_pairs_of_boxes

Kernel = Literal["pairs", "boxes", "trees"]

# Nanoseconds, measured: a pair of all pairs (binning, and every dimension more), a pair that the
# sweep looks at, a vector sorted for it, a pair that two trees leave to be compared, a vector put
# into a tree. Only the ratios matter.
OF_ALL, PER_DIMENSION, OF_NEAR, OF_SORTED = 0.8, 0.25, 30.0, 70.0
OF_COMPARED, OF_TREE = 4.0, 200.0
PARTS = 64
"""Parts of the sweep and of a tree: many more than threads, as they take unequal times."""
SAMPLE = 8
"""Leaves of a tree by which the pairs to be compared are estimated."""


class Boxes(NamedTuple):
    """A tree and the coordinates of its points as columns."""

    tree: Tree
    columns: np.ndarray


def count_pairs(
    x: np.ndarray,
    dimensions: Sequence[int],
    delay: int,
    theiler: int,
    radii: np.ndarray,
    workers: int | None = None,
    kernel: Kernel | None = None,
) -> np.ndarray:
    """Number of pairs i < j of delay vectors with j - i > theiler within each radius.

    Parameters
    ----------
    x : ndarray of float64, shape (n,)
        As `series` returns it; each gap at least as many nan wide as the delay. Differences from
        nan are within no radius, and so no kernel asks for gaps.
    dimensions : sequence of int
        Ascending.
    radii : ndarray of float64, shape (r,)
        Positive, ascending.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.
    kernel : {"pairs", "boxes", "trees"}, optional
        Whether to look at all pairs, at near ones, or at pairs of boxes of k-d trees; unless given,
        what is expected to be fastest. The counts do not depend on it.

    Returns
    -------
    ndarray of int64, shape (dimensions, radii)
    """
    counts = [
        _count(x, dimensions, delay, theiler, part, workers, kernel) for part in _parts_of(radii)
    ]
    return np.concatenate(counts, axis=-1)


def _parts_of(radii: np.ndarray) -> list[np.ndarray]:
    return [radii[k : k + _pairs.MOST_RADII] for k in range(0, len(radii), _pairs.MOST_RADII)]


def _count(
    x: np.ndarray,
    dimensions: Sequence[int],
    delay: int,
    theiler: int,
    radii: np.ndarray,
    workers: int | None,
    kernel: Kernel | None,
) -> np.ndarray:
    """Counts, shape (dimensions, radii)."""
    # Of one dimension the sorted values tell how many lie within each radius without any pair.
    sort = dimensions[0] == 1 and (len(dimensions) > 1 or kernel != "pairs")
    rest = tuple(dimensions[1:]) if sort else tuple(dimensions)
    if sort and not rest:
        return _sorted(x, theiler, radii, workers)
    bins = _pairs.bins_of(radii)
    ready = _fastest(x, rest, delay, theiler, bins, kernel)
    if ready is None:
        n = len(x) - (dimensions[0] - 1) * delay
        return _along_diagonals(x, dimensions, delay, range(theiler + 1, n), bins, workers)
    if isinstance(ready, _boxes.Strips):
        counts = _near(ready, rest, theiler, bins, workers)
    else:
        counts = np.stack([_by_tree(each, bins, workers) for each in ready])
        if theiler:
            close = range(1, min(theiler + 1, len(x) - (rest[0] - 1) * delay))
            counts -= _along_diagonals(x, rest, delay, close, bins, workers)
    if sort:
        counts = np.concatenate((_sorted(x, theiler, radii, workers), counts))
    return counts


def _fastest(
    x: np.ndarray,
    dimensions: tuple[int, ...],
    delay: int,
    theiler: int,
    bins: _pairs.Bins,
    kernel: Kernel | None,
) -> _boxes.Strips | list[Boxes] | None:
    """Vectors prepared for the sweep, or as trees; None if comparing all pairs is faster.

    Of one dimension a tree is faster than the sweep, unless pairs are few, or many within the
    Theiler window: these it has to take off again.
    """
    with np.errstate(over="ignore"):
        span = float(np.ptp(known(x)))
    if kernel == "pairs" or not np.isfinite(span):
        return None
    radii = bins.radii
    n = len(x) - (dimensions[0] - 1) * delay
    a_pair = OF_ALL + PER_DIMENSION * len(dimensions)
    cost = a_pair * (n - theiler) * (n - theiler - 1) / 2
    close = a_pair * n * theiler
    strips = None
    if kernel == "boxes" or (kernel is None and radii[-1] <= span / 4):
        strips = _boxes.strips_of(x, dimensions[0], dimensions[-1], delay, float(radii[-1]))
        if kernel == "boxes":
            return strips
        near = OF_SORTED * n + OF_NEAR * _boxes.candidates(strips, float(radii[-1]))
        cost, strips = (near, strips) if near < cost else (cost, None)
    trees, of_trees = [], close
    for m in dimensions:
        if kernel is None and of_trees + OF_TREE * n > cost:
            return strips
        trees.append(_tree(x, m, delay))
        of_trees += OF_TREE * n + OF_COMPARED * _left_to_compare(trees[-1], bins)
    return trees if kernel == "trees" or of_trees < cost else strips


def _tree(x: np.ndarray, m: int, delay: int) -> Boxes:
    places = np.flatnonzero(unbroken(x, (m - 1) * delay + 1))
    found = tree(np.column_stack([x[places + k * delay] for k in range(m)]))
    return Boxes(found, columns_of(found))


def _left_to_compare(one: Boxes, bins: _pairs.Bins) -> float:
    """Approximate number of pairs to be compared one by one."""
    leaves = (len(one.tree.begin) + 1) // 2
    chosen = range(leaves - 1, 2 * leaves - 1, max(leaves // SAMPLE, 1))
    boxes = np.array([(leaf, 0) for leaf in chosen])
    unused = np.zeros(len(bins.radii) + 1, np.int64)
    compared = count_pairs_of_boxes(*one, boxes, bins, unused, False)
    return compared / len(chosen) * leaves / 2


def _by_tree(one: Boxes, bins: _pairs.Bins, workers: int | None) -> np.ndarray:
    """Counts of all pairs of a tree, shape (radii,)."""
    nodes = min((len(one.tree.begin) + 1) // 2, PARTS) if thread_count(workers) > 1 else 1

    def part(k: int) -> np.ndarray:
        """Of one node of a level with itself and those that follow."""
        counts = np.zeros(len(bins.radii) + 1, np.int64)
        boxes = np.array([(nodes - 1 + k, other) for other in range(nodes - 1 + k, 2 * nodes - 1)])
        count_pairs_of_boxes(*one, boxes, bins, counts, True)
        return counts

    return _within(in_threads(part, range(nodes), workers))


def _along_diagonals(
    x: np.ndarray,
    dimensions: Sequence[int],
    delay: int,
    lags: range,
    bins: _pairs.Bins,
    workers: int | None,
) -> np.ndarray:
    """Counts of the pairs of vectors at these lags, shape (dimensions, radii)."""
    row_of = _rows(dimensions)
    parts = 4 * thread_count(workers)

    def part(k: int) -> np.ndarray:
        counts = np.zeros((len(dimensions), len(bins.radii) + 1), np.int64)
        some = lags[k::parts]
        _pairs.count_diagonals(x, some.start, some.stop, some.step, delay, row_of, bins, counts)
        return counts

    return _within(in_threads(part, range(min(parts, len(lags))), workers))


def _near(
    strips: _boxes.Strips,
    dimensions: Sequence[int],
    theiler: int,
    bins: _pairs.Bins,
    workers: int | None,
) -> np.ndarray:
    n, row_of = len(strips.order), _rows(dimensions)
    parts = PARTS if thread_count(workers) > 1 else 1

    def part(k: int) -> np.ndarray:
        counts = np.zeros((len(dimensions), len(bins.radii) + 1), np.int64)
        ends = n * k // parts, n * (k + 1) // parts
        _boxes.count_near(strips, *ends, theiler, row_of, bins, counts)
        return counts

    return _within(in_threads(part, range(parts), workers))


def _sorted(x: np.ndarray, theiler: int, radii: np.ndarray, workers: int | None) -> np.ndarray:
    """Counts for dimension 1, by sorting, minus those within the Theiler window."""
    values = np.sort(known(x))
    parts = thread_count(workers)

    def part(k: int) -> np.ndarray:
        within = np.zeros(len(radii[k::parts]), np.int64)
        _boxes.count_sorted(values, radii[k::parts], within)
        return within

    counts = np.empty(len(radii), np.int64)
    for k, within in enumerate(in_threads(part, range(parts), workers)):
        counts[k::parts] = within
    counts = counts[None]
    if theiler:
        close = range(1, min(theiler + 1, len(x)))
        counts = counts - _along_diagonals(x, (1,), 1, close, _pairs.bins_of(radii), workers)
    return counts


def _rows(dimensions: Sequence[int]) -> np.ndarray:
    row_of = np.full(dimensions[-1], -1)
    row_of[np.array(dimensions) - 1] = np.arange(len(dimensions))
    return row_of


def _within(binned: list[np.ndarray]) -> np.ndarray:
    """Cumulative counts within each radius, from counts per bin of all parts."""
    return np.cumsum(np.sum(binned, axis=0), axis=-1)[..., :-1]
