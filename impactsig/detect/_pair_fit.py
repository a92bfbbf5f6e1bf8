"""Two half-sines that overlap, to be fitted together.

    f(t) = sum over both of A sin(pi (t - t0) / T)        t0 <= t < t0 + T

Each has its own height, start and length; a weak prior keeps the lengths alike.
"""

from __future__ import annotations

import math

import numpy as np

from .._compiled import njit

PAIR = 6  # A, t0, ln T of the first, then of the second
ALIKE_SD = 0.25  # of the logarithm of the second length over the first
SHARES = np.array(
    [0.4, 0.45, 0.5, 0.55, 0.6, 0.66, 0.72]
)  # of both that one lasts: where a fit begins


@njit(nogil=True)
def begin_pair(points, x, first, last, p):
    """The best of several pairs from first to last touch that the two have together, into `p`."""
    best = np.inf
    for share in SHARES:
        length = share * (last - first)
        second = last - length
        aa = ab = bb = ax = bx = xx = 0.0
        for k in range(len(points)):
            a = _half_sine_at(points[k] - first, length)
            b = _half_sine_at(points[k] - second, length)
            aa += a * a
            ab += a * b
            bb += b * b
            ax += a * x[k]
            bx += b * x[k]
            xx += x[k] * x[k]
        determinant = aa * bb - ab * ab
        if determinant <= 1e-6 * aa * bb:
            continue
        one = (ax * bb - bx * ab) / determinant
        other = (bx * aa - ax * ab) / determinant
        misfit = xx - one * ax - other * bx
        if one > 0.0 and other > 0.0 and misfit < best:
            best = misfit
            p[0], p[1], p[2] = one, first, math.log(length)
            p[3], p[4], p[5] = other, second, math.log(length)
    return best < np.inf


@njit(nogil=True)
def _half_sine_at(u, length):
    return math.sin(math.pi * u / length) if 0.0 < u < length else 0.0


@njit(nogil=True)
def pair_cost(p, points, x, normal):
    """Misfit, and with the prior the cost, at `p`; J^T J and J^T e go into `normal`."""
    normal[:] = 0.0
    misfit = 0.0
    slope = np.zeros(PAIR)
    for k in range(len(points)):
        e = x[k]
        inside = False
        for m in (0, 3):
            length = math.exp(p[m + 2])
            u = points[k] - p[m + 1]
            if not 0.0 < u < length:
                slope[m] = slope[m + 1] = slope[m + 2] = 0.0
                continue
            inside = True
            angle = math.pi * u / length
            slope[m] = math.sin(angle)
            slope[m + 1] = -p[m] * math.cos(angle) * math.pi / length
            slope[m + 2] = -p[m] * math.cos(angle) * angle
            e -= p[m] * slope[m]
        misfit += e * e
        if inside:
            for i in range(PAIR):
                for j in range(i + 1):
                    normal[i, j] += slope[i] * slope[j]
                normal[i, -1] += slope[i] * e
    unlike = (p[5] - p[2]) / ALIKE_SD
    weight = 1.0 / ALIKE_SD**2
    normal[2, 2] += weight
    normal[5, 5] += weight
    normal[5, 2] -= weight
    normal[2, -1] += unlike / ALIKE_SD
    normal[5, -1] -= unlike / ALIKE_SD
    return misfit, misfit + unlike * unlike
