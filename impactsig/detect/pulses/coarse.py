"""Errors by a converter whose step is coarser than the noise.

Samples of a foot that is lower than half a step are alike zero, whatever its shape, and no mean
over them helps. Where noise moves samples from one step to the next, it does: of the regular part
of the rounding exp(-2 (pi s / step)^2) is left with noise of standard deviation s, and the rest
adds step^2 / 12 to its variance.
"""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

from ._model import POWER
from .edges import ERRORS, FIT, NO_PULSE
from .fit_errors import MADE, NOW

COARSE = 0.6  # steps: more noise than this is seen as it is
HIDDEN = 0.6  # of both feet: what contact times are off by where a step is a tenth of the height
TENTH = 0.1


def noise_below(values: np.ndarray, step: float, factor: float) -> float:
    """Standard deviation of noise that hardly moves samples, by how many differ from both beside.

    Values are to be multiplied by `factor`, as the step is.
    A share u of them is a step higher and d is a step lower: 1 / (Q(u) + Q(d)) steps for normally
    distributed noise of any mean, where Q(p) is how many standard deviations a share p is beyond.
    """
    codes = values * (factor / step)
    alike = np.abs(codes[:-2] - codes[2:]) < 0.5
    rise = codes[1:-1] - codes[:-2]
    beyond = 0.0
    for side in (rise, -rise):
        lone = alike & (side > 0.5) & (side < 1.5)
        share = min(max(np.count_nonzero(lone) / max(len(rise), 1), 1e-6), 0.4)
        beyond -= NormalDist().inv_cdf(share)
    return step / beyond


def add_hidden_feet(rows: np.ndarray, step: float, noise: float) -> None:
    """Add what a converter's step hides of the feet to the errors of contact times, in the rows."""
    left = math.exp(-2.0 * (math.pi * noise / step) ** 2)
    for row in rows:
        kept = row[FIT:]
        if row[5] == NO_PULSE or not row[2] > step or math.isnan(kept[MADE]):
            continue
        share = step / row[2]
        power = math.exp(kept[NOW + POWER])
        foot = row[1] * math.asin((0.5 * share) ** (1.0 / power)) / math.pi
        off = HIDDEN * math.sqrt(min(share / TENTH, 2.0)) * foot * left
        row[ERRORS + 1] = math.hypot(row[ERRORS + 1], off)
