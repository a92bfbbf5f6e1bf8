"""Kernels that project sounds on modes that start at any shift, Q and K of `_shift_kernels.py`."""

from __future__ import annotations

import math

import numpy as np

from .._lane_kernels import fused, reordered

LANES = 64  # sounds that are projected side by side
ROWS_AT_ONCE = 4  # of a basis, that sounds are projected on
LOST = 1e-4  # fraction of the square of a column; if less is left, rounding is magnified
ROUNDED = 1e-26  # fraction of the square of a column that rounding may leave
_NONE = np.uint64(0)


@reordered
def orthonormal(columns, count, parts, begin, shifts, basis, grams):
    """Rows of Q' and K' at each shift, basis[j, r, k] at sample k, and the elements of G.

    The first `count` of `columns`, of which `parts` values make a sample, are made orthonormal by
    the method of Gram and Schmidt, once more where little is left of one: to rounding. What is left
    by no more than rounding is nothing. The last two are freed from these. Sample 0 is column
    `begin` at shift 0; rows of the basis that are not needed come first, and are zeros.
    """
    spare, whole = basis.shape[1] - len(columns), -(-columns.shape[1] // parts)
    apart = np.empty((parts, len(columns), whole))  # values a sample apart lie side by side
    for c in range(len(columns)):
        for part in range(parts):
            own, values = apart[part, c], columns[c, part:]
            for k in range((len(values) - 1) // parts + 1):
                own[k] = values[k * parts]
    for j in range(len(shifts)):
        basis[j, :spare] = 0.0
        rows, first = basis[j, spare:], begin - shifts[j]
        for c in range(len(columns)):
            row, own = rows[c], apart[first % parts, c, first // parts :]
            for k in range(len(row)):
                row[k] = own[k]
            before, square = product(row, row), 0.0
            for turn in range(2):
                if turn and square >= LOST * before:
                    break
                done = 0
                while done + 4 <= min(c, count):
                    free_of_four(row, rows[done], rows[done + 1], rows[done + 2], rows[done + 3])
                    done += 4
                for other in range(done, min(c, count)):
                    add_times(-product(row, rows[other]), rows[other], row)
                square = product(row, row)
            if c < count:
                scale = 1.0 / math.sqrt(square) if square > ROUNDED * before else 0.0
                for k in range(len(row)):
                    row[k] *= scale
            elif c == count:
                grams[0, j] = square
            else:
                grams[1, j], grams[2, j] = square, product(row, rows[count])


@reordered
def free_of_four(row, p, q, r, s):
    """Take what a row has of four orthonormal ones off it."""
    a = b = c = d = 0.0
    for k in range(len(row)):
        a += row[k] * p[k]
        b += row[k] * q[k]
        c += row[k] * r[k]
        d += row[k] * s[k]
    for k in range(len(row)):
        row[k] -= a * p[k] + b * q[k] + c * r[k] + d * s[k]


@reordered
def product(row, other):
    """Scalar product of two rows."""
    total = 0.0
    for k in range(len(row)):
        total += row[k] * other[k]
    return total


@reordered
def add_times(factor, other, row):
    """Add so many times the other to a row."""
    for k in range(len(row)):
        row[k] += factor * other[k]


@fused
def project(sounds, which, first, basis, energy, projections):
    """Energy of some sounds from sample first[i] on, and projections of them over its root.

    A projection is the power in all but the last two rows of a basis, and the products with these,
    at each shift; there are ROWS_AT_ONCE rows, or a multiple. LANES sounds are projected side by
    side, each in a lane of the processor's vectors, with as many digits as the basis has.
    """
    shifts, rows, size = basis.shape
    kind = basis.dtype
    block, sums = np.empty(size * LANES, kind), np.empty((ROWS_AT_ONCE, LANES), kind)
    power = np.empty(LANES, kind)
    for at in range(0, len(which), LANES):
        count = min(LANES, len(which) - at)
        for i in range(count):
            sound = sounds[which[at + i], first[at + i] : first[at + i] + size]
            energy[at + i] = product(sound, sound)
            scale = 1.0 / math.sqrt(energy[at + i]) if energy[at + i] > 0.0 else 0.0
            for k in range(size):
                block[k * count + i] = scale * sound[k]
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


@fused
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


@reordered
def leave_and_change(sounds, which, first, place, error, prior, basis, grams, left, change):
    """What a model leaves of sounds from sample first[i] on, and how it changes by a shift.

    Both are for sounds of energy 1, fitted at the fine shift nearest to place[i]; error[i] is their
    s. Of the change, what other amplitudes would do as well is taken off, and its size is 1.
    """
    size, middle = left.shape[1], len(basis) // 2
    later, fitted = np.empty(size), np.empty(size)
    for i in range(len(which)):
        at = min(max(middle + math.floor(place[i] + 0.5), 1), len(basis) - 2)
        sound = sounds[which[i], first[i] : first[i] + size]
        scale = 1.0 / math.sqrt(product(sound, sound))
        for k in range(size):
            left[i, k] = scale * sound[k]
        fit_at(left[i], error[i], prior, basis[at - 1], grams[:, at - 1], change[i])
        fit_at(left[i], error[i], prior, basis[at + 1], grams[:, at + 1], later)
        fit_at(left[i], error[i], prior, basis[at], grams[:, at], fitted)
        for k in range(size):
            change[i, k] = later[k] - change[i, k]
            left[i, k] -= fitted[k]
        fit_at(change[i], error[i], prior, basis[at], grams[:, at], fitted)
        for k in range(size):
            change[i, k] -= fitted[k]
        square = product(change[i], change[i])
        scale = 1.0 / math.sqrt(square) if square > 0.0 else 1.0
        for k in range(size):
            change[i, k] *= scale


@reordered
def fit_at(sound, error, prior, rows, gram, out):
    """What the model with these rows of Q' and K' makes of a sound of energy 1."""
    out[:] = 0.0
    for row in range(len(rows) - 2):
        add_times(product(sound, rows[row]), rows[row], out)
    impulse, slope = gram[0] + error / prior[0], gram[1] + error / prior[1]
    first, second = product(sound, rows[-2]), product(sound, rows[-1])
    det = impulse * slope - gram[2] * gram[2]
    add_times((first * slope - second * gram[2]) / det, rows[-2], out)
    add_times((second * impulse - first * gram[2]) / det, rows[-1], out)
