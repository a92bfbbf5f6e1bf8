"""Kernels that time sounds of the same modes behind a band-limiting filter.

A sound y that starts a shift d after a sample is modelled as

    y = Q(d) a + K(d) b + e,    b ~ N(0, E V),    e ~ N(0, s E),    E = |y|^2,

where the orthonormal columns Q span the modes that start there, K holds the filter's impulse
response there and its slope, orthogonal to Q, and s is the power of a sample's error relative to E.
For an unbounded prior of a, the logarithm of the probability of d is, up to a constant,

    L(d) = (|Q'y|^2 + y'K (G + s / V)^-1 K'y) / (2 s E) - ln det(1 + V G / s) / 2,    G = K'K.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel, njit
from .._attack_kernels import innovations
from .._lane_kernels import exponentials, logarithms
from ._alike_kernels import UNSURE, add_products, filtered_at, taps_at

NEAR_TAPS = 8  # samples on either side from which a crossing is interpolated
FINE = 8  # places between two samples that a crossing is looked for at
BETWEEN = 16  # places between two shifts at which the probability is interpolated
FALL = 30.0  # by which its logarithm may lie below the greatest to count
LANES = 64  # sounds that are projected side by side
ROWS_AT_ONCE = 4  # of a basis, that sounds are projected on
LOST = 0.01  # fraction of the square of a column; if less is left, rounding is magnified
ROUNDED = 1e-26  # fraction of the square of a column that rounding may leave
FAINTEST = 1e-300  # energy whose reciprocal is finite
NOTHING = 1e-30  # energy over the noise of a sample for which probabilities are not finite
_NONE = np.uint64(0)


@njit(nogil=True)
def high_passed(waves, taps, out):
    """out[i, k]: the filtered sample k + len(taps) // 2 of wave i."""
    for i in range(len(waves)):
        filtered_at(waves[i], 0, taps, out[i])


@kernel
def accumulate(cells, factors):
    """Replace each row by y[i] = factor y[i - 1] + cell[i], with the factor of the row."""
    for row in range(cells.shape[0]):
        total = 0.0j
        for i in range(cells.shape[1]):
            total = factors[row] * total + cells[row, i]
            cells[row, i] = total


@njit(nogil=True)
def add_rings(rings, energy, noise, rows, total):
    """Add the lagged products of all rings of more than the FAINTEST energy, over it; the noise.

    The noise is that of so many rows.
    """
    floor = 0.0
    for i in range(len(rings)):
        if energy[i] > FAINTEST:
            add_lagged_products(rings[i], rows, 1.0 / energy[i], total)
            floor += rows * noise / energy[i]
    return floor


@njit(nogil=True)
def add_lagged_products(ring, rows, factor, total):
    """Add to total[i, j], i <= j, the factor times H'H, H[k, i] = ring[k + i] with so many rows.

    Along a diagonal one product comes and one goes: from the last column on, for sounds decay, and
    sums lose no digits as terms are added that are greater.
    """
    width = len(total)
    sums, values = np.empty((4, width)), np.empty(width)
    add_products(ring, 0, 1, 1, ring[width - 1 : width - 1 + rows], width, sums)
    for i in range(width):
        values[i] = (sums[0, i] + sums[1, i]) + (sums[2, i] + sums[3, i])
        total[i, width - 1] += factor * values[i]
    for back in range(1, width):  # all diagonals side by side
        b = width - 1 - back
        comes, goes, value = ring[b], ring[b + rows], values[back:]
        head, tail = ring[: width - back], ring[rows : rows + width - back]
        for a in range(width - back):
            value[a] += head[a] * comes - tail[a] * goes
        for a in range(width - back):
            total[a, b] += factor * value[a]


@njit(nogil=True)
def crossings(sounds, quiet, begin, end, shares, out):
    """First crossing of a fraction of each sound's greatest modulus, and its duration.

    The crossing and the greatest are looked for from sample `begin` to `end`, between samples as
    well. The share is the first of `shares`, or more where noise reaches it (the second is a
    multiple of the noise before sample `quiet`), but no more than the third.

    out : (n, 3), room for both and for the standard error that this noise gives the crossing; NaN
        where a sound is silent
    """
    rows = np.empty((FINE, 2 * NEAR_TAPS))
    for part in range(FINE):
        taps_at(part / FINE, rows[part])
    sizes, between = np.empty(FINE * (end - begin)), np.empty(end - begin)
    for i in range(len(sounds)):
        noise = 0.0
        for k in range(quiet):
            noise += sounds[i, k] * sounds[i, k]
        greatest = 0.0
        for part in range(FINE):
            filtered_at(sounds[i], begin + 1 - NEAR_TAPS, rows[part], between)
            for k in range(len(between)):
                size = abs(between[k])
                sizes[FINE * k + part] = size
                greatest = max(greatest, size)
        out[i, 0] = out[i, 1] = out[i, 2] = np.nan
        level = max(shares[0] * greatest, shares[1] * math.sqrt(noise / quiet))
        level = min(level, shares[2] * greatest)
        if greatest > 0.0:
            k = 0
            while sizes[k] < level:
                k += 1
            rise = sizes[k] - sizes[k - 1] if k else np.inf
            last = k + 1
            while last < len(sizes) and sizes[last] >= level:
                last += 1
            out[i, 0] = begin + (k - (sizes[k] - level) / rise) / FINE
            out[i, 1] = (last - k) / FINE
            out[i, 2] = math.sqrt(noise / quiet) / (FINE * rise)


@allocating
def abruptness(waves, split, lag, slope, count, out):
    """Power of two innovations of each wave at `split` over the greatest two of `count`."""
    innovation = np.empty(count)
    for i in range(len(waves)):
        innovations(waves[i], split, lag, slope, innovation)
        first = greatest = 0.0
        for k in range(count - 1):
            power = innovation[k] * innovation[k] + innovation[k + 1] * innovation[k + 1]
            if k == 0:
                first = power
            greatest = max(greatest, power)
        out[i] = first / greatest if greatest > 0.0 else 1.0


@allocating
def log_probabilities(projection, gram, energy, error, prior, value, explained):
    """Log probability L of each shift, and the fraction of the energy that is explained.

    `gram` holds the two diagonal elements of G and that beside them, `error` is s, `prior` the
    two diagonal elements of V.
    """
    count = np.uint64(len(value))
    first, second = error / prior[0], error / prior[1]
    scale = prior[0] * prior[1] / (error * error)
    for j in range(count):
        g0, g1 = gram[0, j] + first, gram[1, j] + second
        det = g0 * g1 - gram[2, j] * gram[2, j]
        b0, b1 = projection[1, j], projection[2, j]
        beyond = (b0 * b0 * g1 - 2.0 * b0 * b1 * gram[2, j] + b1 * b1 * g0) / det
        explained[j] = (projection[0, j] + beyond) / energy
        value[j] = det * scale
    logarithms(value)
    for j in range(count):
        value[j] = 0.5 * (explained[j] / error - value[j])


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
        for j in range(len(shifts)):
            at, to = np.uint64(begin - shifts[j]), np.uint64(j)
            for k in range(np.uint64(size)):
                row[k * wide + to] = own[at + k * step]
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
        for j in range(len(shifts)):
            out, of = basis[j, spare + c], np.uint64(j)
            for k in range(np.uint64(size)):
                out[k] = row[k * wide + of]


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


@allocating
def place(projections, energy, grams, near, floor, prior, shift, beyond):
    """Most probable whole shift at which each sound starts; shifts count from the first.

    -1 where the sound is nothing beside noise. beyond[i]: what starts more than `near` samples away
    from there add to the variance. `floor`: the noise of a sample and the part of s that the
    model's errors make.
    """
    value, explained = np.empty(grams.shape[1]), np.empty(grams.shape[1])
    for i in range(len(energy)):
        shift[i], beyond[i] = -1, 0.0
        if energy[i] <= NOTHING * floor[0]:
            continue
        error = floor[0] / energy[i] + floor[1]
        log_probabilities(projections[i], grams, energy[i], error, prior, value, explained)
        best = value.argmax()
        shift[i] = best
        most = value[best]
        for j in range(len(value)):
            value[j] = (value[j] - most) / UNSURE
        exponentials(value)
        total = 0.0
        for j in range(len(value)):
            total += value[j]
            if abs(j - best) > near:
                beyond[i] += value[j] * (j - best) ** 2
        beyond[i] /= total


@allocating
def leave(projections, energy, grams, floor, freedom, prior, left):
    """Fraction of the energy of each sound that the most probable shift leaves.

    As in `weigh`, s is at least what is left to each of the degrees of freedom.
    """
    value, explained = np.empty(grams.shape[1]), np.empty(grams.shape[1])
    for i in range(len(energy)):
        error = floor[0] / energy[i] + floor[1]
        log_probabilities(projections[i], grams, energy[i], error, prior, value, explained)
        left[i] = max(1.0 - explained[value.argmax()], 0.0)
        if left[i] > error * freedom:
            error = left[i] / freedom
            log_probabilities(projections[i], grams, energy[i], error, prior, value, explained)
            left[i] = max(1.0 - explained[value.argmax()], 0.0)


@allocating
def weigh(projections, energy, grams, step, floor, freedom, prior, out):
    """Posterior mean and deviation of the shift, residual share, error, log evidence.

    Shifts lie `step` apart about 0. `floor`: the noise of a sample, and the part of s that the
    model's errors make; s is at least what is left to each of the degrees of freedom.
    """
    value, explained = np.empty(grams.shape[1]), np.empty(grams.shape[1])
    scratch = np.empty(BETWEEN * (len(value) + 4))
    for i in range(len(energy)):
        error = floor[0] / energy[i] + floor[1]
        log_probabilities(projections[i], grams, energy[i], error, prior, value, explained)
        best = value.argmax()
        left = max(1.0 - explained[best], 0.0)
        if left > error * freedom:
            error = left / freedom
            log_probabilities(projections[i], grams, energy[i], error, prior, value, explained)
            best = value.argmax()
            left = max(1.0 - explained[best], 0.0)
        out[i, 0], out[i, 1], evidence = _moments(value, value[best], step, scratch)
        out[i, 2], out[i, 3] = left, error
        out[i, 4] = evidence - 0.5 / error - 0.5 * freedom * math.log(error)


@allocating
def _moments(value, most, step, scratch):
    """Mean, standard deviation of the shift, and ln of the sum of exp(value).

    Between two shifts a cubic through four gives the value at BETWEEN places. `scratch` has room
    for so many after each, and for as many sums.
    """
    last, count = len(value) - 1, 0
    weight, greatest = scratch[4 * BETWEEN :], scratch[:BETWEEN]
    for j in range(last):
        if value[j] >= most - FALL or value[j + 1] >= most - FALL:
            a, b = value[j], value[j + 1]
            p = value[j - 1] if j else 2.0 * a - b
            q = value[j + 2] if j + 2 < len(value) else 2.0 * b - a
            first, second, third = b - p, 2.0 * p - 5.0 * a + 4.0 * b - q, 3.0 * (a - b) + q - p
            for k in range(BETWEEN):  # here, with numbers known beforehand, it runs in vector lanes
                t = (k + 0.5) / BETWEEN
                weight[count + k] = a + 0.5 * t * (first + t * (second + t * third))
            count += BETWEEN
    greatest[:] = -np.inf
    for begin in range(0, count, BETWEEN):
        for k in range(BETWEEN):
            one = weight[begin + k]
            greatest[k] = one if one > greatest[k] else greatest[k]
    top = greatest.max()
    for k in range(np.uint64(count)):
        weight[k] -= top
    exponentials(weight[:count])
    total, first = scratch[BETWEEN : 2 * BETWEEN], scratch[2 * BETWEEN : 3 * BETWEEN]
    second, begin = scratch[3 * BETWEEN : 4 * BETWEEN], np.uint64(0)
    total[:], first[:], second[:] = 0.0, 0.0, 0.0
    for j in range(last):
        if value[j] >= most - FALL or value[j + 1] >= most - FALL:
            for k in range(np.uint64(BETWEEN)):  # sums side by side: they run in vector lanes
                one, at = weight[begin + k], j + (k + 0.5) / BETWEEN - 0.5 * last
                total[k] += one
                first[k] += one * at
                second[k] += one * at * at
            begin += np.uint64(BETWEEN)
    mass = total.sum()
    mean = first.sum() / mass
    # Nothing between two places is checked.
    variance = max(second.sum() / mass - mean * mean, 0.0) + 1.0 / (12.0 * BETWEEN * BETWEEN)
    return step * mean, step * math.sqrt(variance), top + math.log(mass * step / BETWEEN)
