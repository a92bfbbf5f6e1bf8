"""Exact contacts with a soft stop, from touch to zero depth, for many touches."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import allocating
from ...simulation.exact.flow import COMPLETE, Leg, bounds, locate
from ...simulation.exact.gap import close, stays_open


@allocating
def flights(kappa, delta, omega, push_cos, push_sin, load, speed, lasts, leaves):
    """Duration and final velocity of contacts; inf and 0 if they do not end.

    The depth q obeys ``q'' + 2 delta q' + kappa q = push_cos cos(omega t) + push_sin sin(omega t)
    + load`` from q = 0, q' = speed > 0. All arrays have shape (contacts,). Each contact is followed
    for a thousand times the longer of the forcing's and its own period at most.
    """
    waves = np.zeros((1, 5))
    series = np.zeros(COMPLETE + 1)
    for n in range(len(speed)):
        w = omega[n]
        # In units of 1 / omega, as the engine's legs are.
        k, d = kappa[n] / w**2, delta[n] / w
        a, b, f = push_cos[n] / w**2, push_sin[n] / w**2, load[n] / w**2
        size = (k - 1) ** 2 + (2 * d) ** 2
        x_cos = ((k - 1) * a - 2 * d * b) / size
        x_sin = ((k - 1) * b + 2 * d * a) / size
        difference = (math.sqrt(k) - d) * (math.sqrt(k) + d)
        root = math.sqrt(abs(difference))
        reach = math.hypot(x_cos, x_sin)
        v = speed[n] / w
        waves[0, 0] = 1.0
        waves[0, 1], waves[0, 2], waves[0, 3], waves[0, 4] = x_cos, x_sin, a, b
        series[0], series[1] = 0.0, v
        series[2] = (f + a - 2 * d * v) / 2
        series[3] = (b - 4 * d * series[2] - k * v) / 6
        series[COMPLETE] = 0.0
        leg = Leg(
            k, d, root, math.copysign(1.0, difference) if difference != 0 else 0.0, f / k, 0.0,
            max(1.0, d + root), reach, reach, -f / k - x_cos, v - x_sin, waves, series,
        )  # fmt: skip
        end = 1000 * 2 * math.pi * max(1.0, 1 / math.sqrt(k))
        tau, out = flight(leg, end)
        lasts[n], leaves[n] = tau / w, out * w


@allocating
def flight(leg, end):
    """Time at which the depth of a leg returns to zero, and the velocity there."""
    tau, x, v = 0.0, 0.0, leg.series[1]
    a, jerk = 2 * leg.series[2], 6 * leg.series[3]
    b = -2 * leg.delta * leg.w - leg.kappa * leg.z
    most, third = bounds(leg, b, -2 * leg.delta * b - leg.kappa * leg.w)
    while tau < end:
        if v < 0:
            high = -2 * x / v
            turn = max(a + third * high / 2, 0.0)
            if 2 * turn * x <= v * v:
                tau, _x, v = close(leg, tau, (1.0, 0.0, 0.0), x, v, a, jerk, x, v, high, third)
                return tau, v
        step = stays_open(x, v, a, most, third, most, 0.0, third, 0.0)
        tau += max(step, 2e-16 * max(tau, 1e-3))
        x, v, a, jerk, b, b1 = locate(leg, tau)
        if x <= 0.0:  # by rounding, at the very end
            return tau, v
        if b == b:
            most, third = bounds(leg, b, b1)
    return math.inf, 0.0
