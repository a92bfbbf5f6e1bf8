"""Joint fit of two half-sines that overlap.

    f(t) = sum over both of A sin(pi (t - t0) / T)        t0 <= t < t0 + T

Each has its own height, start and length; a weak prior keeps the lengths alike.
"""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import kernel

PAIR = 6  # A, t0, ln T of the first, then of the second
ALIKE_SD = 0.25  # of the logarithm of the second length over the first
SHARES = np.array(
    [0.4, 0.45, 0.5, 0.55, 0.6, 0.66, 0.72]
)  # of both that one lasts: where a fit begins


@kernel
def begin_pair(points, x, first, last, p):
    """Initial guess of a pair between first and last touch, into `p`."""
    best = np.inf
    per = points[1] - points[0]
    for share in SHARES:
        length = share * (last - first)
        second = last - length
        pace = math.pi / length
        turn_s, turn_c = math.sin(pace * per), math.cos(pace * per)
        early, late = pace * (points[0] - first), pace * (points[0] - second)
        s, c, z, w = math.sin(early), math.cos(early), math.sin(late), math.cos(late)
        aa = ab = bb = ax = bx = xx = 0.0
        for k in range(len(points)):
            a = s if 0.0 < points[k] - first < length else 0.0
            b = z if 0.0 < points[k] - second < length else 0.0
            s, c = s * turn_c + c * turn_s, c * turn_c - s * turn_s
            z, w = z * turn_c + w * turn_s, w * turn_c - z * turn_s
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


@kernel
def pair_cost(p, points, x, normal):
    """Misfit and cost with the prior at `p`; writes the normal equations into `normal`."""
    for i in range(PAIR):
        for j in range(normal.shape[1]):
            normal[i, j] = 0.0
    misfit = 0.0
    first, second = math.exp(p[2]), math.exp(p[5])
    per = points[1] - points[0]
    # Sines and cosines of points at equal distances, each from the one before.
    one, other = math.pi / first, math.pi / second
    one_s, one_c = math.sin(one * per), math.cos(one * per)
    other_s, other_c = math.sin(other * per), math.cos(other * per)
    early, late = one * (points[0] - p[1]), other * (points[0] - p[4])
    s, c, z, w = math.sin(early), math.cos(early), math.sin(late), math.cos(late)
    for k in range(len(points)):
        e = x[k]
        u, v = points[k] - p[1], points[k] - p[4]
        in_first, in_second = 0.0 < u < first, 0.0 < v < second
        f = f_start = f_log = g = g_start = g_log = 0.0
        if in_first:
            f, f_start = s, -p[0] * one * c
            f_log = f_start * u
            e -= p[0] * f
        if in_second:
            g, g_start = z, -p[3] * other * w
            g_log = g_start * v
            e -= p[3] * g
        s, c = s * one_c + c * one_s, c * one_c - s * one_s
        z, w = z * other_c + w * other_s, w * other_c - z * other_s
        misfit += e * e
        if in_first:
            _add(normal, 0, f, f_start, f_log, e)
        if in_second:
            _add(normal, 3, g, g_start, g_log, e)
        if in_first and in_second:
            normal[3, 0] += g * f
            normal[3, 1] += g * f_start
            normal[3, 2] += g * f_log
            normal[4, 0] += g_start * f
            normal[4, 1] += g_start * f_start
            normal[4, 2] += g_start * f_log
            normal[5, 0] += g_log * f
            normal[5, 1] += g_log * f_start
            normal[5, 2] += g_log * f_log
    unlike = (p[5] - p[2]) / ALIKE_SD
    weight = 1.0 / ALIKE_SD**2
    normal[2, 2] += weight
    normal[5, 5] += weight
    normal[5, 2] -= weight
    normal[2, -1] += unlike / ALIKE_SD
    normal[5, -1] -= unlike / ALIKE_SD
    return misfit, misfit + unlike * unlike


@kernel
def _add(normal, at, f, start, log, e):
    """Add a point to the normal equations of the pulse whose first parameter is `at`."""
    normal[at, at] += f * f
    normal[at + 1, at] += start * f
    normal[at + 1, at + 1] += start * start
    normal[at + 2, at] += log * f
    normal[at + 2, at + 1] += log * start
    normal[at + 2, at + 2] += log * log
    normal[at, -1] += f * e
    normal[at + 1, -1] += start * e
    normal[at + 2, -1] += log * e
