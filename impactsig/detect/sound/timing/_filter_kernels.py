"""Kernels of filters: values between samples, and responses of matched filters.

Loops are written so that they run in vector lanes: with a few terms at a time, and with unsigned
indices, as signed ones may count from the end.
"""

from __future__ import annotations

import math

import numpy as np

from .._lane_kernels import fused

TAPS = 24  # samples on either side from which a value between samples is interpolated
_NONE, _FOUR = np.uint64(0), np.uint64(4)


@fused
def taps_at(part, taps):
    """Interpolation weights at a fractional position: windowed sinc.

    Half of them, and the sample itself, lie before the place.
    """
    half = len(taps) // 2
    sine = math.sin(math.pi * part) / math.pi
    for n in range(2 * half):
        k = n + 1 - half
        away = part - k
        if away == 0.0:
            taps[:] = 0.0
            taps[n] = 1.0
            return
        sign = -1.0 if k % 2 else 1.0
        taps[n] = sign * sine / away * math.cos(0.5 * math.pi * away / half) ** 2


@fused
def filtered_at(wave, first, taps, out):
    """out[k]: scalar product of the taps with the wave from sample first + k on.

    Eight taps at a time: the inner loop runs in vector lanes.
    """
    out[:] = 0.0
    count, whole = len(out), len(taps) // 8 * 8
    for n in range(0, whole, 8):
        t0, t1, t2, t3 = taps[n], taps[n + 1], taps[n + 2], taps[n + 3]
        t4, t5, t6, t7 = taps[n + 4], taps[n + 5], taps[n + 6], taps[n + 7]
        part = wave[first + n : first + n + count + 7]
        for k in range(count):
            one = out[k] + t0 * part[k] + t1 * part[k + 1] + t2 * part[k + 2] + t3 * part[k + 3]
            one = one + t4 * part[k + 4] + t5 * part[k + 5] + t6 * part[k + 6] + t7 * part[k + 7]
            out[k] = one
    for n in range(whole, len(taps)):
        tap, part = taps[n], wave[first + n : first + n + count]
        for k in range(count):
            out[k] += tap * part[k]


@fused
def between(y, place, taps, out):
    """out[k]: y interpolated at `place` + k; `taps` is scratch."""
    whole = math.floor(place)
    taps_at(place - whole, taps)
    filtered_at(y, int(whole) + 1 - TAPS, taps, out)


@fused
def product(y, first, weighted):
    """Scalar product of the weighted wave with samples of y from `first` on."""
    a = b = c = d = 0.0
    whole = len(weighted) // 4 * 4
    for k in range(0, whole, 4):
        a += weighted[k] * y[first + k]
        b += weighted[k + 1] * y[first + k + 1]
        c += weighted[k + 2] * y[first + k + 2]
        d += weighted[k + 3] * y[first + k + 3]
    for k in range(whole, len(weighted)):
        a += weighted[k] * y[first + k]
    return (a + b) + (c + d)


@fused
def add_products(y, begin, step, weights, count, sums):
    """Set sums[:, i], i < count, to the parts of sum_k weights[k] y[begin + k + i step].

    Their sum, (0 + 1) + (2 + 3), is that of `product`. Four terms of a part are added at a time.
    Indices are unsigned: signed ones, which may count from the end, keep loops out of vector lanes.
    """
    whole = len(weights) // 4 * 4
    by, end = np.uint64(step), np.uint64(count)
    for part in range(4):
        out = sums[part]
        out[:] = 0.0
        done = part
        for k in range(part, whole - 12, 16):
            w0, w1, w2, w3 = weights[k], weights[k + 4], weights[k + 8], weights[k + 12]
            a = np.uint64(begin + k)
            b, c, d = a + _FOUR, a + _FOUR + _FOUR, a + _FOUR + _FOUR + _FOUR
            for i in range(_NONE, end):
                j = i * by
                out[i] = out[i] + w0 * y[a + j] + w1 * y[b + j] + w2 * y[c + j] + w3 * y[d + j]
            done = k + 16
        for k in range(done, whole, 4):
            w0, a = weights[k], np.uint64(begin + k)
            for i in range(_NONE, end):
                out[i] += w0 * y[a + i * by]
    out = sums[0]
    for k in range(whole, len(weights)):
        w0, a = weights[k], np.uint64(begin + k)
        for i in range(_NONE, end):
            out[i] += w0 * y[a + i * by]
