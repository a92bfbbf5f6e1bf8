"""Kernels that follow a beam from event to event, by the exact flow of all its modes."""

from __future__ import annotations

import math

from ..._compiling.compiled import kernel
from ..basis.events import (
    BEAM_APPROACH,
    DIVERGED,
    DONE,
    EXHAUSTED,
    FULL,
    GREATEST,
    HEAD,
    IMPACT,
    IMPACT_COUNT,
    KNOWN,
    LEG_COUNT,
    LOW,
    PART,
    PHASE,
    REGIME,
    RELEASE,
    ROW_COUNT,
    ROW_KIND,
    ROW_KNOWN,
    ROW_REGIME,
    SPENT,
    STICK,
    STICK_COUNT,
    TOUCH,
    TURNS,
)
from ..exact.passing import pass_time, set_clock, time_until
from .beam_flow import (
    APART,
    AT_BALANCE,
    AT_REST,
    TOUCHING,
    advance,
    begin,
    evaluate,
    first_zero,
    turned,
)

FREE, CONTACT = 0, 1


@kernel
def note(events, count, clock, kind, regime, known, approach, beam, state):
    """Write an event."""
    if len(events) == 0:
        return
    row = events[count[ROW_COUNT]]
    row[TURNS], row[PHASE], row[ROW_KIND], row[ROW_REGIME] = (
        clock[TURNS],
        clock[PHASE],
        kind,
        regime,
    )
    row[ROW_KNOWN], row[BEAM_APPROACH] = known, approach
    for n in range(2 * beam.modes):
        row[HEAD + n] = state[n]
    count[ROW_COUNT] += 1


@kernel
def gap_rate(beam, state, clock):
    """Rate of the gap between tip and stop."""
    rate = (beam.wave[0] * 1j * turned(clock[PHASE] + clock[LOW])).real
    for n in range(beam.modes):
        rate += beam.signal[0, n] * state[beam.modes + n]
    return rate


@kernel
def part_with(beam, state, clock, rate):
    """Apply the impulse at the tip that gives the gap a given rate."""
    change = (rate - gap_rate(beam, state, clock)) / beam.modes
    for n in range(beam.modes):
        state[beam.modes + n] -= beam.side * change


@kernel
def put_on(beam, state, clock):
    """Set the tip exactly on the stop, so that rounding does not add up over impacts."""
    gap = beam.offset[FREE] + (beam.wave[FREE] * turned(clock[PHASE] + clock[LOW])).real
    for n in range(beam.modes):
        gap += beam.signal[FREE, n] * state[n]
    for n in range(beam.modes):
        state[n] += beam.side * gap / beam.modes


@kernel
def fastest(beam, state):
    """Scale of the modes' velocities, to judge what is rounding."""
    total = 0.0
    for n in range(beam.modes):
        total += abs(state[beam.modes + n])
    return total


@kernel
def rest_on(beam, state, clock):
    """Remove the gap's remaining rate; whether the tip then presses on the stop."""
    part_with(beam, state, clock, 0.0)
    terms, _value = begin(beam, FREE, state, clock)
    _d, _g1, g2, g3, _most, _third = evaluate(beam.scratch, terms, 0.0)
    return g2 < 0 or (g2 == 0.0 and g3 <= 0)


@kernel
def hit(beam, state, clock, count, totals, events):
    """Impact on the rigid stop; the next regime and the kind of its start."""
    speed = -gap_rate(beam, state, clock)
    left = 0.0
    if speed > 1e-13 * fastest(beam, state):
        rebound = beam.restitution * speed
        totals[GREATEST] = max(totals[GREATEST], speed)
        totals[SPENT] += (speed - rebound) * (speed + rebound) / (2 * beam.modes)
        count[IMPACT_COUNT] += 1
        part_with(beam, state, clock, rebound)
        note(events, count, clock, IMPACT, FREE, TOUCHING, speed, beam, state)
        if rebound > 0.0:
            if rebound > beam.chatter * totals[GREATEST] or beam.restitution >= 1:
                return FREE, TOUCHING
            terms, _value = begin(beam, FREE, state, clock)
            _d, _g1, g2, _g3, _most, third = evaluate(beam.scratch, terms, 0.0)
            # All further rebounds together take so long; the force must not change much in it.
            left = 2 * rebound / (1 - beam.restitution)
            if g2 >= 0 or 100 * third * left > g2 * g2:
                return FREE, TOUCHING
            left /= -g2
            totals[SPENT] += rebound * rebound / (2 * beam.modes)
    if rest_on(beam, state, clock):
        count[STICK_COUNT] += 1
        note(events, count, clock, STICK, CONTACT, APART, left, beam, state)
        return CONTACT, APART
    return FREE, AT_REST


@kernel
def opens(beam, regime, state, clock):
    """Whether the gap of a regime, which is closed, opens by the motion to come."""
    terms, _value = begin(beam, regime, state, clock)
    _d, g1, _g2, _g3, _most, _third = evaluate(beam.scratch, terms, 0.0)
    return g1 >= 0


@kernel
def meet(beam, state, clock, count, totals, events):
    """Touch or leave the soft stop; the next regime and the kind of its start, as `hit`."""
    speed = -gap_rate(beam, state, clock)
    known, pressed = TOUCHING, speed > 0
    moves = abs(speed) > 1e-13 * fastest(beam, state)
    if moves and not abs(speed) > 1e-6 * totals[GREATEST] > 0.0:
        # A slow one may be rounding all the same, which the motion to come does not bear out.
        moves = opens(beam, CONTACT if pressed else FREE, state, clock)
    if not moves:
        known, pressed = AT_REST, rest_on(beam, state, clock)
    if pressed:
        totals[GREATEST] = max(totals[GREATEST], speed)
        count[IMPACT_COUNT] += 1
        note(events, count, clock, TOUCH, CONTACT, known, max(speed, 0.0), beam, state)
        return CONTACT, known
    note(events, count, clock, PART, FREE, known, 0.0, beam, state)
    return FREE, known


@kernel
def run(beam, clock, state, after, where, count, totals, events, end_turns, end_phase, most_legs):
    """Move to the end phase, writing events as rows; to be called again when they are full.

    The arrays are as in `events`.
    """
    spent = 0
    count[ROW_COUNT] = 0
    while True:
        if len(events) > 0 and count[ROW_COUNT] + 3 > len(events):
            return FULL
        if spent >= most_legs:
            return EXHAUSTED
        spent += 1
        count[LEG_COUNT] += 1
        end = time_until(clock, end_turns, end_phase)
        if end <= 0:
            return DONE
        i, known = where[REGIME], where[KNOWN]
        terms, value = begin(beam, i, state, clock)
        if not math.isfinite(value) and beam.offset[i] < math.inf:
            return DIVERGED
        if beam.offset[i] == math.inf:  # no stop
            closed, tau = False, end
        else:
            if known == APART and value <= 0:
                known = TOUCHING
            closed, tau = first_zero(beam.scratch, terms, value, known, end)
        if tau > 0:
            advance(beam, i, state, clock[PHASE] + clock[LOW], tau, after)
            for n in range(2 * beam.modes):
                state[n] = after[n]
            if tau >= end:
                set_clock(clock, end_turns, end_phase)
            else:
                pass_time(clock, tau)
        if not closed:
            where[KNOWN] = APART if tau > 0 else known
        elif i == CONTACT and beam.restitution >= 0:
            part_with(beam, state, clock, 0.0)
            note(events, count, clock, RELEASE, FREE, AT_BALANCE, 0.0, beam, state)
            where[REGIME], where[KNOWN] = FREE, AT_BALANCE
        elif beam.restitution >= 0:
            put_on(beam, state, clock)
            where[REGIME], where[KNOWN] = hit(beam, state, clock, count, totals, events)
        else:
            where[REGIME], where[KNOWN] = meet(beam, state, clock, count, totals, events)
