"""Levenberg-Marquardt fits of one pulse, or of two that overlap."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiled import allocating, inner
from ._model import FLAT, WIDER, pulse_cost, room_for
from ._small_matrices import factor, solve
from .pair_fit import pair_cost

FOUND = 1e-2  # of the cost, in variances of the noise: a step that promises or gains less ends it
MOST = 30  # steps
# Logarithms move by little a step, so no exponential overflows.
LONGEST_STEP = np.array(
    [[np.inf, np.inf, 1.0, 1.0, 1.0, 1.0], [np.inf, np.inf, 0.5, np.inf, np.inf, 0.5]]
)


class Seen(NamedTuple):
    """The data of a fit; for one pulse also the typical log edge."""

    points: np.ndarray
    x: np.ndarray
    log_edge: float


class Fit(NamedTuple):
    """Result of a fit; for one pulse with its curve."""

    misfit: float  # residual variance over the noise's
    normal: np.ndarray  # normal equations, with the priors
    curve: np.ndarray


@allocating
def fit_pulse(points, x, log_edge, p):
    """Fit one pulse from `p`, in place; returns a Fit.

    Points lie at equal distances. x and the height are in units of the noise; log_edge is the
    logarithm of a typical edge's length.
    """
    return _descend(False, Seen(points, x, log_edge), p)


@allocating
def fit_pair(points, x, p):
    """Fit two half-sines from `p`, in place; returns the residual variance over the noise's."""
    return _descend(True, Seen(points, x, 0.0), p).misfit


@inner
def _cost(pair, p, seen, curve, normal):
    """Misfit, cost and normal equations of a model."""
    if pair:
        return pair_cost(p, seen.points, seen.x, normal)
    return pulse_cost(p, seen.points, seen.x, seen.log_edge, curve, normal)


@allocating
def _descend(pair, seen, p):
    n, longest = len(p), LONGEST_STEP[1 if pair else 0]
    here, there = np.empty((WIDER, WIDER + 1)), np.empty((WIDER, WIDER + 1))
    low, step, trial = np.empty((n, n)), np.empty(n), np.empty(n)
    room = 0 if pair else len(seen.points)
    curve, other = room_for(room), room_for(room)
    misfit, cost = _cost(pair, p, seen, curve, here)
    damping = 1e-2
    for _ in range(MOST):
        for i in range(n):
            for j in range(i):
                low[i, j] = here[i, j]
            low[i, i] = here[i, i] * (1.0 + damping) + 1e-12
            step[i] = here[i, WIDER]
        if factor(low):
            solve(low, step)
            promised = 0.0
            for i in range(n):
                promised += step[i] * here[i, WIDER]
            if promised * (1.0 + damping) < FOUND:
                break
            if not pair:
                # The shape is linear in the length of the flat top, not in its logarithm.
                step[FLAT] = math.log(max(1.0 + step[FLAT], 0.3))
            for i in range(n):
                trial[i] = p[i] + min(max(step[i], -longest[i]), longest[i])
            new_misfit, new_cost = _cost(pair, trial, seen, other, there)
            if new_cost < cost:
                gain = cost - new_cost
                for i in range(n):
                    p[i] = trial[i]
                here, there = there, here
                curve, other = other, curve
                misfit, cost = new_misfit, new_cost
                if gain < FOUND:
                    break
                damping *= 0.1
                continue
        # Where a sample enters the pulse there is a kink, which a little damping does not see.
        damping = max(10.0 * damping, 0.01)
        if damping > 1e6:
            break
    return Fit(misfit / len(seen.points), here, curve)
