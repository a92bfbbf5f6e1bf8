"""Kernels of the recurrence plot: close vectors, and lengths of lines."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit


@njit(nogil=True)
def _close(x, i, j, span, delay, radius):
    for c in range(0, span + 1, delay):  # noqa: SIM110 - any() of a generator does not compile
        if not abs(x[i + c] - x[j + c]) <= radius:
            return False
    return True


@njit(nogil=True)
def close_pairs(x, dimension, delay, radius, first, step, found):
    """found[i, j]: whether vectors i and j are within the radius, for the greater in such steps."""
    span = (dimension - 1) * delay
    for i in range(first, len(x) - span, step):
        for j in range(i + 1):
            found[i, j] = found[j, i] = _close(x, i, j, span, delay, radius)


@njit(nogil=True)
def line_lengths(x, dimension, delay, radius, theiler, first, step):
    """Number of diagonal and vertical lines of every length, each of shape (N + 1,).

    Those of every `step`-th diagonal and column, from `first` on. Points of the matrix with
    |i - j| <= theiler count as no recurrence. Nothing but the counts is kept: memory is O(N).
    """
    span = (dimension - 1) * delay
    count = len(x) - span
    diagonal = np.zeros(count + 1, np.int64)
    vertical = np.zeros(count + 1, np.int64)
    for lag in range(theiler + 1 + first, count, step):
        length = 0
        for i in range(count - lag):
            if _close(x, i, i + lag, span, delay, radius):
                length += 1
            else:
                diagonal[length] += 2  # above and below the main diagonal
                length = 0
        diagonal[length] += 2
    for j in range(first, count, step):
        length = 0
        for i in range(count):
            if abs(i - j) > theiler and _close(x, i, j, span, delay, radius):
                length += 1
            else:
                vertical[length] += 1
                length = 0
        vertical[length] += 1
    diagonal[0] = vertical[0] = 0
    return diagonal, vertical


@njit(nogil=True)
def matrix_lines(matrix, theiler):
    """The same for the diagonals and columns of a matrix of any shape.

    Points with |i - j| <= theiler count as no recurrence; -1 counts all.
    """
    rows, columns = matrix.shape
    diagonal = np.zeros(min(rows, columns) + 1, np.int64)
    vertical = np.zeros(rows + 1, np.int64)
    for lag in range(-rows + 1, columns):
        if abs(lag) <= theiler:
            continue
        length = 0
        for i in range(max(0, -lag), min(rows, columns - lag)):
            if matrix[i, i + lag]:
                length += 1
            else:
                diagonal[length] += 1
                length = 0
        diagonal[length] += 1
    for j in range(columns):
        length = 0
        for i in range(rows):
            if abs(i - j) > theiler and matrix[i, j]:
                length += 1
            else:
                vertical[length] += 1
                length = 0
        vertical[length] += 1
    diagonal[0] = vertical[0] = 0
    return diagonal, vertical


@njit(nogil=True)
def histogram(x, dimension, delay, theiler, low, high, bins):
    """Histogram of distances of pairs from `low` to `high`: counts, number below, extremes."""
    span = (dimension - 1) * delay
    count = len(x) - span
    counts = np.zeros(bins, np.int64)
    least, most = np.full(bins, np.inf), np.full(bins, -np.inf)
    below = 0
    width = high - low if high > low else 1.0  # divided by: bins over it may be infinite
    for i in range(count):
        for j in range(i + theiler + 1, count):
            apart = 0.0
            for c in range(0, span + 1, delay):
                one = abs(x[i + c] - x[j + c])
                if not one <= apart:
                    apart = one
            if apart < low:
                below += 1
            elif apart <= high:
                k = min(int((apart - low) / width * bins), bins - 1)
                counts[k] += 1
                least[k] = min(least[k], apart)
                most[k] = max(most[k], apart)
    return counts, below, least, most
