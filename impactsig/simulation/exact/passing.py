"""What follows an event: clock, event rows, impacts, change of mode, sticking and release."""

from __future__ import annotations

import math

from ..._compiling.compiled import cfunc, inlined, kernel
from ..basis.events import (
    BROKEN,
    CONTACT_COUNT,
    DONE,
    FASTEST,
    IMPACT,
    IMPACT_COUNT,
    LOST,
    LOW,
    MARK,
    MODE,
    PART,
    PHASE,
    ROW_APPROACH,
    ROW_COUNT,
    ROW_KIND,
    ROW_MODE,
    ROW_Q,
    ROW_STOP,
    ROW_V,
    STICK,
    STICK_COUNT,
    STUCK,
    TOUCH,
    TURN,
    TURNS,
    Q,
    V,
)
from .flow import push

# What the closing of a gap means.
HIT, ENTER, LEAVE, CLEAR, LIFT, PRESS, HALT = range(7)

TURN_LOW = 2.4492935982947064e-16  # 2 pi - TURN
CALM = 0.01  # relative change of the pressing force for which chatter is a geometric series
NOTHING = 4e-16  # a gap this small beside what it is the difference of is closed


@cfunc("float64(float64)")
def constant_law(_velocity):
    """Placeholder for a restitution function that the stop does not have."""
    return math.nan


@inlined
def pass_time(clock, tau):
    """Advance the phase by tau, as a compensated sum reduced to a turn."""
    total = clock[PHASE] + tau
    part = total - clock[PHASE]
    clock[LOW] += (clock[PHASE] - (total - part)) + (tau - part)
    while total >= TURN:
        total -= TURN  # exact for total < 2 TURN, and else of no more than one rounding
        clock[LOW] -= TURN_LOW
        clock[TURNS] += 1
    clock[PHASE] = total + clock[LOW]
    clock[LOW] += total - clock[PHASE]
    if clock[PHASE] < 0:
        clock[PHASE] += TURN
        clock[TURNS] -= 1
        clock[LOW] += TURN_LOW


@inlined
def set_clock(clock, turns, phase):
    """Put the clock at an instant."""
    clock[TURNS], clock[PHASE], clock[LOW] = turns, phase, 0.0


@inlined
def time_until(clock, turns, phase):
    """Time from the clock to an instant."""
    return (turns - clock[TURNS]) * TURN + (phase - clock[PHASE]) - clock[LOW]


@inlined
def note(events, count, clock, kind, stop, mode, q, v, approach):
    """Write one event."""
    if len(events) == 0:
        return
    row = events[count[ROW_COUNT]]
    row[TURNS], row[PHASE], row[ROW_KIND], row[ROW_STOP] = clock[TURNS], clock[PHASE], kind, stop
    row[ROW_MODE], row[ROW_Q], row[ROW_V], row[ROW_APPROACH] = mode, q, v, approach
    count[ROW_COUNT] += 1


@inlined
def heading(p, i, way):
    """The mode for motion in a direction; with friction there is one for each."""
    return i - i % 2 + (1 if way < 0 else 0) if p.has_friction else i


@inlined
def touches(p, i, q):
    """Whether a rigid stop is touched."""
    for s in range(p.gaps[i]):
        if p.meanings[i, s, 0] == HIT and p.gap[i, s, 0] * q + p.gap[i, s, 2] == 0.0:
            return True
    return False


@inlined
def hold(clock, count, events, i, q):
    """Stick at the present position."""
    count[STUCK] = 1
    count[STICK_COUNT] += 1
    note(events, count, clock, STICK, -1, i, q, 0.0, 0.0)


@inlined
def pass_gap(p, clock, state, count, events, s, end, end_turns, end_phase, upper, lower):
    """Handle the closing of a gap: an impact, a change of mode, or rest."""
    i = count[MODE]
    v = state[V]
    meaning, stop, beyond = p.meanings[i, s, 0], p.meanings[i, s, 1], p.meanings[i, s, 2]
    if meaning == HALT:
        state[V] = 0.0
        return DONE
    if meaning == HIT:
        state[Q] = -p.gap[i, s, 2] / p.gap[i, s, 0]
        if v == 0.0:
            hold(clock, count, events, i, state[Q])
            return DONE
        return rebound(
            p, clock, state, count, events, stop, end, end_turns, end_phase, upper, lower
        )
    count[MODE] = beyond
    if p.gap[i, s, 1] == 0.0:
        state[Q] = p.land[i, s]
    if p.pressed[beyond] > 0 and p.pressed[i] == 0:
        state[LOST] += v * v / 2
    elif p.pressed[beyond] == 0 and p.pressed[i] > 0:
        state[LOST] -= v * v / 2
    if meaning in (ENTER, PRESS):
        approach = max(p.side[stop] * v, 0.0)
        count[IMPACT_COUNT] += 1
        count[CONTACT_COUNT] += 1
        state[FASTEST] = max(state[FASTEST], approach)
        note(events, count, clock, TOUCH, stop, beyond, state[Q], v, approach)
    else:
        kind = MARK if meaning == CLEAR else PART
        note(events, count, clock, kind, stop, beyond, state[Q], v, 0.0)
    return DONE


@inlined
def returned(p, stop, v, upper, lower):
    """Restitution coefficient at an approach velocity."""
    r = p.restitution[stop]
    if r == -2.0:
        return upper(v * p.speed) if p.side[stop] > 0 else lower(v * p.speed)
    return r


@inlined
def rebound(p, clock, state, count, events, stop, end, end_turns, end_phase, upper, lower):
    """Reverse the velocity at a rigid stop; chatter may end there at once."""
    side = p.side[stop]
    v = abs(state[V])
    r = returned(p, stop, v, upper, lower)
    if not 0 <= r <= 1:
        return BROKEN
    out = r * v
    i = heading(p, count[MODE], -side if out > 0 else side)
    count[MODE] = i
    state[V] = -side * out if out > 0 else 0.0
    state[FASTEST] = max(state[FASTEST], v)
    if p.pressed[i] == 0:
        state[LOST] += (v * v - out * out) / 2
    count[IMPACT_COUNT] += 1
    note(events, count, clock, IMPACT, stop, i, state[Q], state[V], v)
    if out == 0.0 or out > p.chatter * state[FASTEST] or r == 1.0:
        return DONE
    if p.restitution[stop] == -2.0 and out > 1e-12 * state[FASTEST]:
        slower = returned(p, stop, 1e-3 * out, upper, lower)
        if not abs(slower - r) <= CALM * (1 - r):
            return DONE
    settle(p, clock, state, count, events, side, r, out, end, end_turns, end_phase)
    return DONE


@kernel
def settle(p, clock, state, count, events, side, r, out, end, end_turns, end_phase):
    """Sum the remaining rebounds of a chatter as a geometric series, then stick."""
    i = count[MODE]
    f, f1, _f2 = push(p, clock, 0.0)
    pressing = side * (f + still(p, i, state[Q]))
    back = pressing - p.kinetic  # what brings the mass back; friction helps what slows it
    if back <= 0:
        return
    away = pressing + p.kinetic
    ratio = math.sqrt(back / away)
    left = out / away * (1 + 1 / ratio) / (1 - r * ratio)
    change = abs(f1) + p.force_bound[2] * left + 2 * p.delta[i] * away + p.kappa[i] * out
    if change * left > CALM * back:
        return
    state[V] = 0.0
    if p.pressed[i] == 0:
        state[LOST] += out * out / 2
    if left >= end:
        set_clock(clock, end_turns, end_phase)
    else:
        pass_time(clock, left)
    hold(clock, count, events, i, state[Q])


@inlined
def grip(p, i, q):
    """Least and greatest force that hold a mass at rest at q: by friction and rigid stops."""
    low, high = -p.static, p.static
    for s in range(p.gaps[i]):
        if p.meanings[i, s, 0] == HIT and p.gap[i, s, 0] * q + p.gap[i, s, 2] == 0.0:
            if p.gap[i, s, 0] < 0:
                high = math.inf
            else:
                low = -math.inf
    return low, high


@inlined
def still(p, i, q):
    """Constant part of the force per mass at rest at q, without friction."""
    f = p.constant[i] - p.kappa[i] * q
    return f + (p.kinetic if i % 2 == 0 else -p.kinetic) if p.has_friction else f


@kernel
def unstick(p, clock, i, q, end):
    """Time until the force exceeds what holds the mass, and the direction; 0 if it stays."""
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


@kernel
def depart(p, clock, i, q):
    """Direction in which a mass at rest leaves, 0 if held; and whether the hold just gives way.

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
