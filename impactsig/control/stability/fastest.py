"""Gain and memory of interval feedback that minimise the greatest multiplier."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from ...errors import InvalidInput
from .impact_map import SpikeMap

GAINS, MEMORIES = np.linspace(-2.0, 2.0, 17), np.linspace(-0.75, 1.5, 10)  # of the first look
REFINED = 3  # of its best
OPTIONS = {"xatol": 1e-7, "fatol": 1e-10, "maxiter": 400}


def fastest(maps: list[SpikeMap], growth: Callable[[float, float], float]) -> tuple[float, float]:
    """Gain and memory with the least growth, by Nelder and Mead's method from a grid.

    Raises
    ------
    InvalidInput
        If the parameter moves no interval.
    """
    from scipy.optimize import minimize

    scale = float(np.abs([one.stretch for one in maps]).max())
    scale = max(scale, float(np.abs([one.interval @ one.shift for one in maps]).max()))
    if not scale > 0:
        raise InvalidInput("parameter", "one without effect", "one that affects the intervals")

    def of(values: Any) -> float:
        return growth(values[0] / scale, values[1])

    starts = sorted(product(GAINS, MEMORIES), key=of)[:REFINED] + _exact(maps, scale)
    found = [minimize(of, start, method="Nelder-Mead", options=OPTIONS) for start in starts]
    gain, memory = min(found, key=lambda one: one.fun).x
    return float(gain / scale), float(memory)


def _exact(maps: list[SpikeMap], scale: float) -> list[tuple[float, float]]:
    """Gain that removes the unstable direction if it is the only one.

    There s' = L s + b p and I' = t s + c p, so that p = -(L / b) s makes s' zero. The state follows
    from the last interval and the last change: s = L (I - c p) / t + b p.
    """
    if len(maps) > 1:
        return []
    one = maps[0]
    values, right = np.linalg.eig(one.matrix)
    k = int(np.argmax(np.abs(values)))
    if np.iscomplex(values[k]):
        return []
    large, along = float(values[k].real), right[:, k].real
    across = np.linalg.pinv(right)[k].real
    pushed, told = float(across @ one.shift), float(one.interval @ along)
    if not abs(pushed * told) > 0:
        return []
    gain = -(large**2) / (pushed * told)
    memory = large * (large * one.stretch / told - pushed) / pushed
    return [(gain * scale, memory)]
