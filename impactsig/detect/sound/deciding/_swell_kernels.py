"""Kernel for `swells.py`: powers beside attacks."""

from __future__ import annotations

import math

import numpy as np

from .._lane_kernels import fused


@fused
def powers_beside(x, attack, valid, edges, lags, out):
    """Mean squares of the innovations beside attacks, in stretches that follow one another.

    Parameters
    ----------
    x : samples
    attack : (n,) places between samples of x
    valid : first and last (exclusive) index of x that is a sample; beyond, these go on
    edges : (m + 1,) ascending limits of the stretches, in samples after an attack
    lags : lag and slope of the innovations
    out : (m, n), room for the mean squares
    """
    lag, slope = lags
    share = lag / slope
    for k in range(len(attack)):
        at = math.ceil(attack[k])
        begin = at + edges[0]
        for part in range(len(out)):
            end = at + edges[part + 1]
            total = 0.0
            for i in range(begin, end):
                now = x[min(max(i, valid[0]), valid[1] - 1)]
                earlier = x[min(max(i - lag, valid[0]), valid[1] - 1)]
                first = x[min(max(i - lag - slope, valid[0]), valid[1] - 1)]
                y = np.float64(now) - (1.0 + share) * earlier + share * first
                total += y * y
            out[part, k] = total / (end - begin)
            begin = end
