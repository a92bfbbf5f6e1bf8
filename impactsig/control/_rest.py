"""Kernels: impacts and rest under delayed feedback.

As `simulate._contact` and `simulate._rest`, with the control force among what presses on the mass.
"""

from __future__ import annotations

import math

from ..simulate._contact import SPEED, note, restitution_at, slide, touched
from ..simulate._events import IMPACT, REVERSE
from ..simulate._flow import TURN, inner
from ..simulate._passing import CALM
from ..simulate._rates import PLACE, RESTITUTION, SIDE, jerk, open_leg, pull
from ..simulate._rest import holding, rigid_at
from ._line import VELOCITY, read

LOOKS = 64  # at the forces on a mass at rest, in the period of the fastest forcing


@inner
def force_at(fb, line, past, tau, y, v):
    """Control force per mass, tau after the beginning of the step; y is the displacement."""
    if not fb.on:
        return 0.0
    late = read(line, past.step, past.last, past.first, fb.signal, past.offset + tau)
    push = fb.gain * (late - (v if fb.signal == VELOCITY else y))
    return min(max(push, -fb.limit), fb.limit)


@inner
def departure(p, f, leg, s, fb, line, past, y, k):
    """Where a mass at rest goes: 1 up, -1 down, 0 stays, 2 no number; and if from a balance."""
    low, high = holding(p, k)
    at = y + leg.origin
    control = force_at(fb, line, past, 0.0, at, 0.0)
    push = pull(f, leg, s, 0.0, y, 0.0) + control
    if not math.isfinite(push):
        return 2, False
    even = p.static == p.kinetic
    if push in (low, high):
        h = 1e-6
        rate = jerk(p, f, leg, s, y) + (force_at(fb, line, past, h, at, 0.0) - control) / h
        if push == low and rate < 0:
            return -1, even
        if push == high and rate > 0:
            return 1, even
    if low <= push <= high:
        return 0, False
    return 1 if push > high else -1, False


@inner
def unstick(p, f, leg, s, fb, line, past, y, low, high, end):
    """Time until the forces on a mass that rests leave [low, high], or `end` if that is sooner.

    Returns it with the direction in which the mass goes, 0 if it stays, 2 if a force is no number.
    """
    tau, before = 0.0, 0.0
    at = y + leg.origin
    while True:
        push = pull(f, leg, s, tau, y, 0.0) + force_at(fb, line, past, tau, at, 0.0)
        if not math.isfinite(push):
            return tau, 2
        out = 1 if push > high else (-1 if push < low else 0)
        if out != 0 and tau > 0:
            for _ in range(100):
                middle = (before + tau) / 2
                if not before < middle < tau:
                    break
                push = pull(f, leg, s, middle, y, 0.0)
                push += force_at(fb, line, past, middle, at, 0.0)
                if low <= push <= high:
                    before = middle
                else:
                    tau = middle
        if out != 0 or tau >= end:
            return tau, out
        before = tau
        tau = min(tau + TURN / LOOKS / p.fastest, end)


@inner
def rest_or_turn(p, f, s, fb, line, past, clock, state, count, events):
    """A sliding mass comes to rest: it turns, unless it is held (which the next pass finds)."""
    state[1] = 0.0
    slide(count, 0)
    approach = state[SPEED + 1 :]
    leg = open_leg(p, s, clock[0], clock[1], clock[2], count[0], approach, state[0], 0.0)
    way, _ = departure(p, f, leg, s, fb, line, past, state[0], rigid_at(p, leg, state[0]))
    if abs(way) == 1:
        slide(count, way)
        note(events, count, clock, state, REVERSE, -1, 0.0)


@inner
def rebound(p, f, s, fb, line, past, clock, state, count, events, k, calm):
    """Reset the velocity at a rigid stop.

    Returns how long a chatter takes that is to be summed (0: none), -1 if the user's restitution
    is none. It is summed only where its end comes before `calm`, the time in which what is fed
    back is smooth, and nothing that presses on the mass changes by much.
    """
    side = p.stops[k, SIDE]
    v = abs(state[1])
    r = restitution_at(p, f, k, v)
    if math.isnan(r):
        return -1.0
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
        return 0.0
    rest = count[0] - count[0] % 3
    approach = state[SPEED + 1 :]
    leg = open_leg(p, s, clock[0], clock[1], clock[2], rest, approach, state[0], state[1])
    at = p.stops[k, PLACE]
    control = force_at(fb, line, past, 0.0, at, 0.0)
    pressing = side * (pull(f, leg, s, 0.0, state[0], 0.0) + control)
    if not pressing > p.static:
        return 0.0
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
                return -1.0
            speed *= kept * share
    if left >= calm:
        return 0.0
    most = 0.0
    for j in range(len(p.waves)):
        most += abs(p.waves[j, 1]) * p.waves[j, 0] ** 2
    change = abs(jerk(p, f, leg, s, state[0])) + most * left
    change += leg.rate * (pressing * (leg.damping > 0) + leg.rate * out)
    swing = abs(force_at(fb, line, past, left, at, 0.0) - control) + abs(fb.gain) * out
    if change * left + swing > CALM * (pressing - p.static):
        return 0.0
    if free:
        state[3] += out * out / 2
    return left
