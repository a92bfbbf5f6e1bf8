"""Levenberg-Marquardt fits of one pulse, or of two that overlap."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ._damped_step import FIRST, MOST, UNBOUND, damped_step, more_damped
from ._model import CURVE, FLAT, LANES, PARAMETERS, WIDER, pulse_cost
from .pair_fit import pair_cost

FOUND = 1e-2  # of the cost, in variances of the noise: a step that promises or gains less ends it
STEPS = 30
# Logarithms move by little a step, so no exponential overflows.
LONGEST_STEP = np.array(
    [[np.inf, np.inf, 1.0, 1.0, 1.0, 1.0], [np.inf, np.inf, 0.5, np.inf, np.inf, 0.5]]
)


class Fit(NamedTuple):
    """Result of a fit; for one pulse with its curve."""

    misfit: float  # residual variance over the noise's
    normal: np.ndarray  # normal equations, with the priors
    curve: np.ndarray


class Room(NamedTuple):
    """Room for a fit: two places for normal equations and curves, one of which has the result."""

    normals: np.ndarray
    curves: np.ndarray
    low: np.ndarray
    step: np.ndarray
    trial: np.ndarray


@allocating
def room_to_fit(points):
    """Room for fits of one pulse to so many points, or, for none, of two."""
    return Room(
        np.empty((2, WIDER, WIDER + 1)),
        np.zeros((2, CURVE, points + LANES)),
        np.empty((PARAMETERS, PARAMETERS)),
        np.empty(PARAMETERS),
        np.empty(PARAMETERS),
    )


@allocating
def fit_pulse(points, x, log_edge, p):
    """Fit one pulse from `p`, in place; returns a Fit.

    Points lie at equal distances. x and the height are in units of the noise; log_edge is the
    logarithm of a typical edge's length.
    """
    room = room_to_fit(len(points))
    misfit, at = descend(points, x, log_edge, p, room, None)
    return Fit(misfit, room.normals[at], room.curves[at])


@allocating
def fit_pair(points, x, p):
    """Fit two half-sines from `p`, in place; returns the residual variance over the noise's."""
    return descend(points, x, 0.0, p, room_to_fit(0), True)[0]


@kernel
def _cost(points, x, log_edge, p, curve, normal, two):
    """Misfit, cost and normal equations of a model."""
    if two is None:  # which numba asks while it compiles, and leaves out the rest if it is
        return pulse_cost(p, points, x, log_edge, curve, normal)
    return pair_cost(p, points, x, normal)


@kernel
def descend(points, x, log_edge, p, room, two):
    """Fit one pulse, or two unless `two` is None: misfit, and where in the room the rest is."""
    n, longest = len(p), LONGEST_STEP[0 if two is None else 1]
    low, step, trial = room.low, room.step, room.trial
    now = 0
    misfit, cost = _cost(points, x, log_edge, p, room.curves[now], room.normals[now], two)
    damping = FIRST
    for _ in range(STEPS):
        here = room.normals[now]
        if damped_step(here, damping, UNBOUND, low, step):
            promised = 0.0
            for i in range(n):
                promised += step[i] * here[i, WIDER]
            if promised * (1.0 + damping) < FOUND:
                break
            if two is None:
                # The shape is linear in the length of the flat top, not in its logarithm.
                step[FLAT] = math.log(max(1.0 + step[FLAT], 0.3))
            for i in range(n):
                trial[i] = p[i] + min(max(step[i], -longest[i]), longest[i])
            other = 1 - now
            curve, normal = room.curves[other], room.normals[other]
            new_misfit, new_cost = _cost(points, x, log_edge, trial, curve, normal, two)
            if new_cost < cost:
                gain = cost - new_cost
                for i in range(n):
                    p[i] = trial[i]
                now = other
                misfit, cost = new_misfit, new_cost
                if gain < FOUND:
                    break
                damping *= 0.1
                continue
        # Where a sample enters the pulse there is a kink, which a little damping does not see.
        damping = more_damped(damping)
        if damping > MOST:
            break
    return misfit / len(points), now
