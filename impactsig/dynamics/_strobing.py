"""A motion once a forcing period, until its orbit has closed, it is caught, or its time is over."""

from __future__ import annotations

import math

import numpy as np

from .._compiled import njit
from ..simulate._engine import run
from ..simulate._events import COLUMNS, COUNTERS, DONE
from ..simulate._flow import Problem

NOISE = 1e-13  # returns this close, as a share of the size, are exact but for rounding
RESOLVED = 10.0  # strobes closer than so many tolerances are one


@njit(nogil=True)
def closing(strobes, n, tolerance, longest):
    """Period of the orbit that strobe n has closed, 0 if none.

    An orbit of m periods has closed where the last m strobes are back to within d of those before,
    these to within e of theirs, with as many impacts, and what a transient that shrinks so has
    left to go, d / (1 - d/e), is below the tolerance, a share of the strobes' size.
    """
    size = 0.0
    for k in range(max(0, n - 3 * longest), n + 1):
        size = max(size, abs(strobes[k, 0]), abs(strobes[k, 1]))
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
            alike &= strobes[n - j, 2] == strobes[n - j - m, 2]
        if not alike or last > limit:
            continue
        if last <= NOISE * size or (last < before and last * before <= limit * (before - last)):
            return least(strobes, n, m, RESOLVED * limit)
    return 0


@njit(nogil=True)
def least(strobes, n, m, limit):
    """The least divisor of m after which the last m strobes are back to within a limit."""
    for d in range(1, m):
        if m % d == 0:
            back = True
            for j in range(m):
                back &= apart(strobes, n - j, n - j - d) <= limit
                back &= strobes[n - j, 2] == strobes[n - j - d, 2]
            if back:
                return d
    return m


@njit(nogil=True, inline="always")
def apart(strobes, i, j):
    """Distance of two strobes in the greater of displacement and velocity."""
    return max(abs(strobes[i, 0] - strobes[j, 0]), abs(strobes[i, 1] - strobes[j, 1]))


@njit(nogil=True)
def caught(x, v, points, owner, radius):
    """The attractor that a strobe is within the radius of, -1 if none."""
    for k in range(len(points)):
        if math.hypot(x - points[k, 0], v - points[k, 1]) <= radius[owner[k]]:
            return owner[k]
    return -1


@njit(nogil=True)
def follow(p, scratch, upper, lower, clock, state, count, strobes, rule, known):
    """Fill in strobes from row 1 on, one forcing period each, until the orbit closes.

    A strobe is position, velocity, impacts in the period before it and the energy lost in it.
    `rule` is the tolerance, the longest period, whether to end where the orbit closes, and the work
    a period may take; `known` are the points of known attractors, whose each is, and the radii
    within which they catch. Returns the status, the last row filled in, the period of the orbit
    (0 if it has not closed), and the attractor that caught it (-1 if none).
    """
    none = np.empty((0, COLUMNS))
    tolerance, longest, ends, legs = rule
    points, owner, radius = known
    phase, period, seen = clock[1], 0, 0
    for n in range(1, len(strobes)):
        impacts, energy = count[2], state[3]
        count[6] = 0
        status = run(
            p, scratch, clock, state, count, none, clock[0] + 1.0, phase, legs, upper, lower
        )
        if status != DONE:
            return status, n - 1, 0, -1
        strobes[n, 0] = state[0] + p.origin[count[0]]
        strobes[n, 1] = state[1]
        strobes[n, 2] = count[2] - impacts
        strobes[n, 3] = state[3] - energy
        by = caught(strobes[n, 0], strobes[n, 1], points, owner, radius)
        if by >= 0:
            return status, n, 0, by
        m = closing(strobes, n, tolerance, longest)
        if m > 0:
            if ends:
                return status, n, m, -1
            period, seen = m, n
    # Where the orbit is closed, rounding may hide it from the last strobe alone.
    return DONE, len(strobes) - 1, period if len(strobes) - 1 - seen <= 3 * longest else 0, -1


@njit(nogil=True)
def follow_all(p, scratch, upper, lower, phase, states, modes, strobes, rule, known, found, orbits):
    """Follow many starts: status, period, attractor and periods taken of each, and closed orbits.

    `found` has shape (starts, 4), `orbits` (starts, longest, 3), the last being the impacts.
    """
    clock, count = np.empty(3), np.zeros(COUNTERS, np.int64)
    for k in range(len(states)):
        clock[0], clock[1], clock[2] = 0.0, phase, 0.0
        count[:] = 0
        count[0] = modes[k]
        state = states[k]
        strobes[0, 0], strobes[0, 1] = state[0] + p.origin[modes[k]], state[1]
        strobes[0, 2] = strobes[0, 3] = 0.0
        status, last, m, by = follow(
            p, scratch, upper, lower, clock, state, count, strobes, rule, known
        )
        found[k, 0], found[k, 1], found[k, 2], found[k, 3] = status, m, by, last
        for j in range(m):
            for c in range(3):
                orbits[k, j, c] = strobes[last - m + 1 + j, c]


@njit(nogil=True)
def follow_machines(many, scratch, upper, lower, clocks, states, counts, strobes, rule, found):
    """Follow one start of each machine of a layout, from where the clocks and states are.

    `many` are their tables as `simulate._modes.problems` makes them; `found`, of shape
    (machines, 3), is filled with the status, the periods taken and the period of the orbit.
    """
    known = np.empty((0, 2)), np.empty(0, np.int64), np.empty(0)
    for k in range(len(states)):
        p = machine(many, k)
        strobes[k, 0, 0], strobes[k, 0, 1] = states[k, 0] + p.origin[counts[k, 0]], states[k, 1]
        strobes[k, 0, 2] = strobes[k, 0, 3] = 0.0
        status, last, m, _ = follow(
            p, scratch, upper, lower, clocks[k], states[k], counts[k], strobes[k], rule, known
        )
        found[k, 0], found[k, 1], found[k, 2] = status, last, m


@njit(nogil=True, inline="always")
def machine(many, k):
    """The tables of one of them."""
    return Problem(
        many.kappa[k],
        many.delta[k],
        many.root[k],
        many.sort[k],
        many.constant[k],
        many.rest[k],
        many.drift[k],
        many.cosine[k],
        many.sine[k],
        many.reach[k],
        many.rate[k],
        many.ratio[k],
        many.force_cos[k],
        many.force_sin[k],
        many.force_bound[k],
        many.pressed,
        many.gaps,
        many.leans[k],
        many.gap[k],
        many.means,
        many.land[k],
        many.origin[k],
        many.side,
        many.restitution[k],
        many.speed[k],
        many.kinetic[k],
        many.static[k],
        many.rubs,
        many.chatter,
        many.skip,
    )
