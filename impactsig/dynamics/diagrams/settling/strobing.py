"""Stroboscopic iteration until the orbit closes, an attractor catches it, or time is up."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import inlined, kernel, njit
from ....simulation.basis.events import (
    DONE,
    IMPACT_COUNT,
    LEG_COUNT,
    LOST,
    MODE,
    PHASE,
    STROBE_ENERGY,
    STROBE_IMPACTS,
    TURNS,
    Q,
    V,
)
from ....simulation.batches.batch_kernels import machine
from ....simulation.exact.engine import run

NOISE = 1e-13  # returns this close, as a share of the size, are exact but for rounding
# What is found of a start: status, period of the orbit (0: not closed), attractor that caught it
# (counted from 1; 0: none), periods taken.
STATUS_OF, CLOSED, CAUGHT, TAKEN = range(4)
FOUND = TAKEN + 1

RESOLVED = 10.0  # strobes closer than so many tolerances are one


@kernel
def closing(strobes, n, tolerance, longest):
    """Period of the orbit that strobe n closes, 0 if none.

    An orbit of m periods has closed where the last m strobes are back to within d of those before,
    these to within e of theirs, with as many impacts, and what a transient that shrinks so has
    left to go, d / (1 - d/e), is below the tolerance, a share of the strobes' size.
    """
    size = 0.0
    for k in range(max(0, n - 3 * longest), n + 1):
        size = max(size, abs(strobes[k, Q]), abs(strobes[k, V]))
    limit = tolerance * size
    for m in range(1, longest + 1):
        if n < 3 * m:
            return 0
        if apart(strobes, n, n - m) > limit:
            continue
        last, before, alike = 0.0, 0.0, True
        for j in range(m):
            last = max(last, apart(strobes, n - j, n - j - m))
            before = max(before, apart(strobes, n - j - m, n - j - 2 * m))
            alike &= strobes[n - j, STROBE_IMPACTS] == strobes[n - j - m, STROBE_IMPACTS]
        if not alike or last > limit:
            continue
        if last <= NOISE * size or (last < before and last * before <= limit * (before - last)):
            return least(strobes, n, m, RESOLVED * limit)
    return 0


@inlined
def comes_near(strobes, n, limit, longest):
    """Whether strobe n is within a limit of one that may be a period before it.

    With a limit no less than that of `closing`, no other strobe closes an orbit, and this takes
    less time.
    """
    near = False
    for m in range(1, min(longest, n // 3) + 1):
        near |= apart(strobes, n, n - m) <= limit
    return near


@kernel
def least(strobes, n, m, limit):
    """Least divisor of m after which the last m strobes repeat within a limit."""
    for d in range(1, m):
        if m % d == 0:
            back = True
            for j in range(m):
                back &= apart(strobes, n - j, n - j - d) <= limit
                back &= strobes[n - j, STROBE_IMPACTS] == strobes[n - j - d, STROBE_IMPACTS]
            if back:
                return d
    return m


@njit(nogil=True)
def least_of_each(strobes, m, share):
    """`least` of each motion at its last strobe, and impacts in as many periods.

    The limit is that share of the greatest displacement or velocity.
    """
    rows = strobes.shape[1]
    periods, impacts = np.zeros((2, len(strobes)), np.int64)
    for k in range(len(strobes)):
        size = 0.0
        for n in range(rows):
            size = max(size, abs(strobes[k, n, Q]), abs(strobes[k, n, V]))
        periods[k] = least(strobes[k], rows - 1, m, share * size)
        for n in range(rows - periods[k], rows):
            impacts[k] += int(strobes[k, n, STROBE_IMPACTS])
    return periods, impacts


@inlined
def apart(strobes, i, j):
    """Distance of two strobes: the greater of displacement and velocity."""
    return max(abs(strobes[i, Q] - strobes[j, Q]), abs(strobes[i, V] - strobes[j, V]))


@inlined
def caught(x, v, points, owner, radius):
    """Index of the attractor within whose radius a strobe lies, -1 if none."""
    for k in range(len(points)):
        if math.hypot(x - points[k, 0], v - points[k, 1]) <= radius[owner[k]]:
            return owner[k]
    return -1


@kernel
def follow(p, scratch, upper, lower, clock, state, count, strobes, first, rule, known):
    """Fill in strobes from row `first` on, one forcing period each, until the orbit closes.

    A strobe is position, velocity, impacts in the period before it and the energy lost in it.
    `rule` is the tolerance, the longest period, whether to end where the orbit closes, and the work
    a period may take; `known` are the points of known attractors, whose each is, and the radii
    within which they catch. Returns the status, the last row filled in, the period of the orbit
    (0 if it has not closed), and the attractor that caught it (-1 if none).
    """
    tolerance, longest, ends, legs = rule
    points, owner, radius = known
    phase, period, seen = clock[PHASE], 0, 0
    greatest = 0.0
    for n in range(max(0, first - 3 * longest), first):
        greatest = max(greatest, abs(strobes[n, Q]), abs(strobes[n, V]))
    for n in range(first, len(strobes)):
        impacts, energy = count[IMPACT_COUNT], state[LOST]
        count[LEG_COUNT] = 0
        status = run(
            p, scratch, clock, state, count, strobes[:0], clock[TURNS] + 1.0, phase, legs,
            upper, lower,
        )  # fmt: skip
        if status != DONE:
            return status, n - 1, 0, -1
        strobes[n, Q] = state[Q] + p.origin[count[MODE]]
        strobes[n, V] = state[V]
        strobes[n, STROBE_IMPACTS] = count[IMPACT_COUNT] - impacts
        strobes[n, STROBE_ENERGY] = state[LOST] - energy
        by = caught(strobes[n, Q], strobes[n, V], points, owner, radius)
        if by >= 0:
            return status, n, 0, by
        greatest = max(greatest, abs(strobes[n, Q]), abs(strobes[n, V]))
        m = 0
        if comes_near(strobes, n, tolerance * greatest, longest):
            m = closing(strobes, n, tolerance, longest)
        if m > 0:
            if ends:
                return status, n, m, -1
            period, seen = m, n
    # Where the orbit is closed, rounding may hide it from the last strobe alone.
    return DONE, len(strobes) - 1, period if len(strobes) - 1 - seen <= 3 * longest else 0, -1


@kernel
def go_on(p, scratch, upper, lower, clock, state, count, strobes, rule, known, found):
    """`follow` a motion from where it is, which `found` says; that is then brought up to date.

    `found` has FOUND zeros at first. A motion that has ended is left as it is.
    """
    if found[STATUS_OF] != DONE or found[CLOSED] > 0 or found[CAUGHT] > 0:
        return
    first = found[TAKEN] + 1
    if first == 1:
        strobes[0, Q], strobes[0, V] = state[Q] + p.origin[count[MODE]], state[V]
        strobes[0, STROBE_IMPACTS] = strobes[0, STROBE_ENERGY] = 0.0
    status, last, m, by = follow(
        p, scratch, upper, lower, clock, state, count, strobes, first, rule, known
    )
    found[STATUS_OF], found[CLOSED], found[CAUGHT], found[TAKEN] = status, m, by + 1, last


@kernel
def follow_starts(
    p, scratch, upper, lower, clocks, states, counts, strobes, rule, known, found, orbits
):
    """Follow many starts of one machine: what is found of each, and closed orbits.

    `found`, of zeros, has shape (starts, FOUND), `orbits` (starts, longest, 3), the last being the
    impacts. All share the `strobes`.
    """
    for k in range(len(states)):
        go_on(
            p, scratch, upper, lower, clocks[k], states[k], counts[k], strobes, rule, known,
            found[k],
        )  # fmt: skip
        first = found[k, TAKEN] - found[k, CLOSED] + 1
        for j in range(found[k, CLOSED]):
            for c in range(3):
                orbits[k, j, c] = strobes[first + j, c]


@kernel
def follow_machines(
    many, scratch, upper, lower, clocks, states, counts, strobes, upto, rule, known, found
):
    """Follow one motion of each machine of a layout, from where the clocks and states are.

    `many` are their tables as `modes.stacks` makes them; `upto` is the last strobe to be taken, and
    the next call goes on from there.
    """
    for k in range(len(states)):
        go_on(
            machine(many, k), scratch, upper, lower, clocks[k], states[k], counts[k],
            strobes[k][: upto + 1], rule, known, found[k],
        )  # fmt: skip
