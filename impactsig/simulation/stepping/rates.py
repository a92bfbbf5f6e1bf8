"""The equation of motion that the stepping engine steps, in one mode at a time.

Positions count from the origin of the mode: the deepest stop that is touched, so that nothing
cancels there. A mode is written in digits of base 3: the direction of sliding (0 none, 1 up,
2 down), then for each stop whether it is `OUT`, `PUSHING` or `SLACK`: reached, but left behind by a
stop that only ever pushes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import cfunc, inlined, kernel
from ...oscillators import laws
from ...oscillators.laws import (
    BY_APPROACH,
    EXPONENT,
    HERTZ,
    LAW,
    LAW_COLUMNS,
    LOSS,
    PLACE,
    SIDE,
    STIFFNESS,
)
from ..basis.delay import pushed, pushed_rate
from ..basis.events import TURN
from ..exact.flow import phase_of

OUT, PUSHING, SLACK = range(3)
# Columns of `Problem.stops`: those of `laws`, and what the digit of the stop in the mode counts.
WEIGHT = LAW_COLUMNS

hertz_push = inlined(laws.hertz_push)
approach_loss = inlined(laws.approach_loss)
spring_push = inlined(laws.spring_push)


class Problem(NamedTuple):
    """An oscillator, its forcing period 2 pi, per mass.

    Few arrays, as each that is passed on is counted by numba, at a cost.
    """

    kappa: float
    damping: float
    constant: float
    waves: np.ndarray  # ratio to the reference's frequency, amplitude and angle of the forcing
    fastest: float  # greatest of the ratios
    stops: np.ndarray  # a row for each of `Oscillator.stops`
    order: np.ndarray  # upper stops as they are reached, then the lower
    kinetic: float
    static: float
    forced: bool  # whether there is a `law` of the user's
    omega: float
    inertia: float  # mass omega^2
    start: float  # phase at t = 0
    base_amplitude: float  # of what the stops move with; 0 where they rest
    base_ratio: float  # frequency over that of the reference
    base_angle: float
    chatter: float
    fixed: float  # step, or 0: adaptive
    tolerance: float
    rounding: float  # of the acceleration, by forces that may cancel
    longest: float
    far: float  # displacement or velocity at which a motion has diverged


class Functions(NamedTuple):
    """User's functions: a further force, restitution of stops, and control."""

    law: object  # the user's: further force, restitution of the upper and of the lower stop
    upper: object
    lower: object
    control: object = None  # a `Control` where there is one


class Scratch(NamedTuple):
    """Work arrays for one step."""

    waves: np.ndarray  # ratio, amplitude and angle at its start of the components of the forcing
    hertz: np.ndarray  # side, place, stiffness, exponent and loss of the Hertz stops in contact
    kq: np.ndarray
    kv: np.ndarray
    q: np.ndarray  # Bernstein coefficients of what position and velocity gain
    v: np.ndarray
    events: np.ndarray  # a row an event function; see `crossing`
    stack: np.ndarray


class Leg(NamedTuple):
    """The equation of motion in a mode, from the start of a step.

    Numbers rather than `Problem`, because passing arrays to the innermost functions costs more
    than these compute.
    """

    kappa: float
    damping: float
    constant: float
    origin: float
    waves: int
    hertz: int
    rate: float
    forced: bool
    elapsed: float
    omega: float
    inertia: float
    base_amplitude: float
    base_ratio: float
    base_angle: float


@cfunc("float64(float64, float64, float64)")
def no_law(t, x, v):
    """Zero: placeholder for a law that the oscillator does not have."""
    return 0.0


@kernel
def status(p, mode, k):
    """Digit of a stop."""
    return (mode // int(p.stops[k, WEIGHT])) % 3


@kernel
def origin(p, mode):
    """Where the positions of a mode count from."""
    at = 0.0
    for k in p.order:
        if status(p, mode, k) != OUT:
            at = p.stops[k, PLACE]
    return at


@kernel
def open_leg(p, s, turns, phase, low, mode, approach, y, v):
    """The equation of motion in a mode, from an instant on."""
    at = origin(p, mode)
    kappa, damping = p.kappa, p.damping
    constant = p.constant - p.kappa * at
    sliding = mode % 3
    if sliding != 0:
        constant += p.kinetic if sliding == 2 else -p.kinetic
    hertz = 0
    stiff, drag = 0.0, 0.0
    for k in range(len(p.stops)):
        if status(p, mode, k) != PUSHING:
            continue
        off = p.stops[k, PLACE] - at
        if p.stops[k, LAW] != HERTZ:
            kappa += p.stops[k, STIFFNESS]
            damping += p.stops[k, LOSS]
            constant += p.stops[k, STIFFNESS] * off
            continue
        n, loss = p.stops[k, EXPONENT], p.stops[k, LOSS]
        if p.stops[k, BY_APPROACH] >= 0:
            loss = approach_loss(p.stops[k, BY_APPROACH], approach[k])
        s.hertz[hertz, 0], s.hertz[hertz, 1], s.hertz[hertz, 2] = (
            p.stops[k, SIDE],
            off,
            p.stops[k, STIFFNESS],
        )
        s.hertz[hertz, 3], s.hertz[hertz, 4] = n, loss
        hertz += 1
        depth = max(p.stops[k, SIDE] * (y - off), 0.0)
        depth = max(depth, ((n + 1) * v * v / (2 * p.stops[k, STIFFNESS])) ** (1 / (n + 1)))
        stiff += n * p.stops[k, STIFFNESS] * depth ** (n - 1)
        drag += loss * p.stops[k, STIFFNESS] * depth**n
    for j in range(len(p.waves)):
        s.waves[j, 0], s.waves[j, 1] = p.waves[j, 0], p.waves[j, 1]
        s.waves[j, 2] = phase_of(p.waves[j, 0], turns, phase) + p.waves[j, 2] + p.waves[j, 0] * low
    rate = max(math.sqrt(kappa + stiff), damping + drag, p.fastest)
    elapsed = (turns * TURN + (phase - p.start)) + low
    base_angle = phase_of(p.base_ratio, turns, phase) + p.base_angle if p.forced else 0.0
    return Leg(
        kappa,
        damping,
        constant,
        at,
        len(p.waves),
        hertz,
        rate,
        p.forced,
        elapsed,
        p.omega,
        p.inertia,
        p.base_amplitude,
        p.base_ratio,
        base_angle,
    )


@inlined
def accelerate(law, control, leg, waves, hertz, tau, y, v):
    """Acceleration tau after the start of the step."""
    a = leg.constant - leg.kappa * y - leg.damping * v
    for j in range(leg.waves):
        a += waves[j, 1] * math.cos(waves[j, 2] + waves[j, 0] * tau)
    for i in range(leg.hertz):
        side, n = hertz[i, 0], hertz[i, 3]
        depth = side * (y - hertz[i, 1])
        if depth > 0:
            # `hertz_push`, written out: to call it costs long runs some per cent.
            power = depth * math.sqrt(depth) if n == 1.5 else depth**n
            a -= side * hertz[i, 2] * power * (1 + hertz[i, 4] * side * v)
    if leg.forced:
        x, u = y + leg.origin, v
        if leg.base_amplitude != 0.0:
            angle = leg.base_angle + leg.base_ratio * tau
            x += leg.base_amplitude * math.cos(angle)
            u -= leg.base_amplitude * leg.base_ratio * math.sin(angle)
        a += law((leg.elapsed + tau) / leg.omega, x, u * leg.omega) / leg.inertia
    if control is not None:
        a += pushed(control, tau, y + leg.origin, v)
    return a


@kernel
def pull(f, leg, s, tau, y, v):
    """`accelerate`, for callers outside the inner loop."""
    return accelerate(f.law, f.control, leg, s.waves, s.hertz, tau, y, v)


@kernel
def jerk(p, f, leg, s, y):
    """Rate of the acceleration of a mass that rests at y, at the start of the step."""
    rate = 0.0
    for j in range(len(p.waves)):
        rate -= p.waves[j, 0] * p.waves[j, 1] * math.sin(s.waves[j, 2])
    if p.forced:  # only the law's own part is differenced
        h = 1e-5
        later = accelerate(f.law, None, leg, s.waves, s.hertz, h, y, 0.0)
        later -= accelerate(f.law, None, leg, s.waves, s.hertz, -h, y, 0.0)
        known = 0.0
        for j in range(len(p.waves)):
            known -= 2 * p.waves[j, 1] * math.sin(s.waves[j, 2]) * math.sin(p.waves[j, 0] * h)
        rate += (later - known) / (2 * h)
    return rate + pushed_rate(f.control, y + leg.origin)
