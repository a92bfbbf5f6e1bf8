"""Kernels that project sounds on modes that start at any shift, Q and K of `_shift_kernels.py`."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import njit

LANES = 64  # sounds that are projected side by side
ROWS_AT_ONCE = 4  # of a basis, that sounds are projected on
LOST = 1e-4  # fraction of the square of a column; if less is left, rounding is magnified
ROUNDED = 1e-26  # fraction of the square of a column that rounding may leave
_NONE = np.uint64(0)


@njit(nogil=True)
def orthonormal(columns, count, parts, begin, shifts, basis, grams):
    """Rows of Q' and K' at each shift, basis[j, r, k] at sample k, and the elements of G.

    The first `count` of `columns`, of which `parts` values make a sample, are made orthonormal by
    the method of Gram and Schmidt, once more where little is left of one: to rounding. What is left
    by no more than rounding is nothing. The last two are freed from these. Sample 0 is column
    `begin` at shift 0; rows of the basis that are not needed come first, and are zeros. All shifts
    are worked out side by side, in lanes of the processor's vectors.
    """
    spare, size = basis.shape[1] - len(columns), basis.shape[2]
    wide, step = np.uint64(len(shifts)), np.uint64(parts)
    held = np.empty((len(columns), size * len(shifts)))
    square, before = np.empty(len(shifts)), np.empty(len(shifts))
    basis[:, :spare] = 0.0
    for c in range(len(columns)):
        row, own = held[c], columns[c]
        for k in range(np.uint64(size)):
            at, to = np.uint64(begin) + k * step, k * wide
            for j in range(wide):
                row[to + j] = own[at - np.uint64(shifts[j])]
        products(row, row, before)
        for turn in range(2):
            if turn and (square >= LOST * before).all():
                break
            for other in range(min(c, count)):
                products(row, held[other], square)
                take_off(row, held[other], square)
            products(row, row, square)
        if c < count:
            for j in range(len(shifts)):
                some = square[j] > ROUNDED * before[j]
                square[j] = 1.0 - 1.0 / math.sqrt(square[j]) if some else 1.0
            take_off(row, row, square)
        elif c == count:
            grams[0] = square
        else:
            grams[1] = square
            products(row, held[count], grams[2])
        for k in range(np.uint64(size)):
            for j in range(wide):
                basis[j, spare + c, k] = row[k * wide + j]


@njit(nogil=True)
def products(row, other, out):
    """Scalar product of two rows in each lane."""
    wide = np.uint64(len(out))
    out[:] = 0.0
    for k in range(_NONE, np.uint64(len(row)), wide):
        for j in range(_NONE, wide):
            out[j] += row[k + j] * other[k + j]


@njit(nogil=True)
def take_off(row, other, times):
    """Take so many times the other off a row, in each lane."""
    wide = np.uint64(len(times))
    for k in range(_NONE, np.uint64(len(row)), wide):
        for j in range(_NONE, wide):
            row[k + j] -= times[j] * other[k + j]


@njit(nogil=True)
def project(sounds, first, basis, energy, projections):
    """Energy of each sound from sample first[i] on, and its projections on the basis at each shift.

    A projection is the power in all but the last two rows of a basis, and the products with these;
    there are ROWS_AT_ONCE rows, or a multiple. LANES sounds are projected side by side, each in a
    lane of the processor's vectors.
    """
    shifts, rows, size = basis.shape
    block, sums, power = np.empty(size * LANES), np.empty((ROWS_AT_ONCE, LANES)), np.empty(LANES)
    for at in range(0, len(sounds), LANES):
        count = min(LANES, len(sounds) - at)
        for i in range(count):
            total = 0.0
            for k in range(size):
                value = sounds[at + i, first[at + i] + k]
                block[k * count + i] = value
                total += value * value
            energy[at + i] = total
        a, b, c, d = sums[0, :count], sums[1, :count], sums[2, :count], sums[3, :count]
        for j in range(shifts):
            power[:] = 0.0
            for row in range(0, rows, ROWS_AT_ONCE):
                four_products(block, count, basis[j, row : row + ROWS_AT_ONCE], a, b, c, d)
                for i in range(count):
                    power[i] += a[i] * a[i] + b[i] * b[i]
                if row + ROWS_AT_ONCE < rows:
                    for i in range(count):
                        power[i] += c[i] * c[i] + d[i] * d[i]
            for i in range(count):
                projections[at + i, 0, j] = power[i]
                projections[at + i, 1, j], projections[at + i, 2, j] = c[i], d[i]


@njit(nogil=True)
def four_products(block, count, rows, a, b, c, d):
    """Scalar products of four rows with so many sounds, whose samples lie side by side.

    Four samples at a time: a sum is read and written once for four, a sample once for four rows.
    """
    far = np.uint64(count)
    a[:] = 0.0
    b[:] = 0.0
    c[:] = 0.0
    d[:] = 0.0
    whole = rows.shape[1] // 4 * 4
    for k in range(0, whole, 4):
        a0, a1, a2, a3 = rows[0, k], rows[0, k + 1], rows[0, k + 2], rows[0, k + 3]
        b0, b1, b2, b3 = rows[1, k], rows[1, k + 1], rows[1, k + 2], rows[1, k + 3]
        c0, c1, c2, c3 = rows[2, k], rows[2, k + 1], rows[2, k + 2], rows[2, k + 3]
        d0, d1, d2, d3 = rows[3, k], rows[3, k + 1], rows[3, k + 2], rows[3, k + 3]
        at = np.uint64(k * count)
        for i in range(at, at + far):
            w, x, y, z = block[i], block[i + far], block[i + far + far], block[i + far + far + far]
            j = i - at
            a[j] = a[j] + a0 * w + a1 * x + a2 * y + a3 * z
            b[j] = b[j] + b0 * w + b1 * x + b2 * y + b3 * z
            c[j] = c[j] + c0 * w + c1 * x + c2 * y + c3 * z
            d[j] = d[j] + d0 * w + d1 * x + d2 * y + d3 * z
    for k in range(whole, rows.shape[1]):
        a0, b0, c0, d0 = rows[0, k], rows[1, k], rows[2, k], rows[3, k]
        at = np.uint64(k * count)
        for i in range(_NONE, far):
            w = block[at + i]
            a[i] += a0 * w
            b[i] += b0 * w
            c[i] += c0 * w
            d[i] += d0 * w
