"""Kernels that compare all pairs along diagonals of fixed lag, binned by the bits of a float.

Of delay vectors of the maximum norm, the distance of the pair (i, i + lag) in dimension m is the
maximum of |x[i + k delay] - x[i + lag + k delay]| over k < m: along a diagonal of fixed lag it is
a running maximum, and since the bin of a maximum is the maximum of the bins, every difference is
binned once, to a byte, and all dimensions are maxima of bytes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import njit

CHUNK = 8192  # pairs at a time, so that what is passed on stays in the nearest cache
MOST_RADII = 254  # a bin is a byte, and one value of it says "look closer"
CLOSER = 255
INFINITE = int(np.array(np.inf).view(np.int64))
FINEST = 8192  # cells of the table, in bytes of the nearest cache
EMPTY_AT = 2**31  # increments after which tables of 32 bits are emptied


class Bins(NamedTuple):
    """Table that gives the bin of a distance: the number of radii smaller than it.

    The bits of a positive float, read as a whole number, ascend with it; their upper part is the
    cell. A cell that no radius divides holds its bin, any other says CLOSER; the search among the
    radii then begins at `least`. So the comparison of d with a radius decides, and no logarithm.
    """

    radii: np.ndarray
    cells: np.ndarray
    least: np.ndarray
    shift: int
    offset: int


def bins_of(radii: np.ndarray) -> Bins:
    """The bins between ascending radii, at most MOST_RADII."""
    bits = radii.view(np.int64)
    lowest, highest = int(bits[0]), int(bits[-1])
    shift = 32
    while (highest >> shift) - (lowest >> shift) > FINEST - 3:
        shift += 1
    offset = (lowest >> shift) - 1
    cells = np.arange(offset, (highest >> shift) + 2)
    # The first and the last cell stand for all that is smaller, and all that is greater.
    begin = cells << shift
    end = begin | ((1 << shift) - 1)
    begin[0], end[-1] = 0, INFINITE
    # Positive floats ascend as their bits do.
    least, most = bits.searchsorted(begin), bits.searchsorted(end)
    found = np.where(least == most, least, CLOSER)
    return Bins(radii, found.astype(np.uint8), least.astype(np.uint8), shift, offset)


@njit(nogil=True)
def _look_closer(d, k, radii):
    while k < len(radii) and d > radii[k]:
        k += 1
    return k


@njit(nogil=True)
def _bin_diagonal(x, lag, bins, cell, b):
    """b[i] = bin of |x[i] - x[i + lag]|; `cell` is scratch."""
    top = len(bins.cells) - 1
    for start in range(0, len(x) - lag, CHUNK):
        size = min(CHUNK, len(x) - lag - start)
        early = x[start : start + size]
        late = x[start + lag : start + lag + size]
        found = b[start : start + size]
        # Two loops: the first runs in lanes, the second looks up.
        for i in range(size):
            bits = np.float64(abs(early[i] - late[i])).view(np.int64)
            cell[i] = min(max((bits >> bins.shift) - bins.offset, 0), top)
        for i in range(size):
            k = bins.cells[cell[i]]
            if k == CLOSER:
                d = abs(early[i] - late[i])
                k = np.uint8(_look_closer(d, np.int64(bins.least[cell[i]]), bins.radii))
            found[i] = k


@njit(nogil=True)
def _empty(tables, counts):
    """Add the tables to the counts, and clear them."""
    size = counts.shape[1]
    for row in range(len(counts)):
        for half in range(2):
            for i in range(size):
                for j in range(size):
                    many = np.int64(tables[row, half, 256 * i + j])
                    counts[row, i] += many
                    counts[row, j] += many
    tables[:] = 0


@njit(nogil=True)
def count_diagonals(x, first, last, step, delay, row_of, bins, counts):
    """counts[row, k] += pairs in bin k at the lags range(first, last, step).

    row_of[m - 1] is the row of dimension m, or -1 where m is not asked for.

    Two bytes that lie side by side are counted as one number of 16 bits, which halves the
    increments; odd and even ones have a table each, lest an increment wait for the one before.
    """
    b = np.empty(len(x), np.uint8)
    cell = np.empty(CHUNK, np.uint16)
    c = np.empty(CHUNK, np.uint8)
    two = c.view(np.uint16)
    tables = np.zeros((len(counts), 2, 256 * counts.shape[1]), np.uint32)
    one = np.uint32(1)
    held = 0
    for lag in range(first, last, step):
        _bin_diagonal(x, lag, bins, cell, b)
        held += len(x) - lag
        if held > EMPTY_AT:
            _empty(tables, counts)
            held = len(x) - lag
        for start in range(0, len(x) - lag, CHUNK):
            for m in range(len(row_of)):
                begin = start + m * delay
                size = min(CHUNK, len(x) - lag - begin)
                if size <= 0:
                    break
                new = b[begin : begin + size]
                if m == 0:
                    for i in range(size):
                        c[i] = new[i]
                else:
                    for i in range(size):
                        c[i] = max(c[i], new[i])
                row = row_of[m]
                if row < 0:
                    continue
                even, odd = tables[row, 0], tables[row, 1]
                for i in range(size // 4):
                    even[two[2 * i]] += one
                    odd[two[2 * i + 1]] += one
                for i in range(size // 4 * 4, size):
                    counts[row, c[i]] += 1
    _empty(tables, counts)
