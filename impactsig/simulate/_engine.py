"""The exact engine: piecewise linear motion from event to event, without a time step.

In mode i, with the unit of time chosen so that the reference forcing has frequency 1,

    q'' + 2 delta_i q' + kappa_i q = sum_j (A_j cos theta_j + B_j sin theta_j) + f_i,

q counted from the origin of the mode (a touched stop is the origin of its contact mode, so that
nothing cancels there). The flow is the forced response plus a decaying free motion. A mode lasts
while all its gaps

    g = alpha q + beta q' + gamma

are open: to the next stop, or back to the one that is touched (beta = 0), to rest where friction
turns (alpha = 0), to a force of zero. They are followed by conservative advancement: where
|g''| <= M from now on, a gap stays open for

    h = (g' + sqrt(g'^2 + 2 M g)) / M,

so no step can jump over a first contact. Once g' < 0 and g <= g'^2 / 2M the gap closes without
turning, and roots of parabolas, kept in that bracket, finish. M is the lesser of two bounds: z''
of the free motion is a free motion itself, whose energy does not grow; and the energy of q'' is
fed by the forcing alone. Bounds of the third derivative sharpen both uses in the same way.
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

# What the closing of a gap means.
HIT, ENTER, LEAVE, CLEAR, LIFT, PRESS, HALT = range(7)
ORDER = 12  # of the Taylor series that serves short legs
INVERSE = tuple([0.0] + [1 / n for n in range(1, ORDER + 1)])

TURN = 2 * math.pi
TURN_LOW = 2.4492935982947064e-16  # 2 pi - TURN
CALM = 0.01  # relative change of the pressing force for which chatter is a geometric series
NOTHING = 4e-16  # a gap this small beside what it is the difference of is closed


class Problem(NamedTuple):
    """An oscillator in the unit of time of its reference forcing, as modes with their gaps."""

    kappa: np.ndarray  # shape (modes,), as all down to drift
    delta: np.ndarray
    root: np.ndarray  # sqrt |kappa - delta^2|
    sort: np.ndarray  # sign of kappa - delta^2: 1 underdamped, 0 critical, -1 overdamped
    constant: np.ndarray  # f, kinetic friction included
    rest: np.ndarray  # f / kappa, 0 where kappa = 0
    drift: np.ndarray  # f where kappa = 0, else 0
    cosine: np.ndarray  # forced response, shape (modes, components)
    sine: np.ndarray
    reach: np.ndarray  # bounds of the forced response and of its derivatives, shape (modes, 5)
    rate: np.ndarray  # the fastest rate there is, for the range of the Taylor series
    ratio: np.ndarray  # frequencies over that of the reference, shape (components,)
    force_cos: np.ndarray
    force_sin: np.ndarray
    force_bound: np.ndarray  # bounds of the forcing and its derivatives, shape (4,)
    pressed: np.ndarray  # how many soft stops each mode presses on
    gaps: np.ndarray  # how many each mode has
    leans: np.ndarray  # whether beta is not 0 for all of them
    gap: np.ndarray  # alpha, beta, gamma; shape (modes, gaps, 3)
    means: np.ndarray  # meaning, stop, mode beyond; shape (modes, gaps, 3)
    land: np.ndarray  # position in the mode beyond, where alpha q + gamma = 0
    origin: np.ndarray  # of each mode, in the coordinates of the stops
    side: np.ndarray  # of each stop: 1 upper, -1 lower
    restitution: np.ndarray  # of each stop; -1 for a soft one, -2 where a function tells
    speed: float  # what an approach velocity is to be multiplied by for that function
    kinetic: float  # friction per mass
    static: float
    rubs: bool
    chatter: float  # share of the greatest approach velocity below which rebounds are summed
    skip: bool  # whether a motion that can close no gap is ended in one step


class Scratch(NamedTuple):
    """Room for one leg: a row (ratio, cosine, sine) a component; Taylor coefficients; gaps.

    Cosine and sine are of the angle passed since the start of the leg, which has more digits than
    the phase.
    """

    waves: np.ndarray
    series: np.ndarray
    gaps: np.ndarray  # at the start, and how long one that is closed there is certain to open


class Leg(NamedTuple):
    """One leg, as numbers: its mode, its free motion at the start, and what `Scratch` holds.

    Numbers rather than `Problem`, because passing arrays to the innermost functions costs more
    than these compute.
    """

    kappa: float
    delta: float
    root: float
    sort: float
    rest: float
    drift: float
    rate: float
    reach: float  # bound of the second derivative of the forced response
    z: float
    w: float
    waves: np.ndarray
    series: np.ndarray


@cfunc("float64(float64)", cache=True)
def constant_law(_velocity):
    """Stands in for a restitution function where there is none."""
    return math.nan


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
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


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def free(leg, tau):
    """Free motion (z, z') after tau; near critical damping both forms meet without cancelling."""
    delta, root = leg.delta, leg.root
    if leg.sort > 0:
        decay = math.exp(-delta * tau) if delta > 0 else 1.0
        c = decay * math.cos(root * tau)
        s = decay * math.sin(root * tau) / root
    elif leg.sort < 0:
        slow = math.exp(-leg.kappa / (delta + root) * tau)
        gone = -math.expm1(-2 * root * tau)
        c = slow * (1 - gone / 2)
        s = slow * gone / (2 * root)
    else:
        c = math.exp(-delta * tau)
        s = c * tau
    z = leg.z * c + (leg.w + delta * leg.z) * s
    w = leg.w * c - (leg.kappa * leg.z + delta * leg.w) * s
    f = leg.drift
    if f != 0.0:  # kappa = 0: a constant force makes it drift
        x = 2 * delta * tau
        if x < 0.03:  # tau^2 / 2 less what damping takes, where the closed form would cancel
            z += f * tau * tau * (0.5 - x / 6 * (1 - x / 4 * (1 - x / 5 * (1 - x / 6))))
        else:
            z += f * (tau + math.expm1(-x) / (2 * delta)) / (2 * delta)
        w += f * s
    return z, w


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def bound(kappa, delta, root, sort, y, y1):
    """Bound from now on of a free motion that is at y, y1: by its energy, or mode by mode."""
    if kappa == 0.0:
        return abs(y)  # asked of z'' and higher only: one decaying exponential
    most = math.sqrt(y * y + y1 * y1 / kappa)
    if sort < 0:
        fast = delta + root
        slow = kappa / fast
        most = min(most, (abs(fast * y + y1) + abs(slow * y + y1)) / (2 * root))
    return most


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def forced(waves, tau):
    """Forced response and its first three derivatives, tau after the start of the leg."""
    x = v = a = jerk = 0.0
    for j in range(len(waves)):
        ratio = waves[j, 0]
        c, s = math.cos(ratio * tau), math.sin(ratio * tau)
        value = waves[j, 1] * c + waves[j, 2] * s
        speed = ratio * (waves[j, 2] * c - waves[j, 1] * s)
        x += value
        v += speed
        a -= ratio * ratio * value
        jerk -= ratio * ratio * speed
    return x, v, a, jerk


@njit(cache=True, nogil=True, error_model="numpy")
def steady(p, i, turns, phase):
    """Forced response and its derivative at a phase."""
    x = v = 0.0
    for j in range(len(p.ratio)):
        angle = phase_of(p.ratio[j], turns, phase)
        c, s = math.cos(angle), math.sin(angle)
        x += p.cosine[i, j] * c + p.sine[i, j] * s
        v += p.ratio[j] * (p.sine[i, j] * c - p.cosine[i, j] * s)
    return x, v


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def push(p, clock, tau):
    """Forcing and its first two derivatives, tau after the clock."""
    f = f1 = f2 = 0.0
    for j in range(len(p.ratio)):
        ratio = p.ratio[j]
        angle = phase_of(ratio, clock[0], clock[1]) + ratio * tau
        c, s = math.cos(angle), math.sin(angle)
        value = p.force_cos[j] * c + p.force_sin[j] * s
        f += value
        f1 += ratio * (p.force_sin[j] * c - p.force_cos[j] * s)
        f2 -= ratio * ratio * value
    return f, f1, f2


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def begin(p, scratch, i, turns, phase, low, q, v):
    """The leg in region i that starts from q, v at that phase (and what the phase lacks).

    The Taylor coefficients of q come from the equation of motion, order by order.
    """
    waves, series = scratch.waves, scratch.series
    delta, kappa = p.delta[i], p.kappa[i]
    series[0], series[1] = q, v
    for n in range(ORDER - 1):
        series[n + 2] = p.constant[i] if n == 0 else 0.0
    z, w = q - p.rest[i], v
    for j in range(len(waves)):
        ratio = p.ratio[j]
        angle = phase_of(ratio, turns, phase)
        c, s = math.cos(angle), math.sin(angle)
        c, s = c - s * ratio * low, s + c * ratio * low
        waves[j, 0] = ratio
        waves[j, 1] = p.cosine[i, j] * c + p.sine[i, j] * s
        waves[j, 2] = p.sine[i, j] * c - p.cosine[i, j] * s
        z -= waves[j, 1]
        w -= ratio * waves[j, 2]
        term = p.force_cos[j] * c + p.force_sin[j] * s
        other = p.force_sin[j] * c - p.force_cos[j] * s
        for n in range(ORDER - 1):
            series[n + 2] += term
            term, other = other * ratio * INVERSE[n + 1], -term * ratio * INVERSE[n + 1]
    for n in range(ORDER - 1):
        series[n + 2] -= 2 * delta * (n + 1) * series[n + 1] + kappa * series[n]
        series[n + 2] *= INVERSE[n + 1] * INVERSE[n + 2]
    return Leg(
        kappa,
        delta,
        p.root[i],
        p.sort[i],
        p.rest[i],
        p.drift[i],
        p.rate[i],
        p.reach[i, 2],
        z,
        w,
        waves,
        series,
    )


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def locate(leg, tau):
    """Position less that at the start of the leg, its three derivatives, and a bound of |q''|.

    Short legs go by their Taylor series, which keeps the digits of tiny gaps; its bound is the
    caller's (returned as -1).
    """
    if tau * leg.rate < 0.25:
        series = leg.series
        x = v = a = jerk = 0.0
        for n in range(ORDER, 2, -1):
            x = (x + series[n]) * tau
            v = v * tau + n * series[n]
            a = a * tau + n * (n - 1) * series[n]
            jerk = jerk * tau + n * (n - 1) * (n - 2) * series[n]
        x = (x + series[2]) * tau
        v = v * tau + 2 * series[2]
        a = a * tau + 2 * series[2]
        return (x + series[1]) * tau, v * tau + series[1], a, jerk, -1.0
    x, v, a, jerk = forced(leg.waves, tau)
    z, w = free(leg, tau)
    b = leg.drift - 2 * leg.delta * w - leg.kappa * z
    b1 = -2 * leg.delta * b - leg.kappa * w
    most = bound(leg.kappa, leg.delta, leg.root, leg.sort, b, b1) + leg.reach
    return x + z + leg.rest - leg.series[0], v + w, a + b, jerk + b1, most


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def close(leg, tau, at, v, x, velocity, a, jerk, gap, speed, high, third):
    """Instant and state at which a gap closes that is certain to close without turning.

    `at` is alpha, beta and the gap at the start of the leg, where the velocity is v. The position x
    (from that at the start), velocity, acceleration, jerk, gap and `speed` (its derivative,
    negative) hold at tau; the gap closes before tau + high. third bounds |g'''|. Each step goes to
    the root of the parabola at hand.
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
        x, velocity, a, jerk, _most = locate(leg, tau)
        gap = distance + alpha * x + beta * (velocity - v)
        speed = alpha * velocity + beta * a
        if gap > 0:
            low = tau
        else:
            high = tau
        if speed >= 0 or high - low <= 2e-16 * high:
            break
    return tau, x, velocity


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def grip(p, i, q):
    """Least and greatest force that a rest at q can hold: friction, and rigid stops it touches."""
    low, high = -p.static, p.static
    for s in range(p.gaps[i]):
        if p.means[i, s, 0] == HIT and p.gap[i, s, 0] * q + p.gap[i, s, 2] == 0.0:
            if p.gap[i, s, 0] < 0:
                high = math.inf
            else:
                low = -math.inf
    return low, high


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def still(p, i, q):
    """Constant part of the force per mass at rest at q, friction left out."""
    f = p.constant[i] - p.kappa[i] * q
    return f + (p.kinetic if i % 2 == 0 else -p.kinetic) if p.rubs else f


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def unstick(p, clock, i, q, end):
    """Time until the force leaves what holds the mass, and whither; 0 is nowhere as yet."""
    low, high = grip(p, i, q)
    rest = still(p, i, q)
    most, jolt, size = p.force_bound[2], p.force_bound[3], p.force_bound[0]
    if most == 0.0 or (rest - size >= low and rest + size <= high):
        return end, 0
    tau = 0.0
    for _ in range(10000):
        f, f1, f2 = push(p, clock, tau)
        step = math.inf
        for way in (1, -1):
            room = way * ((high if way > 0 else low) - rest - f)
            if room == math.inf:
                continue
            if room <= 0 and way * f1 > 0 and tau > 0:
                return tau, way
            room = max(room, 0.0)
            speed, bend = -way * f1, -way * f2
            certain = (speed + math.sqrt(speed * speed + 2 * most * room)) / most
            if speed >= 0 and bend > 0:
                certain = max(certain, 3 * bend / jolt)
            step = min(step, certain)
        tau += max(step, 2e-16 * max(tau, 1e-3))
        if tau >= end:
            return end, 0
    return tau, 0


@njit(cache=True, nogil=True, error_model="numpy")
def depart(p, clock, i, q):
    """Whither a mass at rest goes, 0 where it is held; and whether what holds it just gives way.

    There the next derivative of the force decides.
    """
    low, high = grip(p, i, q)
    f, f1, f2 = push(p, clock, 0.0)
    f += still(p, i, q)
    slack = NOTHING * (abs(p.kappa[i] * q) + abs(p.constant[i]) + p.force_bound[0])
    for way in (1, -1):
        over = way * (f - (high if way > 0 else low))
        if over > slack:
            return way, False
        if over >= -slack and (way * f1 > 0 or (f1 == 0.0 and way * f2 > 0)):
            return way, True
    return 0, False


@njit(cache=True, nogil=True, error_model="numpy")
def run(p, scratch, clock, state, count, events, end_turns, end_phase, most_legs, upper, lower):
    """Move to the end phase, writing events as rows; to be called again when they are full.

    The arrays are as in `_events`; `upper` and `lower` are the restitution functions of rigid
    stops.
    """
    spent = 0
    count[5] = 0
    room = len(events)
    gaps = scratch.gaps
    while True:
        if room > 0 and count[5] + 4 > room:
            return FULL
        if spent >= most_legs:
            return EXHAUSTED
        spent += 1
        count[6] += 1
        i = count[0]
        end = (end_turns - clock[0]) * TURN + (end_phase - clock[1]) - clock[2]
        if end <= 0:
            return DONE

        q, v = state[0], state[1]
        if not (math.isfinite(q) and math.isfinite(v)):
            return DIVERGED
        way, level = 0, False  # level: the force is just at the limit of what held the mass
        if count[1] != 0:  # held by a rigid stop or by friction
            tau, way = unstick(p, clock, i, q, end)
            if tau >= end:
                clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                return DONE
            pass_time(clock, tau)
            if way == 0:
                continue
            end -= tau
            count[1] = 0
            level = p.static == p.kinetic
            i = heading(p, i, way)
            note(events, count, clock, RELEASE, -1, i, q, 0.0, 0.0)
        elif v == 0.0 and (p.rubs or touches(p, i, q)):
            way, level = depart(p, clock, i, q)
            if way == 0:
                hold(clock, count, events, i, q)
                continue
            level = level and p.static == p.kinetic
            if heading(p, i, way) != i:
                i = heading(p, i, way)
                note(events, count, clock, REVERSE, -1, i, q, 0.0, 0.0)
        count[0] = i

        leg = begin(p, scratch, i, clock[0], clock[1], clock[2], q, v)
        kappa, delta, root, sort = leg.kappa, leg.delta, leg.root, leg.sort
        b = leg.drift - 2 * delta * leg.w - kappa * leg.z
        b1 = -2 * delta * b - kappa * leg.w
        b2 = -2 * delta * b1 - kappa * b
        most = bound(kappa, delta, root, sort, b, b1) + leg.reach
        third = bound(kappa, delta, root, sort, b1, b2) + p.reach[i, 3]
        if not (most < 1e140 and abs(v) < 1e140):
            return DIVERGED  # their squares would overflow
        fourth = 0.0  # asked for where a gap depends on the velocity, and of a start from rest
        if p.leans[i] or v == 0.0:
            b3 = -2 * delta * b2 - kappa * b1
            fourth = bound(kappa, delta, root, sort, b2, b3) + p.reach[i, 4]
        if level:
            leg.series[2] = 0.0
        a, jerk = 2 * leg.series[2], 6 * leg.series[3]

        # The gaps as they are; one that is closed opens, or is passed at once.
        closed = -1
        inside = True
        for s in range(p.gaps[i]):
            alpha, beta, gamma = p.gap[i, s, 0], p.gap[i, s, 1], p.gap[i, s, 2]
            gap = alpha * q + beta * v + gamma
            certain = 0.0
            size = abs(alpha * q) + abs(beta * v) + abs(gamma)
            if beta != 0.0 and gap < -1e-12 * size:  # an impact has turned the velocity
                closed = s
                break
            if gap <= NOTHING * size:
                gap, inside = 0.0, False
                g1, g2, g3 = alpha * v + beta * a, alpha * a + beta * jerk, alpha * jerk
                if g1 < 0 or (g1 == 0.0 and (g2 < 0 or (g2 == 0.0 and g3 < 0))):
                    closed = s
                    break
                if g1 == 0.0 and g2 > 0:
                    certain = 1.5 * g2 / (abs(alpha) * third + abs(beta) * fourth + 1e-300)
                elif g1 == 0.0 and g3 > 0:
                    certain = 2 * g3 / (fourth + 1e-300)
            gaps[s, 0], gaps[s, 1], gaps[s, 2], gaps[s, 3] = gap, certain, alpha, beta
        if p.skip and inside and not p.rubs and kappa > 0:
            swing = bound(kappa, delta, root, sort, leg.z, leg.w) + p.reach[i, 0]
            reaches = False
            for s in range(p.gaps[i]):
                alpha, beta, gamma = p.gap[i, s, 0], p.gap[i, s, 1], p.gap[i, s, 2]
                reaches |= beta != 0.0 or gamma + alpha * leg.rest <= swing
            if not reaches:
                z, w = free(leg, end)
                x, u = steady(p, i, end_turns, end_phase)
                state[0], state[1] = x + z + p.rest[i], u + w
                clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                return DONE

        tau = 0.0
        d, u = 0.0, v
        due, d_due, u_due, next_closed = math.inf, 0.0, 0.0, -1
        fed = p.force_bound[2] / math.sqrt(kappa) if kappa > 0 else p.force_bound[1]
        again = False  # rounding alone has closed a gap, which is on its way open again
        number = p.gaps[i]
        steps = 0
        while closed < 0:
            h = due = math.inf
            # q'' is itself an oscillator's motion, and only the forcing feeds its energy: near
            # resonance a bound far below what holds from now on.
            energy = math.sqrt(a * a + jerk * jerk / kappa) if kappa > 0 else abs(a)
            for s in range(number):
                if tau == 0.0 and gaps[s, 1] > 0:
                    h = min(h, gaps[s, 1])
                    continue
                alpha, beta = gaps[s, 2], gaps[s, 3]
                gap, speed, bend = gaps[s, 0] + alpha * d, alpha * u, alpha * a
                local, jolt, window = most, third, math.inf
                if beta != 0.0:
                    gap += beta * (u - v)
                    speed += beta * a
                    bend += beta * jerk
                    local = abs(alpha) * most + abs(beta) * third
                    jolt = abs(alpha) * third + abs(beta) * fourth
                if gap <= 0.0 and speed < 0:
                    closed = s
                    break
                if gap <= 0.0 and tau > 0:
                    again = True
                    if beta == 0.0:
                        d = -p.gap[i, s, 2] / alpha - q
                    break
                shake = jolt
                if energy > 0 and beta == 0.0:
                    window = (abs(speed) + math.sqrt(speed * speed + 2 * energy * gap)) / energy
                    local = min(most, energy + fed * window)
                    if kappa > 0:
                        jolt = min(third, math.sqrt(kappa) * (energy + fed * window))
                if speed < 0:
                    reach = -2 * gap / speed
                    turn = max(bend + jolt * reach / 2, 0.0)
                    if reach <= window and 2 * turn * gap <= speed * speed:
                        at, d_at, u_at = close(
                            leg, tau, (alpha, beta, gaps[s, 0]), v, d, u, a, jerk, gap, speed,
                            reach, shake,
                        )  # fmt: skip
                        if at < due:
                            due, d_due, u_due, next_closed = at, d_at, u_at, s
                        if not p.leans[i]:  # all depend on the way alone, and one is on its way
                            break
                        continue
                if local > 0:
                    step = (speed + math.sqrt(speed * speed + 2 * local * gap)) / local
                    # Within twice that, and the window: g'' there is at least what it is here,
                    # less what the bound of its third derivative can take.
                    span = min(2 * step, window)
                    sag = jolt * span / 3 - bend
                    square = speed * speed + 2 * sag * gap
                    if square >= 0 and speed < 0:
                        span = min(span, 2 * gap / (math.sqrt(square) - speed))
                    elif sag > 0:
                        span = min(span, (speed + math.sqrt(square)) / sag)
                    h = min(h, max(step, span))
            if closed >= 0 or again:
                break
            h = max(h, 2e-16 * max(tau, 1e-3))
            if due < math.inf and (tau + h >= due or not p.leans[i]):
                tau, d, u, closed = due, d_due, u_due, next_closed
                break
            if tau + h >= end:
                tau = end
                break
            tau += h
            d, u, a, jerk, new = locate(leg, tau)
            most = new if new >= 0 else most
            steps += 1
            # The higher bounds are those of the start, and hold for a transient long gone.
            if tau > TURN or (p.leans[i] and steps >= 50):
                break

        if tau >= end:
            d, u, _a, _jerk, _new = locate(leg, end)
            closed = -1
        state[0], state[1] = q + d, u
        if p.pressed[i] == 0:  # else it is among what the contact loses
            state[3] += p.kinetic * abs(d)
        if tau >= end:
            for s in range(p.gaps[i]):
                alpha, beta, gamma = p.gap[i, s, 0], p.gap[i, s, 1], p.gap[i, s, 2]
                if beta == 0.0 and alpha * state[0] + gamma < 0:
                    state[0] = -gamma / alpha
            clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
            return DONE
        pass_time(clock, tau)
        if closed < 0:
            continue
        alpha, beta = p.gap[i, closed, 0], p.gap[i, closed, 1]
        if tau > 0 and beta == 0.0 and alpha * u >= 0:  # closed at the very turning point
            state[0], state[1] = -p.gap[i, closed, 2] / alpha, 0.0
            continue
        status = pass_gap(
            p, clock, state, count, events, closed, end - tau, end_turns, end_phase, upper, lower
        )
        if status != DONE:
            return status


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def heading(p, i, way):
    """The mode for motion that way: with friction there is one for either."""
    return i - i % 2 + (1 if way < 0 else 0) if p.rubs else i


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def touches(p, i, q):
    """Whether a rigid stop is touched."""
    for s in range(p.gaps[i]):
        if p.means[i, s, 0] == HIT and p.gap[i, s, 0] * q + p.gap[i, s, 2] == 0.0:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def pass_time(clock, tau):
    """Add tau to the phase as a compensated sum, and keep it below a turn."""
    total = clock[1] + tau
    part = total - clock[1]
    clock[2] += (clock[1] - (total - part)) + (tau - part)
    while total >= TURN:
        total -= TURN  # exact for total < 2 TURN, and else of no more than one rounding
        clock[2] -= TURN_LOW
        clock[0] += 1
    clock[1] = total + clock[2]
    clock[2] += total - clock[1]
    if clock[1] < 0:
        clock[1] += TURN
        clock[0] -= 1
        clock[2] += TURN_LOW


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def note(events, count, clock, kind, stop, mode, q, v, approach):
    """Write one event."""
    if len(events) == 0:
        return
    row = events[count[5]]
    row[0], row[1], row[2], row[3] = clock[0], clock[1], kind, stop
    row[4], row[5], row[6], row[7] = mode, q, v, approach
    count[5] += 1


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def hold(clock, count, events, i, q):
    """Let the mass stick where it is."""
    count[1] = 1
    count[3] += 1
    note(events, count, clock, STICK, -1, i, q, 0.0, 0.0)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def pass_gap(p, clock, state, count, events, s, end, end_turns, end_phase, upper, lower):
    """What the closing of a gap means: an impact, another mode, rest."""
    i = count[0]
    v = state[1]
    meaning, stop, beyond = p.means[i, s, 0], p.means[i, s, 1], p.means[i, s, 2]
    if meaning == HALT:
        state[1] = 0.0
        return DONE
    if meaning == HIT:
        state[0] = -p.gap[i, s, 2] / p.gap[i, s, 0]
        if v == 0.0:
            hold(clock, count, events, i, state[0])
            return DONE
        return rebound(
            p, clock, state, count, events, stop, end, end_turns, end_phase, upper, lower
        )
    count[0] = beyond
    if p.gap[i, s, 1] == 0.0:
        state[0] = p.land[i, s]
    if p.pressed[beyond] > 0 and p.pressed[i] == 0:
        state[3] += v * v / 2
    elif p.pressed[beyond] == 0 and p.pressed[i] > 0:
        state[3] -= v * v / 2
    if meaning in (ENTER, PRESS):
        approach = max(p.side[stop] * v, 0.0)
        count[2] += 1
        count[4] += 1
        state[2] = max(state[2], approach)
        note(events, count, clock, TOUCH, stop, beyond, state[0], v, approach)
    else:
        kind = MARK if meaning == CLEAR else PART
        note(events, count, clock, kind, stop, beyond, state[0], v, 0.0)
    return DONE


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def returned(p, stop, v, upper, lower):
    """Restitution coefficient at an approach velocity."""
    r = p.restitution[stop]
    if r == -2.0:
        return upper(v * p.speed) if p.side[stop] > 0 else lower(v * p.speed)
    return r


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def rebound(p, clock, state, count, events, stop, end, end_turns, end_phase, upper, lower):
    """Reset the velocity at a rigid stop; sum chatter to its end, where the mass sticks."""
    side = p.side[stop]
    v = abs(state[1])
    r = returned(p, stop, v, upper, lower)
    if not 0 <= r <= 1:
        return BROKEN
    out = r * v
    i = heading(p, count[0], -side if out > 0 else side)
    count[0] = i
    state[1] = -side * out if out > 0 else 0.0
    state[2] = max(state[2], v)
    if p.pressed[i] == 0:
        state[3] += (v * v - out * out) / 2
    count[2] += 1
    note(events, count, clock, IMPACT, stop, i, state[0], state[1], v)
    if out == 0.0 or out > p.chatter * state[2] or r == 1.0:
        return DONE
    if p.restitution[stop] == -2.0 and out > 1e-12 * state[2]:
        slower = returned(p, stop, 1e-3 * out, upper, lower)
        if not abs(slower - r) <= CALM * (1 - r):
            return DONE
    f, f1, _f2 = push(p, clock, 0.0)
    pressing = side * (f + still(p, i, state[0]))
    back = pressing - p.kinetic  # what brings the mass back; friction helps what slows it
    if back <= 0:
        return DONE
    away = pressing + p.kinetic
    ratio = math.sqrt(back / away)
    left = out / away * (1 + 1 / ratio) / (1 - r * ratio)
    change = abs(f1) + p.force_bound[2] * left + 2 * p.delta[i] * away + p.kappa[i] * out
    if change * left > CALM * back:
        return DONE
    state[1] = 0.0
    if p.pressed[i] == 0:
        state[3] += out * out / 2
    if left >= end:
        clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
    else:
        pass_time(clock, left)
    hold(clock, count, events, i, state[0])
    return DONE


@njit(cache=True, nogil=True, error_model="numpy")
def phases_of(ratio, turns, phase):
    """`phase_of` for arrays."""
    out = np.empty(len(turns))
    for k in range(len(turns)):
        out[k] = phase_of(ratio, turns[k], phase[k])
    return out


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def follow(p, scratch, row, turns, phase):
    """Mode, position from its origin and velocity in the segment that `row` opens."""
    i = int(row[4])
    if row[2] == STICK:
        return i, row[5], 0.0
    leg = begin(p, scratch, i, row[0], row[1], 0.0, row[5], row[6])
    tau = max((turns - row[0]) * TURN + (phase - row[1]), 0.0)
    if tau * leg.rate < 0.25:
        d, v, _a, _jerk, _most = locate(leg, tau)
        return i, row[5] + d, v
    z, w = free(leg, tau)
    x, v = steady(p, i, turns, phase)
    return i, leg.rest + x + z, v + w


@njit(cache=True, nogil=True, error_model="numpy")
def sample(p, scratch, rows, where, turns, phase):
    """Position and velocity at instants, each in the segment that `where` names."""
    q, v = np.empty(len(turns)), np.empty(len(turns))
    for k in range(len(turns)):
        i, x, v[k] = follow(p, scratch, rows[where[k]], turns[k], phase[k])
        for s in range(p.gaps[i]):
            alpha, gamma = p.gap[i, s, 0], p.gap[i, s, 2]
            if p.gap[i, s, 1] == 0.0 and alpha * x + gamma < 0:
                x = -gamma / alpha  # rounding
                n = where[k] + 1
                if n < len(rows) and rows[n, 2] == STICK and rows[n - 1, 2] == IMPACT:
                    v[k] = 0.0  # among the rebounds that were summed
        q[k] = x + p.origin[i]
    return q, v


@njit(cache=True, nogil=True, error_model="numpy")
def greatest(p, i, leg, first, slope, length):
    """Greatest value of first + slope[0] d + slope[1] u of a leg, d the way and u the velocity.

    Each step goes as far as bounds of its second derivative keep it below the best so far; a
    maximum that a step went across is found by its vanishing derivative.
    """
    size, more = abs(slope[0]), abs(slope[1])
    tau, before, rising = 0.0, 0.0, False
    best = -math.inf
    for _ in range(100_000):
        x, v, a, jerk, _most = locate(leg, tau)
        value = first + slope[0] * x + slope[1] * v
        trend = slope[0] * v + slope[1] * a
        best = max(best, value)
        if rising and trend < 0:
            low, high, at = before, tau, (before + tau) / 2
            for _step in range(60):
                x, v, a, jerk, _most = locate(leg, at)
                best = max(best, first + slope[0] * x + slope[1] * v)
                trend_at = slope[0] * v + slope[1] * a
                if trend_at > 0:
                    low = at
                else:
                    high = at
                curve = slope[0] * a + slope[1] * jerk
                last = at
                at = at - trend_at / curve if curve < 0 else math.inf
                if not low < at < high:
                    at = (low + high) / 2
                if abs(at - last) <= 1e-9 * length:
                    break
        if tau >= length:
            break
        z, w = free(leg, tau)
        b = leg.drift - 2 * leg.delta * w - leg.kappa * z
        b1 = -2 * leg.delta * b - leg.kappa * w
        b2 = -2 * leg.delta * b1 - leg.kappa * b
        most = size * (bound(leg.kappa, leg.delta, leg.root, leg.sort, b, b1) + p.reach[i, 2])
        most += more * (bound(leg.kappa, leg.delta, leg.root, leg.sort, b1, b2) + p.reach[i, 3])
        room = best - value + 1e-11 * abs(best)
        step = (trend + math.sqrt(trend * trend + 2 * most * room)) / most if most > 0 else length
        before, rising = tau, trend > 0
        tau = min(tau + max(step, 1e-5 * length), length)
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def peaks(p, scratch, rows, first, last, ends, springs, dampers, positions):
    """Greatest force of contacts, from the touch in row `first` to row `last`.

    A run that ends within a contact does so at the turns and phase `ends`.
    """
    peak = np.empty(len(first))
    for n in range(len(first)):
        stop = int(rows[first[n], 3])
        side = p.side[stop]
        spring, damper = side * springs[stop], side * dampers[stop]
        best = -math.inf
        for k in range(first[n], min(last[n], len(rows))):
            row = rows[k]
            i = int(row[4])
            depth = row[5] + (p.origin[i] - positions[stop])
            turns, phase = ends
            if k + 1 < len(rows):
                turns, phase = rows[k + 1, 0], rows[k + 1, 1]
            length = (turns - row[0]) * TURN + (phase - row[1])
            if row[2] == STICK or length <= 0:
                best = max(best, spring * depth + damper * row[6])
                continue
            leg = begin(p, scratch, i, row[0], row[1], 0.0, row[5], row[6])
            best = max(best, greatest(p, i, leg, spring * depth, (spring, damper), length))
        peak[n] = best
    return peak
