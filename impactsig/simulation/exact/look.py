"""Evaluate a motion after the run: its state at any instant, and the peaks of contacts."""

from __future__ import annotations

import math

from ..._compiling.compiled import inlined, kernel
from ..basis.events import (
    IMPACT,
    PHASE,
    ROW_KIND,
    ROW_MODE,
    ROW_Q,
    ROW_STOP,
    ROW_V,
    STICK,
    TURN,
    TURNS,
)
from .flow import begin, bound, bounds, free, locate, steady
from .gap import stays_open


@kernel
def sample(p, scratch, rows, where, turns, phase, q, v):
    """Position q and velocity v at instants, each in the segment that `where` names."""
    if len(where) == 0:
        return
    row = rows[where[0]]
    i = int(row[ROW_MODE])
    leg = begin(p, scratch, i, row[TURNS], row[PHASE], 0.0, row[ROW_Q], row[ROW_V])
    for k in range(len(where)):
        if k > 0 and where[k] != where[k - 1]:
            row = rows[where[k]]
            i = int(row[ROW_MODE])
            leg = begin(p, scratch, i, row[TURNS], row[PHASE], 0.0, row[ROW_Q], row[ROW_V])
        tau = max((turns[k] - row[TURNS]) * TURN + (phase[k] - row[PHASE]), 0.0)
        if row[ROW_KIND] == STICK:
            x, u = row[ROW_Q], 0.0
        elif tau * leg.rate < 0.25:
            d, u, _a, _jerk, _b, _b1 = locate(leg, tau)
            x = row[ROW_Q] + d
        else:
            z, w = free(leg, tau)
            x, u = steady(p, i, turns[k], phase[k])
            x, u = leg.rest + x + z, u + w
        for s in range(p.gaps[i]):
            alpha, gamma = p.gap[i, s, 0], p.gap[i, s, 2]
            if p.gap[i, s, 1] == 0.0 and alpha * x + gamma < 0:
                x = -gamma / alpha  # rounding
                n = where[k] + 1
                if n < len(rows) and rows[n, ROW_KIND] == STICK and row[ROW_KIND] == IMPACT:
                    u = 0.0  # among the rebounds that were summed
        q[k], v[k] = x + p.origin[i], u


@inlined
def greatest(leg, first, slope, length, fourth):
    """Greatest value of first + slope[0] d + slope[1] u over a leg; d displacement, u velocity.

    Where it falls, the room below the best so far is a gap. Where it rises, its derivative is one;
    once that is certain to vanish without turning, Newton's method finds the maximum. `fourth`
    bounds the fourth derivative of the position.
    """
    size, more = abs(slope[0]), abs(slope[1])
    b = leg.drift - 2 * leg.delta * leg.w - leg.kappa * leg.z
    most, third = bounds(leg, b, -2 * leg.delta * b - leg.kappa * leg.w)
    tau, best = 0.0, -math.inf
    low, high = 0.0, -1.0  # the maximum lies between them, where high is not negative
    for _ in range(100_000):
        x, v, a, jerk, b, b1 = locate(leg, tau)
        value = first + slope[0] * x + slope[1] * v
        trend = slope[0] * v + slope[1] * a
        curve = slope[0] * a + slope[1] * jerk
        best = max(best, value)
        if high >= 0:
            low, high = (tau, high) if trend > 0 else (low, tau)
            if trend * trend > 1e-16 * abs(curve * best) and high - low > 1e-9 * length:
                tau = tau - trend / curve if curve < 0 else math.inf
                if tau >= length and high == length:
                    tau = length
                elif not low < tau < high:
                    tau = (low + high) / 2
                continue
            if trend > 0:
                tau, high = high, -1.0
                continue
            high = -1.0
        if tau >= length:
            break
        if b == b:
            most, third = bounds(leg, b, b1)
        jolt = size * third + more * fourth
        if trend < 0 or (trend == 0.0 and curve <= 0):
            room = best - value + 1e-11 * abs(best)
            swift = size * most + more * third
            step = stays_open(room, -trend, -curve, swift, jolt, swift, 0.0, jolt, 0.0)
        elif curve < 0 and curve * curve >= 2 * jolt * trend:
            low, high = tau, min(tau - 2 * trend / curve, length)
            tau = min(tau - trend / curve, length)
            continue
        else:
            step = (curve + math.sqrt(curve * curve + 2 * jolt * trend)) / jolt
        tau = min(tau + max(step, 1e-5 * length), length)
    return best


@kernel
def peaks(p, scratch, rows, first, last, ends, springs, dampers, positions, peak):
    """Greatest force `peak` of contacts, from the touch in row `first` to row `last`.

    A run that ends within a contact does so at the turns and phase `ends`.
    """
    for n in range(len(first)):
        stop = int(rows[first[n], ROW_STOP])
        side = p.side[stop]
        spring, damper = side * springs[stop], side * dampers[stop]
        best = -math.inf
        for k in range(first[n], min(last[n], len(rows))):
            row = rows[k]
            i = int(row[ROW_MODE])
            depth = row[ROW_Q] + (p.origin[i] - positions[stop])
            turns, phase = ends
            if k + 1 < len(rows):
                turns, phase = rows[k + 1, TURNS], rows[k + 1, PHASE]
            length = (turns - row[TURNS]) * TURN + (phase - row[PHASE])
            if row[ROW_KIND] == STICK or length <= 0:
                best = max(best, spring * depth + damper * row[ROW_V])
                continue
            leg = begin(p, scratch, i, row[TURNS], row[PHASE], 0.0, row[ROW_Q], row[ROW_V])
            fourth = 0.0
            if damper != 0.0:
                b = leg.drift - 2 * leg.delta * leg.w - leg.kappa * leg.z
                b1 = -2 * leg.delta * b - leg.kappa * leg.w
                b2 = -2 * leg.delta * b1 - leg.kappa * b
                b3 = -2 * leg.delta * b2 - leg.kappa * b1
                fourth = bound(leg.kappa, leg.delta, leg.root, leg.damping_kind, b2, b3)
                fourth += p.reach[i, 4]
            slope = (spring, damper)
            best = max(best, greatest(leg, spring * depth, slope, length, fourth))
        peak[n] = best
