"""Where pulses of one machine touch: read off the mean edges of the clear ones, of any shape.

The samples of all clear pulses, over their heights, are added up in short stretches of v, the time
from the start of their fits over the length of the rise, or from their end backwards over that of
the fall. With s = v - v0 beyond the touch v0, the mean edge is taken as

    a s^q (1 + b s + c s^2)

up to LEVEL of the height, with normal priors on ln a, ln q, b and c about the fitted edge, and on
v0 about where it is expected: a maximum a posteriori, by the method of Levenberg and Marquardt.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._damped_step import FIRST as DAMPING
from .._damped_step import MOST, damped_step, more_damped
from .._model import START, parts_of
from .._small_matrices import factor, invert
from ..edges import FIT
from ..fit_errors import BASE, FROM, NOISE, NOW, TILT, TO, ZERO
from ._common_rest import EXACT, is_clear

STRETCHES, FIRST, LAST = 150, -0.5, 1.0
"""How many, and from where to where [edges]."""
LEVEL = 0.6
"""Height up to which an edge is looked at."""
TERMS = 5
ABOUT = np.array([0.0, 0.5, 0.3, 0.5, 0.7])
"""Standard deviations of v0, which is given, ln a, ln q, b and c."""
ROUNDS, ENOUGH = 30, 1e-3
"""Steps at most, and a gain that ends them."""
BEGINS, FARTHEST = (0.0, -1.0, 1.0), 0.25
"""Where the touch is looked for first, in what it is expected to be off, and no farther [edges]."""
BESIDE = (-1.0, 1.0, -2.0, 2.0)
"""And from there [stretches]."""
STEEPEST, LONGEST = 30.0, 0.3
"""Slope [heights an edge], which has no bound where q < 1, and step in one parameter."""


@kernel
def add_edges(rows, alike, x, origin, rise, fall, edges):
    """Add the samples of clear pulses to the two mean `edges`, (2, STRETCHES, 3).

    Of each stretch the sums of the squares of heights, of these times v and of samples times
    heights, all over the variance of the noise. `rise` and `fall` are shares of the length.
    """
    for k in alike:
        if not is_clear(rows[k]):
            continue
        kept, height = rows[k, FIT:], rows[k, 2]
        zero = int(kept[ZERO])
        parts = parts_of(kept[NOW:])
        length = parts.rise + parts.flat + parts.fall
        one = 1.0 / max(kept[NOISE] ** 2, (EXACT * height) ** 2)
        for side in range(2):
            edge = length * (fall if side else rise)
            at, step = kept[NOW + START], 1.0
            if side:
                at, step = at + length, -1.0
            low, high = at + step * FIRST * edge, at + step * LAST * edge
            first = int(max(math.ceil(min(low, high)), kept[FROM]))
            last = int(min(math.floor(max(low, high)), kept[TO] - 1.0))
            for i in range(first, last + 1):
                v = step * (i - at) / edge
                b = min(int((v - FIRST) * (STRETCHES / (LAST - FIRST))), STRETCHES - 1)
                value = x[zero + i - origin] - kept[BASE] - kept[TILT] * i
                edges[side, b, 0] += height * height * one
                edges[side, b, 1] += height * height * one * v
                edges[side, b, 2] += height * value * one


@kernel
def _evaluate(p, about, v, y, w, normal):
    """Cost of the edge `p`; its normal equations go into `normal` (TERMS x TERMS + 1)."""
    for i in range(TERMS):
        for j in range(TERMS + 1):
            normal[i, j] = 0.0
    a, q = math.exp(p[1]), math.exp(p[2])
    misfit = 0.0
    for k in range(len(v)):
        s = v[k] - p[0]
        if s <= 0.0:
            misfit += w[k] * y[k] * y[k]
            continue
        power, bent = a * s**q, 1.0 + s * (p[3] + s * p[4])
        f = power * bent
        slope = power / s * (q * bent + s * (p[3] + 2.0 * s * p[4]))
        j0, j1 = -min(max(slope, -STEEPEST), STEEPEST), f
        j2, j3, j4 = f * q * math.log(s), power * s, power * s * s
        e, one = y[k] - f, w[k]
        misfit += one * e * e
        normal[0, 0] += one * j0 * j0
        normal[1, 0] += one * j1 * j0
        normal[1, 1] += one * j1 * j1
        normal[2, 0] += one * j2 * j0
        normal[2, 1] += one * j2 * j1
        normal[2, 2] += one * j2 * j2
        normal[3, 0] += one * j3 * j0
        normal[3, 1] += one * j3 * j1
        normal[3, 2] += one * j3 * j2
        normal[3, 3] += one * j3 * j3
        normal[4, 0] += one * j4 * j0
        normal[4, 1] += one * j4 * j1
        normal[4, 2] += one * j4 * j2
        normal[4, 3] += one * j4 * j3
        normal[4, 4] += one * j4 * j4
        normal[0, TERMS] += one * j0 * e
        normal[1, TERMS] += one * j1 * e
        normal[2, TERMS] += one * j2 * e
        normal[3, TERMS] += one * j3 * e
        normal[4, TERMS] += one * j4 * e
    cost = misfit
    for i in range(TERMS):
        off = (p[i] - about[0, i]) / about[1, i]
        normal[i, i] += about[1, i] ** -2.0
        normal[i, TERMS] -= off / about[1, i]
        cost += off * off
    return misfit, cost


@kernel
def _descend(p, seen, room):
    """Move the edge `p` to the least cost near by, in place; the misfit and the cost there."""
    about, v, y, w = seen
    trial, step, low, here, there = room
    misfit, cost = _evaluate(p, about, v, y, w, here)
    damping = DAMPING
    for _ in range(ROUNDS):
        if damped_step(here, damping, 0.0, low, step):
            for i in range(TERMS):
                trial[i] = p[i] + min(max(step[i], -LONGEST), LONGEST)
            new_misfit, new_cost = _evaluate(trial, about, v, y, w, there)
            if new_cost < cost:
                gain = cost - new_cost
                for i in range(TERMS):
                    p[i] = trial[i]
                    for j in range(TERMS + 1):
                        here[i, j] = there[i, j]
                misfit, cost = new_misfit, new_cost
                if gain < ENOUGH:
                    break
                damping *= 0.1
                continue
        damping = more_damped(damping)
        if damping > MOST:
            break
    return misfit, cost


@allocating
def read_touch(edge, power, expected, spread):
    """Where the touch of a mean edge lies from that of the fitted one, and the variance [edges].

    And by how much the logarithm of its power is less than that of the fitted edge.

    Parameters
    ----------
    edge : array (STRETCHES, 3)
        As `add_edges` fills it.
    power : float
        Of the fitted edge.
    expected, spread : float
        Where the touch is expected, and the standard deviation about that.
    """
    end = 2.0 / math.pi * math.asin(LEVEL ** (1.0 / power))
    v, y, w = np.empty(STRETCHES), np.empty(STRETCHES), np.empty(STRETCHES)
    count = 0
    for b in range(STRETCHES):
        one = edge[b, 0]
        if one > 0.0 and edge[b, 1] < end * one:
            v[count], y[count], w[count] = edge[b, 1] / one, edge[b, 2] / one, one
            count += 1
    about = np.zeros((2, TERMS))
    about[0, 1], about[0, 2] = power * math.log(0.5 * math.pi), math.log(power)
    about[0, 4] = -0.4 * power
    about[0, 0] = expected
    about[1, :] = ABOUT
    about[1, 0] = spread
    seen = (about, v[:count], y[:count], w[:count])
    low, inverse = np.empty((TERMS, TERMS)), np.empty((TERMS, TERMS))
    here, there = np.empty((TERMS, TERMS + 1)), np.empty((TERMS, TERMS + 1))
    room = (np.empty(TERMS), np.empty(TERMS), low, here, there)
    p, touch, variance, least = np.empty(TERMS), 0.0, spread * spread, np.inf
    steeper = 0.0
    lowest = about[0].copy()
    # Where a stretch enters the edge the cost has a kink: the least of several valleys.
    for turn in range(len(BEGINS) + len(BESIDE)):
        for i in range(TERMS):
            p[i] = lowest[i] if turn >= len(BEGINS) else about[0, i]
        if turn < len(BEGINS):
            p[0] = expected + BEGINS[turn] * min(spread, FARTHEST)
        else:
            p[0] = touch + BESIDE[turn - len(BEGINS)] * ((LAST - FIRST) / STRETCHES)
        misfit, cost = _descend(p, seen, room)
        if cost < least:
            for i in range(TERMS):
                for j in range(i + 1):
                    low[i, j] = here[i, j]
            factor(low)
            invert(low, inverse)
            free = max(count - 3, 1)
            touch, variance, least = p[0], inverse[0, 0] * max(misfit / free, 1.0), cost
            steeper = max(about[0, 2] - p[2], 0.0)
            for i in range(TERMS):
                lowest[i] = p[i]
    return touch, variance, steeper
