"""The exact engine: piecewise linear motion from event to event, without a time step.

In region i, with the unit of time chosen so that the reference forcing has frequency 1,

    q'' + 2 delta_i q' + kappa_i q = sum_j (A_j cos theta_j + B_j sin theta_j) + f_i,

q counted from the origin of the region (a touched stop is the origin of its contact region, so
that nothing cancels there). The flow is the forced response plus a decaying free motion. Gaps are
followed by conservative advancement: where |q''| <= M from now on, a gap g stays open for

    h = (g' + sqrt(g'^2 + 2 M g)) / M,

so no step can jump over a first contact. Once g' < 0 and g <= g'^2 / 2M the gap closes without
turning, and roots of parabolas, kept in that bracket, finish. M is the lesser of two bounds: z''
of the free motion is a free motion itself, whose energy does not grow; and the energy of q'' is
fed by the forcing alone. A bound of q''' sharpens both uses in the same way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

FREE, UPPER, LOWER = 0, 1, 2  # regions: away from the stops, in contact with either
# Kinds of event; the state after it opens a segment of the motion.
START, IMPACT, STICK, RELEASE, TOUCH, PART = range(6)
DONE, FULL, EXHAUSTED, DIVERGED = range(4)  # statuses
COLUMNS = 7  # of an event: turns, phase, kind, side, position, velocity, approach velocity
ORDER = 12  # of the Taylor series that serves short legs
INVERSE = tuple([0.0] + [1 / n for n in range(1, ORDER + 1)])

TURN = 2 * math.pi
TURN_LOW = 2.4492935982947064e-16  # 2 pi - TURN
CALM = 0.01  # relative change of the pressing force for which chatter is a geometric series


class Problem(NamedTuple):
    """An oscillator in the unit of time of its reference forcing; regions FREE, UPPER, LOWER."""

    kappa: np.ndarray
    delta: np.ndarray
    root: np.ndarray  # sqrt |kappa - delta^2|
    sort: np.ndarray  # sign of kappa - delta^2: 1 underdamped, 0 critical, -1 overdamped
    constant: np.ndarray  # f
    rest: np.ndarray  # f / kappa, 0 where kappa = 0
    drift: np.ndarray  # f where kappa = 0, else 0
    cosine: np.ndarray  # forced response, shape (3, components)
    sine: np.ndarray
    reach: np.ndarray  # bounds of the forced response and of its derivatives, shape (3, 5)
    rate: np.ndarray  # the fastest rate there is, for the range of the Taylor series
    ratio: np.ndarray  # frequencies over that of the reference
    force_cos: np.ndarray
    force_sin: np.ndarray
    force_bound: np.ndarray  # bounds of the forcing and its derivatives, shape (4,)
    stop: np.ndarray  # upper and lower position, infinite where there is none
    restitution: np.ndarray  # of either; negative for a soft stop
    chatter: float  # share of the greatest approach velocity below which rebounds are summed
    skip: bool  # whether a motion that cannot reach a stop is ended in one step


class Scratch(NamedTuple):
    """Room for one leg: a row (ratio, cosine, sine) a component; Taylor coefficients.

    Cosine and sine are of the angle passed since the start of the leg, which has more digits than
    the phase.
    """

    waves: np.ndarray
    series: np.ndarray


class Leg(NamedTuple):
    """One leg, as numbers: its region, its free motion at the start, and what `Scratch` holds.

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
    """Forcing with the constant of the free region, and its derivative."""
    f, f1 = p.constant[FREE], 0.0
    for j in range(len(p.ratio)):
        ratio = p.ratio[j]
        angle = phase_of(ratio, clock[0], clock[1]) + ratio * tau
        c, s = math.cos(angle), math.sin(angle)
        f += p.force_cos[j] * c + p.force_sin[j] * s
        f1 += ratio * (p.force_sin[j] * c - p.force_cos[j] * s)
    return f, f1


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
def close(leg, tau, side, gap, speed, a, jerk, high, third, distance):
    """Instant and velocity at which a gap closes that is certain to close without turning.

    `gap`, `speed` (its derivative, negative), the acceleration `a` and `jerk` hold at tau; the gap
    closes before tau + high. `distance` is the gap at the start of the leg; side is 1 for a stop
    above, -1 below; third bounds |q'''|. Each step goes to the root of the parabola at hand.
    """
    low, high = tau, tau + high
    before = math.inf
    velocity = -side * speed
    for _ in range(60):
        square = speed * speed + 2 * side * a * gap
        step = 2 * gap / (math.sqrt(square) - speed) if square > 0 else math.inf
        if not (low <= tau + step <= high):
            step = (low + high) / 2 - tau
        elif third * abs(step) ** 3 <= -1e-17 * speed * tau:
            # What this step misses would not be seen.
            return tau + step, velocity + step * (a + jerk * step / 2)
        elif abs(step) >= before / 2 and abs(step) < 1e-9 * tau:
            return tau, velocity  # down to rounding
        before = abs(step)
        tau += step
        x, velocity, a, jerk, _most = locate(leg, tau)
        gap, speed = distance - side * x, -side * velocity
        if gap > 0:
            low = tau
        else:
            high = tau
        if speed >= 0 or high - low <= 2e-16 * high:
            break
    return tau, velocity


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def unstick(p, clock, side, end):
    """Time until the force that presses the mass to a stop vanishes, or `end` if it is sooner."""
    tau = 0.0
    most = p.force_bound[2]
    pressing = p.constant[FREE] - p.kappa[FREE] * p.stop[0 if side > 0 else 1]
    for _ in range(10000):
        f, f1 = push(p, clock, tau)
        f, f1 = side * (f - p.constant[FREE] + pressing), side * f1
        if f <= 0 and (f1 < 0 or most == 0.0) and tau > 0:
            return tau
        if most == 0.0 or pressing * side > p.force_bound[0]:
            return end
        f = max(f, 0.0)
        step = (f1 + math.sqrt(f1 * f1 + 2 * most * f)) / most
        tau += max(step, 2e-16 * max(tau, 1e-3))
        if tau >= end:
            return end
    return end


@njit(cache=True, nogil=True, error_model="numpy")
def run(p, scratch, clock, state, count, events, end_turns, end_phase, most_legs):
    """Move to the end phase, writing events as rows; to be called again when they are full.

    clock : turns of the reference, its phase, and what the phase lacks.
    state : position from the origin of the region, velocity, greatest approach velocity, energy
        lost at the stops per mass.
    count : region, side stuck to (0 if none), impacts, sticks, contacts, rows written, legs.
    """
    spent = 0
    count[5] = 0
    room = len(events)
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

        if count[1] != 0:  # stuck to a rigid stop
            side = count[1]
            tau = unstick(p, clock, side, end)
            if tau >= end:
                clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                return DONE
            pass_time(clock, tau)
            count[1] = 0
            note(events, count, clock, RELEASE, side, state[0], 0.0, 0.0)
            end -= tau
            released = True
        else:
            released = False

        q, v = state[0], state[1]
        if not (math.isfinite(q) and math.isfinite(v)):
            return DIVERGED
        leg = begin(p, scratch, i, clock[0], clock[1], clock[2], q, v)
        kappa, delta, root, sort = leg.kappa, leg.delta, leg.root, leg.sort
        b = leg.drift - 2 * delta * leg.w - kappa * leg.z
        b1 = -2 * delta * b - kappa * leg.w
        b2 = -2 * delta * b1 - kappa * b
        start_bound = bound(kappa, delta, root, sort, b, b1) + leg.reach
        third = bound(kappa, delta, root, sort, b1, b2) + p.reach[i, 3]
        if not (start_bound < 1e140 and abs(v) < 1e140):
            return DIVERGED  # their squares would overflow
        upper, lower = p.stop[0], p.stop[1]
        if i == UPPER:
            upper, lower = math.inf, 0.0
        elif i == LOWER:
            upper, lower = 0.0, -math.inf
        if p.skip and i == FREE and p.kappa[i] > 0 and not released and q < upper and q > lower:
            swing = bound(kappa, delta, root, sort, leg.z, leg.w) + p.reach[i, 0]
            if p.rest[i] + swing < upper and p.rest[i] - swing > lower:
                z, w = free(leg, end)
                x, u = steady(p, i, end_turns, end_phase)
                state[0], state[1] = x + z + p.rest[i], u + w
                clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                return DONE

        # A leg that begins at a stop with no speed: where to, and how far is certain?
        tau = 0.0
        h = 0.0
        side = 0
        if v == 0.0 and q in (upper, lower):
            side = 1 if q == upper else -1
            away = -side * 2 * leg.series[2]
            away1 = -side * 6 * leg.series[3]
            if released:
                away, leg.series[2] = 0.0, 0.0
            if away > 0:
                h = 1.5 * away / third if third > 0 else math.inf
            elif away == 0 and away1 > 0:
                b3 = -2 * delta * b2 - kappa * b1
                fourth = bound(kappa, delta, root, sort, b2, b3) + p.reach[i, 4]
                h = 2 * away1 / fourth if fourth > 0 else math.inf
            elif i != FREE:
                if away < 0 or away1 < 0:
                    touch_stop(p, clock, state, count, events, i, -side)
                    continue
                h = 0.0
            elif p.restitution[0 if side > 0 else 1] >= 0:
                count[1] = side
                count[3] += 1
                note(events, count, clock, STICK, side, q, 0.0, 0.0)
                continue
            elif away < 0 or away1 < 0:
                touch_stop(p, clock, state, count, events, i, side)
                continue
            side = 0

        most = start_bound
        d, u, a, jerk = 0.0, v, 2 * leg.series[2], 6 * leg.series[3]
        fed = p.force_bound[2] / math.sqrt(kappa) if kappa > 0 else p.force_bound[1]
        arrived = False
        while True:
            if h == 0.0:
                h = math.inf
                for k in range(2):
                    s = 1 if k == 0 else -1
                    distance = upper - q if k == 0 else q - lower
                    if distance == math.inf:
                        continue
                    gap, speed = distance - s * d, -s * u
                    if gap <= 0.0 and speed < 0:
                        arrived, side = True, s
                        break
                    if gap <= 0.0 and tau > 0:
                        # Rounding alone has it touch: it is on its way out again.
                        arrived, side = True, 0
                        q = upper if k == 0 else lower
                        break
                    # q'' is itself an oscillator's motion, and only the forcing feeds its energy:
                    # near resonance a bound far below what holds from now on.
                    local, jolt, window = most, third, math.inf
                    energy = math.sqrt(a * a + jerk * jerk / kappa) if kappa > 0 else abs(a)
                    if energy > 0:
                        window = (abs(speed) + math.sqrt(speed * speed + 2 * energy * gap)) / energy
                        local = min(most, energy + fed * window)
                        if kappa > 0:
                            jolt = min(third, math.sqrt(kappa) * (energy + fed * window))
                    bend = -s * a
                    if speed < 0:
                        reach = -2 * gap / speed
                        turn = max(bend + jolt * reach / 2, 0.0)
                        if reach <= window and 2 * turn * gap <= speed * speed:
                            tau, u = close(leg, tau, s, gap, speed, a, jerk, reach, third, distance)
                            arrived, side = True, s
                            break
                    if local > 0:
                        step = (speed + math.sqrt(speed * speed + 2 * local * gap)) / local
                        # Within twice that, and the window: q'' there is at least what it is
                        # here, less what the bound of q''' can take.
                        span = min(2 * step, window)
                        sag = jolt * span / 3 - bend
                        square = speed * speed + 2 * sag * gap
                        if square >= 0 and speed < 0:
                            span = min(span, 2 * gap / (math.sqrt(square) - speed))
                        elif sag > 0:
                            span = min(span, (speed + math.sqrt(square)) / sag)
                        h = min(h, max(step, span))
                if arrived:
                    break
                h = max(h, 2e-16 * max(tau, 1e-3))
            if tau + h >= end:
                break
            tau += h
            h = 0.0
            d, u, a, jerk, new = locate(leg, tau)
            most = new if new >= 0 else most
            if tau > TURN:
                break
        if tau >= end or (not arrived and h > 0.0):
            d, u, _a, _jerk, _new = locate(leg, end)
            state[0], state[1] = q + d, u
            if q + d > upper or q + d < lower:
                state[0] = upper if q + d > upper else lower
            clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
            return DONE
        pass_time(clock, tau)
        if not arrived:
            state[0], state[1] = q + d, u
            continue
        state[1] = u
        if side == 0:
            state[0] = q
            continue
        state[0] = upper if side > 0 else lower
        if side * u <= 0:  # closed at the very turning point
            state[1] = 0.0
            continue
        if i != FREE or p.restitution[0 if side > 0 else 1] < 0:
            touch_stop(p, clock, state, count, events, i, side)
            continue
        rebound(p, clock, state, count, events, side, end - tau, end_turns, end_phase)


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
def note(events, count, clock, kind, side, q, v, approach):
    """Write one event."""
    if len(events) == 0:
        return
    row = events[count[5]]
    row[0], row[1], row[2] = clock[0], clock[1], kind
    row[3], row[4], row[5], row[6] = side, q, v, approach
    count[5] += 1


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def touch_stop(p, clock, state, count, events, i, side):
    """Into the contact region of a soft stop, or out of it."""
    v = state[1]
    if i == FREE:
        count[0] = UPPER if side > 0 else LOWER
        count[2] += 1
        count[4] += 1
        state[0] = 0.0
        state[2] = max(state[2], abs(v))
        state[3] += v * v / 2
        note(events, count, clock, TOUCH, side, 0.0, v, abs(v))
    else:
        count[0] = FREE
        side = 1 if i == UPPER else -1
        state[0] = p.stop[0 if side > 0 else 1]
        state[3] -= v * v / 2
        note(events, count, clock, PART, side, state[0], v, 0.0)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def rebound(p, clock, state, count, events, side, end, end_turns, end_phase):
    """Reset the velocity at a rigid stop; sum chatter to its end, where the mass sticks."""
    v = abs(state[1])
    r = p.restitution[0 if side > 0 else 1]
    out = r * v
    state[1] = -side * out if out > 0 else 0.0
    state[2] = max(state[2], v)
    state[3] += (v * v - out * out) / 2
    count[2] += 1
    note(events, count, clock, IMPACT, side, state[0], state[1], v)
    if out == 0.0 or out > p.chatter * state[2] or r == 1.0:
        return
    f, f1 = push(p, clock, 0.0)
    pressing = side * (f - p.kappa[FREE] * state[0])
    if pressing <= 0:
        return
    left = 2 * out / (pressing * (1 - r))
    change = abs(f1) + p.force_bound[2] * left + 2 * p.delta[FREE] * pressing
    change += p.kappa[FREE] * out
    if change * left > CALM * pressing:
        return
    state[1] = 0.0
    state[3] += out * out / 2
    count[1] = side
    count[3] += 1
    if left >= end:
        clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
    else:
        pass_time(clock, left)
    note(events, count, clock, STICK, side, state[0], 0.0, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def phases_of(ratio, turns, phase):
    """`phase_of` for arrays."""
    out = np.empty(len(turns))
    for k in range(len(turns)):
        out[k] = phase_of(ratio, turns[k], phase[k])
    return out


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def follow(p, scratch, row, turns, phase):
    """Region, position from its origin and velocity in the segment that `row` opens."""
    side = row[3]
    i = FREE
    if row[2] == START or row[2] == TOUCH:
        i = UPPER if side > 0 else (LOWER if side < 0 else FREE)
    if row[2] == STICK:
        return i, row[4], 0.0
    leg = begin(p, scratch, i, row[0], row[1], 0.0, row[4], row[5])
    tau = max((turns - row[0]) * TURN + (phase - row[1]), 0.0)
    if tau * leg.rate < 0.25:
        d, v, _a, _jerk, _most = locate(leg, tau)
        return i, row[4] + d, v
    z, w = free(leg, tau)
    x, v = steady(p, i, turns, phase)
    return i, leg.rest + x + z, v + w


@njit(cache=True, nogil=True, error_model="numpy")
def sample(p, segments, where, turns, phase):
    """Position and velocity at instants, each in the segment that `where` names."""
    scratch = Scratch(np.empty((len(p.ratio), 3)), np.empty(ORDER + 1))
    q, v = np.empty(len(turns)), np.empty(len(turns))
    for k in range(len(turns)):
        i, x, u = follow(p, scratch, segments[where[k]], turns[k], phase[k])
        if i != FREE:
            x += p.stop[i - 1]
        q[k], v[k] = min(max(x, p.stop[1]), p.stop[0]) if i == FREE else x, u
    return q, v


@njit(cache=True, nogil=True, error_model="numpy")
def peak_forces(p, rows, which, lasts, stiffness, damping):
    """Greatest force of each contact: the greatest of a scan, refined by golden section."""
    scratch = Scratch(np.empty((len(p.ratio), 3)), np.empty(ORDER + 1))
    peak = np.empty(len(which))
    for n in range(len(which)):
        row = rows[which[n]]
        k = 0 if row[3] > 0 else 1
        leg = begin(p, scratch, k + 1, row[0], row[1], 0.0, row[4], row[5])
        spring, damper = row[3] * stiffness[k], row[3] * damping[k]
        steps = min(max(int(8 * p.rate[k + 1] * lasts[n]), 16), 100_000)
        best, at = -math.inf, 0.0
        for m in range(steps + 1):
            tau = lasts[n] * m / steps
            y, v, _a, _jerk, _most = locate(leg, tau)
            force = spring * y + damper * v
            if force > best:
                best, at = force, tau
        width = lasts[n] / steps
        low, high = max(at - width, 0.0), min(at + width, lasts[n])
        for _ in range(44):  # the force has one maximum between two steps
            left = high - 0.6180339887498949 * (high - low)
            y, v, _a, _jerk, _most = locate(leg, left)
            one = spring * y + damper * v
            right = low + (high - left)
            y, v, _a, _jerk, _most = locate(leg, right)
            two = spring * y + damper * v
            best = max(best, one, two)
            if one < two:
                low = left
            else:
                high = right
        peak[n] = best
    return peak
