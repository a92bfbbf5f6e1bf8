"""One half-sine fitted to the samples around a crest: what most impacts nearly are.

It tells an impact that is clearly one from what may be two in a fraction of the time that the fits
of both take.
"""

from __future__ import annotations

import math

import numpy as np

from .._compiled import njit
from ._small_matrices import factor, solve

FOOT = 0.12  # of the height: what the feet of a pulse lie below
HALF_SINE_FOOT = 0.924  # of its length a half-sine is above FOOT of its height
STEPS = 3  # of the fit, at most
LARGEST = 0.3  # of its length: how far a step moves either end


@njit(nogil=True)
def is_half_sine(means, left, right, roughly, closely):
    """Whether a half-sine leaves little of the means, in squares of their unit.

    Parameters
    ----------
    means : array (n,)
        Of the samples above the baseline.
    left, right : float
        The feet of the pulse, in places of the means.
    roughly : float
        Sum of squares that the half-sine between the feet may leave,
    closely : float
        and that which the fitted one may.
    """
    length = (right - left) / HALF_SINE_FOOT
    start = 0.5 * (left + right - length)
    square = cross = total = 0.0
    for k in range(len(means)):
        u = (k - start) / length
        total += means[k] * means[k]
        if 0.0 < u < 1.0:
            s = math.sin(math.pi * u)
            square += s * s
            cross += s * means[k]
    if (total - cross * cross / square if square > 0.0 else total) < roughly:
        return True
    if square <= 0.0 or cross <= 0.0:
        return False
    height = cross / square
    normal, step = np.empty((3, 3)), np.empty(3)
    rest = _normal_equations(means, height, start, length, normal, step)
    for _ in range(STEPS):
        if not factor(normal):
            return False
        solve(normal, step)
        height += step[0]
        start += min(max(step[1], -LARGEST * length), LARGEST * length)
        length += min(max(step[2], -LARGEST * length), LARGEST * length)
        before = rest
        rest = _normal_equations(means, height, start, length, normal, step)
        if rest < closely:
            return True
        if rest > 0.9 * before:
            return False
    return False


@njit(nogil=True)
def _normal_equations(means, height, start, length, normal, right):
    """Sum of squares that a half-sine leaves; normal equations by height, start and length."""
    normal[:] = 0.0
    right[:] = 0.0
    rest = 0.0
    pace = math.pi / length
    for k in range(len(means)):
        u, e = k - start, means[k]
        if 0.0 < u < length:
            s, slope = math.sin(pace * u), -height * pace * math.cos(pace * u)
            e -= height * s
            by_length = slope * u / length
            normal[0, 0] += s * s
            normal[1, 0] += slope * s
            normal[1, 1] += slope * slope
            normal[2, 0] += by_length * s
            normal[2, 1] += by_length * slope
            normal[2, 2] += by_length * by_length
            right[0] += e * s
            right[1] += e * slope
            right[2] += e * by_length
        rest += e * e
    return rest
