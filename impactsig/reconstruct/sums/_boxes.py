"""Kernels that compare near pairs only: strips of one coordinate, swept along the next.

Boxes as wide as the greatest radius hold all partners of a point in themselves and those beside
them [Theiler1987]_; here they have no walls in the second coordinate. Delay vectors are sorted by
the strip that their first coordinate falls in, and within it by their second. A strip is a little
wider than the greatest radius, so the partners of a vector lie in its own strip and in the next,
each time in a window of the second coordinate that moves on with it. What is compared beyond the
partners themselves is half as many again; memory is that of the vectors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import njit
from .._series import unbroken

CLOSER = 255  # as in _pairs
MOST_STRIPS = 2**22  # so that no rounding of the quotient reaches the slack of a strip's width


class Strips(NamedTuple):
    """Delay vectors in the order of the sweep.

    Attributes
    ----------
    vectors : ndarray, shape (n, m)
        Coordinates; nan where the series ends before them, or a gap comes.
    order : ndarray of int32, shape (n,)
        Their places in time.
    start : ndarray, shape (strips + 2,)
        Where each strip begins; the last two are n.
    along : int
        The coordinate that is swept.
    """

    vectors: np.ndarray
    order: np.ndarray
    start: np.ndarray
    along: int


def strips_of(x: np.ndarray, lowest: int, highest: int, delay: int, radius: float) -> Strips:
    """Vectors of dimension `lowest`, with the further coordinates that `highest` needs."""
    places = len(x) - (lowest - 1) * delay
    order = np.flatnonzero(unbroken(x, len(x) - places + 1))
    along = min(1, lowest - 1)
    first, second = x[order], x[order + along * delay]
    if along:
        low = first.min()
        width = max(radius * (1 + 1e-6), (first.max() - low) / min(len(order), MOST_STRIPS))
        strip = np.floor((first - low) / width)
        # numpy sorts 16 bits by radix, in a third of the time.
        strip = strip.astype(np.uint16 if strip.max() < 2**16 else np.int32)
        ascending = np.argsort(second)
        ascending = ascending[np.argsort(strip[ascending], kind="stable")]
        start = np.searchsorted(strip[ascending], np.arange(int(strip.max()) + 3))
    else:
        ascending = np.argsort(second)
        start = np.array([0, len(order), len(order)])
    order = order[ascending].astype(np.int32)
    vectors = np.full((len(order), highest), np.nan)
    for k in range(highest):
        here = order < len(x) - k * delay
        vectors[here, k] = x[order[here] + k * delay]
    return Strips(vectors, order, start, along)


@njit(nogil=True)
def candidates(strips, radius):
    """Number of pairs that the sweep compares."""
    start, y = strips.start, strips.vectors[:, strips.along]
    total = 0
    for s in range(len(start) - 2):
        ahead = start[s]
        low = high = start[s + 1]
        for p in range(start[s], start[s + 1]):
            while ahead < start[s + 1] and y[ahead] - y[p] <= radius:
                ahead += 1
            while low < start[s + 2] and y[p] - y[low] > radius:
                low += 1
            high = max(high, low)
            while high < start[s + 2] and y[high] - y[p] <= radius:
                high += 1
            total += ahead - p - 1 + high - low
    return total


@njit(nogil=True, inline="always")
def bin_of(d, cells, least, radii, shift, offset):
    cell = min(max((np.float64(d).view(np.int64) >> shift) - offset, 0), len(cells) - 1)
    k = np.int64(cells[cell])
    if k == CLOSER:
        k = np.int64(least[cell])
        while k < len(radii) and d > radii[k]:
            k += 1
    return k


@njit(nogil=True)
def count_near(strips, first, last, theiler, row_of, bins, counts):
    """counts[row, k] += pairs in bin k within the greatest radius.

    Pairs of which the first in the order of the sweep is one of [first, last). row_of[m - 1] is the
    row of dimension m, or -1.
    """
    vectors, order, start, along = strips
    radii, cells, least, shift, offset = bins
    radius = radii[-1]
    s = np.searchsorted(start, first, side="right") - 1
    low = start[s + 1]
    for p in range(first, last):
        while p >= start[s + 1]:
            s += 1
            low = start[s + 1]
        i, y = order[p], vectors[p, along]
        while low < start[s + 2] and y - vectors[low, along] > radius:
            low += 1
        for own in range(2):
            for q in range(p + 1, start[s + 1]) if own else range(low, start[s + 2]):
                if vectors[q, along] - y > radius:
                    break
                j = order[q]
                if abs(i - j) <= theiler:
                    continue
                d, k = -1.0, 0
                for m in range(len(row_of)):
                    apart = abs(vectors[p, m] - vectors[q, m])
                    # Nor is nan, where one of the two is no vector of this dimension.
                    if not apart <= radius:
                        break
                    if apart > d:
                        d = apart
                        k = bin_of(d, cells, least, radii, shift, offset)
                    if row_of[m] >= 0:
                        counts[row_of[m], k] += 1


@njit(nogil=True)
def count_sorted(y, radii, within):
    """within[k] += pairs of the ascending y that differ by radii[k] or less."""
    for k in range(len(radii)):
        ahead = 0
        for p in range(len(y)):
            while ahead < len(y) and y[ahead] - y[p] <= radii[k]:
                ahead += 1
            within[k] += ahead - p - 1
