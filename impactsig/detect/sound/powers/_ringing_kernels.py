"""Kernel for `ringing.py`: what prediction may gain in the background of a record."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import njit
from ...signal.order_kernels import centre_of

COUNTS, TINIEST = 1e-4, 1e-300  # of the loudest, what counts as ringing; power


@njit(nogil=True)
def prediction_gain(narrow, gain, edges, share):
    """The greatest over the octaves of ln mean N_b - mean ln N_b, the median over the cores.

    Parameters
    ----------
    narrow : (cores, 2, bands), noise and greatest power
    gain : of the bands, for white noise
    edges : first band of each octave, and the end of the last one
    share : of each band in its octave
    """
    greatest, gains = -np.inf, np.empty(len(narrow))
    for octave in range(len(edges) - 1):
        inside = range(edges[octave], edges[octave + 1])
        for k in range(len(narrow)):
            noise, loudest = narrow[k]
            least = TINIEST
            for b in inside:
                least = max(least, COUNTS * (loudest[b] / gain[b]))
            mean = logarithm = 0.0
            for b in inside:
                own = max(noise[b] / gain[b], least)
                mean += share[b] * own
                logarithm += share[b] * math.log(own)
            gains[k] = math.log(mean) - logarithm
        greatest = max(greatest, centre_of(gains, len(gains)))
    return greatest
