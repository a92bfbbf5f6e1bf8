"""Classical Runge-Kutta method with the random force constant over each step.

Either a step that ends beyond a rigid stop is cut where it gets there, and goes on from the
rebound; or the motion is unfolded as Zhuravlev does [Zhuravlev1976]_: the position is that of the
stop plus or minus abs(y), y passes through 0 where the mass hits, and all that is left of an impact
of restitution r is that y' becomes r y'.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import inlined, kernel
from ._random import Numbers, draw, draw_pair, numbers
from .equation import (
    BLOCK,
    F,
    Q,
    V,
    accelerate,
    ground_at,
    note,
    note_touches,
    push_at,
    restitution,
)

BOUNCES = 64  # impacts in one step, beyond which the mass is left at the stop
CORRECTIONS = 8


@kernel
def drive_at(p, t):
    """Terms that depend on time alone: force, and motion of the stops."""
    at, moving = ground_at(p, t)
    return t, push_at(p, t), at, moving


@kernel
def wall_of(p):
    """The rigid stop about which the motion is unfolded."""
    return p.low if p.fold > 0 else p.high


@kernel
def folded(p, y, u):
    """Position and velocity from coordinates that may be unfolded."""
    if p.fold == 0.0:
        return y, u
    sign = p.fold if y >= 0 else -p.fold
    return wall_of(p) + p.fold * abs(y), sign * u


@inlined
def rate(p, law, drive, state, lane, y, u, noise):
    """Acceleration of the coordinate."""
    t, push, at, moving = drive
    if p.fold == 0.0:
        a = accelerate(p, law, push, t, at, moving, state, lane, y, u) - p.damping * u
    else:
        q, v = folded(p, y, u)
        a = accelerate(p, law, push, t, at, moving, state, lane, q, v) - p.damping * v
        a *= p.fold if y >= 0 else -p.fold
    if p.kinetic > 0 and u != 0.0:
        a -= math.copysign(p.kinetic, u)
    return a + noise


@kernel
def stride(p, law, start, middle, end, state, lane, y, u, h, noise, later):
    """One classical step while the noise changes from one value to another."""
    k1 = rate(p, law, start, state, lane, y, u, noise)
    between = 0.5 * (noise + later)
    v2 = u + 0.5 * h * k1
    k2 = rate(p, law, middle, state, lane, y + 0.5 * h * u, v2, between)
    v3 = u + 0.5 * h * k2
    k3 = rate(p, law, middle, state, lane, y + 0.5 * h * v2, v3, between)
    v4 = u + h * k3
    k4 = rate(p, law, end, state, lane, y + h * v3, v4, later)
    return y + h / 6 * (u + 2 * v2 + 2 * v3 + v4), u + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


@kernel
def land(p, f, key, path, r, state, count, events, lane, step, q, v, q1, v1, noise, later, pair):
    """The step from q, v that would end beyond a rigid stop at q1, v1, with its impacts.

    White noise held constant acts both before and after the impact, so that what it does to the
    energy is correlated, and the mean energy is off by the order of the step. Its impulse until the
    impact is therefore drawn given that of the step: a Brownian bridge, with each velocity that
    follows weighted by itself, as faster paths come to the stop more often. That is the length of
    a normal vector in space.
    """
    h = p.step
    t, left = step * h, h
    for number in range(BOUNCES):
        upper = q1 > p.high
        wall = p.high if upper else p.low
        start, t0 = drive_at(p, t), t
        now = noise + (later - noise) * (1 - left / h)
        # Newton's method from the end, within a bracket: the beginning, which after an impact is at
        # the stop as well, counts as before it.
        before, after = 0.0, left
        tau = left - (q1 - wall) / v1 if (v1 > 0) == upper else 0.0
        at, speed, next_tau = q, v, tau
        for _ in range(CORRECTIONS):
            tau = next_tau if before < next_tau < after else 0.5 * (before + after)
            middle, end = drive_at(p, t0 + 0.5 * tau), drive_at(p, t0 + tau)
            then = noise + (later - noise) * (1 - (left - tau) / h)
            at, speed = stride(p, f.law, start, middle, end, state, lane, q, v, tau, now, then)
            if at > wall if upper else at < wall:
                after = tau
            else:
                before = tau
            miss = (wall - at) / speed
            if not abs(miss) > 1e-9 * h:
                break
            next_tau = tau + miss
        out = max(speed if upper else -speed, 0.0)  # 0: a touch at no speed
        if p.sigma > 0:
            draw_pair(r, key, path, step, 2 * number, pair)
            deviation = p.sigma * math.sqrt(tau * (left - tau) / left)
            along, first = out + deviation * pair[0], deviation * pair[1]
            draw_pair(r, key, path, step, 2 * number + 1, pair)
            actual = math.sqrt(along**2 + first**2 + (deviation * pair[0]) ** 2)
            noise -= (actual - out if upper else out - actual) / (left - tau)
            later, out = noise, actual
        back = restitution(p, f, upper, out)
        note(events, count, lane, t0 + tau, p.high_stop if upper else p.low_stop, out)
        q, v = wall, -back * out if upper else back * out
        t, left = t0 + tau, left - tau
        start, middle, end = drive_at(p, t), drive_at(p, t + 0.5 * left), drive_at(p, t + left)
        now = noise + (later - noise) * (1 - left / h)
        q1, v1 = stride(p, f.law, start, middle, end, state, lane, q, v, left, now, later)
        if p.low <= q1 <= p.high:
            return q1, v1
        if not (q1 < p.low or q1 > p.high):
            return math.nan, math.nan
    return q, v


@kernel
def pass_through(p, f, count, events, lane, t, y, u, y1, u1):
    """Effect of an impact on a step through y = 0 in unfolded coordinates."""
    h = p.step
    share = y / (y - y1)
    for _ in range(CORRECTIONS):  # Newton's method on the cubic through both ends
        s = share
        value = (
            y * (1 + 2 * s) * (1 - s) ** 2
            + h * u * s * (1 - s) ** 2
            + y1 * s * s * (3 - 2 * s)
            - h * u1 * s * s * (1 - s)
        )
        slope = (
            6 * s * (1 - s) * (y1 - y) + h * u * (1 - s) * (1 - 3 * s) + h * u1 * s * (3 * s - 2)
        )
        share = min(max(s - value / slope, 0.0), 1.0) if slope != 0.0 else s
    speed = slope / h
    r = restitution(p, f, p.fold < 0, abs(speed))
    note(events, count, lane, t + share * h, p.low_stop if p.fold > 0 else p.high_stop,
         abs(speed))  # fmt: skip
    return y1 - (1 - r) * speed * (1 - share) * h, u1 - (1 - r) * speed


def scratch(lanes: int) -> Numbers:
    """Allocate work arrays for so many paths."""
    return numbers(lanes, BLOCK)


@kernel
def begin(p, f, key, path, given, state, count, events):
    """Convert positions to unfolded coordinates."""
    if p.fold != 0.0:
        for lane in range(state.shape[1]):
            state[Q, lane] = p.fold * (state[Q, lane] - wall_of(p))
            state[V, lane] *= p.fold


@kernel
def move(p, f, key, path, given, state, count, first, last, every, seen, events):
    """Move a group of paths from step `first` to step `last`; as `_splitting.move` does."""
    h, lanes = p.step, state.shape[1]
    r, z = given.room, given.normal
    scale = p.sigma / math.sqrt(h)
    pair = r.pair
    looks = 0
    step = first
    while step < last:
        block = step // BLOCK
        stop = min(last, (block + 1) * BLOCK)
        for lane in range(lanes):
            draw(r, key, path[lane], block, z[lane])
        for now in range(step, stop):
            t = now * h
            start, middle, end = drive_at(p, t), drive_at(p, t + 0.5 * h), drive_at(p, t + h)
            for lane in range(lanes):
                noise = scale * z[lane, now - block * BLOCK]
                later = noise
                if p.fresh > 0:
                    noise = state[F, lane]
                    later = p.memory * noise + p.fresh * z[lane, now - block * BLOCK]
                    state[F, lane] = later
                y, u = state[Q, lane], state[V, lane]
                y1, u1 = stride(p, f.law, start, middle, end, state, lane, y, u, h, noise, later)
                if p.fold != 0.0:
                    if y * y1 < 0:
                        y1, u1 = pass_through(p, f, count, events, lane, t, y, u, y1, u1)
                elif y1 < p.low or y1 > p.high:
                    y1, u1 = land(
                        p, f, key, path[lane], r, state, count, events, lane, now,
                        y, u, y1, u1, noise, later, pair,
                    )  # fmt: skip
                if len(p.soft) > 0:
                    before, _ = folded(p, y, u)
                    q, v = folded(p, y1, u1)
                    note_touches(p, state, events, count, lane, t, h, before, q, v)
                state[Q, lane], state[V, lane] = y1, u1
            if (now + 1) % every == 0 and looks < seen.shape[1]:
                at, moving = ground_at(p, t + h)
                for lane in range(lanes):
                    q, v = folded(p, state[Q, lane], state[V, lane])
                    seen[lane, looks, 0], seen[lane, looks, 1] = q + at, v + moving
                looks += 1
        step = stop
