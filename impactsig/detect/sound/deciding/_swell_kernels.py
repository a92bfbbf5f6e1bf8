"""Kernel for `swells.py`: how abrupt rises are."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import kernel

SHARE = 0.2  # of R, that e is less for
LEAST = np.finfo(np.float64).eps, np.finfo(np.float64).tiny  # of the mean power, and of none


@kernel
def put_sharpness(power, inside, chance, sharp, rise):
    """Abruptness e of each rise and its R, by powers in four stretches about its attack.

    `inside` is the share of the two next to the attack in the time of all, `chance` what e has by
    chance. Both are NaN where powers are.
    """
    for k in range(power.shape[1]):
        outer, inner = power[0, k] + power[3, k], power[1, k] + power[2, k]
        least = LEAST[0] * 0.5 * ((1.0 - inside) * outer + inside * inner) + LEAST[1]
        slow, before = np.log(power[0, k] + least), np.log(power[1, k] + least)
        after, on = np.log(power[2, k] + least), np.log(power[3, k] + least)
        rise[k] = on - slow
        sharp[k] = after - before - SHARE * max(rise[k], 0.0) - chance
