"""Kernels for the power spectra of many frames of a sound at once.

LANES frames are transformed side by side, one in each lane of the processor's vectors; scipy's
transforms are compiled for processors with narrow ones. Two real samples make a complex number: a
frame of N samples needs a transform of M = N / 2 numbers, of which x[n] is the n-th. A pass of
radix r takes every M/r-th row, and leaves the r results side by side [Pease1968]_:

    y[r p + k] = exp(-2 pi i j k / n) sum_d x[p + d M/r] exp(-2 pi i d k / r),

with n the length of the transforms that are left, P = M / n and j = floor(p / P). After the last
pass `order_after` says where each frequency lies. What two passes of radices r and s make of r s
rows depends on these alone: they are taken one after the other while the rows are in the nearest
memory, and so are the last three. A row holds the real parts of all frames, then the imaginary
parts. Indices are unsigned: signed ones, which may count from the end, keep a loop out of vector
lanes.
"""

from __future__ import annotations

import math

import numpy as np

from .._lane_kernels import fused

LANES = 64
MOST_NEAR = 48  # rows that passes make of as many others in the nearest memory
_LANES, _ROW = np.uint64(LANES), np.uint64(2 * LANES)
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
def to_single(x, faintest, out):
    """Samples over a power of 2 above all of them, in single precision, then zeros.

    That power is returned, 0 if all samples are 0; its exponent is at least `faintest`.
    """
    count, whole = np.uint64(len(x)), np.uint64(len(x) // LANES * LANES)
    most = np.zeros(LANES)
    for at in range(_NONE, whole, _LANES):
        for k in range(_NONE, _LANES):
            size = abs(np.float64(x[at + k]))
            most[k] = size if size > most[k] else most[k]
    greatest = most.max()
    for i in range(whole, count):
        greatest = max(greatest, abs(np.float64(x[i])))
    out[count if greatest > 0.0 else 0 :] = np.float32(0.0)
    if greatest == 0.0:
        return 0.0
    scale = math.ldexp(1.0, max(math.frexp(greatest)[1], faintest))
    share = 1.0 / scale
    for i in range(count):
        out[i] = np.float32(x[i] * share)
    return scale


@fused
def add_powers(
    single, hop, window, passes, turn, half_turn, place, columns, rows, square,
    scale, first, width, weights, power,
):  # fmt: skip
    """Set power[b, i] to the power of band b in frame i, times the scale.

    Parameters
    ----------
    single : samples; the frames begin `hop` apart, a whole number of these is there
    passes : radices of the passes
    turn, half_turn : cosines and sines of the frequencies of half a frame, and of a frame
    place : order of the frequencies after the passes
    columns, rows, square : (hop * (LANES + (N - 1) // hop),), (2, M * 2 LANES) and
        ((M + 1) LANES,), scratch
    first, width, weights : of the coefficients that each band sums
    """
    for at in range(0, power.shape[1], LANES):
        power_spectra(
            single, hop, window, at, passes, turn, half_turn, place, columns, rows, square
        )  # fmt: skip
        add_bands(square, scale, first, width, weights, at, power)


@fused
def power_spectra(
    single, hop, window, at, passes, turn, half_turn, place, columns, rows, square
):  # fmt: skip
    """square[k * LANES + f]: power of coefficient k of frame at + f, less its weighted mean."""
    x, y = rows[0], rows[1]
    count, past = len(place), 1
    near = np.empty((2, MOST_NEAR * 2 * LANES), np.float32)
    wide = _gather(single, hop, len(window), at * hop, columns)
    i = 0
    while i < len(passes):
        radix, second, third = passes[i], passes[i + 1] if i + 1 < len(passes) else 1, 1
        if i + 3 == len(passes) and radix * second * passes[i + 2] <= MOST_NEAR:
            third = passes[i + 2]
        some, others = radix * second, second * third
        groups = count // (radix * others)
        if i > 0 and others == 1:
            _pass(radix, x, groups, 1, groups, turn, 0, 1, past, y)
            groups = 0
        for g in range(groups):  # passes of few rows, which stay in the nearest memory
            o = _ROW * np.uint64(radix * others * g)
            if i == 0:
                for k in range(radix * others):
                    p = g + (k // radix + k % radix * others) * groups
                    _load(columns, hop, wide, window, p, k, near[0])
                _pass(radix, near[0], others, radix, 1, turn, g, groups, past, near[1])
            else:
                far = others * groups
                _pass(
                    radix,
                    x[_ROW * np.uint64(g) :],
                    others,
                    groups,
                    far,
                    turn,
                    g,
                    groups,
                    past,
                    near[1],
                )
            for k in range(third):
                of = near[1, _ROW * np.uint64(radix * k) :]
                to = y[o:] if third == 1 else near[0, _ROW * np.uint64(some * k) :]
                p = radix * (g + k * groups)
                _pass(second, of, radix, 1, radix * third, turn, p, 1, past * radix, to)
            if third > 1:
                _pass(third, near[0], some, 1, some, turn, some * g, 1, past * some, y[o:])
        past *= radix * others
        i += 1 + (second > 1) + (third > 1)
        x, y = y, x
    first = _ROW * np.uint64(place[0])
    for k in range(1, count // 2 + 1):
        a, b = _ROW * np.uint64(place[k]), _ROW * np.uint64(place[count - k])
        p, q = _LANES * np.uint64(k), _LANES * np.uint64(count - k)
        # A Hann window spreads the weighted mean over two coefficients.
        mean = _HALF if k == 1 else np.float32(0.0)
        _squares(
            x[a : a + _ROW], x[b : b + _ROW], x[first : first + _ROW], mean,
            half_turn[0, k], half_turn[1, k], square[p : p + _LANES], square[q : q + _LANES],
        )  # fmt: skip
    last = _LANES * np.uint64(count)
    for f in range(_NONE, _LANES):
        difference = x[first + f] - x[first + _LANES + f]
        square[f] = np.float32(0.0)
        square[last + f] = difference * difference


@fused
def add_bands(square, scale, first, width, weights, at, power):
    """power[b, at + f]: scaled and weighted sums over the coefficients of each band."""
    total = np.empty(LANES, np.float32)
    count = min(LANES, power.shape[1] - at)
    begin = 0
    for b in range(len(first)):
        total[:] = 0.0
        row = _LANES * np.uint64(first[b])
        for k in range(width[b]):
            weight = weights[begin + k]
            for f in range(_NONE, _LANES):
                total[f] += weight * square[row + f]
            row += _LANES
        begin += width[b]
        out = power[b, at : at + count]
        for f in range(count):
            out[f] = scale * total[f]


@fused
def _gather(single, hop, size, begin, columns):
    """Put the samples of LANES frames from `begin` on in `columns`, those of a place in a row.

    Where windows of that size overlap, frames share what is `hop` apart: each column of these is
    gathered once. Returns their number.
    """
    wide = LANES + (size - 1) // hop
    stride = np.uint64(wide)
    for m in range(wide):
        part, column = single[begin + m * hop : begin + (m + 1) * hop], columns[m:]
        for r in range(np.uint64(hop)):
            column[r * stride] = part[r]
    return wide


@fused
def _load(columns, hop, wide, window, p, k, rows):
    """Set row k to the p-th complex number of all frames, two windowed samples."""
    for half in range(2):
        n, at = 2 * p + half, (2 * k + half) * LANES
        weight, first = window[n], n % hop * wide + n // hop
        some, row = columns[first : first + LANES], rows[at : at + LANES]
        for f in range(_NONE, _LANES):
            row[f] = weight * some[f]


@fused
def _pass(radix, x, count, apart, far, turn, p, between, past, y):
    """So many results of a pass, those of p, p + between, ... in rows that follow one another.

    Each begins `apart` rows after the last one, and takes rows `far` from one another.
    """
    step, far = _ROW * np.uint64(apart), _ROW * np.uint64(far)
    if radix == 1:
        for f in range(_ROW * np.uint64(count)):
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
        a, o = step * np.uint64(m), _ROW * np.uint64(2 * m)
        b = a + far
        _two(x[a : a + _ROW], x[b : b + _ROW], turn[0, k], turn[1, k], y[o : o + _TWO * _ROW])


@fused
def _two(a, b, c1, s1, y):
    for f in range(_NONE, _LANES):
        ar, ai, br, bi = a[f], a[_LANES + f], b[f], b[_LANES + f]
        y[f] = ar + br
        y[_LANES + f] = ai + bi
        real, imag = ar - br, ai - bi
        y[_ROW + f] = real * c1 - imag * s1
        y[_ROW + _LANES + f] = real * s1 + imag * c1


@fused
def _pass_of_three(x, count, step, far, turn, p, between, past, y):
    for m in range(count):
        k = (p + m * between) // past * past
        a, o = step * np.uint64(m), _ROW * np.uint64(3 * m)
        b = a + far
        c = b + far
        _three(
            x[a : a + _ROW], x[b : b + _ROW], x[c : c + _ROW],
            turn[0, k], turn[1, k], turn[0, 2 * k], turn[1, 2 * k], y[o : o + _THREE * _ROW],
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
        y[_ROW + f] = real * c1 - imag * s1
        y[_ROW + _LANES + f] = real * s1 + imag * c1
        real, imag = mid_r - turn_r, mid_i - turn_i
        y[_TWO * _ROW + f] = real * c2 - imag * s2
        y[_TWO * _ROW + _LANES + f] = real * s2 + imag * c2


@fused
def _pass_of_four(x, count, step, far, turn, p, between, past, y):
    for m in range(count):
        k = (p + m * between) // past * past
        c1, s1, c2, s2 = turn[0, k], turn[1, k], turn[0, 2 * k], turn[1, 2 * k]
        c3, s3 = turn[0, 3 * k], turn[1, 3 * k]
        a, o = step * np.uint64(m), _ROW * np.uint64(4 * m)
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
            y[o + _ROW + f] = real * c1 - imag * s1
            y[o + _ROW + _LANES + f] = real * s1 + imag * c1
            real, imag = even_r - odd_r, even_i - odd_i
            y[o + _TWO * _ROW + f] = real * c2 - imag * s2
            y[o + _TWO * _ROW + _LANES + f] = real * s2 + imag * c2
            real, imag = gap_r - turn_r, gap_i - turn_i
            y[o + _THREE * _ROW + f] = real * c3 - imag * s3
            y[o + _THREE * _ROW + _LANES + f] = real * s3 + imag * c3


@fused
def _pass_of_five(x, count, step, far, turn, p, between, past, y):
    for m in range(count):
        k = (p + m * between) // past * past
        c1, s1, c2, s2 = turn[0, k], turn[1, k], turn[0, 2 * k], turn[1, 2 * k]
        c3, s3, c4, s4 = turn[0, 3 * k], turn[1, 3 * k], turn[0, 4 * k], turn[1, 4 * k]
        a, o = step * np.uint64(m), _ROW * np.uint64(5 * m)
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
            y[o + _ROW + f] = real * c1 - imag * s1
            y[o + _ROW + _LANES + f] = real * s1 + imag * c1
            real, imag = mid_r - turn_r, mid_i - turn_i
            y[o + _FOUR * _ROW + f] = real * c4 - imag * s4
            y[o + _FOUR * _ROW + _LANES + f] = real * s4 + imag * c4
            mid_r = ar + _COSINE_10 * outer_r + _COSINE_5 * inner_r
            mid_i = ai + _COSINE_10 * outer_i + _COSINE_5 * inner_i
            turn_r = _SINE_10 * tilt_r - _SINE_5 * bend_r
            turn_i = _SINE_10 * tilt_i - _SINE_5 * bend_i
            real, imag = mid_r + turn_r, mid_i + turn_i
            y[o + _TWO * _ROW + f] = real * c2 - imag * s2
            y[o + _TWO * _ROW + _LANES + f] = real * s2 + imag * c2
            real, imag = mid_r - turn_r, mid_i - turn_i
            y[o + _THREE * _ROW + f] = real * c3 - imag * s3
            y[o + _THREE * _ROW + _LANES + f] = real * s3 + imag * c3


@fused
def _squares(one, other, zero, mean, c, s, square, square_other):
    """Powers of coefficients k and M - k from the rows of these frequencies.

    The sum of the row of frequency 0, the coefficient 0, is added `mean` times to the coefficient
    k. The rows are handed in as such: of indices into one array, this loop is not in vector lanes.
    """
    for f in range(_NONE, _LANES):
        ar, ai, br, bi = one[f], one[_LANES + f], other[f], -other[_LANES + f]
        even_r, even_i = _HALF * (ar + br), _HALF * (ai + bi)
        odd_r, odd_i = _HALF * (ai - bi), _HALF * (br - ar)
        turn_r, turn_i = odd_r * c - odd_i * s, odd_r * s + odd_i * c
        real = even_r + turn_r + mean * (zero[f] + zero[_LANES + f])
        imag = even_i + turn_i
        square[f] = real * real + imag * imag
        real, imag = even_r - turn_r, even_i - turn_i
        square_other[f] = real * real + imag * imag
