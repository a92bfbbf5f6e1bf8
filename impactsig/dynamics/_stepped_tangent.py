"""Kernels: how the neighbours of a stepped motion move with it, from event to event.

The motion is stepped again from row to row, and with every step the variational equation
``x'' = a_q x + a_v x'`` by the same stages: the columns are the derivative of the step as it is
taken; it must fulfil the tolerance for them too, because a direction that the motion has left
still contracts. Derivatives of a force of the user's are central differences, good to about 1e-10.
Saltation matrices are those of `_tangent`; that of a Hertz stop with a restitution coefficient,
whose loss goes by its approach velocity, needs what that velocity gains by either column as well.
"""

from __future__ import annotations

import math

from numba import njit

from ..simulate._events import IMPACT, MARK, PART, RELEASE, REVERSE, START, STICK, TOUCH
from ..simulate._flow import TURN
from ..simulate._passing import pass_time
from ..simulate._rates import (
    EXPONENT,
    HERTZ,
    LAW,
    LOSS,
    PLACE,
    PUSHER,
    PUSHING,
    RESTITUTION,
    SIDE,
    SPRING,
    STIFFNESS,
    jerk,
    open_leg,
    origin,
    pull,
    status,
)
from ..simulate._retrace import mode_of
from ..simulate._step import stride
from ._tangent import (
    BY_FRICTION,
    BY_STOP,
    DETERMINANT,
    FIRST,
    FREE,
    HELD,
    IMPACTS,
    KIND,
    MODE,
    NEXT,
    PHASE,
    SINGULAR,
    TURNS,
    due,
    list_collapse,
    multiply,
    orthonormalize,
    rescale,
    take,
)

# What `motion` holds: position and velocity, step to try next, greatest speed; then for each stop
# the approach velocity of its last contact, and what that gains by either column.
Q, V, WISH, SWIFT, STOPS = range(5)
SMALL = 6e-6  # of a quantity, to difference a function by: the cube root of rounding
FINE = 1e-8  # of the time that the motion takes: step where a Hertz contact begins or ends


@njit(cache=True, nogil=True, error_model="numpy")
def pull_slopes(p, f, leg, mode, motion, tau, y, v, by_approach):
    """Derivatives of the acceleration by position and velocity, and by the approach velocities."""
    of_q, of_v = -leg.kappa, -leg.damping
    count = len(p.stops)
    for k in range(count):
        by_approach[k] = 0.0
        if p.stops[k, LAW] != HERTZ or status(p, mode, k) != PUSHING:
            continue
        side, n, stiffness = p.stops[k, SIDE], p.stops[k, EXPONENT], p.stops[k, STIFFNESS]
        depth = side * (y - (p.stops[k, PLACE] - leg.origin))
        if depth <= 0:
            continue
        loss, touched = p.stops[k, LOSS], motion[STOPS + k]
        own = p.stops[k, RESTITUTION] >= 0
        if own:
            r = p.stops[k, RESTITUTION]
            loss = 0.75 * (1 - r * r) / touched if touched > 0 else 0.0
        power = stiffness * depth**n
        of_q -= n * power / depth * (1 + loss * side * v)
        of_v -= power * loss
        if own and touched > 0:
            by_approach[k] = power * v * loss / touched
    if leg.forced:
        x, u = y + leg.origin, v
        if leg.swing != 0.0:
            angle = leg.sway + leg.pace * tau
            x += leg.swing * math.cos(angle)
            u -= leg.swing * leg.pace * math.sin(angle)
        t = (leg.elapsed + tau) / leg.omega
        rate = max(1.0, math.sqrt(abs(of_q)))
        h = SMALL * max(abs(x) + abs(u) / rate, 1e-12)
        of_q += (f.law(t, x + h, u * leg.omega) - f.law(t, x - h, u * leg.omega)) / (
            2 * h * leg.inertia
        )
        g = SMALL * max(abs(x) * rate + abs(u), 1e-12)
        of_v += (f.law(t, x, (u + g) * leg.omega) - f.law(t, x, (u - g) * leg.omega)) / (
            2 * g * leg.inertia
        )
    return of_q, of_v


@njit(cache=True, nogil=True, error_model="numpy")
def vary(p, tab, f, s, leg, mode, motion, h, y, columns, new, slopes, by_approach):
    """The columns after the step of h from y just taken, whose stages are in `s`, into `new`.

    Returns the mean divergence over the step, and the error in units of the tolerance.
    """
    count = len(p.stops)
    trace = 0.0
    for i in range(13):
        x = 0.0
        for j in range(i):
            x += tab.a[i, j] * s.kq[j]
        of_q, of_v = pull_slopes(
            p, f, leg, mode, motion, tab.c[i] * h, y + h * x, s.kq[i], by_approach
        )
        if i < 12:
            trace += tab.a[12, i] * of_v
        for j in range(2):
            dq = dv = 0.0
            for m in range(i):
                weight = tab.a[i, m]
                dq += weight * slopes[m, j]
                dv += weight * slopes[m, 2 + j]
            dq, dv = columns[0, j] + h * dq, columns[1, j] + h * dv
            if i == 12:
                new[0, j], new[1, j] = dq, dv
            slope = of_q * dq + of_v * dv
            for k in range(count):
                if by_approach[k] != 0.0:
                    slope += by_approach[k] * motion[STOPS + count + 2 * k + j]
                    trace = math.nan  # the determinant is not that of a flow
            slopes[i, j], slopes[i, 2 + j] = dv, slope
    worst = 0.0
    for j in range(2):
        third = fifth = 0.0
        for part, rate in ((j, leg.rate), (2 + j, 1.0)):
            e3 = e5 = 0.0
            for i in range(13):
                e3 += tab.errors[0, i] * slopes[i, part]
                e5 += tab.errors[1, i] * slopes[i, part]
            third, fifth = third + (rate * e3) ** 2, fifth + (rate * e5) ** 2
        size = math.hypot(leg.rate * columns[0, j], columns[1, j])
        if fifth > 0:
            worst = max(worst, h * fifth / math.sqrt(fifth + 0.01 * third) / size)
    return trace, worst / max(p.tolerance, 1e-12)


@njit(cache=True, nogil=True, error_model="numpy")
def settle(p, motion, columns, totals, orthonormal):
    """Make the columns orthonormal, or of a common scale; what depends on them with them."""
    count = len(p.stops)
    a, b, c, d = columns[0, 0], columns[1, 0], columns[0, 1], columns[1, 1]
    scale = totals[FIRST]
    if not orthonormal:
        rescale(columns, totals)
        share = math.exp(scale - totals[FIRST])
        for n in range(STOPS + count, STOPS + 3 * count):
            motion[n] *= share
        return
    orthonormalize(columns, totals)
    area = a * d - b * c
    norm = math.hypot(a, b)
    for k in range(STOPS + count, STOPS + 3 * count, 2):
        first, second = motion[k], motion[k + 1]
        if area == 0.0 or norm == 0.0:
            motion[k], motion[k + 1] = 0.0, 0.0
            continue
        # The second is what Gram and Schmidt leave of it, over its own length.
        motion[k] = first / norm
        motion[k + 1] = (second - (a * c + b * d) / norm**2 * first) * norm / area


@njit(cache=True, nogil=True, error_model="numpy")
def retrace(
    p, tab, f, s, turns, phase, place, motion, columns, totals, orthonormal,
    slopes, by_approach, clock, new, parts,
):  # fmt: skip
    """Step the motion and the columns from where `place` has them to an instant.

    The slope of Hertz' force begins as the root of the depth, which no polynomial follows: steps
    double from where it does, and halve to where it ends (where a contact `parts`).
    """
    clock[0], clock[1], clock[2] = place[TURNS], place[PHASE], 0.0
    mode = int(place[MODE])
    approach = motion[STOPS : STOPS + len(p.stops)]
    while True:
        end = (turns - clock[0]) * TURN + (phase - clock[1]) - clock[2]
        if end <= 0:
            break
        y, v = motion[Q], motion[V]
        leg = open_leg(p, s, clock[0], clock[1], clock[2], mode, approach, y, v)
        a = pull(f, leg, s, 0.0, y, v)
        wish = motion[WISH]
        if leg.hertz > 0 and wish == 0.0:
            wish = FINE / leg.rate
        most = end
        if parts and end * leg.rate > FINE:
            most = end / 2
        step, dq, dv, wish, _ = stride(p, tab, f, leg, s, wish, most, y, v, a, motion[SWIFT])
        if step == 0.0:
            columns[:] = math.nan
            break
        trace, error = vary(
            p, tab, f, s, leg, mode, motion, step, y, columns, new, slopes, by_approach
        )
        if error > 1 and step * leg.rate > FINE:
            motion[WISH] = step * max(0.2, 0.9 * error**-0.125)
            continue
        totals[DETERMINANT] += step * trace
        columns[:] = new
        if error > 1e-6:
            wish = min(wish, step * 0.9 * error**-0.125)
        motion[Q], motion[V] = y + dq, v + dv
        motion[WISH] = min(wish, 2 * step) if leg.hertz > 0 else wish
        motion[SWIFT] = max(motion[SWIFT], abs(motion[V]))
        pass_time(clock, step)
        settle(p, motion, columns, totals, orthonormal)
    place[TURNS], place[PHASE] = turns, phase


@njit(cache=True, nogil=True, error_model="numpy")
def pull_in(p, f, s, row, mode, approach, y, v):
    """Acceleration in a mode at the instant of a row, and the leg."""
    leg = open_leg(p, s, row[0], row[1], 0.0, mode, approach, y, v)
    return pull(f, leg, s, 0.0, y, v), leg


@njit(cache=True, nogil=True, error_model="numpy")
def jump(p, f, s, row, after, place, motion, columns, totals, collapses, at_once):
    """Saltation at an impact, a change of contact or of the direction of friction."""
    before = int(place[MODE])
    kind, k, q, v = int(row[2]), int(row[3]), row[5], row[6]
    count = len(p.stops)
    approach = motion[STOPS : STOPS + count]
    there = q + origin(p, after) - origin(p, before)
    if kind == IMPACT:
        totals[IMPACTS] += 1
        come = p.stops[k, SIDE] * row[7]
        if come == 0.0:
            totals[SINGULAR] += 1
            return
        r = rho = -v / come
        if p.stops[k, RESTITUTION] < 0:
            law = f.upper if p.stops[k, SIDE] > 0 else f.lower
            u, h = abs(come), 1e-3 * abs(come)
            near = law((u + h) * p.omega) * (u + h) - law((u - h) * p.omega) * (u - h)
            far = law((u + 2 * h) * p.omega) * (u + 2 * h)
            far -= law((u - 2 * h) * p.omega) * (u - 2 * h)
            rho = (8 * near - far) / (12 * h)
        a, _ = pull_in(p, f, s, row, before, approach, there, come)
        b, _ = pull_in(p, f, s, row, after, approach, q, v)
        multiply(columns, -r, 0.0, (b + rho * a) / come, -rho)
        if r * rho == 0.0:
            list_collapse(collapses, totals, row, 1)
        else:
            totals[DETERMINANT] += math.log(abs(r * rho))
    elif kind in (TOUCH, PART):
        law = p.stops[k, LAW]
        at_gap = p.stops[k, PLACE] == q + origin(p, after)
        totals[IMPACTS] += kind == TOUCH
        if kind == TOUCH and law == HERTZ and p.stops[k, RESTITUTION] >= 0 and v != 0.0:
            # What the approach velocity gains: the touch comes earlier or later.
            a, _ = pull_in(p, f, s, row, before, approach, there, v)
            for j in range(2):
                gain = columns[1, j] - a * columns[0, j] / v
                motion[STOPS + count + 2 * k + j] = gain if v > 0 else -gain
        elif law == SPRING or (law == PUSHER and kind == TOUCH and at_gap):
            change = -p.stops[k, LOSS] if kind == TOUCH else p.stops[k, LOSS]
            multiply(columns, 1.0, 0.0, change, 1.0)
        elif law == PUSHER and at_once and place[KIND] == IMPACT and v != 0.0:
            # The impact has turned the velocity, and with it what a stop that only pushes does.
            a, _ = pull_in(p, f, s, row, before, approach, there, v)
            b, _ = pull_in(p, f, s, row, after, approach, q, v)
            multiply(columns, 1.0, 0.0, (b - a) / v, 1.0)
        if kind == PART:
            for j in range(2):
                motion[STOPS + count + 2 * k + j] = 0.0
    elif kind == REVERSE and not (at_once and place[KIND] == START):
        a, _ = pull_in(p, f, s, row, before, approach, there, 0.0)
        b, _ = pull_in(p, f, s, row, after, approach, q, 0.0)
        if a == 0.0 or b == 0.0:
            totals[SINGULAR] += 1
            return
        multiply(columns, 1.0, 0.0, 0.0, b / a)
        totals[DETERMINANT] += math.log(abs(b / a))


@njit(cache=True, nogil=True, error_model="numpy")
def let_go(p, f, s, row, after, motion, columns, totals, orthonormal, by_approach):
    """Saltation where a mass held by friction sets off; the column that was lost begins anew."""
    q = row[5]
    rest = after - after % 3
    approach = motion[STOPS : STOPS + len(p.stops)]
    _, leg = pull_in(p, f, s, row, rest, approach, q, 0.0)
    of_q, _ = pull_slopes(p, f, leg, rest, motion, 0.0, q, 0.0, by_approach)
    of_t = jerk(p, f, leg, s, q)
    if of_t == 0.0:
        totals[SINGULAR] += 1
        return
    off = 0.0
    if p.static != p.kinetic:
        a, _ = pull_in(p, f, s, row, after, approach, q, 0.0)
        off = a * of_q / of_t
    multiply(columns, 1.0, 0.0, off, 0.0)
    if orthonormal:
        norm = math.hypot(columns[0, 0], columns[1, 0])
        totals[FIRST] += math.log(norm)
        columns[0, 0], columns[1, 0] = columns[0, 0] / norm, columns[1, 0] / norm
        columns[0, 1], columns[1, 1] = -columns[1, 0], columns[0, 0]


@njit(cache=True, nogil=True, error_model="numpy")
def carry_to(
    p, tab, f, s, turns, phase, place, motion, columns, totals, orthonormal,
    slopes, by_approach, clock, new,
):  # fmt: skip
    """Carry the columns to an instant without event."""
    if place[HELD] == FREE:
        retrace(
            p, tab, f, s, turns, phase, place, motion, columns, totals, orthonormal,
            slopes, by_approach, clock, new, False,
        )  # fmt: skip
    place[TURNS], place[PHASE] = turns, phase


@njit(cache=True, nogil=True, error_model="numpy")
def carry(
    p, tab, f, s, rows, end, instants, taken, place, motion, columns, totals, collapses,
    orthonormal, slopes, by_approach, clock, new,
):  # fmt: skip
    """Carry the columns through events to the turns and phase `end`; take totals at instants."""
    count = len(p.stops)
    approach = motion[STOPS : STOPS + count]
    for w in range(len(rows)):
        row = rows[w]
        kind, k = int(row[2]), int(row[3])
        while due(row[0], row[1], place, instants):
            n = int(place[NEXT])
            carry_to(
                p, tab, f, s, instants[n, 0], instants[n, 1], place, motion, columns, totals,
                orthonormal, slopes, by_approach, clock, new,
            )  # fmt: skip
            take(taken, place, totals)
        at_once = row[0] == place[TURNS] and row[1] == place[PHASE]
        by_stop = kind == STICK and k >= 0
        if place[HELD] == FREE and not by_stop:
            retrace(
                p, tab, f, s, row[0], row[1], place, motion, columns, totals, orthonormal,
                slopes, by_approach, clock, new, kind == PART and p.stops[k, LAW] == HERTZ,
            )  # fmt: skip
        place[TURNS], place[PHASE] = row[0], row[1]
        if k >= 0 and (kind in (TOUCH, MARK)):
            approach[k] = row[7]
        mode = mode_of(p, f, s, row, approach)
        if kind == STICK and place[HELD] == FREE:
            place[HELD] = BY_STOP if by_stop else BY_FRICTION
            list_collapse(collapses, totals, row, 0 if by_stop else 1)
            multiply(columns, 0.0 if by_stop else 1.0, 0.0, 0.0, 0.0)
        elif kind == RELEASE:
            if place[HELD] == BY_FRICTION:
                let_go(p, f, s, row, mode, motion, columns, totals, orthonormal, by_approach)
            place[HELD] = FREE
        elif kind != MARK:
            jump(p, f, s, row, mode, place, motion, columns, totals, collapses, at_once)
        place[MODE] = mode
        if kind != MARK:
            place[KIND] = kind
            motion[WISH] = 0.0
        motion[Q], motion[V] = row[5], row[6]
        if kind != RELEASE:
            settle(p, motion, columns, totals, orthonormal)
    while True:
        ends = not due(end[0], end[1], place, instants)
        n = int(place[NEXT])
        turns, phase = (end[0], end[1]) if ends else (instants[n, 0], instants[n, 1])
        carry_to(
            p, tab, f, s, turns, phase, place, motion, columns, totals, orthonormal,
            slopes, by_approach, clock, new,
        )  # fmt: skip
        if ends:
            break
        take(taken, place, totals)
