"""The exact engine: piecewise linear motion from event to event, without a time step.

In mode i, with the unit of time chosen so that the forcing period is 2 pi,

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
fed by the forcing alone. Bounds of the third derivative, found in the same way, make steps longer
(`gap.stays_open`) and the bracket wider.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import kernel
from ..basis.events import (
    DIVERGED,
    DONE,
    EXHAUSTED,
    FULL,
    LEG_COUNT,
    LOST,
    LOW,
    MODE,
    PHASE,
    RELEASE,
    REVERSE,
    ROW_COUNT,
    STUCK,
    TURN,
    TURNS,
    Q,
    V,
)
from .flow import begin, bound, bounds, free, locate, steady
from .gap import close, stays_open
from .passing import (
    NOTHING,
    depart,
    heading,
    hold,
    note,
    pass_gap,
    pass_time,
    set_clock,
    time_until,
    touches,
    unstick,
)


@kernel
def from_rest(p, i, leg, q):
    """Fourth derivative at a start from rest where lower ones vanish; clears these of rounding.

    What is but rounding must not choose the side of a soft stop.
    """
    snap, series = 0.0, leg.series
    force = abs(leg.kappa * q) + abs(leg.kappa * p.origin[i]) + p.force_bound[0]
    if abs(series[2]) <= NOTHING * (force + abs(p.constant[i])):
        series[2] = 0.0
        if abs(series[3]) <= NOTHING * p.force_bound[1]:
            series[3] = 0.0
            for j in range(len(leg.waves)):
                snap -= leg.waves[j, 0] ** 2 * leg.waves[j, 3]
            snap = snap if abs(snap) > NOTHING * p.force_bound[2] else 0.0
    return snap


@kernel
def run(p, scratch, clock, state, count, events, end_turns, end_phase, most_legs, upper, lower):
    """Move to the end phase, writing events as rows; to be called again when they are full.

    The arrays are as in `events`; `upper` and `lower` are the restitution functions of rigid
    stops.
    """
    # One long body: its parts share a score of numbers, and to pass these on costs more than most
    # parts compute.
    spent = 0
    count[ROW_COUNT] = 0
    room = len(events)
    gaps = scratch.gaps
    while True:
        if room > 0 and count[ROW_COUNT] + 4 > room:
            return FULL
        if spent >= most_legs:
            return EXHAUSTED
        spent += 1
        count[LEG_COUNT] += 1
        i = count[MODE]
        end = time_until(clock, end_turns, end_phase)
        if end <= 0:
            return DONE

        q, v = state[Q], state[V]
        if not (math.isfinite(q) and math.isfinite(v)):
            return DIVERGED
        way, level = 0, False  # level: the force is just at the limit of what held the mass
        rests = False  # where neither friction nor a rigid stop could hold it
        if count[STUCK] != 0:  # held by a rigid stop or by friction
            tau, way = unstick(p, clock, i, q, end)
            if tau >= end:
                set_clock(clock, end_turns, end_phase)
                return DONE
            pass_time(clock, tau)
            if way == 0:
                continue
            end -= tau
            count[STUCK] = 0
            level = p.static == p.kinetic
            i = heading(p, i, way)
            note(events, count, clock, RELEASE, -1, i, q, 0.0, 0.0)
        elif v == 0.0 and (p.has_friction or touches(p, i, q)):
            way, level = depart(p, clock, i, q)
            if way == 0:
                hold(clock, count, events, i, q)
                continue
            level = level and p.static == p.kinetic
            if heading(p, i, way) != i:
                i = heading(p, i, way)
                note(events, count, clock, REVERSE, -1, i, q, 0.0, 0.0)
        elif v == 0.0:
            rests = True
        count[MODE] = i

        leg = begin(p, scratch, i, clock[TURNS], clock[PHASE], clock[LOW], q, v)
        kappa, delta, root, damping_kind = leg.kappa, leg.delta, leg.root, leg.damping_kind
        b = leg.drift - 2 * delta * leg.w - kappa * leg.z
        b1 = -2 * delta * b - kappa * leg.w
        b2 = -2 * delta * b1 - kappa * b
        most, third = bounds(leg, b, b1)
        if not (most < 1e140 and abs(v) < 1e140):
            return DIVERGED  # their squares would overflow
        fourth = 0.0  # asked for where a gap depends on the velocity, and of a start from rest
        if p.depends_on_velocity[i] or v == 0.0:
            b3 = -2 * delta * b2 - kappa * b1
            fourth = bound(kappa, delta, root, damping_kind, b2, b3) + p.reach[i, 4]
        if level:
            leg.series[2] = 0.0
        snap = from_rest(p, i, leg, q) if rests else 0.0
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
                g1, g2 = alpha * v + beta * a, alpha * a + beta * jerk
                g3, g4 = alpha * jerk + beta * snap, alpha * snap
                falls = g3 < 0 or (g3 == 0.0 and g4 < 0)
                if g1 < 0 or (g1 == 0.0 and (g2 < 0 or (g2 == 0.0 and falls))):
                    closed = s
                    break
                if g1 == 0.0 and g2 > 0:
                    certain = 1.5 * g2 / (abs(alpha) * third + abs(beta) * fourth + 1e-300)
                elif g1 == 0.0 and g3 > 0:
                    certain = 2 * g3 / (fourth + 1e-300)
            gaps[s, 0] = gap if beta == 0.0 else alpha * q + gamma
            gaps[s, 1], gaps[s, 2], gaps[s, 3] = certain, alpha, beta
        if p.skip and inside and not p.has_friction and kappa > 0:
            sag = leg.drift / kappa
            swing = bound(kappa, delta, root, damping_kind, leg.z - sag, leg.w) + p.reach[i, 0]
            reaches = False
            for s in range(p.gaps[i]):
                alpha, beta, gamma = p.gap[i, s, 0], p.gap[i, s, 1], p.gap[i, s, 2]
                reaches |= beta != 0.0 or gamma + alpha * (leg.rest + sag) <= swing
            if not reaches:
                z, w = free(leg, end)
                x, u = steady(p, i, end_turns, end_phase)
                state[Q], state[V] = x + z + p.rest[i], u + w
                set_clock(clock, end_turns, end_phase)
                return DONE

        tau = 0.0
        d, u = 0.0, v
        due, d_due, u_due, next_closed = math.inf, 0.0, 0.0, -1
        stiff = math.sqrt(kappa)
        fed = p.force_bound[2] / stiff if kappa > 0 else p.force_bound[1]
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
                local, jolt = most, third
                if beta != 0.0:
                    # The velocity as it is, not what it has gained: it may have all but gone.
                    gap += beta * u
                    gap = max(gap, 0.0) if tau == 0.0 else gap
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
                # The bounds as they are now, and how fast the forcing lets them grow.
                now, jolt_now, feeds, shakes = local, jolt, 0.0, 0.0
                if beta == 0.0 and 0.0 < energy < most:
                    now, feeds = energy, fed
                if beta == 0.0 and 0.0 < stiff * energy < third:
                    jolt_now, shakes = stiff * energy, stiff * fed
                if speed < 0:
                    reach = -2 * gap / speed
                    shake = min(jolt, jolt_now + shakes * reach)
                    turn = max(bend + shake * reach / 2, 0.0)
                    if 2 * turn * gap <= speed * speed:
                        at, d_at, u_at = close(
                            leg, tau, (alpha, beta, gaps[s, 0]), d, u, a, jerk, gap, speed,
                            reach, shake,
                        )  # fmt: skip
                        if at < due:
                            due, d_due, u_due, next_closed = at, d_at, u_at, s
                        if not p.depends_on_velocity[i]:  # by position alone, gaps close in order
                            break
                        continue
                h = min(h, stays_open(gap, speed, bend, local, jolt, now, feeds, jolt_now, shakes))
            if closed >= 0 or again:
                break
            h = max(h, 2e-16 * max(tau, 1e-3))
            if due < math.inf and (tau + h >= due or not p.depends_on_velocity[i]):
                tau, d, u, closed = due, d_due, u_due, next_closed
                break
            if tau + h >= end:
                tau = end
                break
            tau += h
            d, u, a, jerk, b, b1 = locate(leg, tau)
            if b == b:
                most, third = bounds(leg, b, b1)
            steps += 1
            # The bound of the fourth derivative is that of the start.
            if tau > TURN or (p.depends_on_velocity[i] and steps >= 50):
                break

        if tau >= end:
            d, u, _a, _jerk, _b, _b1 = locate(leg, end)
            closed = -1
        state[Q], state[V] = q + d, u
        if p.pressed[i] == 0:  # else it is among what the contact loses
            state[LOST] += p.kinetic * abs(d)
        if tau >= end:
            for s in range(p.gaps[i]):
                alpha, beta, gamma = p.gap[i, s, 0], p.gap[i, s, 1], p.gap[i, s, 2]
                if beta == 0.0 and alpha * state[Q] + gamma < 0:
                    state[Q] = -gamma / alpha
            set_clock(clock, end_turns, end_phase)
            return DONE
        pass_time(clock, tau)
        if closed < 0:
            continue
        alpha, beta = p.gap[i, closed, 0], p.gap[i, closed, 1]
        if tau > 0 and beta == 0.0 and alpha * u >= 0:  # closed at the very turning point
            state[Q], state[V] = -p.gap[i, closed, 2] / alpha, 0.0
            continue
        status = pass_gap(
            p, clock, state, count, events, closed, end - tau, end_turns, end_phase, upper, lower
        )
        if status != DONE:
            return status
