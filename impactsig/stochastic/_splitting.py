"""A step split into what can be solved exactly: flight with impacts, and a kick.

Half a kick, a flight, half a kick [Strang1968]_: the halves of successive steps are one kick, so
the state between calls is that after a kick, at the end of its step. Within the kick, noise and
drag act between the halves. Paths are moved in groups, a step at a time, so that the processor
works at several while each waits for its own numbers.
"""

from __future__ import annotations

import math

from ..simulate._flow import inlined, inner, kernel
from ._equation import (
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
    rub,
)
from ._random import LAST, START, draw, draw_pair

FAR = 20.0  # velocities before and after a step, by the noise squared: 0 between has exp(-2 FAR)
BOUNCES = 64  # impacts in one flight, beyond which the mass is left at the stop


@inner
def bounce(p, f, state, count, events, lane, t, end):
    """A flight that would end beyond a rigid stop: with its impacts, under the force at the stop.

    Flown straight, an impact would come with the velocity of the middle of the step, whenever it
    comes, and be off by the first order. As the force does not depend on the state, the map keeps
    areas where the impact does, as the rest of the step. Rebounds that come ever faster are summed,
    if they end within the step: then the mass is at the stop.
    """
    h, middle = p.step, t + 0.5 * p.step
    at, moving = ground_at(p, middle)
    a = state[F, lane] + accelerate(
        p, f.law, push_at(p, middle), middle, at, moving, state, lane,
        p.high if end > p.high else p.low, 0.0,
    )  # fmt: skip
    q, u = state[Q, lane], state[V, lane] - 0.5 * h * a
    left = h
    for _ in range(BOUNCES):
        upper = end > p.high
        side, wall = (1.0, p.high) if upper else (-1.0, p.low)
        room, speed, push = max(side * (wall - q), 0.0), side * u, side * a
        out = math.sqrt(max(speed * speed + 2 * push * room, 0.0))
        if speed >= 0:
            flight = 2 * room / (speed + out) if room > 0 else 0.0
        else:
            flight = (out - speed) / push
        left = max(left - flight, 0.0)
        r = restitution(p, f, upper, out)
        note(p, events, count, lane, t + h - left, p.high_stop if upper else p.low_stop, out)
        q, u = wall, -side * r * out
        end = q + u * left + 0.5 * a * left * left
        if p.low <= end <= p.high:
            state[Q, lane], state[V, lane] = end, u + a * (left - 0.5 * h)
            return
        if not (end < p.low or end > p.high):
            state[Q, lane] = state[V, lane] = math.nan
            return
        if push > 0 and 2 * r * out < push * (1 - r) * left:
            break
    state[Q, lane], state[V, lane] = q, -0.5 * h * a


@inlined
def fly(p, f, state, count, events, lane, t):
    """A flight from kick to kick, with its impacts and touches."""
    q, v = state[Q, lane], state[V, lane]
    end = q + v * p.step
    if end < p.low or end > p.high:
        bounce(p, f, state, count, events, lane, t, end)
    else:
        state[Q, lane] = end
    if len(p.soft) > 0:
        note_touches(p, state, events, count, lane, t, p.step, q, state[Q, lane], v)


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
    if size * end > FAR * spread * spread:
        return math.copysign(end, v)
    draw_pair(r, key, path, step, 0, r.pair)
    one, two = r.pair[0], r.pair[1]
    least = 0.5 * (
        size + end - math.sqrt((end - size) ** 2 + spread * spread * (one * one + two * two))
    )
    if least > 0:
        return math.copysign(end, v)
    return math.copysign(end - least, one)


@inner
def seen_at(p, q, a, v):
    """Position in the middle of a kick, corrected for that of the discrete motion.

    Of a linear oscillator the positions between the kicks' halves are normal, but wider by a
    factor 1 / (1 - (omega h)^2 / 4), and the velocities are as they should be; q + a h^2 / 8 has
    the right variance up to the fourth order.
    """
    if p.kinetic > 0:
        if v == 0.0:
            return q
        a -= math.copysign(p.kinetic, v)
    x = q + a * p.step * p.step / 8
    if x > p.high:
        x = 2 * p.high - x
    if x < p.low:
        x = 2 * p.low - x
    return x


@kernel
def begin(p, f, key, path, r, state, count, events):
    """From states at t = 0 to those after the kick there, half a kick."""
    h = 0.5 * p.step
    push = push_at(p, 0.0)
    at, moving = ground_at(p, 0.0)
    spread = p.sigma * math.sqrt(h)
    for lane in range(state.shape[1]):
        q, v = state[Q, lane], state[V, lane]
        a = accelerate(p, f.law, push, 0.0, at, moving, state, lane, q, v) + state[F, lane]
        a -= p.damping * v
        draw_pair(r, key, path[lane], 0, START, r.pair)
        noise = spread * r.pair[1]
        if p.kinetic > 0 and spread > 0:
            half = 0.5 * h * a
            state[V, lane] = half + rub_shaken(
                p.kinetic * h, spread, r, key, path[lane], LAST, v + half, noise
            )
        elif p.kinetic > 0:
            state[V, lane] = rub(v, a, h, p.kinetic, p.static)
        else:
            state[V, lane] = v + h * a + noise


@kernel
def advance(p, f, key, path, r, z, state, count, first, last, every, looks, seen, events):
    """Steps `first` to `last` with given random numbers, z[lane, 0] for the first; looks so far."""
    h, lanes = p.step, state.shape[1]
    decay, root = math.exp(-p.damping * h), math.exp(-0.5 * p.damping * h)
    shaken, loss = p.sigma * math.sqrt(h), p.kinetic * h
    spread = shaken
    if p.damping > 0:
        spread = p.sigma * math.sqrt(-math.expm1(-2 * p.damping * h) / (2 * p.damping))
    for step in range(first, last):
        t = (step + 1) * h
        push = push_at(p, t)
        at, moving = ground_at(p, t)
        k = step - first
        looking = (step + 1) % every == 0 and looks < seen.shape[1]
        for lane in range(lanes):
            fly(p, f, state, count, events, lane, t - h)
            q, v = state[Q, lane], state[V, lane]
            force, noise = state[F, lane], spread * z[lane, k]
            if p.fresh > 0:
                state[F, lane] = p.memory * force + p.fresh * z[lane, k]
                force = 0.5 * (force + state[F, lane])
            a = accelerate(p, f.law, push, t, at, moving, state, lane, q, v) + force
            if p.forced or len(p.soft) > 0:  # Heun's method, where a depends on v
                late = decay * (v + 0.5 * h * a) + noise + 0.5 * h * a
                a += accelerate(p, f.law, push, t, at, moving, state, lane, q, late) + force
                a *= 0.5
            before = v + 0.5 * h * a
            if p.kinetic > 0:
                if p.sigma > 0:
                    noise = shaken * z[lane, k]
                    after = root * before
                    end = abs(after) - loss + (noise if after >= 0 else -noise)
                    if abs(after) * end > FAR * shaken * shaken:
                        after = root * math.copysign(end, after)
                    else:  # not called where it need not be: passing `r` on takes long
                        after = root * rub_shaken(
                            loss, shaken, r, key, path[lane], step, after, noise
                        )
                    new = after + 0.5 * h * a
                else:
                    new = rub(v, a - p.damping * v, h, p.kinetic, p.static)
                    before = after = 0.5 * (v + new)
            else:
                after = decay * before + noise
                new = after + 0.5 * h * a
            state[V, lane] = new
            if looking:
                # What noise and drag do to the velocity is seen half before, half after them.
                middle = after if ((step + 1) // every) % 2 else before
                seen[lane, looks, 0] = seen_at(p, q, a, middle) + at
                seen[lane, looks, 1] = middle + moving
        looks += looking
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
        State after the kick at the beginning of step `first`, and impacts so far; both are
        advanced.
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
