"""Kernels for the variational equation over a step of the stepping engine.

``x'' = a_q x + a_v x'`` by the same stages: the columns are the derivative of the step as it is
taken; it must fulfil the tolerance for them too, because a direction that the motion has left still
contracts. Derivatives of a force of the user's are central differences, good to about 1e-10.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import kernel
from ...oscillators.laws import BY_APPROACH, EXPONENT, HERTZ, LAW, LOSS, PLACE, SIDE, STIFFNESS
from ...simulation.basis.events import V
from ...simulation.stepping.rates import PUSHING, approach_loss, status

# What `motion` holds: position and velocity, step to try next, greatest speed; then for each stop
# the approach velocity of its last contact, and what that gains by either column.
WISHED, SWIFT, STOPS = range(V + 1, V + 4)
SMALL = 6e-6  # of a quantity, to difference a function by: the cube root of rounding


@kernel
def pull_slopes(p, f, leg, mode, motion, tau, y, v, by_approach):
    """Derivatives of the acceleration by position and velocity, and by the approach velocities."""
    of_q, of_v = -leg.kappa, -leg.damping
    count = len(p.stops)
    for k in range(count):
        by_approach[k] = 0.0
        if p.stops[k, LAW] != HERTZ or status(p, mode, k) != PUSHING:
            continue
        side, n, stiffness = p.stops[k, SIDE], p.stops[k, EXPONENT], p.stops[k, STIFFNESS]
        depth = side * (y - (p.stops[k, PLACE] - leg.origin))
        if depth <= 0:
            continue
        loss, touched = p.stops[k, LOSS], motion[STOPS + k]
        own = p.stops[k, BY_APPROACH] >= 0
        if own:
            loss = approach_loss(p.stops[k, BY_APPROACH], touched)
        power = stiffness * depth**n
        of_q -= n * power / depth * (1 + loss * side * v)
        of_v -= power * loss
        if own and touched > 0:
            by_approach[k] = power * v * loss / touched
    if leg.forced:
        x, u = y + leg.origin, v
        if leg.base_amplitude != 0.0:
            angle = leg.base_angle + leg.base_ratio * tau
            x += leg.base_amplitude * math.cos(angle)
            u -= leg.base_amplitude * leg.base_ratio * math.sin(angle)
        t = (leg.elapsed + tau) / leg.omega
        rate = max(1.0, math.sqrt(abs(of_q)))
        h = SMALL * max(abs(x) + abs(u) / rate, 1e-12)
        of_q += (f.law(t, x + h, u * leg.omega) - f.law(t, x - h, u * leg.omega)) / (
            2 * h * leg.inertia
        )
        g = SMALL * max(abs(x) * rate + abs(u), 1e-12)
        of_v += (f.law(t, x, (u + g) * leg.omega) - f.law(t, x, (u - g) * leg.omega)) / (
            2 * g * leg.inertia
        )
    return of_q, of_v


@kernel
def vary(p, tab, f, s, leg, mode, motion, h, y, columns, new, slopes, by_approach):
    """Advance the columns over the step just taken, whose stages are in `s`, into `new`.

    Returns the mean divergence over the step, and the error in units of the tolerance.
    """
    count = len(p.stops)
    trace = 0.0
    for i in range(13):
        x = 0.0
        for j in range(i):
            x += tab.a[i, j] * s.kq[j]
        of_q, of_v = pull_slopes(
            p, f, leg, mode, motion, tab.c[i] * h, y + h * x, s.kq[i], by_approach
        )
        if i < 12:
            trace += tab.a[12, i] * of_v
        for j in range(2):
            dq = dv = 0.0
            for m in range(i):
                weight = tab.a[i, m]
                dq += weight * slopes[m, j]
                dv += weight * slopes[m, 2 + j]
            dq, dv = columns[0, j] + h * dq, columns[1, j] + h * dv
            if i == 12:
                new[0, j], new[1, j] = dq, dv
            slope = of_q * dq + of_v * dv
            for k in range(count):
                if by_approach[k] != 0.0:
                    slope += by_approach[k] * motion[STOPS + count + 2 * k + j]
                    trace = math.nan  # the determinant is not that of a flow
            slopes[i, j], slopes[i, 2 + j] = dv, slope
    worst = 0.0
    for j in range(2):
        third = fifth = 0.0
        for part, rate in ((j, leg.rate), (2 + j, 1.0)):
            e3 = e5 = 0.0
            for i in range(13):
                e3 += tab.errors[0, i] * slopes[i, part]
                e5 += tab.errors[1, i] * slopes[i, part]
            third, fifth = third + (rate * e3) ** 2, fifth + (rate * e5) ** 2
        size = math.hypot(leg.rate * columns[0, j], columns[1, j])
        if fifth > 0:
            worst = max(worst, h * fifth / math.sqrt(fifth + 0.01 * third) / size)
    return trace, worst / max(p.tolerance, 1e-12)
