"""Kernel for `overload.py`: samples near the limits of a record."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import njit


@njit(nogil=True)
def number_beyond(x, first, size, middle, away, out):
    """out[k]: how many of `size` samples from first[k] on are further `away` from the middle."""
    for k in range(len(out)):
        near, count = x[first[k] : first[k] + size], 0
        for i in range(np.uint64(len(near))):
            count += abs(near[i] - middle) > away
        out[k] = count
