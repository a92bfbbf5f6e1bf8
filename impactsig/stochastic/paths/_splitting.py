"""Splitting integrator: flights with impacts, and kicks by all other forces.

Half a kick, a flight, half a kick [Strang1968]_: the halves of successive steps are one kick, so
the state between calls is that after a kick, at the end of its step. Within the kick, noise and
drag act between the halves. A group's paths are moved together, a step at a time, in loops over the
paths that each do one thing to few arrays without branches: so they are compiled to vector
instructions. What few paths meet, an impact, is done for these alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel
from ._random import FORCE, FORCE_ACROSS, START, Room, draw_all, draw_coins, draw_pair, room
from .equation import (
    ACROSS,
    BLOCK,
    F,
    Q,
    V,
    accelerate,
    contact_force,
    ground_at,
    note,
    note_touches,
    push_at,
    restitution,
    rub,
)

BOUNCES = 64  # impacts in one flight, beyond which the mass is left at the stop


class Lanes(NamedTuple):
    """Random numbers of a group, and work arrays within a step."""

    room: Room
    normal: np.ndarray  # shape (BLOCK, lanes), step by step
    coin: np.ndarray  # the same, for friction; see `draw_coins`; or of the force across
    q: np.ndarray  # shape (lanes,), as all below: after the flight
    v: np.ndarray
    force: np.ndarray  # filtered noise
    kick: np.ndarray  # normal numbers of parametric white noise, times the position
    a: np.ndarray  # acceleration but for damping, friction and noise
    late: np.ndarray  # the same at the end of the kick, where the velocity matters
    before: np.ndarray  # velocity before drag, friction and noise, and after
    after: np.ndarray
    x: np.ndarray  # against the ground
    u: np.ndarray


def scratch(lanes: int) -> Lanes:
    """Allocate work arrays for so many paths."""
    numbers = np.zeros((2, BLOCK, lanes))
    return Lanes(room(BLOCK * lanes), *numbers, *np.zeros((10, lanes)))


@inlined
def bounce(p, f, state, count, events, lane, t, end):
    """End a flight that would cross a rigid stop, with its impacts, under constant force.

    Flown straight, an impact would come with the velocity of the middle of the step, whenever it
    comes, and be off by the first order. As the force does not depend on the state, the map keeps
    areas where the impact does, as the rest of the step. Rebounds that come ever faster are summed,
    if they end within the step: then the mass is at the stop.
    """
    h, middle = p.step, t + 0.5 * p.step
    at, moving = ground_at(p, middle)
    stop = p.high if end > p.high else p.low
    a = state[F, lane] * (stop if p.parametric else 1.0) + accelerate(
        p, f.law, push_at(p, middle), middle, at, moving, state, lane, stop, 0.0
    )
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
        note(events, count, lane, t + h - left, p.high_stop if upper else p.low_stop, out)
        q, u = wall, -side * r * out
        end = q + u * left + 0.5 * a * left * left
        if p.low <= end <= p.high:
            return end, u + a * (left - 0.5 * h)
        if not (end < p.low or end > p.high):
            return math.nan, math.nan
        if push > 0 and 2 * r * out < push * (1 - r) * left:
            break
    return q, -0.5 * h * a


@inlined
def fly(p, f, state, w, count, events, t):
    """Flights from kick to kick, with impacts and touches."""
    q, v = state[Q], state[V]
    lanes, beyond = len(q), 0
    for lane in range(lanes):
        end = q[lane] + v[lane] * p.step
        w.q[lane], w.v[lane] = end, v[lane]
        beyond += (end < p.low) | (end > p.high)
    if beyond > 0:
        for lane in range(lanes):
            end = w.q[lane]
            if end < p.low or end > p.high:
                w.q[lane], w.v[lane] = bounce(p, f, state, count, events, lane, t, end)
    if len(p.soft) > 0:
        for lane in range(lanes):
            note_touches(p, state, events, count, lane, t, p.step, q[lane], w.q[lane], v[lane])


@inlined
def accelerate_all(p, f, push, t, at, moving, state, w, v, a):
    """Accelerations without damping, friction and white noise, at velocities v."""
    lanes = len(a)
    if p.forced:
        share = 1 / p.mass
        if p.base_amplitude == 0.0:
            f.laws(t, w.q, v, a)
        else:
            for lane in range(lanes):
                w.x[lane], w.u[lane] = w.q[lane] + at, v[lane] + moving
            f.laws(t, w.x, w.u, a)
        for lane in range(lanes):
            a[lane] = push - p.kappa * w.q[lane] + w.force[lane] + share * a[lane]
    else:
        for lane in range(lanes):
            a[lane] = push - p.kappa * w.q[lane] + w.force[lane]
    if len(p.soft) > 0:
        for lane in range(lanes):
            a[lane] += contact_force(p, state, lane, w.q[lane], v[lane])


@inlined
def rub_shaken(v, loss, spread, noise, coin):
    """Sample of v' = -f sgn v + white noise after a step [CaugheyDienes1961]_.

    While v does not pass 0 it loses `loss` = f h of its size. The size is a Brownian motion with
    drift that is reflected at 0, of which the least value between both ends is known; once it has
    been 0 either sign is as likely.

    Parameters
    ----------
    loss, spread, noise : float
        f h, the deviation of what noise adds in the step, and what it does add.
    coin : float
        -2 log U for a uniform number U, and by chance negative.
    """
    size = abs(v)
    end = size - loss + noise * math.copysign(1.0, v)
    least = 0.5 * (size + end - math.sqrt((end - size) ** 2 + spread * spread * abs(coin)))
    passed = least <= 0
    return math.copysign(end - least if passed else end, coin if passed else v)


@inlined
def look(p, w, at, moving, later, seen):
    """Positions and velocities in the middle of a kick, relative to the ground.

    What noise and drag do to the velocity is seen half before, half after them, in turn. The
    position is corrected for that of the discrete motion: of a linear oscillator the positions
    between the kicks' halves are normal, but wider by a factor 1 / (1 - (omega h)^2 / 4), and the
    velocities are as they should be; q + a h^2 / 8 has the right variance up to the fourth order.
    """
    for lane in range(len(w.q)):
        q, a, v = w.q[lane], w.a[lane], w.after[lane] if later else w.before[lane]
        if p.kinetic > 0:
            a = 0.0 if v == 0.0 else a - math.copysign(p.kinetic, v)
        q += a * p.step * p.step / 8
        if q > p.high:
            q = 2 * p.high - q
        if q < p.low:
            q = 2 * p.low - q
        seen[lane, 0] = q + at
        seen[lane, 1] = v + moving


@kernel
def begin(p, f, key, path, w, state, count, events):
    """Half a kick, from the states at t = 0."""
    h = 0.5 * p.step
    push = push_at(p, 0.0)
    at, moving = ground_at(p, 0.0)
    spread = p.sigma * math.sqrt(h)
    pair = w.room.pair
    for lane in range(state.shape[1]):
        q, v = state[Q, lane], state[V, lane]
        times = q if p.parametric else 1.0
        a = accelerate(p, f.law, push, 0.0, at, moving, state, lane, q, v) + state[F, lane] * times
        a -= p.damping * v
        draw_pair(w.room, key, path[lane], 0, START, pair)
        noise = spread * times * pair[1]
        if p.kinetic > 0 and spread > 0:
            half = 0.5 * h * a
            draw_pair(w.room, key, path[lane], 0, 0, pair)
            coin = math.copysign(pair[0] * pair[0] + pair[1] * pair[1], pair[0])
            deviation = spread * abs(times)
            state[V, lane] = half + rub_shaken(v + half, p.kinetic * h, deviation, noise, coin)
        elif p.kinetic > 0:
            state[V, lane] = rub(v, a, h, p.kinetic, p.static)
        else:
            state[V, lane] = v + h * a + noise


@kernel
def advance(p, f, w, normal, coin, state, count, first, last, every, looks, seen, events):
    """Steps `first` to `last` with given random numbers, a row each; returns samples so far."""
    h, lanes = p.step, state.shape[1]
    q, v, force, across = state[Q], state[V], state[F], state[ACROSS]
    decay, root = math.exp(-p.damping * h), math.exp(-0.5 * p.damping * h)
    shaken, loss = p.sigma * math.sqrt(h), p.kinetic * h
    spread = shaken
    if p.damping > 0:
        spread = p.sigma * math.sqrt(-math.expm1(-2 * p.damping * h) / (2 * p.damping))
    for step in range(first, last):
        t = (step + 1) * h
        push = push_at(p, t)
        at, moving = ground_at(p, t)
        z, tossed = normal[step - first], coin[step - first]
        fly(p, f, state, w, count, events, t - h)
        if p.fresh > 0:
            for lane in range(lanes):
                w.force[lane] = 0.5 * force[lane]
            if p.across != 0.0:
                c, s = p.memory * p.turned, p.memory * p.across
                for lane in range(lanes):
                    one, other = force[lane], across[lane]
                    force[lane] = c * one - s * other + p.fresh * z[lane]
                    across[lane] = s * one + c * other + p.fresh * tossed[lane]
            else:
                for lane in range(lanes):
                    force[lane] = p.memory * force[lane] + p.fresh * z[lane]
            for lane in range(lanes):
                w.force[lane] += 0.5 * force[lane]
        kick = z
        if p.parametric:
            kick = w.kick
            for lane in range(lanes):
                w.force[lane] *= w.q[lane]
                kick[lane] = w.q[lane] * z[lane]
        accelerate_all(p, f, push, t, at, moving, state, w, w.v, w.a)
        if p.forced or len(p.soft) > 0:  # Heun's method, where a depends on v
            for lane in range(lanes):
                push_half = 0.5 * h * w.a[lane]
                w.after[lane] = decay * (w.v[lane] + push_half) + spread * kick[lane] + push_half
            accelerate_all(p, f, push, t, at, moving, state, w, w.after, w.late)
            for lane in range(lanes):
                w.a[lane] = 0.5 * (w.a[lane] + w.late[lane])
        if p.kinetic > 0 and p.sigma == 0:
            for lane in range(lanes):
                slowed = w.a[lane] - p.damping * w.v[lane]
                v[lane] = rub(w.v[lane], slowed, h, p.kinetic, p.static)
                w.before[lane] = w.after[lane] = 0.5 * (w.v[lane] + v[lane])
        else:
            for lane in range(lanes):
                w.before[lane] = w.v[lane] + 0.5 * h * w.a[lane]
            if p.kinetic > 0:
                for lane in range(lanes):
                    times = abs(w.q[lane]) if p.parametric else 1.0
                    w.after[lane] = root * rub_shaken(
                        root * w.before[lane], loss, shaken * times, shaken * kick[lane],
                        tossed[lane],
                    )  # fmt: skip
            else:
                for lane in range(lanes):
                    w.after[lane] = decay * w.before[lane] + spread * kick[lane]
            for lane in range(lanes):
                v[lane] = w.after[lane] + 0.5 * h * w.a[lane]
        for lane in range(lanes):
            q[lane] = w.q[lane]
        if (step + 1) % every == 0 and looks < seen.shape[1]:
            look(p, w, at, moving, ((step + 1) // every) % 2 == 1, seen[:, looks])
            looks += 1
    return looks


@kernel
def move(p, f, key, path, w, state, count, first, last, every, seen, events):
    """Advance a group of paths from step `first` to step `last`, and store samples.

    Parameters
    ----------
    p, f : Problem, Functions
        The system.
    key, path : uint32, shapes (2,) and (lanes,)
        Key of the generator, and the numbers of the paths.
    w : Lanes
        Room for what is on the way, as `scratch` makes it.
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
        shift, end = first - block * BLOCK, min(last, (block + 1) * BLOCK)
        draw_all(w.room, key, path, block, FORCE, w.normal)
        if p.kinetic > 0 and p.sigma > 0:
            draw_coins(w.room, key, path, block, w.coin)
        elif p.across != 0.0:
            draw_all(w.room, key, path, block, FORCE_ACROSS, w.coin)
        looks = advance(
            p, f, w, w.normal[shift:], w.coin[shift:], state, count, first, end, every, looks, seen,
            events,
        )  # fmt: skip
        first = end
