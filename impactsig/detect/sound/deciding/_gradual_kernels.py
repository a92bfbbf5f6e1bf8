"""Kernels for `gradual.py`: log-odds of rises, but for their attacks and by these."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import kernel
from .._kernels import STEP
from .._nearby_kernels import greatest_beside, nearest

RISEN, ABRUPT = 0.33, 60.0  # B from which on, and H below which a rise may be gradual
OF_H, OF_G, OF_OCTAVES, OF_GROWTH, OFFSET = 0.55, 1.5, 0.95, -0.9, -5.4  # of the log-odds
LEAST, MOST_GROWTH = -1.0, 3.0  # that counts [neper]
OF_R, OF_S, OF_BEFORE = 2.2, -1.65, -1.6  # of R, S, S' in the log-odds
MOST_S, MOST_BEFORE = 4.0, 2.0  # that count [neper]
SUDDEN, SHOWN = 3.0, 0.3  # R of an impact, and least S of a gradual rise
LEAST_OCTAVES = 0.03
BESIDE = 3  # GROUPs, of the rise in narrow bands


@kernel
def put_steady_odds(frame, by_octaves, bands, likelihood, growth, rises, reach, out):
    """As `steady_odds`, by B, G, W and H; H is the greatest at most `reach` from an impact."""
    for k in range(len(frame)):
        group = nearest(frame[k], len(bands))
        h = greatest_beside(rises, frame[k] // STEP, reach)
        if greatest_beside(bands, group, BESIDE) < RISEN or h >= ABRUPT:
            out[k] = np.inf
            continue
        g = greatest_beside(likelihood, group, BESIDE)
        grown = greatest_beside(growth, group, BESIDE)
        out[k] = OF_H * np.log1p(h) + OF_G * np.log1p(g) + OFFSET
        out[k] += OF_GROWTH * min(max(grown, LEAST), MOST_GROWTH)
        out[k] += OF_OCTAVES * np.log(by_octaves[k] + LEAST_OCTAVES)


@kernel
def put_gradual_odds(steady, power, edges, out):
    """As `gradual_odds`: `steady`, and what R, S and S' add to it."""
    for k in range(len(steady)):
        out[k], heard = np.inf, 0
        for part in range(len(power)):
            heard += power[part, k] > 0.0  # neither silent nor NaN
        if heard < len(power):
            continue
        earlier = mean_of(power, k, edges, 1, 3)
        rise = np.log(mean_of(power, k, edges, 4, 6) / mean_of(power, k, edges, 2, 4))
        wide = np.log(mean_of(power, k, edges, 5, 7) / earlier)
        before = np.log(earlier / mean_of(power, k, edges, 0, 1))
        if rise < SUDDEN and wide > SHOWN:
            out[k] = steady[k] + OF_R * max(rise, LEAST)
            out[k] += OF_S * min(wide, MOST_S)
            out[k] += OF_BEFORE * min(max(before, LEAST), MOST_BEFORE)


@kernel
def mean_of(power, k, edges, first, last):
    """Mean over some of the stretches between the edges."""
    total = 0.0
    for part in range(first, last):
        total += (edges[part + 1] - edges[part]) * power[part, k]
    return total / (edges[last] - edges[first])
