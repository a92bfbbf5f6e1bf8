"""How long a gap stays open for certain, and the instant at which it closes."""

from __future__ import annotations

import math

from ..._compiling.compiled import inlined
from .flow import locate


@inlined
def vanishes(gap, speed, brake):
    """Root h > 0 of gap + speed h - brake h^2 / 2, without cancellation."""
    root = math.sqrt(speed * speed + 2 * brake * gap)
    return (speed + root) / brake if speed >= 0 else 2 * gap / (root - speed)


@inlined
def stays_open(gap, speed, bend, most, jolt, now, feeds, jolt_now, shakes):
    """Time for which a gap g >= 0 stays open for certain, from its first two derivatives.

    h from here, |g''| is at most the lesser of `most` and now + feeds h, and the third derivative
    the lesser of `jolt` and jolt_now + shakes h.
    """
    if now <= 0:
        return math.inf
    step = vanishes(gap, speed, now)
    if feeds > 0:
        step = vanishes(gap, speed, min(most, now + feeds * step))
    # g + g' h + g'' h^2 / 2 - J h^3 / 6 is less than the gap. For h up to a span H, with J H h^2
    # for J h^3, a parabola is less still; where g' >= 0, with g h / H for g, so is a parabola
    # times h.
    if speed < 0:
        span = 3 * step
        sag = min(jolt, jolt_now + shakes * span) * span / 3 - bend
        if speed * speed + 2 * sag * gap >= 0:
            span = min(span, vanishes(gap, speed, sag))
        return max(step, span)
    if jolt_now <= 0:
        return step
    span = vanishes(speed, bend / 2, jolt_now / 3)
    if gap > 0:
        span = max(2 * span, step)
    if span > 0:
        worst = min(jolt, jolt_now + shakes * span)
        span = min(span, vanishes(speed + gap / span, bend / 2, worst / 3))
    return max(step, span)


@inlined
def close(leg, tau, at, x, velocity, a, jerk, gap, speed, high, third):
    """Instant and state at which a gap closes that is certain to close monotonically.

    `at` is alpha, beta and what the gap is at the start of the leg, but for the velocity. The
    position x (from that at the start), velocity, acceleration, jerk, gap and `speed` (its
    derivative, negative) hold at tau; the gap closes before tau + high. third bounds |g'''|. Each
    step goes to the root of the parabola at hand.
    """
    alpha, beta, distance = at
    low, high = tau, tau + high
    before = math.inf
    for _ in range(60):
        bend = alpha * a + beta * jerk
        square = speed * speed - 2 * bend * gap
        step = 2 * gap / (math.sqrt(square) - speed) if square > 0 else math.inf
        if not (low <= tau + step <= high):
            step = (low + high) / 2 - tau
        elif third * abs(step) ** 3 <= -1e-17 * speed * tau:
            # What this step misses would not be seen.
            x += step * (velocity + step * (a / 2 + jerk * step / 6))
            return tau + step, x, velocity + step * (a + jerk * step / 2)
        elif abs(step) >= before / 2 and abs(step) < 1e-9 * tau:
            return tau, x, velocity  # down to rounding
        before = abs(step)
        tau += step
        x, velocity, a, jerk, _b, _b1 = locate(leg, tau)
        gap = distance + alpha * x + beta * velocity
        speed = alpha * velocity + beta * a
        if gap > 0:
            low = tau
        else:
            high = tau
        if speed >= 0 or high - low <= 2e-16 * high:
            break
    return tau, x, velocity
