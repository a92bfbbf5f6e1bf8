"""Slow, readable twins: what the fast code must agree with."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, sqrt

import numpy as np

# The beam of Karpodinis' thesis. Its table of damping and forcing is not in the text that is left:
# DAMPING and AMPLITUDE are our choice; the natural frequency and the restitution are the thesis'.
NATURAL_FREQUENCY = 22.2  # [Hz]
RESTITUTION = 0.2
DAMPING = 0.03
AMPLITUDE = 0.25


def frequency_ratio(frequency):
    """Forcing frequency [Hz] -> omega of the dimensionless beam."""
    return frequency / NATURAL_FREQUENCY


def seconds(dimensionless_time):
    """Time in units of 1/omega_n -> [s]."""
    return np.asarray(dimensionless_time) / (2 * pi * NATURAL_FREQUENCY)


def rk4_step(t, x, v, h, omega, damping=DAMPING, amplitude=AMPLITUDE):
    """One classical Runge-Kutta step of x'' + 2 damping x' + x = amplitude cos(omega t)."""
    two_damping = 2 * damping
    middle = amplitude * cos(omega * (t + h / 2))
    a1 = amplitude * cos(omega * t) - two_damping * v - x
    v2 = v + h / 2 * a1
    a2 = middle - two_damping * v2 - (x + h / 2 * v)
    v3 = v + h / 2 * a2
    a3 = middle - two_damping * v3 - (x + h / 2 * v2)
    v4 = v + h * a3
    a4 = amplitude * cos(omega * (t + h)) - two_damping * v4 - (x + h * v3)
    return x + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def integrate_impacts(
    omega,
    periods,
    *,
    steps=300,
    damping=DAMPING,
    amplitude=AMPLITUDE,
    restitution=RESTITUTION,
    state=(0.0, 0.0, 0.0),
    most=None,
):
    """Impacts on a stop at x = 1, integrated as the thesis did.

    RK4 with a fixed step of 1/`steps` period; a step that would end beyond the stop is taken back
    and halved until it cannot be halved further; then x' -> -restitution x'. A visit to the stop
    shorter than a step is missed, as it was in the thesis (its depth is below h^2/8).

    `state` is (t, x, x') to start from. Returns the dimensionless instants and approach velocities
    of the impacts in the next `periods` forcing periods (or of the first `most`), and the final
    state.
    """
    # At the stop x'' = amplitude cos - 1 - 2 damping x' < 0 for x' >= 0: the forcing alone cannot
    # press the mass to the stop, so there is neither chatter nor sticking to care for.
    assert amplitude < 1
    h = 2 * pi / omega / steps
    t, x, v = state
    end = t + periods * steps * h
    instants, speeds = [], []
    while t < end and (most is None or len(instants) < most):
        x_next, v_next = rk4_step(t, x, v, h, omega, damping, amplitude)
        if x_next < 1:
            t, x, v = t + h, x_next, v_next
            continue
        part = h
        while part > 1e-15:
            part /= 2
            x_next, v_next = rk4_step(t, x, v, part, omega, damping, amplitude)
            if x_next < 1:
                t, x, v = t + part, x_next, v_next
        instants.append(t)
        speeds.append(v)
        x, v = 1.0, -restitution * v
    return np.array(instants), np.array(speeds), (t, x, v)


def one_impact_orbit(omega, *, n=1, damping=DAMPING, amplitude=AMPLITUDE, restitution=RESTITUTION):
    """Approach velocity of the orbit with one impact in n forcing periods, in closed form.

    Shaw & Holmes (1983): between impacts the motion is the forced response plus a decaying free
    one; that x = 1 at both ends of T = 2 pi n / omega and x' is reset between them leaves a
    quadratic for the approach velocity V, of which the greater root is the stable orbit.
    """
    period = 2 * pi * n / omega
    damped = sqrt(1 - damping**2)
    decay = np.exp(-damping * period)
    c, s = cos(damped * period), np.sin(damped * period)
    delta = 1 - 2 * decay * c + decay**2
    alpha = (1 + restitution) * decay * s / (damped * delta)
    gamma = (
        -restitution + (1 + restitution) * (1 - decay * c - damping * decay * s / damped) / delta
    )
    forced = amplitude**2 / ((1 - omega**2) ** 2 + (2 * damping * omega) ** 2)
    return max(np.roots([alpha**2 + (gamma / omega) ** 2, 2 * alpha, 1 - forced]))


def cv2(intervals):
    """Holt et al. (1996): mean of twice the difference over the sum of neighbouring intervals."""
    pairs = [2 * abs(b - a) / (b + a) for a, b in pairwise(intervals)]
    return sum(pairs) / len(pairs)


def local_variation(intervals):
    """Shinomoto et al. (2003)."""
    pairs = [3 * ((a - b) / (a + b)) ** 2 for a, b in pairwise(intervals)]
    return sum(pairs) / len(pairs)


def leave_one_out_score(values, edges):
    """Integral of the squared histogram density less twice its mean where each value was left out.

    This is what Rudemo's formula abbreviates: an estimate, up to a constant, of the integrated
    squared error.
    """
    n, width = len(values), edges[1] - edges[0]
    count = np.histogram(values, edges)[0]
    squared = sum((c / (n * width)) ** 2 * width for c in count)
    left_out = sum(c * (c - 1) / ((n - 1) * width) for c in count) / n
    return squared - 2 * left_out


def slot_hits(cycles, fold, centres, reach, gaps=()):
    """Hits and instants due of each slot, going from instant to instant through the run."""
    hits, due = [0] * len(centres), [0] * len(centres)
    first, last = min(cycles), max(cycles)
    for k, centre in enumerate(centres):
        turn = int(np.floor((first - centre) / fold)) - 1
        while centre + turn * fold <= last + reach:
            instant = centre + turn * fold
            turn += 1
            if instant < first - reach or any(low < instant <= high for low, high in gaps):
                continue
            due[k] += 1
            hits[k] += any(abs(u - instant) <= reach for u in cycles)
    return hits, due


def slot_score(fit, span, floor):
    """Log-likelihood of hits, misses and other impacts of slots, less a penalty by parameter."""
    count, slots = fit.impacts, len(fit.centre)
    hits, due = sum(fit.hits), sum(fit.due)
    others = count - hits
    width = max(fit.jitter, floor)
    score = -hits * np.log(width * np.sqrt(2 * np.pi)) - hits * fit.jitter**2 / (2 * width**2)
    score += hits * np.log(hits / due)
    if due > hits:
        score += (due - hits) * np.log(1 - hits / due)
    if others:
        rate = others / span
        score += others * np.log(rate) - rate * span
    score -= slots * 2 * np.log(count) + 3 * np.log(count) / 2
    # Slots apart by less than the floor would gain this much by their number alone.
    return score - hits / 2 * (floor / width) ** 2 * (slots - 1) / slots


def outside_dead_time(time, dead_time):
    """The instants that are counted: each more than the dead time after the one counted before."""
    counted = []
    for instant in time:
        if not dead_time or not counted or instant > counted[-1] + dead_time:
            counted.append(instant)
    return counted


def greatest_difference(x, y):
    """Kolmogorov-Smirnov: over every value, the shares of both samples up to it compared."""
    return max(
        abs(sum(u <= value for u in x) / len(x) - sum(u <= value for u in y) / len(y))
        for value in (*x, *y)
    )


def area_between(x, y):
    """Wasserstein: the area between the cumulative distributions of two samples."""
    steps = sorted((*x, *y))
    return sum(
        abs(sum(u <= low for u in x) / len(x) - sum(u <= low for u in y) / len(y)) * (high - low)
        for low, high in pairwise(steps)
    )
