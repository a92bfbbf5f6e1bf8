"""Kernels that time sounds of the same modes behind a band-limiting filter.

A sound y that starts a shift d after a sample is taken for

    y = Q(d) a + K(d) b + e,    b ~ N(0, E V),    e ~ N(0, s E),    E = |y|^2,

where the orthonormal columns Q span the modes that start there, K holds the filter's impulse
response there and its slope, freed from Q, and s is the power of a sample's error relative to E.
With a of any size, the logarithm of the probability of d is, but for a constant,

    L(d) = (|Q'y|^2 + y'K (G + s / V)^-1 K'y) / (2 s E) - ln det(1 + V G / s) / 2,    G = K'K.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiled import njit
from .._kernels import innovations
from ._alike_kernels import UNSURE, product, taps_at

NEAR_TAPS = 8  # samples on either side that a crossing is made of
FINE = 8  # places between two samples that a crossing is looked for at
BETWEEN = 16  # places between two shifts at which the probability is interpolated
FALL = 30.0  # by which its logarithm may lie below the greatest to count
NOTHING = 1e-30  # energy over the noise of a sample, of which no probability is a number


@njit(nogil=True)
def high_passed(waves, taps, out):
    """out[i, k]: the filtered sample k + len(taps) // 2 of wave i."""
    for i in range(len(waves)):
        filtered_at(waves[i], 0, taps, out[i])


@njit(nogil=True)
def filtered_at(wave, first, taps, out):
    """out[k]: scalar product of the taps with the wave from sample first + k on.

    Tap by tap: the inner loop runs in vector lanes.
    """
    out[:] = 0.0
    for n in range(len(taps)):
        tap, part = taps[n], wave[first + n : first + n + len(out)]
        for k in range(len(out)):
            out[k] += tap * part[k]


@njit(nogil=True)
def add_lagged_products(ring, rows, factor, total):
    """Add to total[i, j], i <= j, the factor times H'H, H[k, i] = ring[k + i] with so many rows.

    Along a diagonal one product comes and one goes: from the last column on, for sounds decay, and
    sums lose no digits as terms are added that are greater.
    """
    width = len(total)
    for i in range(width):
        value = product(ring, i, ring[width - 1 : width - 1 + rows])
        for back in range(i + 1):
            a, b = i - back, width - 1 - back
            if back > 0:
                value += ring[a] * ring[b] - ring[a + rows] * ring[b + rows]
            total[a, b] += factor * value


@njit(nogil=True)
def crossings(sounds, quiet, begin, end, shares, out):
    """First crossing of a share of each sound's greatest modulus, and its duration.

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


@njit(nogil=True)
def abruptness(wave, split, lag, slope, count):
    """Power of two innovations at `split` relative to the greatest two of `count`."""
    innovation = np.empty(count)
    innovations(wave, split, lag, slope, innovation)
    greatest = 0.0
    for k in range(count - 1):
        power = innovation[k] * innovation[k] + innovation[k + 1] * innovation[k + 1]
        greatest = max(greatest, power)
    if greatest == 0.0:
        return 1.0
    return (innovation[0] * innovation[0] + innovation[1] * innovation[1]) / greatest


@njit(nogil=True)
def _project(y, first, basis, out):
    """Projections of y, from sample `first` on, on the basis."""
    last = len(basis) - 2
    power = 0.0
    for c in range(last):
        share = product(y, first, basis[c])
        power += share * share
    out[0] = power
    out[1] = product(y, first, basis[last])
    out[2] = product(y, first, basis[last + 1])


@njit(nogil=True)
def log_probability(projection, gram, energy, error, prior):
    """Log probability L, and the share of the energy that is explained.

    `gram` holds the two diagonal elements of G and that beside them, `error` is s, `prior` the
    two diagonal elements of V.
    """
    g0 = gram[0] + error / prior[0]
    g1 = gram[1] + error / prior[1]
    det = g0 * g1 - gram[2] * gram[2]
    b0, b1 = projection[1], projection[2]
    beyond = (b0 * b0 * g1 - 2.0 * b0 * b1 * gram[2] + b1 * b1 * g0) / det
    explained = (projection[0] + beyond) / energy
    scale = det * prior[0] * prior[1] / (error * error)
    return 0.5 * explained / error - 0.5 * math.log(scale), explained


@njit(nogil=True)
def place(sounds, guess, lead, grid, near, floor, prior, origin, beyond):
    """Most probable whole sample near the guess at which each sound starts.

    -1 where the sound does not hold all that a fit from there needs, or is nothing beside noise.
    beyond[i]: what starts more than `near` samples away from there add to the variance. `lead` is
    how many samples of a fit lie before its origin, `grid` the basis and Gram elements at shifts of
    whole samples, `floor` the noise of a sample and the part of s that the model's errors make.
    """
    basis, gram = grid
    reach, size = len(basis) // 2, basis.shape[2]
    projection, value = np.empty(3), np.empty(len(basis))
    for i in range(len(sounds)):
        origin[i], beyond[i] = -1, 0.0
        if not np.isfinite(guess[i]):
            continue
        middle = math.floor(guess[i] + 0.5)
        first = middle - lead
        if first - reach < 0 or first + reach + size > sounds.shape[1]:
            continue
        energy = 0.0
        for k in range(first, first + size):
            energy += sounds[i, k] * sounds[i, k]
        if energy <= NOTHING * floor[0]:
            continue
        error = floor[0] / energy + floor[1]
        best = 0
        for j in range(len(basis)):
            _project(sounds[i], first, basis[j], projection)
            value[j], _ = log_probability(projection, gram[j], energy, error, prior)
            if value[j] > value[best]:
                best = j
        origin[i] = middle + best - reach
        total = 0.0
        for j in range(len(basis)):
            weight = math.exp((value[j] - value[best]) / UNSURE)
            total += weight
            if abs(j - best) > near:
                beyond[i] += weight * (j - best) ** 2
        beyond[i] /= total


@njit(nogil=True)
def project(sounds, origin, lead, basis, energy, projections):
    """Energy of each sound about its origin, and its projections at every shift."""
    for i in range(len(sounds)):
        first = origin[i] - lead
        energy[i] = 0.0
        for k in range(first, first + basis.shape[2]):
            energy[i] += sounds[i, k] * sounds[i, k]
        for j in range(len(basis)):
            _project(sounds[i], first, basis[j], projections[i, j])


@njit(nogil=True)
def leave(projections, energy, grams, floor, prior, left):
    """Share of the energy of each sound that the most probable shift leaves."""
    value = np.empty(len(grams))
    for i in range(len(energy)):
        error = floor[0] / energy[i] + floor[1]
        _, left[i] = _log_probabilities(projections[i], grams, energy[i], error, prior, value)


@njit(nogil=True)
def weigh(projections, energy, grams, step, floor, freedom, prior, out):
    """Posterior mean and deviation of the shift, residual share, error, log evidence.

    Shifts lie `step` apart about 0. `floor`: the noise of a sample, and the part of s that the
    model's errors make; s is at least what is left to each of the degrees of freedom.
    """
    value = np.empty(len(grams))
    for i in range(len(energy)):
        error = floor[0] / energy[i] + floor[1]
        most, left = _log_probabilities(projections[i], grams, energy[i], error, prior, value)
        if left > error * freedom:
            error = left / freedom
            most, left = _log_probabilities(projections[i], grams, energy[i], error, prior, value)
        out[i, 0], out[i, 1], evidence = _moments(value, most, step)
        out[i, 2], out[i, 3] = left, error
        out[i, 4] = evidence - 0.5 / error - 0.5 * freedom * math.log(error)


@njit(nogil=True)
def _log_probabilities(projection, grams, energy, error, prior, value):
    """L at every shift; the greatest, and the residual share of the energy there."""
    most, best = -np.inf, 0.0
    for j in range(len(grams)):
        value[j], explained = log_probability(projection[j], grams[j], energy, error, prior)
        if value[j] > most:
            most, best = value[j], explained
    return most, max(1.0 - best, 0.0)


@njit(nogil=True)
def _cubic(value, j, t):
    """Cubic interpolation between shift j and the next."""
    a, b = value[j], value[j + 1]
    p = value[j - 1] if j else 2.0 * a - b
    q = value[j + 2] if j + 2 < len(value) else 2.0 * b - a
    bend = 2.0 * p - 5.0 * a + 4.0 * b - q + t * (3.0 * (a - b) + q - p)
    return a + 0.5 * t * (b - p + t * bend)


@njit(nogil=True)
def _moments(value, most, step):
    """Mean, standard deviation of the shift, and ln of the sum of exp(value)."""
    last = len(value) - 1
    greatest = -np.inf
    for j in range(last):
        if max(value[j], value[j + 1]) >= most - FALL:
            for k in range(BETWEEN):
                greatest = max(greatest, _cubic(value, j, (k + 0.5) / BETWEEN))
    total = first = second = 0.0
    for j in range(last):
        if max(value[j], value[j + 1]) >= most - FALL:
            for k in range(BETWEEN):
                t = (k + 0.5) / BETWEEN
                weight = math.exp(_cubic(value, j, t) - greatest)
                at = j + t - 0.5 * last
                total += weight
                first += weight * at
                second += weight * at * at
    mean = first / total
    # Between two places nothing is looked at.
    variance = max(second / total - mean * mean, 0.0) + 1.0 / (12.0 * BETWEEN * BETWEEN)
    return step * mean, step * math.sqrt(variance), greatest + math.log(total * step / BETWEEN)
