"""Kernels of the recurrence plot: which delay vectors are close, and how long they stay so."""

from __future__ import annotations

import numpy as np

from .._compiled import njit


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
    """How many diagonal and vertical lines of every length there are, each of shape (N + 1,).

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
