"""Kernel for `beside.py`: powers beside attacks."""

from __future__ import annotations

import math

import numpy as np

from .._attack_kernels import innovations
from .._lane_kernels import fused, sum_of_squares


@fused
def powers_beside(x, attack, asked, edges, lags, beyond, out):
    """Mean squares of the innovations beside attacks, in stretches that follow one another.

    Parameters
    ----------
    x : samples
    attack : (n,) places between samples of x
    asked : (n,) bool
    edges : (m + 1,) ascending limits of the stretches, in samples after an attack
    lags : lag and slope of the innovations
    beyond : whether the first and the last sample go on; otherwise attacks near them are not asked
    out : (m, n), room for the mean squares; NaN where not asked
    """
    lag, slope = lags
    near, y = np.empty(edges[-1] - edges[0] + lag + slope), np.empty(edges[-1] - edges[0])
    for k in range(len(attack)):
        begin = math.ceil(attack[k]) + edges[0]
        first = begin - lag - slope
        inside = first >= 0 and first + len(near) <= len(x)
        if not (asked[k] and (inside or beyond)):
            out[:, k] = np.nan
            continue
        if inside:
            innovations(x, begin, lag, slope, y)
        else:
            for i in range(len(near)):
                near[i] = x[min(max(first + i, 0), len(x) - 1)]
            innovations(near, lag + slope, lag, slope, y)
        for part in range(len(out)):
            some = y[edges[part] - edges[0] : edges[part + 1] - edges[0]]
            out[part, k] = sum_of_squares(some) / len(some)
