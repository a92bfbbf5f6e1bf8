"""A step split into what can be solved exactly: flight with impacts, and a kick.

Half a flight, a kick, half a flight [Strang1968]_: the halves of successive steps are one flight,
so the state between calls is that before a kick, in the middle of its step. Paths are moved in
groups, a step at a time, so that the processor works at several while each waits for its own
numbers.
"""

from __future__ import annotations

import math

from ..simulate._flow import inlined, inner, kernel
from ._equation import (
    BLOCK,
    A,
    F,
    Q,
    V,
    accelerate,
    ground_at,
    note,
    note_touches,
    push_at,
    restitution,
    rub,
)
from ._random import draw, draw_pair

BOUNCES = 64  # impacts in one flight, beyond which the mass is left at the stop


@inner
def bounce(p, f, state, count, events, lane, t, span, q, v):
    """The flight on from q, v for a time at the end of which it would be beyond a rigid stop.

    The force of the last kick, spread over the time it stands for, acts before the impact for the
    share of that time that lies before it, and not for half of it.
    """
    a = state[A, lane]
    left = span
    for n in range(BOUNCES):
        upper = v > 0
        wall = p.high if upper else p.low
        flight = min(max((wall - q) / v, 0.0), left)
        left -= flight
        r = restitution(p, f, upper, abs(v))
        note(p, events, count, lane, t + span - left, p.high_stop if upper else p.low_stop, abs(v))
        v *= -r
        if n == 0:
            v += (1 + r) * a * (left - 0.5 * span)
        q = wall
        if v > 0 if upper else v < 0:
            v = 0.0
        end = q + v * left
        if p.low <= end <= p.high:
            return end, v
        if not (end < p.low or end > p.high):
            return math.nan, math.nan
    return q, v


@inner
def rub_shaken(loss, spread, r, key, path, step, v, noise):
    """Velocity after a step of v' = -f sgn v + white noise [CaugheyDienes1961]_, as distributed.

    While v does not pass 0 it loses `loss` = f h of its size. The size is a Brownian motion with
    drift that is reflected at 0, of which the least value between both ends is known; once it has
    been 0 either sign is as likely.

    Parameters
    ----------
    loss, spread, noise : float
        f h, the deviation of what noise adds in the step, and what it does add.
    """
    size = abs(v)
    end = size - loss + (noise if v >= 0 else -noise)
    if size * end > 20 * spread * spread:  # it has not been 0: exp(-40)
        return math.copysign(end, v)
    draw_pair(r, key, path, step, 0, r.pair)
    one, two = r.pair[0], r.pair[1]
    least = 0.5 * (
        size + end - math.sqrt((end - size) ** 2 + spread * spread * (one * one + two * two))
    )
    if least > 0:
        return math.copysign(end, v)
    return math.copysign(end - least, one)


@inlined
def fly(p, f, state, count, events, lane, t, span):
    """A flight, with its impacts and touches."""
    q, v = state[Q, lane], state[V, lane]
    end = q + v * span
    if end < p.low or end > p.high:
        end, v = bounce(p, f, state, count, events, lane, t, span, q, v)
    if len(p.soft) > 0:
        note_touches(p, state, events, count, lane, t, span, q, end, v)
    state[Q, lane], state[V, lane] = end, v


@kernel
def begin(p, f, state, count, events):
    """From states at t = 0 to those before the first kick."""
    for lane in range(state.shape[1]):
        fly(p, f, state, count, events, lane, 0.0, 0.5 * p.step)


@inner
def look(p, f, state, t, number, seen):
    """Write where the paths are at t, half a flight after a kick, and leave them where they are."""
    at, moving = ground_at(p, t)
    for lane in range(state.shape[1]):
        q, v = state[Q, lane], state[V, lane]
        end = q + 0.5 * p.step * v
        if end < p.low or end > p.high:
            wall = p.high if v > 0 else p.low
            left = (end - wall) / v
            r = restitution(p, f, v > 0, abs(v))
            upper, v = v > 0, -r * v + (1 + r) * state[A, lane] * left
            if v > 0 if upper else v < 0:
                v = 0.0
            end = min(max(wall + v * left, p.low), p.high)
        seen[lane, number, 0], seen[lane, number, 1] = end + at, v + moving


@kernel
def advance(p, f, key, path, r, z, state, count, first, last, every, looks, seen, events):
    """Steps `first` to `last` with given random numbers, z[lane, 0] for the first; looks so far."""
    h, lanes = p.step, state.shape[1]
    decay = math.exp(-p.damping * h)
    gain = -math.expm1(-p.damping * h) / p.damping if p.damping > 0 else h
    spread = p.sigma * math.sqrt(h)
    if p.damping > 0:
        spread = p.sigma * math.sqrt(-math.expm1(-2 * p.damping * h) / (2 * p.damping))
    for step in range(first, last):
        t = (step + 0.5) * h
        push = push_at(p, t)
        at, moving = ground_at(p, t)
        k = step - first
        for lane in range(lanes):
            q, v = state[Q, lane], state[V, lane]
            force, noise = state[F, lane], spread * z[lane, k]
            if p.fresh > 0:
                state[F, lane] = p.memory * force + p.fresh * z[lane, k]
                force = 0.5 * (force + state[F, lane])
            a = accelerate(p, f.law, push, t, at, moving, state, lane, q, v) + force
            new = decay * v + gain * a + noise
            if p.forced or len(p.soft) > 0:  # Heun's method, where a depends on v
                b = accelerate(p, f.law, push, t, at, moving, state, lane, q, new) + force
                new += 0.5 * gain * (b - a)
                a = 0.5 * (a + b)
            state[A, lane] = a - p.damping * v
            if p.kinetic > 0 and spread > 0:
                half = 0.5 * (new - v - noise)
                new = half + rub_shaken(
                    p.kinetic * h, spread, r, key, path[lane], step, v + half, noise
                )
            elif p.kinetic > 0:
                new = rub(v, (new - v) / h, h, p.kinetic, p.static)
            state[V, lane] = new
        if (step + 1) % every == 0 and looks < seen.shape[1]:
            look(p, f, state, (step + 1) * h, looks, seen)
            looks += 1
        for lane in range(lanes):
            fly(p, f, state, count, events, lane, t, h)
    return looks


@kernel
def move(p, f, key, path, r, z, state, count, first, last, every, seen, events):
    """Move a group of paths from step `first` to step `last`, and note what is seen.

    Parameters
    ----------
    p, f : Problem, Functions
        What moves.
    key, path : uint32, shapes (2,) and (lanes,)
        Key of the generator, and the numbers of the paths.
    r, z : Room, and float, shape (lanes, BLOCK)
        Room for the random numbers.
    state, count : float, shape (rows, lanes), and int, shape (lanes,)
        State before the kick of step `first`, and impacts so far; both are advanced.
    first, last, every : int
        Steps, and at which multiples of steps to look.
    seen : float, shape (lanes, looks, 2)
        Where to write positions and velocities against the ground.
    events : float, shape (n, COLUMNS)
        Where to write the impacts of the first of the paths, as many as fit.
    """
    looks = 0
    while first < last:
        block = first // BLOCK
        end = min(last, (block + 1) * BLOCK)
        for lane in range(state.shape[1]):
            draw(r, key, path[lane], block, z[lane])
        shift = first - block * BLOCK
        looks = advance(
            p, f, key, path, r, z[:, shift:], state, count, first, end, every, looks, seen, events
        )
        first = end
