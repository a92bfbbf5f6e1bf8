"""Kernel for `swells.py`: powers beside attacks."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import njit


@njit(nogil=True)
def powers_beside(x, attack, valid, lengths, lags, out):
    """Mean squares of the innovations beside attacks, in four stretches that follow one another.

    Parameters
    ----------
    x : samples
    attack : (n,) places between samples of x
    valid : first and last (exclusive) index of x that is a sample; beyond, these go on
    lengths : samples of the stretch beside an attack, and of both on one side of it
    lags : lag and slope of the innovations
    out : (4, n), room for the mean squares
    """
    near, far = lengths
    lag, slope = lags
    share = lag / slope
    for k in range(len(attack)):
        at = math.ceil(attack[k])
        begin = at - far
        for part in range(4):
            end = at + (-near, 0, near, far)[part]
            total = 0.0
            for i in range(begin, end):
                now = x[min(max(i, valid[0]), valid[1] - 1)]
                earlier = x[min(max(i - lag, valid[0]), valid[1] - 1)]
                first = x[min(max(i - lag - slope, valid[0]), valid[1] - 1)]
                y = np.float64(now) - (1.0 + share) * earlier + share * first
                total += y * y
            out[part, k] = total / (end - begin)
            begin = end
