"""A kernel to sweep; apart from the other functions, so that workers need not load numba."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit


class Moments(NamedTuple):
    mean: np.ndarray
    square: np.ndarray


@njit(nogil=True)
def logistic(growth, start):
    """Two moments of the logistic map, for all cells of a tile."""
    mean, square = np.zeros(growth.size), np.zeros(growth.size)
    for cell in range(growth.size):
        x = start[cell]
        for _ in range(100):
            x *= growth[cell] * (1 - x)
            mean[cell] += x / 100
            square[cell] += x * x / 100
    return Moments(mean, square)
