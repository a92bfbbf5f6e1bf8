"""Where a mean pulse of unknown shape begins and ends.

With u counted inwards, an edge that begins at u0 is taken as

    s^q (a + b s + c s^2),    s = u - u0,

for powers q from 0 (a jump) to that of a tail. For each u0 and q the posterior of a, b and c is
Gaussian, and what it leaves the likelihood of u0 and q. It is taken up to several heights: where
the edge is no such function, these disagree, and mean and variance are those over all of them.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating
from .._small_matrices import factor, solve

LEVELS = np.array([0.15, 0.3, 0.6])
"""Heights up to which an edge is looked at."""
POWERS = np.array([0.0, 0.3, 0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0])
LIKELY = np.array([0.5, 0.5, 0.5, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5, 0.5])
"""Powers of edges, and how likely they are to each other."""
BENT = np.array([3.0, 1.0, 1.0])
"""Standard deviations of a, b and c, over what a is without these, on an edge of length 1."""
OUT = 3.0
"""How far out of the lowest of LEVELS an edge may begin [distances of lowest and highest]."""
GRID, PASSES, UNLIKELY = 41, 3, 10.0
"""Places looked at, in all and in what the last pass left: less likely by e^-UNLIKELY is none."""
FEWEST = 4
"""Stretches on an edge that show it."""


@allocating
def read_end(u, y, w, first):
    """Where an edge begins, and the variance of that.

    Parameters
    ----------
    u, y, w : array
        Places from outside inwards, heights and their weights (one over the variance).
    first : array
        Of each of LEVELS, the first place in u that lies higher.
    """
    lowest, highest = u[first[0]], u[first[len(LEVELS) - 1]]
    reach = highest - lowest
    coarse = u[1] - u[0]
    total, mean, square = 0.0, 0.0, 0.0
    density = np.empty(GRID)
    for m in range(len(LEVELS)):
        last = first[m]
        begin, end = lowest - OUT * reach - 2.0 * coarse, lowest + 0.5 * coarse
        length = max(u[last] - lowest + 0.3 * reach, coarse)
        outer = 0
        while outer < last and u[outer] < begin - 0.5 * reach:
            outer += 1
        some = last - outer
        if some < FEWEST:
            continue
        best, at = -np.inf, begin
        for turn in range(PASSES):
            best = -np.inf
            for k in range(GRID):
                at = begin + (end - begin) * k / (GRID - 1)
                density[k] = _likelihood(at, u[outer:last], y[outer:last], w[outer:last], length)
                best = max(best, density[k])
            low, high = GRID, -1
            for k in range(GRID):
                if density[k] > best - UNLIKELY:
                    low, high = min(low, k), max(high, k)
            if low == 0 and high == GRID - 1:
                break
            near = (end - begin) / (GRID - 1)
            if turn < PASSES - 1:
                begin, end = begin + (low - 1) * near, begin + (high + 1) * near
        one = here = over = 0.0
        for k in range(GRID):
            at = begin + (end - begin) * k / (GRID - 1) - lowest
            likely = math.exp(density[k] - best)
            one += likely
            here += likely * at
            over += likely * at * at
        grain = ((end - begin) / (GRID - 1)) ** 2 / 12.0
        mean += here / one
        square += over / one + grain
        total += 1.0
    if total == 0.0:
        return lowest - 0.3 * reach, (0.3 * reach) ** 2 + coarse**2
    mean /= total
    return lowest + mean, max(square / total - mean * mean, 0.0)


@allocating
def _likelihood(at, u, y, w, length):
    """Logarithm of the likelihood that an edge begins at a place, over all powers."""
    count = len(u)
    normal, right = np.empty((3, 3)), np.empty(3)
    outside = inside = 0.0
    begin = 0
    while begin < count and u[begin] <= at:
        outside += w[begin] * y[begin] ** 2
        begin += 1
    for k in range(begin, count):
        inside += w[k] * y[k] ** 2
    usual = y[count - 1]
    chances = np.empty(len(POWERS))
    best = -np.inf
    for n in range(len(POWERS)):
        q = POWERS[n]
        s00 = s01 = s02 = s11 = s12 = s22 = r0 = r1 = r2 = 0.0
        for k in range(begin, count):
            s = (u[k] - at) / length
            f = s**q if q > 0.0 else 1.0
            one = w[k] * f * f
            s00 += one
            s01 += one * s
            s02 += one * s * s
            s12 += one * s**3
            s22 += one * s**4
            one = w[k] * f * y[k]
            r0 += one
            r1 += one * s
            r2 += one * s * s
        s11 = s02
        normal[0, 0], normal[1, 0], normal[1, 1] = s00, s01, s11
        normal[2, 0], normal[2, 1], normal[2, 2] = s02, s12, s22
        right[0], right[1], right[2] = r0, r1, r2
        priors = 0.0
        for m in range(3):
            prior = (BENT[m] * usual) ** -2.0
            normal[m, m] += prior
            priors += math.log(prior)
        if not factor(normal):
            chances[n] = -np.inf
            continue
        determinant = 0.0
        for m in range(3):
            determinant -= math.log(normal[m, m])  # reciprocals
        solve(normal, right)
        explained = right[0] * r0 + right[1] * r1 + right[2] * r2
        chances[n] = 0.5 * (priors - determinant - (outside + inside - explained))
        chances[n] += math.log(LIKELY[n])
        best = max(best, chances[n])
    if best == -np.inf:
        return best
    total = 0.0
    for n in range(len(POWERS)):
        total += math.exp(chances[n] - best)
    return best + math.log(total)
