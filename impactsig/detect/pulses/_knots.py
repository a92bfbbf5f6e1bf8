"""Least squares of straight lines between knots, with a prior on the second differences.

The normal equations have five diagonals: `own` and `beside` by samples, the rest by the prior.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel


class Knots(NamedTuple):
    """Normal equations of heights at knots."""

    own: np.ndarray  # diagonal
    beside: np.ndarray  # each with the next one
    beyond: np.ndarray  # and with the one after
    right: np.ndarray


@allocating
def no_knots(count):
    """The equations before any sample."""
    return Knots(np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count))


@kernel
def add_sample(knots, b, f, weight, value):
    """Add a sample at a share f of the way from knot b to the next one."""
    knots.own[b] += weight * (1.0 - f) ** 2
    knots.own[b + 1] += weight * f * f
    knots.beside[b] += weight * f * (1.0 - f)
    knots.right[b] += weight * (1.0 - f) * value
    knots.right[b + 1] += weight * f * value


@kernel
def add_bend(knots, b, weight):
    """Add the prior that the second difference about knot b is none."""
    knots.own[b - 1] += weight
    knots.own[b] += 4.0 * weight
    knots.own[b + 1] += weight
    knots.beside[b - 1] -= 2.0 * weight
    knots.beside[b] -= 2.0 * weight
    knots.beyond[b - 1] += weight


@allocating
def copy_of(knots):
    """The same equations, to be changed."""
    return Knots(knots.own.copy(), knots.beside.copy(), knots.beyond.copy(), knots.right.copy())


@allocating
def solve_knots(knots, out):
    """Put the heights into `out`; whether the equations determine them."""
    own, beside, beyond, right = knots
    count, determined = len(own), True
    pivot, first, second = np.empty(count), np.zeros(count), np.zeros(count)
    for b in range(count):
        pivot[b] = own[b]
        if b > 0:
            pivot[b] -= first[b - 1] ** 2 * pivot[b - 1]
        if b > 1:
            pivot[b] -= second[b - 2] ** 2 * pivot[b - 2]
        determined &= pivot[b] > 0.0
        pivot[b] = max(pivot[b], 1e-300)
        first[b] = beside[b]
        if b > 0:
            first[b] -= first[b - 1] * second[b - 1] * pivot[b - 1]
        first[b] /= pivot[b]
        second[b] = beyond[b] / pivot[b]
        out[b] = right[b]
        if b > 0:
            out[b] -= first[b - 1] * out[b - 1]
        if b > 1:
            out[b] -= second[b - 2] * out[b - 2]
    for b in range(count - 1, -1, -1):
        out[b] /= pivot[b]
        if b + 1 < count:
            out[b] -= first[b] * out[b + 1]
        if b + 2 < count:
            out[b] -= second[b] * out[b + 2]
    return determined
