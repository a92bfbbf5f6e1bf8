"""Kernel for the samples of a core: extremes and the step of a converter."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit

CHANGES = 50  # of a sample to the next, that show the step of a converter
SIDE_BY_SIDE = 64  # samples that are checked in vector lanes


@njit(nogil=True)
def extremes(x):
    """Least and greatest sample, and the least nonzero difference of two in a row.

    That is infinite if hardly any differ.
    """
    changes, done = 0, 1
    steps = np.full(SIDE_BY_SIDE, np.inf)
    low, high = np.full(SIDE_BY_SIDE, np.float64(x[0])), np.full(SIDE_BY_SIDE, np.float64(x[0]))
    for i in range(1, len(x) - SIDE_BY_SIDE + 1, SIDE_BY_SIDE):
        now, before = x[i : i + SIDE_BY_SIDE], x[i - 1 : i - 1 + SIDE_BY_SIDE]
        for k in range(SIDE_BY_SIDE):
            value = np.float64(now[k])
            step = abs(value - before[k])
            changes += step > 0.0
            steps[k] = step if 0.0 < step < steps[k] else steps[k]
            low[k] = value if value < low[k] else low[k]
            high[k] = value if value > high[k] else high[k]
        done = i + SIDE_BY_SIDE
    step, least, greatest = steps.min(), low.min(), high.max()
    for i in range(done, len(x)):
        value = np.float64(x[i])
        least, greatest = min(least, value), max(greatest, value)
        away = abs(value - x[i - 1])
        if away > 0.0:
            changes += 1
            step = min(step, away)
    return least, greatest, step if changes >= CHANGES else np.inf
