"""Integrate-and-fire intervals of Lorenz and Roessler, by a plain Runge-Kutta of small steps."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit
def _slope(lorenz, x, y, z):
    if lorenz:
        return 10.0 * (y - x), x * (28.0 - z) - y, x * y - 8.0 / 3.0 * z
    return -y - z, x + 0.2 * y, 0.2 + z * (x - 5.7)


@njit
def _fire(lorenz, x, y, z, step, count, threshold):
    instants = np.empty(count)
    total, signal, fired, k = 0.0, 0.0, 0, 0
    while fired < count:
        signal = (x + 2.0) ** 2 if lorenz else x + 20.0
        a1, b1, c1 = _slope(lorenz, x, y, z)
        h = 0.5 * step
        a2, b2, c2 = _slope(lorenz, x + h * a1, y + h * b1, z + h * c1)
        xm = x + h * a2
        a3, b3, c3 = _slope(lorenz, xm, y + h * b2, z + h * c2)
        a4, b4, c4 = _slope(lorenz, x + step * a3, y + step * b3, z + step * c3)
        x += step / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        y += step / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
        z += step / 6 * (c1 + 2 * c2 + 2 * c3 + c4)
        after = (x + 2.0) ** 2 if lorenz else x + 20.0
        middle = (xm + 2.0) ** 2 if lorenz else xm + 20.0
        gain = step / 6 * (signal + 4 * middle + after)
        if total + gain >= threshold:
            # linear in between: the integral bends by h^2 dS/dt / 8 at most
            instants[fired] = (k + (threshold - total) / gain) * step
            fired += 1
            total -= threshold
        total += gain
        k += 1
    return instants


def intervals(flow: str, count: int, seed: int, threshold: float = 20.0) -> np.ndarray:
    """Intervals between the instants at which the integral of S passes multiples of `threshold`.

    Roessler (0.2, 0.2, 5.7) with S = x + 20; Lorenz (10, 28, 8/3) with S = (x + 2)^2; the first
    hundred are left out.
    """
    start = np.random.default_rng(seed).normal(1, 0.5, 3)
    lorenz = flow == "lorenz"
    step = 0.002 if lorenz else 0.01
    return np.diff(_fire(lorenz, *start, step, count + 101, threshold))[100:]
