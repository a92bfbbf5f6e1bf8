"""What is read from a motion afterwards: its state at any instant, and the peaks of contacts."""

from __future__ import annotations

import math

from ._events import STICK
from ._flow import TURN, begin, bound, free, inlined, kernel, locate, steady


@inlined
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


@kernel
def sample(p, scratch, rows, where, turns, phase, q, v):
    """Position q and velocity v at instants, each in the segment that `where` names."""
    for k in range(len(turns)):
        i, x, v[k] = follow(p, scratch, rows[where[k]], turns[k], phase[k])
        for s in range(p.gaps[i]):
            alpha, gamma = p.gap[i, s, 0], p.gap[i, s, 2]
            if p.gap[i, s, 1] == 0.0 and alpha * x + gamma < 0:
                x = -gamma / alpha  # rounding
        q[k] = x + p.origin[i]


@kernel
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


@kernel
def peaks(p, scratch, rows, first, last, ends, springs, dampers, positions, peak):
    """Greatest force `peak` of contacts, from the touch in row `first` to row `last`.

    A run that ends within a contact does so at the turns and phase `ends`.
    """
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
