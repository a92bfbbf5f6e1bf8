"""The stepping engine: Runge-Kutta from event to event, for forces of any kind.

Dormand and Prince's 8(5,3) with its interpolant of degree 7, or the classical steps of order 4.
Every event function is linear in position and velocity, so that over a step of the first it is a
polynomial of degree 7. In Bernstein form its coefficients bound it: where all are positive there is
no root, and halving isolates the first root there is. It is then polished by steps that end there,
which are more accurate than the interpolant.

Positions count from the origin of the mode: the deepest stop that is touched, so that nothing
cancels there. A mode is written in digits of base 3: the direction of sliding (0 none, 1 up,
2 down), then for each stop whether it is `OUT`, `PUSHING` or `SLACK`: reached, but left behind by a
stop that only ever pushes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import cfunc, njit

from ._events import (
    BROKEN,
    DIVERGED,
    DONE,
    EXHAUSTED,
    FULL,
    IMPACT,
    MARK,
    PART,
    RELEASE,
    REVERSE,
    STICK,
    TOUCH,
)

OUT, PUSHING, SLACK = range(3)
# Kinds of stop: Kelvin-Voigt stops end contact at zero gap (SPRING) or at zero force (PUSHER).
RIGID, SPRING, PUSHER, HERTZ = range(4)
# Event functions: a stop out of reach is reached; a stop parts; one left behind is out of reach, or
# pushes again; the sliding mass comes to rest.
REACH, LEAVE, EXIT, AGAIN, REST = range(5)
PARTS = 6  # of a step, in which the greatest force is looked for
# Columns of `Problem.stops`. LOSS is the damping of a Kelvin-Voigt stop, or the loss per velocity
# of Hunt and Crossley; RESTITUTION is negative where there is none or a function; the digit of the
# stop in the mode counts WEIGHT.
PLACE, SIDE, LAW, STIFFNESS, LOSS, EXPONENT, RESTITUTION, WEIGHT = range(8)
ROOM = 4  # rows that one pass of `run` may write, besides the first

TURN = 2 * math.pi
TURN_LOW = 2.4492935982947064e-16  # 2 pi - TURN
CALM = 0.01  # relative change of the pressing force for which chatter is a geometric series
DEGREE = 7

# The state goes on after the contract's entries with: step, greatest speed, and for each stop the
# approach velocity of its last contact. The counters: stop that holds the mass (-1: friction
# alone), and whether rows have been written.
STEP, SPEED, APPROACH = 4, 5, 6
HOLDER, BEGUN = 7, 8


class Problem(NamedTuple):
    """An oscillator in the unit of time of its reference forcing, per mass.

    Few arrays, as each that is passed on is counted by numba, at a cost.
    """

    kappa: float
    damping: float
    constant: float
    waves: np.ndarray  # ratio to the reference's frequency, amplitude and angle of the forcing
    fastest: float  # greatest of the ratios
    stops: np.ndarray  # a row for each of `Oscillator.stops`, its columns named above
    order: np.ndarray  # upper stops as they are reached, then the lower
    kinetic: float
    static: float
    forced: bool  # whether there is a `law` of the user's
    omega: float
    inertia: float  # mass omega^2
    start: float  # phase at t = 0
    swing: float  # amplitude, ratio and angle of what the stops move with
    pace: float
    sway: float
    chatter: float
    fixed: float  # step, or 0: adaptive
    tolerance: float
    longest: float


class Functions(NamedTuple):
    """The user's functions: further force, restitution of the upper and of the lower stop."""

    law: object
    upper: object
    lower: object


class Tableau(NamedTuple):
    """The method: stages, error estimates, and the interpolant as Bernstein coefficients."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    e3: np.ndarray
    e5: np.ndarray
    d: np.ndarray
    bernstein: np.ndarray


class Scratch(NamedTuple):
    """Room for one step."""

    waves: np.ndarray  # ratio, amplitude and angle at its start of the components of the forcing
    hertz: np.ndarray  # side, place, stiffness, exponent and loss of the Hertz stops in contact
    kq: np.ndarray
    kv: np.ndarray
    q: np.ndarray  # Bernstein coefficients of what position and velocity gain
    v: np.ndarray
    events: np.ndarray  # value, weight of position, weight of velocity, kind, stop
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
    swing: float  # amplitude, ratio and angle of the base
    pace: float
    sway: float


@cfunc("float64(float64, float64, float64)", cache=True)
def no_law(t, x, v):
    """Nothing, where a kernel wants a law."""
    return 0.0


@cfunc("float64(float64)", cache=True)
def no_restitution(v):
    """Nothing, where a kernel wants a restitution."""
    return 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def phase_of(ratio, turns, phase):
    """Ratio * (2 pi turns + phase) modulo 2 pi, without losing digits to the number of turns."""
    if ratio == 1.0:
        return phase
    product = ratio * turns
    # Dekker's exact product: what rounding took from ratio * turns.
    t = 134217729.0 * ratio
    high = t - (t - ratio)
    low = ratio - high
    t = 134217729.0 * turns
    high2 = t - (t - turns)
    low2 = turns - high2
    error = ((high * high2 - product) + high * low2 + low * high2) + low * low2
    return TURN * ((product - math.floor(product)) + error) + ratio * phase


@njit(cache=True, nogil=True, error_model="numpy")
def pass_time(clock, tau):
    """Add tau to the phase as a compensated sum, and keep it below a turn."""
    total = clock[1] + tau
    part = total - clock[1]
    clock[2] += (clock[1] - (total - part)) + (tau - part)
    while total >= TURN:
        total -= TURN
        clock[2] -= TURN_LOW
        clock[0] += 1
    clock[1] = total + clock[2]
    clock[2] += total - clock[1]
    if clock[1] < 0:
        clock[1] += TURN
        clock[0] -= 1
        clock[2] += TURN_LOW


@njit(cache=True, nogil=True, error_model="numpy")
def status(p, mode, k):
    """Digit of a stop."""
    return (mode // int(p.stops[k, WEIGHT])) % 3


@njit(cache=True, nogil=True, error_model="numpy")
def origin(p, mode):
    """Where the positions of a mode count from."""
    at = 0.0
    for k in p.order:
        if status(p, mode, k) != OUT:
            at = p.stops[k, PLACE]
    return at


@njit(cache=True, nogil=True, error_model="numpy")
def become(p, state, count, k, new):
    """Change the digit of a stop, and count the position from the new origin."""
    old = origin(p, count[0])
    count[0] += (new - status(p, count[0], k)) * int(p.stops[k, WEIGHT])
    at = origin(p, count[0])
    if at != old:
        state[0] += old - at
    state[STEP] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def slide(count, direction):
    """Change the digit of sliding."""
    count[0] += (0 if direction == 0 else (1 if direction > 0 else 2)) - count[0] % 3


@njit(cache=True, nogil=True, error_model="numpy")
def open_leg(p, s, turns, phase, low, mode, approach, y, v):
    """The equation of motion in a mode from that instant."""
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
        if p.stops[k, RESTITUTION] >= 0:
            # A touch at no speed has no velocity to measure the loss by, and none is taken.
            r = p.stops[k, RESTITUTION]
            loss = 0.75 * (1 - r * r) / approach[k] if approach[k] > 0 else 0.0
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
    sway = phase_of(p.pace, turns, phase) + p.sway if p.forced else 0.0
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
        p.swing,
        p.pace,
        sway,
    )


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def accelerate(law, leg, waves, hertz, tau, y, v):
    """Acceleration tau after the start of the step."""
    a = leg.constant - leg.kappa * y - leg.damping * v
    for j in range(leg.waves):
        a += waves[j, 1] * math.cos(waves[j, 2] + waves[j, 0] * tau)
    for i in range(leg.hertz):
        side, n = hertz[i, 0], hertz[i, 3]
        depth = side * (y - hertz[i, 1])
        if depth > 0:
            power = depth * math.sqrt(depth) if n == 1.5 else depth**n
            a -= side * hertz[i, 2] * power * (1 + hertz[i, 4] * side * v)
    if leg.forced:
        x, u = y + leg.origin, v
        if leg.swing != 0.0:
            angle = leg.sway + leg.pace * tau
            x += leg.swing * math.cos(angle)
            u -= leg.swing * leg.pace * math.sin(angle)
        a += law((leg.elapsed + tau) / leg.omega, x, u * leg.omega) / leg.inertia
    return a


@njit(cache=True, nogil=True, error_model="numpy")
def pull(f, leg, s, tau, y, v):
    """`accelerate`, where it need not be fast."""
    return accelerate(f.law, leg, s.waves, s.hertz, tau, y, v)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def classical(law, leg, waves, hertz, t, h, y, v, a):
    """What position and velocity gain in a classical step, t after the start of the leg."""
    v1 = v + h / 2 * a
    a1 = accelerate(law, leg, waves, hertz, t + h / 2, y + h / 2 * v, v1)
    v2 = v + h / 2 * a1
    a2 = accelerate(law, leg, waves, hertz, t + h / 2, y + h / 2 * v1, v2)
    v3 = v + h * a2
    a3 = accelerate(law, leg, waves, hertz, t + h, y + h * v2, v3)
    return h / 6 * (v + 2 * v1 + 2 * v2 + v3), h / 6 * (a + 2 * a1 + 2 * a2 + a3)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def stages(law, leg, waves, hertz, a, c, kq, kv, first, last, h, y, v):
    """Work out some stages from those before them."""
    for i in range(first, last):
        x = u = 0.0
        for j in range(i):
            x += a[i, j] * kq[j]
            u += a[i, j] * kv[j]
        kq[i] = v + h * u
        kv[i] = accelerate(law, leg, waves, hertz, c[i] * h, y + h * x, kq[i])


@njit(cache=True, nogil=True, error_model="numpy")
def take(fixed, tab, law, leg, s, h, y, v, a):
    """What position and velocity gain in a step of h from y, v, where the acceleration is a."""
    if fixed > 0:
        return classical(law, leg, s.waves, s.hertz, 0.0, h, y, v, a)
    kq, kv = s.kq, s.kv
    kq[0], kv[0] = v, a
    stages(law, leg, s.waves, s.hertz, tab.a, tab.c, kq, kv, 1, 12, h, y, v)
    dq = dv = 0.0
    for i in range(12):
        dq += tab.b[i] * kq[i]
        dv += tab.b[i] * kv[i]
    return h * dq, h * dv


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def error(tolerance, rate, tab, s, h, y, v, dv, speed):
    """Error of the step just taken, in units of the tolerance.

    In units of velocity: a displacement counts by the rate of the leg. The tolerance is relative to
    the speed and what the step changes of it, but to no less than a thousandth of the greatest
    speed so far; and rounding is no error of the step's.
    """
    q3 = v3 = q5 = v5 = 0.0
    for i in range(13):
        q3 += tab.e3[i] * s.kq[i]
        v3 += tab.e3[i] * s.kv[i]
        q5 += tab.e5[i] * s.kq[i]
        v5 += tab.e5[i] * s.kv[i]
    n3 = (rate * q3) ** 2 + v3 * v3
    n5 = (rate * q5) ** 2 + v5 * v5
    if n5 == 0.0 and n3 == 0.0:
        return 0.0
    scale = max(abs(v), abs(v + dv), h * abs(s.kv[0]), 1e-3 * speed)
    allowed = tolerance * scale + 1e-15 * rate * abs(y)
    return h * n5 / math.sqrt(2 * (n5 + 0.01 * n3)) / allowed


@njit(cache=True, nogil=True, error_model="numpy")
def first_step(p, leg, y):
    """A step to begin with; the error estimate corrects it."""
    if leg.hertz > 0:
        # depth^n is not smooth where contact begins.
        return p.tolerance ** (1 / 3.5) / leg.rate
    return min(6 * p.tolerance**0.125 / leg.rate, p.longest)


@njit(cache=True, nogil=True, error_model="numpy")
def stride(p, tab, f, leg, s, wish, end, y, v, a, speed):
    """A step within the tolerance, no longer than `end`.

    Returns its length (0 where no step of any length has a finite end), what position and velocity
    gain, the step to try next, and how many were tried.
    """
    if p.fixed > 0:
        h = min(p.fixed, end)
        dq, dv = take(p.fixed, tab, f.law, leg, s, h, y, v, a)
        return h if math.isfinite(dq) and math.isfinite(dv) else 0.0, dq, dv, p.fixed, 1
    h = wish if wish > 0 else first_step(p, leg, y)
    # A jump of the force costs an error of the step's length, so that shorter ones gain nothing.
    least = 1e-3 * p.tolerance / leg.rate
    grow = 6.0
    tries = 0
    while True:
        tries += 1
        step = min(h, end)
        dq, dv = take(p.fixed, tab, f.law, leg, s, step, y, v, a)
        s.kq[12] = v + dv
        s.kv[12] = pull(f, leg, s, step, y + dq, v + dv)
        size = error(p.tolerance, leg.rate, tab, s, step, y, v, dv, speed)
        if not math.isfinite(size):
            if step <= least:
                return 0.0, dq, dv, h, tries
            h = 0.1 * step
            continue
        factor = min(grow, max(0.2, 0.9 * size**-0.125)) if size > 0 else grow
        if size <= 1 or step <= least:
            return step, dq, dv, h if step < h else min(h * factor, p.longest), tries
        h = step * min(factor, 0.9)
        grow = 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(tab, f, leg, s, h, y, v, dq, dv):
    """Bernstein coefficients of what position and velocity gain over the step just taken."""
    stages(f.law, leg, s.waves, s.hertz, tab.a, tab.c, s.kq, s.kv, 13, 16, h, y, v)
    for gain, rates, out in ((dq, s.kq, s.q), (dv, s.kv, s.v)):
        for n in range(DEGREE + 1):
            out[n] = 0.0
        for m in range(DEGREE):
            if m == 0:
                part = gain
            elif m == 1:
                part = h * rates[0] - gain
            elif m == 2:
                part = 2 * gain - h * (rates[12] + rates[0])
            else:
                part = 0.0
                for i in range(16):
                    part += tab.d[m - 3, i] * rates[i]
                part *= h
            for n in range(DEGREE + 1):
                out[n] += tab.bernstein[n, m] * part
        out[1] = h * rates[0] / DEGREE  # without the rounding: small gaps live on it
        out[DEGREE] = gain


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def value(c, w, n, x):
    """Polynomial in Bernstein form and its derivative, by de Casteljau's scheme, at x."""
    for i in range(n + 1):
        w[i] = c[i]
    for m in range(n, 1, -1):
        for i in range(m):
            w[i] += x * (w[i + 1] - w[i])
    if n == 0:
        return w[0], 0.0
    return w[0] + x * (w[1] - w[0]), n * (w[1] - w[0])


@njit(cache=True, nogil=True, error_model="numpy")
def first_root(stack, n):
    """First root in [0, 1] of the polynomial of degree n in stack[0], positive at first; or 2."""
    stack[0, 8], stack[0, 9] = 0.0, 1.0
    top = 1
    while top > 0:
        top -= 1
        c = stack[top]
        low, high = c[8], c[9]
        changes = 0
        sign = 1
        least = math.inf
        for i in range(n + 1):
            least = min(least, c[i])
            if c[i] != 0 and (c[i] > 0) != (sign > 0):
                changes += 1
                sign = -sign
        if least > 0:
            continue
        if low > 0 and c[0] <= 0:
            return low
        if changes == 1 and c[0] > 0 and c[n] < 0:
            left, right, x = 0.0, 1.0, c[0] / (c[0] - c[n])
            for _ in range(60):
                y, slope = value(c, stack[-1], n, x)
                if y > 0:
                    left = x
                else:
                    right = x
                new = x - y / slope if slope < 0 else -1.0
                if not (left < new < right):
                    new = (left + right) / 2
                if abs(new - x) <= 1e-16 or right - left <= 1e-16 or new == x:
                    break
                x = new
            return low + (high - low) * x
        if high - low < 1e-13:
            if c[n] < 0:
                return high
            continue
        # Halve by de Casteljau's scheme: the left half stands on top.
        left_half = stack[top + 1]
        left_half[0] = c[0]
        for m in range(1, n + 1):
            for i in range(n + 1 - m):
                c[i] = (c[i] + c[i + 1]) / 2
            left_half[m] = c[0]
        middle = (low + high) / 2
        stack[top, 8], stack[top, 9] = middle, high
        stack[top + 1, 8], stack[top + 1, 9] = low, middle
        top += 2
    return 2.0


@njit(cache=True, nogil=True, error_model="numpy")
def jerk(p, f, leg, s, y):
    """Rate of the acceleration of a mass that rests at y, at the start of the step."""
    rate = 0.0
    for j in range(len(p.waves)):
        rate -= p.waves[j, 0] * p.waves[j, 1] * math.sin(s.waves[j, 2])
    if p.forced:  # only the law's own part is differenced
        h = 1e-5
        later = pull(f, leg, s, h, y, 0.0) - pull(f, leg, s, -h, y, 0.0)
        known = 0.0
        for j in range(len(p.waves)):
            known -= 2 * p.waves[j, 1] * math.sin(s.waves[j, 2]) * math.sin(p.waves[j, 0] * h)
        rate += (later - known) / (2 * h)
    return rate


@njit(cache=True, nogil=True, error_model="numpy")
def list_events(p, s, leg, mode, y, v):
    """Write the event functions of a mode, positive while it lasts, to `events`; their number."""
    n = 0
    ahead = 0.0  # the side on which the next stop is found; what stands behind it is reached later
    for k in p.order:
        side, digit = p.stops[k, SIDE], status(p, mode, k)
        if side == ahead:
            continue
        depth = side * (y - (p.stops[k, PLACE] - leg.origin))
        stiffness, loss = p.stops[k, STIFFNESS], p.stops[k, LOSS]
        force = stiffness * depth + loss * side * v
        if digit == OUT:
            enter(s.events, n, -depth, -side, 0.0, REACH, k)
            ahead = side
        elif digit == SLACK:
            enter(s.events, n, depth, side, 0.0, EXIT, k)
            n += 1
            enter(s.events, n, -force, -stiffness * side, -loss * side, AGAIN, k)
        elif p.stops[k, LAW] == PUSHER:
            enter(s.events, n, force, stiffness * side, loss * side, LEAVE, k)
        else:
            enter(s.events, n, depth, side, 0.0, LEAVE, k)
        n += 1
    if mode % 3 != 0:
        sign = 1.0 if mode % 3 == 1 else -1.0
        enter(s.events, n, sign * v, 0.0, sign, REST, -1)
        n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def enter(events, n, at, of_position, of_velocity, kind, k):
    """Write one event function."""
    row = events[n]
    row[0], row[1], row[2], row[3], row[4] = at, of_position, of_velocity, kind, k


@njit(cache=True, nogil=True, error_model="numpy")
def zeros_at_start(p, f, leg, s, row, y, v, a, balanced):
    """How many times an event function is zero where the step starts; -1 if it falls from there.

    `balanced`: the mass was just let go where the forces on it cancel, so that what the
    acceleration is but for rounding is known.
    """
    if row[0] > 0:
        return 0
    if row[3] == REST and v == 0.0:
        return 2 if balanced else 1
    slope = row[1] * v + row[2] * a
    if slope != 0:
        return 1 if slope > 0 else -1
    if balanced:
        return 3
    bend = row[1] * a
    if bend != 0:
        return 2 if bend > 0 else -1
    return 3 if row[1] * jerk(p, f, leg, s, y) >= 0 else -1


@njit(cache=True, nogil=True, error_model="numpy")
def event_root(s, row, zeros):
    """First root of an event function over the step, past those where it starts; 2 if none."""
    c = s.stack[0]
    for i in range(DEGREE + 1):
        c[i] = row[0] + row[1] * s.q[i] + row[2] * s.v[i]
    n = DEGREE
    for _ in range(zeros):
        start = c[0]
        for i in range(n):
            c[i] = (c[i + 1] - start) * n / (i + 1)
        n -= 1
    return first_root(s.stack, n)


@njit(cache=True, nogil=True, error_model="numpy")
def unstick(p, f, leg, s, y, low, high, end):
    """Time until the force on a mass that rests leaves [low, high], or `end` if that is sooner.

    Returns it with the direction in which the mass goes, 0 if it stays, 2 if the law is no number.
    Without a law no root can be jumped, as the second derivative of the forcing is bounded; with
    one, its force is looked at 64 times in the period of the fastest forcing.
    """
    reach, most = 0.0, 0.0
    for j in range(len(p.waves)):
        reach += abs(p.waves[j, 1])
        most += abs(p.waves[j, 1]) * p.waves[j, 0] ** 2
    tau, before = 0.0, 0.0
    if not p.forced:
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
        out = 1 if force > high or (force == high and rate > 0 and not p.forced) else 0
        if force < low or (force == low and rate < 0 and not p.forced):
            out = -1
        if out != 0 and p.forced and tau > before:
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
        if p.forced:
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


@njit(cache=True, nogil=True, error_model="numpy")
def clear(gap, slope, most):
    """Time in which a gap stays open for certain, as |gap''| <= most."""
    root = math.sqrt(slope * slope + 2 * most * gap)
    return 2 * gap / (root - slope) if slope < 0 else (slope + root) / most


@njit(cache=True, nogil=True, error_model="numpy")
def rigid_at(p, leg, y):
    """The rigid stop that the mass is at, or -1."""
    for k in range(len(p.stops)):
        if p.stops[k, LAW] == RIGID and y == p.stops[k, PLACE] - leg.origin:
            return k
    return -1


@njit(cache=True, nogil=True, error_model="numpy")
def holding(p, k):
    """The forces that friction and the rigid stop k (-1: none) hold."""
    low = -math.inf if k >= 0 and p.stops[k, SIDE] < 0 else -p.static
    high = math.inf if k >= 0 and p.stops[k, SIDE] > 0 else p.static
    return low, high


@njit(cache=True, nogil=True, error_model="numpy")
def departure(p, f, leg, s, y, k):
    """Where a mass at rest goes: 1 up, -1 down, 0 stays, 2 no number; and if from a balance."""
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


@njit(cache=True, nogil=True, error_model="numpy")
def note(events, count, clock, state, kind, k, approach):
    """Write one event."""
    if len(events) == 0:
        return
    row = events[count[5]]
    row[0], row[1], row[2], row[3] = clock[0], clock[1], kind, k
    row[4], row[5], row[6], row[7] = count[0], state[0], state[1], approach
    count[5] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def run(p, tab, f, s, clock, state, count, events, end_turns, end_phase, most_steps):
    """Move to the end phase, writing events as rows; to be called again when they are full."""
    spent = 0
    count[5] = 0
    room = len(events)
    if room > 0 and count[BEGUN] == 0:
        # The loss of a contact under way is by its approach velocity, which a start does not tell.
        for k in range(len(p.stops)):
            if room < len(p.stops) + ROOM:
                return FULL
            if p.stops[k, LAW] == HERTZ and status(p, count[0], k) == PUSHING:
                note(events, count, clock, state, MARK, k, state[APPROACH + k])
        count[BEGUN] = 1
    approach = state[APPROACH:]
    while True:
        if room > 0 and count[5] + ROOM > room:
            return FULL
        if spent >= most_steps:
            return EXHAUSTED
        end = (end_turns - clock[0]) * TURN + (end_phase - clock[1]) - clock[2]
        if end <= 0:
            return DONE
        y, v = state[0], state[1]
        if not (abs(y) < 1e140 and abs(v) < 1e140):
            return DIVERGED  # their squares would overflow
        balanced = False
        if v == 0.0:
            rest = count[0] - count[0] % 3
            leg = open_leg(p, s, clock[0], clock[1], clock[2], rest, approach, y, v)
            k = rigid_at(p, leg, y)
            if count[1] != 0:
                low, high = holding(p, count[HOLDER])
                wait = min(end, TURN)
                tau, way = unstick(p, f, leg, s, y, low, high, wait)
                if way == 2:
                    return BROKEN
                spent += 1
                count[6] += 1
                if tau >= end:
                    clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                    return DONE
                pass_time(clock, tau)
                if way == 0:
                    continue
                count[1] = 0
                if p.static > 0:
                    slide(count, way)
                note(events, count, clock, state, RELEASE, count[HOLDER], 0.0)
                end -= tau
                balanced = p.static == p.kinetic
            elif k >= 0 or p.static > 0:
                way, balanced = departure(p, f, leg, s, y, k)
                if way == 2:
                    return BROKEN
                if way == 0:
                    hold(p, clock, state, count, events, k)
                    continue
                if p.static > 0:
                    slide(count, way)
        elif p.static > 0 and count[0] % 3 == 0:
            slide(count, 1 if v > 0 else -1)

        leg = open_leg(p, s, clock[0], clock[1], clock[2], count[0], approach, y, v)
        a = pull(f, leg, s, 0.0, y, v)
        if not math.isfinite(a):
            return BROKEN if p.forced else DIVERGED
        number = list_events(p, s, leg, count[0], y, v)
        due = -1
        for i in range(number):
            zeros = zeros_at_start(p, f, leg, s, s.events[i], y, v, a, balanced)
            s.events[i, 5] = zeros
            if zeros < 0 and due < 0:
                due = i
        if due < 0:
            step, dq, dv, wish, tries = stride(
                p, tab, f, leg, s, state[STEP], end, y, v, a, state[SPEED]
            )
            spent += tries if p.fixed == 0 else 0
            count[6] += tries if p.fixed == 0 else 0
            if step == 0.0:
                return BROKEN if p.forced else DIVERGED
            if p.fixed > 0:
                due, step, dq, dv = halve(p, tab, f, leg, s, number, step, y, v, a, dq, dv)
            else:
                due, at = earliest(p, tab, f, leg, s, number, step, y, v, dq, dv)
                if due >= 0:
                    step, dq, dv = polish(
                        p, tab, f, leg, s, s.events[due], at * step, step, y, v, a
                    )
                else:
                    state[STEP] = wish
            turns = clock[0]
            state[0], state[1] = y + dq, v + dv
            if touched(p, count[0]) == 0:  # else it is among what the contact loses
                state[3] += p.kinetic * abs(dq)
            state[SPEED] = max(state[SPEED], abs(state[1]))
            if due < 0 and step >= end:
                clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                inside(p, state, count)
                return DONE
            pass_time(clock, step)
            if due < 0:
                if clock[0] > turns:
                    # Of the steps of fixed length, a turn's are one piece of work.
                    spent += 1 if p.fixed > 0 else 0
                    count[6] += 1 if p.fixed > 0 else 0
                    note(events, count, clock, state, MARK, -1, 0.0)
                continue
        spent += 1
        count[6] += 1
        end = (end_turns - clock[0]) * TURN + (end_phase - clock[1]) - clock[2]
        kind, k = int(s.events[due, 3]), int(s.events[due, 4])
        if kind == REST:
            rest_or_turn(p, f, s, clock, state, count, events)
        elif kind == REACH and p.stops[k, LAW] == RIGID:
            state[0] = p.stops[k, PLACE] - leg.origin
            if p.stops[k, SIDE] * state[1] <= 0:  # closed at the very turning point
                state[1] = 0.0
                if p.static > 0:
                    slide(count, 0)
            elif not rebound(p, f, s, clock, state, count, events, k, end, end_turns, end_phase):
                return BROKEN
        else:
            change_contact(p, clock, state, count, events, kind, k)


@njit(cache=True, nogil=True, error_model="numpy")
def inside(p, state, count):
    """Take back what rounding has put behind a rigid stop."""
    at = origin(p, count[0])
    for k in range(len(p.stops)):
        if (
            p.stops[k, LAW] == RIGID
            and p.stops[k, SIDE] * (state[0] - (p.stops[k, PLACE] - at)) > 0
        ):
            state[0] = p.stops[k, PLACE] - at


@njit(cache=True, nogil=True, error_model="numpy")
def earliest(p, tab, f, leg, s, number, step, y, v, dq, dv):
    """The event that comes first on the interpolant of a step, and its share of the step."""
    due, at = -1, 2.0
    if number > 0:
        interpolate(tab, f, leg, s, step, y, v, dq, dv)
        for i in range(number):
            x = event_root(s, s.events[i], int(s.events[i, 5]))
            if x < at:
                due, at = i, x
    return due, at


@njit(cache=True, nogil=True, error_model="numpy")
def polish(p, tab, f, leg, s, row, h, most, y, v, a):
    """The step that ends at an event, from its instant on the interpolant.

    Newton's iteration on the length of the step itself. Where that leads away, the event grazes,
    and the interpolant has the last word.
    """
    first = h
    dq, dv = take(p.fixed, tab, f.law, leg, s, h, y, v, a)
    last = math.inf
    for _ in range(8):
        at = row[0] + row[1] * dq + row[2] * dv
        slope = row[1] * (v + dv)
        if row[2] != 0.0:
            slope += row[2] * pull(f, leg, s, h, y + dq, v + dv)
        if not slope < 0:
            break
        move = -at / slope
        if abs(move) > 1e-3 * first or not abs(move) < last or h + move <= 0 or h + move > most:
            break
        last = abs(move)
        h += move
        dq, dv = take(p.fixed, tab, f.law, leg, s, h, y, v, a)
        if last <= 4e-16 * h:
            break
    return h, dq, dv


@njit(cache=True, nogil=True, error_model="numpy")
def passed(s, number, dq, dv):
    """The first listed event function that is negative after a gain, or -1."""
    for i in range(number):
        row = s.events[i]
        if row[0] + row[1] * dq + row[2] * dv < 0:
            return i
    return -1


@njit(cache=True, nogil=True, error_model="numpy")
def halve(p, tab, f, leg, s, number, step, y, v, a, dq, dv):
    """The way of the thesis: where a step passes an event, halves of it that do not, to the end.

    Returns the event (-1: none was passed), and the sum of those halves and of what they gain.
    """
    due = passed(s, number, dq, dv)
    if due < 0:
        return due, step, dq, dv
    t = x = u = 0.0
    part = step
    least = 2e-16 * step
    while part > least:
        part /= 2
        start = pull(f, leg, s, t, y + x, v + u) if t > 0 else a
        more, faster = classical(f.law, leg, s.waves, s.hertz, t, part, y + x, v + u, start)
        i = passed(s, number, x + more, u + faster)
        if i < 0:
            t, x, u = t + part, x + more, u + faster
        else:
            due = i
    return due, t, x, u


@njit(cache=True, nogil=True, error_model="numpy")
def hold(p, clock, state, count, events, k):
    """Stick, to the rigid stop k or by friction alone (-1)."""
    state[1] = 0.0
    state[STEP] = 0.0
    count[1] = 1
    count[3] += 1
    count[HOLDER] = k
    slide(count, 0)
    note(events, count, clock, state, STICK, k, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def rest_or_turn(p, f, s, clock, state, count, events):
    """A sliding mass comes to rest: it turns, unless it is held (which the next pass finds)."""
    state[1] = 0.0
    slide(count, 0)
    leg = open_leg(p, s, clock[0], clock[1], clock[2], count[0], state[APPROACH:], state[0], 0.0)
    way, _ = departure(p, f, leg, s, state[0], rigid_at(p, leg, state[0]))
    if abs(way) == 1:
        slide(count, way)
        note(events, count, clock, state, REVERSE, -1, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def touched(p, mode):
    """How many stops push."""
    number = 0
    for k in range(len(p.stops)):
        number += status(p, mode, k) == PUSHING
    return number


@njit(cache=True, nogil=True, error_model="numpy")
def change_contact(p, clock, state, count, events, kind, k):
    """Touch a soft stop, or part from it, or pass one left behind.

    The energy lost at stops is the kinetic energy that was there before the first of them was
    touched less that after the last has parted.
    """
    before = touched(p, count[0])
    v = state[1]
    if kind in (REACH, AGAIN):
        become(p, state, count, k, PUSHING)
        if kind == REACH:
            state[0] = p.stops[k, PLACE] - origin(p, count[0])
        count[2] += 1
        count[4] += 1
        state[2] = max(state[2], abs(v))
        state[APPROACH + k] = abs(v)
        state[3] += v * v / 2 if before == 0 else 0.0
        note(events, count, clock, state, TOUCH, k, abs(v))
        return
    if kind == LEAVE and p.stops[k, LAW] == PUSHER:
        depth = p.stops[k, SIDE] * (state[0] - (p.stops[k, PLACE] - origin(p, count[0])))
        become(p, state, count, k, SLACK if depth > 0 else OUT)
    else:
        become(p, state, count, k, OUT)
        state[0] = p.stops[k, PLACE] - origin(p, count[0])
    if kind == LEAVE:
        state[3] -= v * v / 2 if before == 1 else 0.0
        note(events, count, clock, state, PART, k, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def restitution_at(p, f, k, v):
    """Restitution coefficient of a rigid stop at an approach velocity; NaN if it cannot be."""
    if p.stops[k, RESTITUTION] >= 0:
        return p.stops[k, RESTITUTION]
    r = f.upper(v * p.omega) if p.stops[k, SIDE] > 0 else f.lower(v * p.omega)
    return r if 0 <= r <= 1 else math.nan


@njit(cache=True, nogil=True, error_model="numpy")
def rebound(p, f, s, clock, state, count, events, k, end, end_turns, end_phase):
    """Reset the velocity at a rigid stop; sum chatter to its end, where the mass sticks.

    False if the user's restitution is none.
    """
    side = p.stops[k, SIDE]
    v = abs(state[1])
    r = restitution_at(p, f, k, v)
    if math.isnan(r):
        return False
    out = r * v
    state[1] = -side * out if out > 0 else 0.0
    state[2] = max(state[2], v)
    free = touched(p, count[0]) == 0
    if free:
        state[3] += (v * v - out * out) / 2
    count[2] += 1
    if p.static > 0:
        slide(count, 0 if out == 0.0 else -side)
    note(events, count, clock, state, IMPACT, k, v)
    if out == 0.0 or out > p.chatter * state[2] or r == 1.0:
        return True
    rest = count[0] - count[0] % 3
    leg = open_leg(
        p, s, clock[0], clock[1], clock[2], rest, state[APPROACH:], state[0], state[1]
    )  # fmt: skip
    pressing = side * pull(f, leg, s, 0.0, state[0], 0.0)
    if not pressing > p.static:
        return True
    # Friction shortens the way out and slows the way back.
    up, down = pressing + p.kinetic, pressing - p.kinetic
    kept = math.sqrt(down / up)
    if p.stops[k, RESTITUTION] >= 0:
        left = out * (1 / up + kept / down) / (1 - r * kept)
    else:
        left, speed = 0.0, out
        for _ in range(100_000):
            part = speed * (1 / up + kept / down)
            left += part
            if part <= 1e-16 * left:
                break
            share = restitution_at(p, f, k, kept * speed)
            if math.isnan(share):
                return False
            speed *= kept * share
    most = 0.0
    for j in range(len(p.waves)):
        most += abs(p.waves[j, 1]) * p.waves[j, 0] ** 2
    change = abs(jerk(p, f, leg, s, state[0])) + most * left
    change += leg.rate * (pressing * (leg.damping > 0) + leg.rate * out)
    if change * left > CALM * (pressing - p.static):
        return True
    if free:
        state[3] += out * out / 2
    if left >= end:
        clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
    else:
        pass_time(clock, left)
    hold(p, clock, state, count, events, k)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def recall(p, rows, w, approach):
    """Approach velocities of the contacts under way in row w, from the rows before it."""
    for k in range(len(p.stops)):
        approach[k] = 0.0
        if p.stops[k, RESTITUTION] < 0 or p.stops[k, LAW] != HERTZ:
            continue
        if status(p, int(rows[w, 4]), k) == PUSHING:
            for r in range(w, -1, -1):
                if rows[r, 3] == k and (rows[r, 2] == TOUCH or rows[r, 2] == MARK):
                    approach[k] = rows[r, 7]
                    break


@njit(cache=True, nogil=True, error_model="numpy")
def mode_of(p, f, s, row, approach):
    """Mode of the motion after a row: a start does not tell which way the mass slides."""
    mode = int(row[4])
    if p.static > 0 and mode % 3 == 0 and row[2] != STICK:
        way = 1 if row[6] > 0 else -1
        if row[6] == 0.0:
            leg = open_leg(p, s, row[0], row[1], 0.0, mode, approach, row[5], 0.0)
            way, _ = departure(p, f, leg, s, row[5], rigid_at(p, leg, row[5]))
        if abs(way) == 1:
            mode += 1 if way > 0 else 2
    return mode


@njit(cache=True, nogil=True, error_model="numpy")
def sample(p, tab, f, s, rows, where, turns, phase, order, q, v):
    """Position and velocity at instants, each after the row that `where` names.

    `order` has the instants of a row together and in the order of time.
    """
    approach = np.empty(len(p.stops))
    clock = np.empty(3)
    current = -1
    mode = 0
    x = u = a = step = dq = dv = wish = speed = 0.0
    leg = open_leg(p, s, 0.0, 0.0, 0.0, 0, approach, 0.0, 0.0)
    for n in order:
        w = where[n]
        if w != current:
            current = w
            recall(p, rows, w, approach)
            mode = mode_of(p, f, s, rows[w], approach)
            clock[0], clock[1], clock[2] = rows[w, 0], rows[w, 1], 0.0
            x, u, wish, step = rows[w, 5], rows[w, 6], 0.0, -1.0
            speed = abs(u)
        while True:
            tau = (turns[n] - clock[0]) * TURN + (phase[n] - clock[1]) - clock[2]
            if rows[w, 2] == STICK or tau <= 0:
                at, velocity = x, u
                break
            if step < 0:
                leg = open_leg(p, s, clock[0], clock[1], clock[2], mode, approach, x, u)
                a = pull(f, leg, s, 0.0, x, u)
                step, dq, dv, wish, _ = stride(
                    p, tab, f, leg, s, wish, p.longest, x, u, a, speed
                )  # fmt: skip
            if step == 0.0:
                at, velocity = math.nan, math.nan
                break
            if tau <= step:
                more, faster = take(p.fixed, tab, f.law, leg, s, tau, x, u, a)
                at, velocity = x + more, u + faster
                break
            x, u = x + dq, u + dv
            speed = max(speed, abs(u))
            pass_time(clock, step)
            step = -1.0
        at += origin(p, mode)
        for k in range(len(p.stops)):
            if p.stops[k, LAW] == RIGID and p.stops[k, SIDE] * (at - p.stops[k, PLACE]) > 0:
                at = p.stops[k, PLACE]
        q[n], v[n] = at, velocity


@njit(cache=True, nogil=True, error_model="numpy")
def push_of(p, k, loss, depth, inward):
    """Force per mass of a soft stop."""
    if depth < 0:
        return 0.0
    if p.stops[k, LAW] == HERTZ:
        return p.stops[k, STIFFNESS] * depth ** p.stops[k, EXPONENT] * (1 + loss * inward)
    return p.stops[k, STIFFNESS] * depth + p.stops[k, LOSS] * inward


@njit(cache=True, nogil=True, error_model="numpy")
def peaks(p, tab, f, s, rows, first, last, end_turns, end_phase, out):
    """Greatest force of contacts per mass, each from the row of its touch to that of its end."""
    approach = np.empty(len(p.stops))
    clock = np.empty(3)
    for n in range(len(first)):
        k = int(rows[first[n], 3])
        side = p.stops[k, SIDE]
        best = -math.inf
        for w in range(first[n], last[n]):
            recall(p, rows, w, approach)
            row = rows[w]
            mode = mode_of(p, f, s, row, approach)
            loss = p.stops[k, LOSS]
            if p.stops[k, RESTITUTION] >= 0:
                loss = (
                    0.75 * (1 - p.stops[k, RESTITUTION] ** 2) / approach[k]
                    if approach[k] > 0
                    else 0.0
                )
            clock[0], clock[1], clock[2] = row[0], row[1], 0.0
            x, u, wish, speed = row[5], row[6], 0.0, abs(row[6])
            until_turns, until_phase = end_turns, end_phase
            if w + 1 < len(rows):
                until_turns, until_phase = rows[w + 1, 0], rows[w + 1, 1]
            off = p.stops[k, PLACE] - origin(p, mode)
            best = max(best, push_of(p, k, loss, max(side * (x - off), 0.0), side * u))
            while row[2] != STICK:
                end = (until_turns - clock[0]) * TURN + (until_phase - clock[1]) - clock[2]
                if end <= 0:
                    break
                leg = open_leg(p, s, clock[0], clock[1], clock[2], mode, approach, x, u)
                a = pull(f, leg, s, 0.0, x, u)
                step, dq, dv, wish, _ = stride(p, tab, f, leg, s, wish, end, x, u, a, speed)
                if step == 0.0:
                    break
                top, greatest = 0, push_of(p, k, loss, side * (x - off), side * u)
                for i in range(1, PARTS + 1):
                    more, faster = take(p.fixed, tab, f.law, leg, s, step * i / PARTS, x, u, a)
                    force = push_of(p, k, loss, side * (x + more - off), side * (u + faster))
                    if force > greatest:
                        greatest, top = force, i
                best = max(best, greatest)
                if greatest > 0.9 * best:
                    # The force has one maximum between the neighbours of its greatest value.
                    low = step * max(top - 1, 0) / PARTS
                    high = step * min(top + 1, PARTS) / PARTS
                    for _ in range(40):
                        left = high - 0.6180339887498949 * (high - low)
                        right = low + (high - left)
                        more, faster = take(p.fixed, tab, f.law, leg, s, left, x, u, a)
                        one = push_of(p, k, loss, side * (x + more - off), side * (u + faster))
                        more, faster = take(p.fixed, tab, f.law, leg, s, right, x, u, a)
                        two = push_of(p, k, loss, side * (x + more - off), side * (u + faster))
                        best = max(best, one, two)
                        if one < two:
                            low = left
                        else:
                            high = right
                x, u = x + dq, u + dv
                speed = max(speed, abs(u))
                pass_time(clock, step)
        out[n] = best
