"""A pulse fitted, by maximum a posteriori least squares, with a rise, a flat top and a fall.

Both edges are quarter-sines raised to a common power q:

    f(t) = A sin^q(pi/2 (t - t0)/r)            t0 <= t < t0 + r
           A                                   r <= t - t0 < r + p
           A cos^q(pi/2 (t - t0 - r - p)/d)    r + p <= t - t0 < r + p + d

Half-sines, skewed and flat-topped pulses and Hertzian contacts are (nearly) members; weak priors
on length, symmetry, flatness and q keep the noise of faint pulses from being read as shape.
"""

from __future__ import annotations

import math

import numpy as np

from .._compiled import njit

PARAMETERS = 6  # A, t0, ln r, ln p, ln d, ln q
SKEW_SD, FLAT_SD, FLAT_MEAN, POWER_SD = 0.3, 1.0, -2.0, 0.15
LENGTH_SD = 0.7  # of the logarithm of the edges, about the pulses the detector is matched to


@njit(nogil=True)
def fit_pulse(points, x, log_edge, p):
    """Levenberg-Marquardt from `p`, in place; returns the residual variance over the noise's.

    x and p[0] are in units of the noise; log_edge is the logarithm of a typical edge's length.
    """
    here = np.empty((PARAMETERS, PARAMETERS + 1))
    there = np.empty((PARAMETERS, PARAMETERS + 1))
    low = np.empty((PARAMETERS, PARAMETERS))
    step, trial = np.empty(PARAMETERS), np.empty(PARAMETERS)
    misfit, cost = _model(p, points, x, log_edge, here)
    damping = 1e-2
    for _ in range(25):
        if not _solve(here, damping, low, step):
            damping = 10.0 * damping + 1e-6
            continue
        for i in range(PARAMETERS):
            # Logarithms move by at most a factor of e a step, so no exponential overflows.
            trial[i] = p[i] + (step[i] if i < 2 else min(max(step[i], -1.0), 1.0))
        new_misfit, new_cost = _model(trial, points, x, log_edge, there)
        if new_cost < cost:
            gain = cost - new_cost
            for i in range(PARAMETERS):
                p[i] = trial[i]
            here, there = there, here
            misfit, cost = new_misfit, new_cost
            damping *= 0.1
            if gain < 1e-2:
                break
        else:
            damping = 10.0 * damping + 1e-6
            if damping > 1e6:
                break
    return misfit / len(points)


@njit(nogil=True)
def _model(p, points, x, log_edge, normal):
    """Misfit, and with the priors the cost, at `p`; J^T J and J^T e go into `normal` (6 x 7).

    Samples and amplitude are in units of the noise. Only the lower triangle of J^T J is filled.
    """
    amplitude, t0 = p[0], p[1]
    r, flat, d, q = math.exp(p[2]), math.exp(p[3]), math.exp(p[4]), math.exp(p[5])
    top, end = r + flat, r + flat + d
    rise, fall = 0.5 * math.pi / r, 0.5 * math.pi / d
    for i in range(PARAMETERS):
        for j in range(PARAMETERS + 1):
            normal[i, j] = 0.0
    misfit = 0.0
    for k in range(len(points)):
        u = points[k] - t0
        if u <= 0.0 or u >= end:
            misfit += x[k] * x[k]
            continue
        j0, j1, j2, j3, j4, j5 = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if u < r:
            angle = rise * u
            s = max(math.sin(angle), 1e-3)
            log_s = math.log(s)
            j0 = math.exp(q * log_s)
            slope = amplitude * j0 * q * math.cos(angle) / s
            j1, j2, j5 = -slope * rise, -slope * angle, amplitude * j0 * q * log_s
        elif u >= top:
            angle = fall * (u - top)
            c = max(math.cos(angle), 1e-3)
            log_c = math.log(c)
            j0 = math.exp(q * log_c)
            j1 = amplitude * j0 * q * math.sin(angle) / c * fall
            j2, j3, j4, j5 = j1 * r, j1 * flat, j1 * (u - top), amplitude * j0 * q * log_c
        e = x[k] - amplitude * j0
        misfit += e * e
        # Written out, and without what is 0 on the rise: a loop over all takes a twentieth longer.
        normal[0, 0] += j0 * j0
        normal[1, 0] += j1 * j0
        normal[1, 1] += j1 * j1
        normal[2, 0] += j2 * j0
        normal[2, 1] += j2 * j1
        normal[2, 2] += j2 * j2
        normal[5, 0] += j5 * j0
        normal[5, 1] += j5 * j1
        normal[5, 2] += j5 * j2
        normal[5, 5] += j5 * j5
        normal[0, 6] += j0 * e
        normal[1, 6] += j1 * e
        normal[2, 6] += j2 * e
        normal[5, 6] += j5 * e
        if u >= top:
            normal[3, 0] += j3 * j0
            normal[3, 1] += j3 * j1
            normal[3, 2] += j3 * j2
            normal[3, 3] += j3 * j3
            normal[4, 0] += j4 * j0
            normal[4, 1] += j4 * j1
            normal[4, 2] += j4 * j2
            normal[4, 3] += j4 * j3
            normal[4, 4] += j4 * j4
            normal[5, 3] += j5 * j3
            normal[5, 4] += j5 * j4
            normal[3, 6] += j3 * e
            normal[4, 6] += j4 * e
    skew = (p[2] - p[4]) / SKEW_SD
    flatness = (p[3] - 0.5 * (p[2] + p[4]) - FLAT_MEAN) / FLAT_SD
    power = p[5] / POWER_SD
    length = (0.5 * (p[2] + p[4]) - log_edge) / LENGTH_SD
    a, b = 1.0 / SKEW_SD**2, 1.0 / FLAT_SD**2
    c = 0.25 / LENGTH_SD**2
    normal[2, 2] += a + 0.25 * b + c
    normal[4, 4] += a + 0.25 * b + c
    normal[4, 2] += -a + 0.25 * b + c
    normal[3, 3] += b
    normal[3, 2] -= 0.5 * b
    normal[4, 3] -= 0.5 * b
    normal[5, 5] += 1.0 / POWER_SD**2
    normal[2, 6] -= skew / SKEW_SD - 0.5 * flatness / FLAT_SD + 0.5 * length / LENGTH_SD
    normal[4, 6] -= -skew / SKEW_SD - 0.5 * flatness / FLAT_SD + 0.5 * length / LENGTH_SD
    normal[3, 6] -= flatness / FLAT_SD
    normal[5, 6] -= power / POWER_SD
    priors = skew * skew + flatness * flatness + power * power + length * length
    return misfit, misfit + priors


@njit(nogil=True)
def _solve(normal, damping, low, step):
    """Cholesky solution of (N + damping diag N) step = g; False if it is not definite."""
    for i in range(PARAMETERS):
        for j in range(i + 1):
            total = normal[i, j]
            if i == j:
                total = total * (1.0 + damping) + 1e-12
            for k in range(j):
                total -= low[i, k] * low[j, k]
            if i == j:
                if total <= 0.0:
                    return False
                low[i, i] = math.sqrt(total)
            else:
                low[i, j] = total / low[j, j]
    for i in range(PARAMETERS):
        total = normal[i, PARAMETERS]
        for k in range(i):
            total -= low[i, k] * step[k]
        step[i] = total / low[i, i]
    for i in range(PARAMETERS - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, PARAMETERS):
            total -= low[k, i] * step[k]
        step[i] = total / low[i, i]
    return True
