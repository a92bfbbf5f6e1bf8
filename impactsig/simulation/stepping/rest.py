"""A mass at rest: the forces that hold it, for how long, and its departure."""

from __future__ import annotations

import math

from ..._compiling.compiled import kernel
from ...oscillators.laws import LAW, PLACE, RIGID, SIDE
from ..basis.events import TURN
from .rates import jerk, pull


@kernel
def rigid_at(p, leg, y):
    """The rigid stop that the mass is at, or -1."""
    for k in range(len(p.stops)):
        if p.stops[k, LAW] == RIGID and y == p.stops[k, PLACE] - leg.origin:
            return k
    return -1


@kernel
def holding(p, k):
    """The forces that friction and the rigid stop k (-1: none) hold."""
    low = -math.inf if k >= 0 and p.stops[k, SIDE] < 0 else -p.static
    high = math.inf if k >= 0 and p.stops[k, SIDE] > 0 else p.static
    return low, high


@kernel
def departure(p, f, leg, s, y, k):
    """Direction in which a mass at rest leaves (0: none, 2: NaN), and whether from balance."""
    low, high = holding(p, k)
    force = pull(f, leg, s, 0.0, y, 0.0)
    if not math.isfinite(force):
        return 2, False
    even = p.static == p.kinetic
    if force == low and jerk(p, f, leg, s, y) < 0:
        return -1, even
    if force == high and jerk(p, f, leg, s, y) > 0:
        return 1, even
    if low <= force <= high:
        return 0, False
    return 1 if force > high else -1, False


@kernel
def unstick(p, f, leg, s, y, low, high, end):
    """Time until the force on a mass that rests leaves [low, high], or `end` if that is sooner.

    Returns it with the direction in which the mass goes, 0 if it stays, 2 if the law is no number.
    Without a law no root can be jumped, as the second derivative of the forcing is bounded; with
    one, or under control, the force is looked at 64 times in the period of the fastest forcing.
    """
    looks = p.forced or f.control is not None
    reach, most = 0.0, 0.0
    for j in range(len(p.waves)):
        reach += abs(p.waves[j, 1])
        most += abs(p.waves[j, 1]) * p.waves[j, 0] ** 2
    tau, before = 0.0, 0.0
    if not looks:
        mean = leg.constant - leg.kappa * y
        for i in range(leg.hertz):
            depth = max(s.hertz[i, 0] * (y - s.hertz[i, 1]), 0.0)
            mean -= s.hertz[i, 0] * s.hertz[i, 2] * depth ** s.hertz[i, 3]
        if low <= mean - reach and mean + reach <= high:
            return end, 0
    for _ in range(10000):
        force = pull(f, leg, s, tau, y, 0.0)
        if not math.isfinite(force):
            return tau, 2
        rate = 0.0
        for j in range(len(p.waves)):
            rate -= p.waves[j, 0] * p.waves[j, 1] * math.sin(s.waves[j, 2] + p.waves[j, 0] * tau)
        out = 1 if force > high or (force == high and rate > 0 and not looks) else 0
        if force < low or (force == low and rate < 0 and not looks):
            out = -1
        if out != 0 and looks and tau > before:
            for _ in range(100):
                middle = (before + tau) / 2
                if not before < middle < tau:
                    break
                force = pull(f, leg, s, middle, y, 0.0)
                if low <= force <= high:
                    before = middle
                else:
                    tau = middle
        if out != 0:
            return tau, out
        if tau >= end:
            return end, 0
        if looks:
            before = tau
            tau = min(tau + TURN / 64 / p.fastest, end)
            continue
        step = math.inf
        if most > 0:
            if high < math.inf:
                step = min(step, clear(high - force, -rate, most))
            if low > -math.inf:
                step = min(step, clear(force - low, rate, most))
        tau = min(tau + max(step, 2e-16 * max(tau, 1e-3)), end)
    return min(tau, end), 0


@kernel
def clear(gap, slope, most):
    """Time in which a gap stays open for certain, as |gap''| <= most."""
    root = math.sqrt(slope * slope + 2 * most * gap)
    return 2 * gap / (root - slope) if slope < 0 else (slope + root) / most
