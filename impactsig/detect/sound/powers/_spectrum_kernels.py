"""Kernels for the power spectra of many frames of a sound at once.

Two real samples make a complex number: a frame of N samples needs a transform of M = N / 2 numbers,
by the passes of `_radix_kernels.py`. What two passes of radices r and s make of r s rows depends on
these alone: they are taken one after the other while the rows are in the nearest memory, and so are
the last three.
"""

from __future__ import annotations

import math

import numpy as np

from .._lane_kernels import fused
from ._radix_kernels import LANES, ROW, one_pass

MOST_NEAR = 48  # rows that passes make of as many others in the nearest memory
_NONE, _LANES = np.uint64(0), np.uint64(LANES)
_HALF = np.float32(0.5)


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
def band_powers(
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
            one_pass(radix, x, groups, 1, groups, turn, 0, 1, past, y)
            groups = 0
        for g in range(groups):  # passes of few rows, which stay in the nearest memory
            o = ROW * np.uint64(radix * others * g)
            if i == 0:
                for k in range(radix * others):
                    p = g + (k // radix + k % radix * others) * groups
                    _load(columns, hop, wide, window, p, k, near[0])
                one_pass(radix, near[0], others, radix, 1, turn, g, groups, past, near[1])
            else:
                far = others * groups
                one_pass(
                    radix,
                    x[ROW * np.uint64(g) :],
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
                of = near[1, ROW * np.uint64(radix * k) :]
                to = y[o:] if third == 1 else near[0, ROW * np.uint64(some * k) :]
                p = radix * (g + k * groups)
                one_pass(second, of, radix, 1, radix * third, turn, p, 1, past * radix, to)
            if third > 1:
                one_pass(third, near[0], some, 1, some, turn, some * g, 1, past * some, y[o:])
        past *= radix * others
        i += 1 + (second > 1) + (third > 1)
        x, y = y, x
    first = ROW * np.uint64(place[0])
    for k in range(1, count // 2 + 1):
        a, b = ROW * np.uint64(place[k]), ROW * np.uint64(place[count - k])
        p, q = _LANES * np.uint64(k), _LANES * np.uint64(count - k)
        # A Hann window spreads the weighted mean over two coefficients.
        mean = _HALF if k == 1 else np.float32(0.0)
        _squares(
            x[a : a + ROW], x[b : b + ROW], x[first : first + ROW], mean,
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
