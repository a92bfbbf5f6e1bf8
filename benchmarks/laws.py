"""Pulses of contacts that follow a law of force, integrated: not members of any fitted family.

A mass of 1 meets an obstacle at x = 0 with velocity 1. In units where the stiffness is 1,

    x'' = -F,   F = x^p (1 + d x')        (Hunt and Crossley; d = 0 and p = 3/2: Hertz)
    F = x + 2 z x'                        (Kelvin and Voigt)

until the force has come back to zero. With the restitution e, d is the root of
d (1 + e) = ln((1 + d) / (1 - d e)), whatever the power.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np
from scipy import integrate, optimize

POINTS = 20_001


def power_law(power: float, restitution: float = 1.0) -> Callable:
    """Pulse of `F = x^p (1 + d x')`, of height 1, for times from 0 to 1."""
    e, damping = restitution, 0.0
    if e < 1.0:
        damping = optimize.brentq(
            lambda d: d * (1.0 + e) - math.log((1.0 + d) / (1.0 - d * e)), 1e-6, 1.0 / e - 1e-12
        )
    return _pulse(lambda x, v: np.maximum(x, 0.0) ** power * (1.0 + damping * v))


def kelvin_voigt(damping: float) -> Callable:
    """Pulse of `F = x + 2 z x'`, of height 1, for times from 0 to 1: it begins with a step."""
    return _pulse(lambda x, v: x + 2.0 * damping * v)


def _pulse(force: Callable) -> Callable:
    @functools.cache
    def sampled() -> tuple[np.ndarray, np.ndarray]:
        def parted(time, state):
            return force(*state) if time > 0.0 and state[1] < 0.0 else 1.0

        def left(time, state):
            return state[0] if time > 0.0 and state[1] < 0.0 else 1.0

        parted.terminal = left.terminal = True
        motion = integrate.solve_ivp(
            lambda time, state: (state[1], -force(*state)),
            (0.0, 20.0),
            (0.0, 1.0),
            "DOP853",
            events=(parted, left),
            dense_output=True,
            rtol=1e-12,
            atol=1e-14,
            max_step=0.01,
        )
        u = np.linspace(0.0, 1.0, POINTS)
        values = np.maximum(force(*motion.sol(u * motion.t[-1])), 0.0)
        return u, values / values.max()

    return lambda at: np.interp(at, *sampled())


LAWS = {
    "Hertz": power_law(1.5),
    "square": power_law(2.0),
    "Hunt-Cr. .8": power_law(1.5, 0.8),
    "Hunt-Cr. .5": power_law(1.5, 0.5),
    "Kelvin-Voigt": kelvin_voigt(0.1),
}
