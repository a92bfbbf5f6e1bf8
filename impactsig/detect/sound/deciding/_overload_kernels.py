"""Kernels for `overload.py`: samples near the limits of a record, and what sounds anew."""

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


@njit(nogil=True)
def newness(power, begins, past, fresh, frames, out):
    """out[k]: N, by the powers (bands, frames) from begins[k] on; infinite if none sounded before.

    Of each band, the greatest of the frames from `fresh` to before `frames` is compared with that
    of the first `past` of this band and its neighbours.
    """
    bands = len(power)
    before, after = np.zeros(bands + 2), np.empty(bands)
    for k in range(len(begins)):
        for b in range(bands):
            row = power[b, begins[k] : begins[k] + frames]
            before[b + 1], after[b] = row[:past].max(), row[fresh:].max()
        total, count = 0.0, 0
        for b in range(bands):
            least = max(before[b], before[b + 1], before[b + 2])
            count += least > 0.0
            if after[b] > least > 0.0:
                total += np.log(after[b] / least)
        out[k] = total / count if count else np.inf
