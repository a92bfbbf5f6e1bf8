"""Kernel for `gradual.py`: log-odds of rises but for their attacks."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import kernel
from .._kernels import STEP
from .._nearby_kernels import greatest_beside, nearest

RISEN, ABRUPT = 0.33, 60.0  # B from which on, and H below which a rise may be gradual
OF_H, OF_G, OF_OCTAVES, OF_GROWTH, OFFSET = 0.55, 1.5, 0.95, -0.9, -5.4  # of the log-odds
LEAST, MOST_GROWTH = -1.0, 3.0  # that counts [neper]
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
