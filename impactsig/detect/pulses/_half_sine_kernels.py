"""Fit of one half-sine to the samples around a crest, which suits most impacts.

It tells an impact that is clearly one from what may be two in a fraction of the time that the fits
of both take.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ._small_matrices import factor, solve

FOOT = 0.12  # of the height: what the feet of a pulse lie below
HALF_SINE_FOOT = 0.924  # of its length a half-sine is above FOOT of its height
STEPS = 3  # of the fit, at most
LARGEST = 0.3  # of its length: how far a step moves either end


class _Sums(NamedTuple):
    """Sums of products: of sine, cosine, that times the distance from the start, and the means."""

    ss: float
    sc: float
    su: float
    cc: float
    cu: float
    uu: float
    se: float
    ce: float
    ue: float


@allocating
def is_half_sine(means, left, right, roughly, closely):
    """Whether a half-sine fits the means closely.

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
    total = 0.0
    for k in range(len(means)):
        total += means[k] * means[k]
    sums = _sums(means, start, length)
    square, cross = sums.ss, sums.se
    if (total - cross * cross / square if square > 0.0 else total) < roughly:
        return True
    if square <= 0.0 or cross <= 0.0:
        return False
    height = cross / square
    normal, step = np.empty((3, 3)), np.empty(3)
    rest = total - height * (2.0 * cross - height * square)
    for _ in range(STEPS):
        _normal_equations(sums, height, length, normal, step)
        if not factor(normal):
            return False
        solve(normal, step)
        height += step[0]
        start += min(max(step[1], -LARGEST * length), LARGEST * length)
        length += min(max(step[2], -LARGEST * length), LARGEST * length)
        before = rest
        sums = _sums(means, start, length)
        rest = total - height * (2.0 * sums.se - height * sums.ss)
        if rest < closely:
            return True
        if rest > 0.9 * before:
            return False
    return False


@kernel
def _sums(means, start, length):
    """Sums over the points within a half-sine, by recurrence."""
    pace = math.pi / length
    first = max(math.floor(start) + 1, 0)
    last = min(math.ceil(start + length), len(means))
    ss = sc = su = cc = cu = uu = se = ce = ue = 0.0
    if last > first:
        angle = pace * (first - start)
        s, c = math.sin(angle), math.cos(angle)
        turn_s, turn_c = math.sin(pace), math.cos(pace)
        for k in range(first, last):
            e, at = means[k], c * (k - start)
            ss += s * s
            sc += s * c
            su += s * at
            cc += c * c
            cu += c * at
            uu += at * at
            se += s * e
            ce += c * e
            ue += at * e
            s, c = s * turn_c + c * turn_s, c * turn_c - s * turn_s
    return _Sums(ss, sc, su, cc, cu, uu, se, ce, ue)


@kernel
def _normal_equations(sums, height, length, normal, right):
    """Normal equations of height, start and length of a half-sine."""
    by_start = -height * math.pi / length  # times the cosine
    by_length = by_start / length  # times that and the distance from the start
    normal[0, 0] = sums.ss
    normal[1, 0], normal[1, 1] = by_start * sums.sc, by_start * by_start * sums.cc
    normal[2, 0], normal[2, 1] = by_length * sums.su, by_start * by_length * sums.cu
    normal[2, 2] = by_length * by_length * sums.uu
    right[0] = sums.se - height * sums.ss
    right[1] = by_start * (sums.ce - height * sums.sc)
    right[2] = by_length * (sums.ue - height * sums.su)
