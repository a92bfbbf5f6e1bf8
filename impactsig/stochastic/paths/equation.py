"""The equation of motion under a random force, in the oscillator's units and per mass.

Positions and velocities are taken relative to what the stops stand on. All paths of a group are at
the same instant, so what depends on time alone is worked out once for all of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel
from ...oscillators import laws
from ...oscillators.laws import (
    BY_APPROACH,
    EXPONENT,
    HERTZ,
    LAW,
    LAW_COLUMNS,
    LOSS,
    PLACE,
    PUSHER,
    SIDE,
    STIFFNESS,
)

# Columns of `Problem.soft`: those of `oscillators.laws`, and the number of the stop.
STOP = LAW_COLUMNS
# Rows of the state: position, velocity, the filtered force and what it is turned into where it
# oscillates, then for each soft stop the approach velocity of its last contact.
Q, V, F, ACROSS, APPROACH = range(5)
# Columns of the events that a path is asked for: instant, stop, approach velocity.
INSTANT, WHICH, SPEED, COLUMNS = range(4)
hertz_push = inlined(laws.hertz_push)
approach_loss = inlined(laws.approach_loss)
spring_push = inlined(laws.spring_push)
BLOCK = 64  # steps whose random numbers are drawn together


class Problem(NamedTuple):
    """Parameters of an oscillator, per mass, and of the step."""

    step: float
    kappa: float
    damping: float
    constant: float
    waves: np.ndarray  # frequency, amplitude and angle at t = 0 of the forcing
    soft: np.ndarray
    low: float  # the rigid stops, infinite where there is none
    high: float
    low_restitution: float  # negative: a function of the velocity
    high_restitution: float
    low_stop: int  # their numbers among the oscillator's stops
    high_stop: int
    kinetic: float
    static: float  # what holds: under white noise, which overcomes any force, no more than kinetic
    sigma: float  # of white noise: <noise noise> = sigma^2 delta; 0 where it is filtered
    memory: float  # share of the filtered force that is left after a step
    turned: float  # cosine and sine of the angle that it turns by in a step
    across: float
    fresh: float  # deviation of what the step adds to it
    parametric: bool  # whether the noise is of the stiffness: times the position, it is the force
    forced: bool  # whether there is a `law` of the user's
    mass: float
    fold: float  # Zhuravlev's coordinate: 1 or -1 where position is a stop's plus fold * abs(y)
    base_amplitude: float  # of what the stops stand on
    base_frequency: float
    base_angle: float  # at t = 0


class Functions(NamedTuple):
    """The user's functions: further force, restitution of the upper and of the lower stop."""

    law: object
    laws: object  # the same for many paths at one instant: (t, x, v, out)
    upper: object
    lower: object


@kernel
def push_at(p, t):
    """Part of the force per mass that depends on time alone."""
    push = p.constant
    for j in range(len(p.waves)):
        push += p.waves[j, 1] * math.cos(p.waves[j, 0] * t + p.waves[j, 2])
    return push


@kernel
def ground_at(p, t):
    """Position and velocity of the base of the stops."""
    if p.base_amplitude == 0.0:
        return 0.0, 0.0
    angle = p.base_frequency * t + p.base_angle
    velocity = -p.base_amplitude * p.base_frequency * math.sin(angle)
    return p.base_amplitude * math.cos(angle), velocity


@kernel
def contact_force(p, state, lane, q, v):
    """Force of the soft stops per mass."""
    a = 0.0
    for k in range(len(p.soft)):
        side = p.soft[k, SIDE]
        depth = side * (q - p.soft[k, PLACE])
        if depth <= 0:
            continue
        kind, stiffness, loss = p.soft[k, LAW], p.soft[k, STIFFNESS], p.soft[k, LOSS]
        if kind == HERTZ:
            if p.soft[k, BY_APPROACH] >= 0:
                loss = approach_loss(p.soft[k, BY_APPROACH], state[APPROACH + k, lane])
            root = math.sqrt(depth)
            force = hertz_push(stiffness, p.soft[k, EXPONENT], loss, depth, root, side * v)
        else:
            force = spring_push(stiffness, loss, depth, side * v)
            if kind == PUSHER:
                force = max(force, 0.0)
        a -= side * force
    return a


@inlined
def accelerate(p, law, push, t, at, moving, state, lane, q, v):
    """Acceleration without damping, friction and noise."""
    a = push - p.kappa * q
    if len(p.soft) > 0:
        a += contact_force(p, state, lane, q, v)
    if p.forced:
        a += law(t, q + at, v + moving) / p.mass
    return a


@kernel
def restitution(p, f, upper, v):
    """Restitution coefficient at an approach velocity; NaN if a user's function returns none."""
    r = p.high_restitution if upper else p.low_restitution
    if r < 0:
        r = f.upper(v) if upper else f.lower(v)
        if not 0 <= r <= 1:
            r = math.nan
    return r


@kernel
def note(events, count, lane, t, stop, v):
    """Count an impact, and store it if asked for."""
    k = count[lane]
    if lane == 0 and k < len(events):
        events[k, INSTANT], events[k, WHICH], events[k, SPEED] = t, stop, v
    count[lane] += 1


@kernel
def note_touches(p, state, events, count, lane, t, span, before, q, v):
    """Count the soft stops touched on the way from `before` to q, from t on."""
    for k in range(len(p.soft)):
        side, place = p.soft[k, SIDE], p.soft[k, PLACE]
        if side * (before - place) <= 0 < side * (q - place):
            share = (place - before) / (q - before)
            state[APPROACH + k, lane] = abs(v)
            note(events, count, lane, t + share * span, p.soft[k, STOP], abs(v))


@kernel
def rub(v, a, h, kinetic, static):
    """Exact velocity after time h under constant acceleration and Coulomb friction."""
    if v == 0.0:
        if abs(a) <= static:
            return 0.0
        return (a - math.copysign(kinetic, a)) * h
    slowed = a - math.copysign(kinetic, v)
    new = v + slowed * h
    if new * v > 0:
        return new
    left = h + v / slowed  # from where the mass has come to rest
    if abs(a) <= static:
        return 0.0
    return (a - math.copysign(kinetic, a)) * left
