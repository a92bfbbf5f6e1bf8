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
from typing import NamedTuple

import numpy as np

from ...signal.order_kernels import centre_of
from .._lane_kernels import exponentials, fused, greatest_of, logarithms, reordered
from ._alike_kernels import UNSURE

BETWEEN = 8  # places between two shifts at which the probability is interpolated
FALL = 20.0  # by which its logarithm may lie below the greatest to count
NOTHING = 1e-30  # energy over the noise of a sample for which probabilities are not finite
_NONE = np.uint64(0)


class Shifts(NamedTuple):
    """Shifts of a model about 0."""

    grams: np.ndarray  # (3, shifts), as `log_probabilities` takes them
    step: float  # from one to the next [samples]
    freedom: float  # degrees of it in noise that Q leaves


class Search(NamedTuple):
    """What `most_probable` tries."""

    priors: np.ndarray  # (n, 2), variances V, their greatest first
    begin: int  # the first of these
    error: float  # of the model, at first
    least: float  # error
    enough: float  # evidence, without which no other prior is tried


@fused
def log_probabilities(projection, gram, error, prior, value, explained):
    """Log probability L of each shift, and the fraction of the energy that is explained.

    `projection` is that of a sound over the root of its energy; `gram` holds the two diagonal
    elements of G and that beside them, `error` is s, `prior` the two diagonal elements of V.
    """
    count = np.uint64(len(value))
    explain(projection, gram, error, prior, value, explained)
    scale = prior[0] * prior[1] / (error * error)
    for j in range(count):
        value[j] *= scale
    logarithms(value)
    for j in range(count):
        value[j] = 0.5 * (explained[j] / error - value[j])


@fused
def explain(projection, gram, error, prior, det, explained):
    """The fraction of the energy that each shift explains, and the determinant of G + s / V."""
    first, second = error / prior[0], error / prior[1]
    for j in range(np.uint64(len(det))):
        g0, g1 = gram[0, j] + first, gram[1, j] + second
        det[j] = g0 * g1 - gram[2, j] * gram[2, j]
        b0, b1 = projection[1, j], projection[2, j]
        beyond = (b0 * b0 * g1 - 2.0 * b0 * b1 * gram[2, j] + b1 * b1 * g0) / det[j]
        explained[j] = projection[0, j] + beyond


@fused
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
        log_probabilities(projections[i], grams, error, prior, value, explained)
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


@fused
def leave(projections, energy, grams, floor, freedom, prior, left):
    """Fraction of the energy of each sound that the most probable shift leaves.

    As in `weigh`, s is at least what is left to each of the degrees of freedom.
    """
    value, explained = np.empty(grams.shape[1]), np.empty(grams.shape[1])
    for i in range(len(energy)):
        error = floor[0] / energy[i] + floor[1]
        log_probabilities(projections[i], grams, error, prior, value, explained)
        left[i] = max(1.0 - explained[value.argmax()], 0.0)
        if left[i] > error * freedom:
            error = left[i] / freedom
            log_probabilities(projections[i], grams, error, prior, value, explained)
            left[i] = max(1.0 - explained[value.argmax()], 0.0)


@fused
def weigh(projections, energy, shifts, floor, prior, out):
    """Posterior mean and deviation of the shift, and residual share, of each sound.

    Arguments are those of `_posterior`.
    """
    scratch = _scratch(shifts)
    for i in range(len(energy)):
        out[i, 0], out[i, 1], out[i, 2], _ = _posterior(
            projections[i], energy[i], shifts, floor, prior, scratch
        )


@fused
def _scratch(shifts):
    """What `_posterior` needs: a value and a fraction of each shift, and values between them."""
    count = shifts.grams.shape[1]
    return np.empty(count), np.empty(count), np.empty(BETWEEN * count)


@fused
def most_probable(projections, energy, shifts, noise, search):
    """Mean evidence of sounds, variance of the impulse and error that make it greatest.

    Variances are tried in sequence from the first of the `search` on, up to one that is no better,
    or not enough, and backwards only if the next one is no better: there is one maximum. The
    error is what is left in the median beyond noise, at least the least.
    """
    most, best, error_there = -np.inf, search.begin, search.error
    for way in (1, -1):
        n = search.begin if way == 1 else search.begin - 1
        while 0 <= n < len(search.priors):
            prior = search.priors[n, 0], search.priors[n, 1]
            evidence, error = _evidence(projections, energy, shifts, noise, prior, search)
            if not evidence > most:
                break
            most, best, error_there = evidence, n, error
            if evidence < search.enough:
                return most, search.priors[best, 0], error_there
            n += way
        if best != search.begin:
            break
    return most, search.priors[best, 0], error_there


@fused
def _evidence(projections, energy, shifts, noise, prior, search):
    """Mean evidence of sounds with this prior, and the error that they leave in the median."""
    scratch, beyond = _scratch(shifts), np.empty(len(energy))
    value, explained, _ = scratch
    error, evidence = search.error, 0.0
    for _ in range(2):
        for i in range(len(energy)):
            own = noise / energy[i]
            explain(projections[i], shifts.grams, own + error, prior, value, explained)
            left = max(1.0 - greatest_of(explained), 0.0)
            beyond[i] = left / shifts.freedom - own
        error = max(centre_of(beyond, len(beyond)), search.least)
    for i in range(len(energy)):
        evidence += _posterior(projections[i], energy[i], shifts, (noise, error), prior, scratch)[3]
    return evidence / len(energy), error


@fused
def _posterior(projection, energy, shifts, floor, prior, scratch):
    """Posterior mean and deviation of the shift of a sound, residual share, log evidence.

    `floor`: the noise of a sample, and the part of s that the model's errors make; s is at least
    what is left to each of the degrees of freedom.
    """
    value, explained, between = scratch
    freedom, error = shifts.freedom, floor[0] / energy + floor[1]
    log_probabilities(projection, shifts.grams, error, prior, value, explained)
    best = value.argmax()
    left = max(1.0 - explained[best], 0.0)
    if left > error * freedom:
        error = left / freedom
        log_probabilities(projection, shifts.grams, error, prior, value, explained)
        best = value.argmax()
        left = max(1.0 - explained[best], 0.0)
    mean, deviation, evidence = _moments(value, value[best], shifts.step, between)
    return mean, deviation, left, evidence - 0.5 / error - 0.5 * freedom * math.log(error)


@fused
def _moments(value, most, step, scratch):
    """Mean, standard deviation of the shift, and ln of the sum of exp(value).

    Between two shifts a cubic through four gives the value at BETWEEN places: all between those
    that count. `scratch` has room for so many after each.
    """
    last = len(value) - 1
    low, high = 0, last
    while low < last - 1 and value[low + 1] < most - FALL:
        low += 1
    while high > low + 1 and value[high - 1] < most - FALL:
        high -= 1
    weight = scratch[: (high - low) * BETWEEN]
    begin = _NONE
    for j in range(low, high):
        a, b = value[j], value[j + 1]
        p = value[j - 1] if j else 2.0 * a - b
        q = value[j + 2] if j + 2 < len(value) else 2.0 * b - a
        line, square, cube = b - p, 2.0 * p - 5.0 * a + 4.0 * b - q, 3.0 * (a - b) + q - p
        for k in range(np.uint64(BETWEEN)):  # with numbers known beforehand, in vector lanes
            t = (k + 0.5) / BETWEEN
            weight[begin + k] = a + 0.5 * t * (line + t * (square + t * cube))
        begin += np.uint64(BETWEEN)
    top = greatest_of(weight)
    for k in range(np.uint64(len(weight))):
        weight[k] -= top
    exponentials(weight)
    mass, first, second = _sums(weight, low + 0.5 / BETWEEN - 0.5 * last)
    mean = first / mass
    # Nothing between two places is checked.
    variance = max(second / mass - mean * mean, 0.0) + 1.0 / (12.0 * BETWEEN * BETWEEN)
    return step * mean, step * math.sqrt(variance), top + math.log(mass * step / BETWEEN)


@reordered
def _sums(weight, begin):
    """Sums of weights, BETWEEN of which lie between two shifts, times powers of their places.

    Places begin at `begin`; powers are 0, 1 and 2.
    """
    total = first = second = 0.0
    for k in range(np.uint64(len(weight))):
        one, at = weight[k], begin + k * (1.0 / BETWEEN)
        total += one
        first += one * at
        second += one * at * at
    return total, first, second
