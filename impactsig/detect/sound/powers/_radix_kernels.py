"""Kernels for passes of a Fourier transform of LANES frames, one in each vector lane.

scipy's transforms are compiled for processors with narrow vectors. Of M numbers, x[n] the n-th, a
pass of radix r takes every M/r-th row, and leaves the r results side by side [Pease1968]_:

    y[r p + k] = exp(-2 pi i j k / n) sum_d x[p + d M/r] exp(-2 pi i d k / r),

with n the length of the transforms that are left, P = M / n and j = floor(p / P). After the last
pass `order_after` says where each frequency lies. A row holds the real parts of all frames, then
the imaginary parts. Indices are unsigned: signed ones, which may count from the end, keep a loop
out of vector lanes.
"""

from __future__ import annotations

import numpy as np

from .._lane_kernels import fused

LANES = 64
_LANES, ROW = np.uint64(LANES), np.uint64(2 * LANES)
_NONE, _TWO, _THREE, _FOUR = np.uint64(0), np.uint64(2), np.uint64(3), np.uint64(4)
_HALF = np.float32(0.5)
_SINE_3 = np.float32(np.sin(2 * np.pi / 3))
_COSINE_5, _SINE_5 = np.float32(np.cos(2 * np.pi / 5)), np.float32(np.sin(2 * np.pi / 5))
_COSINE_10, _SINE_10 = np.float32(np.cos(4 * np.pi / 5)), np.float32(np.sin(4 * np.pi / 5))


def radices_of(count: int) -> np.ndarray:
    """Radices whose product is `count`, which has no prime factor above 5."""
    radices = []
    for radix in (4, 2, 3, 5):
        while count % radix == 0:
            radices.append(radix)
            count //= radix
    return np.array(radices)


def order_after(radices: np.ndarray) -> np.ndarray:
    """Row of each frequency after the passes."""
    count = int(np.prod(radices))
    left, below, place = np.arange(count), count, np.zeros(count, np.int64)
    for radix in radices:
        below //= radix
        place += left % radix * below
        left //= radix
    return place


def turns(count: int, of: int) -> np.ndarray:
    """Cosines and sines of -2 pi k / of, k < count."""
    angle = -2.0 * np.pi * np.arange(count) / of
    return np.stack((np.cos(angle), np.sin(angle))).astype(np.float32)


@fused
def one_pass(radix, x, count, apart, far, turn, p, between, past, y):
    """So many results of a pass, those of p, p + between, ... in rows that follow one another.

    Each begins `apart` rows after the last one, and takes rows `far` from one another.
    """
    step, far = ROW * np.uint64(apart), ROW * np.uint64(far)
    if radix == 1:
        for f in range(ROW * np.uint64(count)):
            y[f] = x[f]
    elif radix == 2:
        _pass_of_two(x, count, step, far, turn, p, between, past, y)
    elif radix == 3:
        _pass_of_three(x, count, step, far, turn, p, between, past, y)
    elif radix == 4:
        _pass_of_four(x, count, step, far, turn, p, between, past, y)
    else:
        _pass_of_five(x, count, step, far, turn, p, between, past, y)


@fused
def _pass_of_two(x, count, step, far, turn, p, between, past, y):
    for m in range(count):
        k = (p + m * between) // past * past
        a, o = step * np.uint64(m), ROW * np.uint64(2 * m)
        b = a + far
        _two(x[a : a + ROW], x[b : b + ROW], turn[0, k], turn[1, k], y[o : o + _TWO * ROW])


@fused
def _two(a, b, c1, s1, y):
    for f in range(_NONE, _LANES):
        ar, ai, br, bi = a[f], a[_LANES + f], b[f], b[_LANES + f]
        y[f] = ar + br
        y[_LANES + f] = ai + bi
        real, imag = ar - br, ai - bi
        y[ROW + f] = real * c1 - imag * s1
        y[ROW + _LANES + f] = real * s1 + imag * c1


@fused
def _pass_of_three(x, count, step, far, turn, p, between, past, y):
    for m in range(count):
        k = (p + m * between) // past * past
        a, o = step * np.uint64(m), ROW * np.uint64(3 * m)
        b = a + far
        c = b + far
        _three(
            x[a : a + ROW], x[b : b + ROW], x[c : c + ROW],
            turn[0, k], turn[1, k], turn[0, 2 * k], turn[1, 2 * k], y[o : o + _THREE * ROW],
        )  # fmt: skip


@fused
def _three(a, b, c, c1, s1, c2, s2, y):
    for f in range(_NONE, _LANES):
        ar, ai, br, bi = a[f], a[_LANES + f], b[f], b[_LANES + f]
        cr, ci = c[f], c[_LANES + f]
        sum_r, sum_i = br + cr, bi + ci
        y[f] = ar + sum_r
        y[_LANES + f] = ai + sum_i
        mid_r, mid_i = ar - _HALF * sum_r, ai - _HALF * sum_i
        turn_r, turn_i = _SINE_3 * (bi - ci), _SINE_3 * (cr - br)
        real, imag = mid_r + turn_r, mid_i + turn_i
        y[ROW + f] = real * c1 - imag * s1
        y[ROW + _LANES + f] = real * s1 + imag * c1
        real, imag = mid_r - turn_r, mid_i - turn_i
        y[_TWO * ROW + f] = real * c2 - imag * s2
        y[_TWO * ROW + _LANES + f] = real * s2 + imag * c2


@fused
def _pass_of_four(x, count, step, far, turn, p, between, past, y):
    for m in range(count):
        k = (p + m * between) // past * past
        c1, s1, c2, s2 = turn[0, k], turn[1, k], turn[0, 2 * k], turn[1, 2 * k]
        c3, s3 = turn[0, 3 * k], turn[1, 3 * k]
        a, o = step * np.uint64(m), ROW * np.uint64(4 * m)
        b = a + far
        c = b + far
        d = c + far
        for f in range(_NONE, _LANES):
            ar, ai, br, bi = x[a + f], x[a + _LANES + f], x[b + f], x[b + _LANES + f]
            cr, ci, dr, di = x[c + f], x[c + _LANES + f], x[d + f], x[d + _LANES + f]
            even_r, even_i, gap_r, gap_i = ar + cr, ai + ci, ar - cr, ai - ci
            odd_r, odd_i, turn_r, turn_i = br + dr, bi + di, bi - di, dr - br
            y[o + f] = even_r + odd_r
            y[o + _LANES + f] = even_i + odd_i
            real, imag = gap_r + turn_r, gap_i + turn_i
            y[o + ROW + f] = real * c1 - imag * s1
            y[o + ROW + _LANES + f] = real * s1 + imag * c1
            real, imag = even_r - odd_r, even_i - odd_i
            y[o + _TWO * ROW + f] = real * c2 - imag * s2
            y[o + _TWO * ROW + _LANES + f] = real * s2 + imag * c2
            real, imag = gap_r - turn_r, gap_i - turn_i
            y[o + _THREE * ROW + f] = real * c3 - imag * s3
            y[o + _THREE * ROW + _LANES + f] = real * s3 + imag * c3


@fused
def _pass_of_five(x, count, step, far, turn, p, between, past, y):
    for m in range(count):
        k = (p + m * between) // past * past
        c1, s1, c2, s2 = turn[0, k], turn[1, k], turn[0, 2 * k], turn[1, 2 * k]
        c3, s3, c4, s4 = turn[0, 3 * k], turn[1, 3 * k], turn[0, 4 * k], turn[1, 4 * k]
        a, o = step * np.uint64(m), ROW * np.uint64(5 * m)
        b = a + far
        c = b + far
        d = c + far
        e = d + far
        for f in range(_NONE, _LANES):
            ar, ai, br, bi = x[a + f], x[a + _LANES + f], x[b + f], x[b + _LANES + f]
            cr, ci, dr, di = x[c + f], x[c + _LANES + f], x[d + f], x[d + _LANES + f]
            er, ei = x[e + f], x[e + _LANES + f]
            outer_r, outer_i, inner_r, inner_i = br + er, bi + ei, cr + dr, ci + di
            y[o + f] = ar + outer_r + inner_r
            y[o + _LANES + f] = ai + outer_i + inner_i
            tilt_r, tilt_i, bend_r, bend_i = bi - ei, er - br, ci - di, dr - cr
            mid_r = ar + _COSINE_5 * outer_r + _COSINE_10 * inner_r
            mid_i = ai + _COSINE_5 * outer_i + _COSINE_10 * inner_i
            turn_r = _SINE_5 * tilt_r + _SINE_10 * bend_r
            turn_i = _SINE_5 * tilt_i + _SINE_10 * bend_i
            real, imag = mid_r + turn_r, mid_i + turn_i
            y[o + ROW + f] = real * c1 - imag * s1
            y[o + ROW + _LANES + f] = real * s1 + imag * c1
            real, imag = mid_r - turn_r, mid_i - turn_i
            y[o + _FOUR * ROW + f] = real * c4 - imag * s4
            y[o + _FOUR * ROW + _LANES + f] = real * s4 + imag * c4
            mid_r = ar + _COSINE_10 * outer_r + _COSINE_5 * inner_r
            mid_i = ai + _COSINE_10 * outer_i + _COSINE_5 * inner_i
            turn_r = _SINE_10 * tilt_r - _SINE_5 * bend_r
            turn_i = _SINE_10 * tilt_i - _SINE_5 * bend_i
            real, imag = mid_r + turn_r, mid_i + turn_i
            y[o + _TWO * ROW + f] = real * c2 - imag * s2
            y[o + _TWO * ROW + _LANES + f] = real * s2 + imag * c2
            real, imag = mid_r - turn_r, mid_i - turn_i
            y[o + _THREE * ROW + f] = real * c3 - imag * s3
            y[o + _THREE * ROW + _LANES + f] = real * s3 + imag * c3
