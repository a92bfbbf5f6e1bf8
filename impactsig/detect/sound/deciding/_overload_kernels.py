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
    bands, count = len(power), len(begins)
    before, after = np.zeros((bands + 2, count)), np.empty((bands, count))
    for b in range(bands):
        for k in range(count):
            row = power[b, begins[k] : begins[k] + frames]
            for i in range(past):
                before[b + 1, k] = max(before[b + 1, k], row[i])
            after[b, k] = row[fresh]
            for i in range(fresh + 1, frames):
                after[b, k] = max(after[b, k], row[i])
    heard = np.zeros(count)
    out[:] = 0.0
    for b in range(bands):
        for k in range(count):
            least = max(before[b, k], before[b + 1, k], before[b + 2, k])
            heard[k] += least > 0.0
            if after[b, k] > least > 0.0:
                out[k] += np.log(after[b, k] / least)
    for k in range(count):
        out[k] = out[k] / heard[k] if heard[k] > 0.0 else np.inf
