"""Noise that swells again and again, as that of a fan or a compressor, told from impacts.

Noise that swells 5 to 100 times a second rises within 4 ms as much as at an impact, but no more in
one millisecond than in another. With P(a, b) the mean square of the innovations from a to b
milliseconds after the attack, and r the samples in a millisecond,

    e = ln(P(0, 1) / P(-1, 0)) - 0.2 max(0, ln(P(1, 4) / P(-4, -1))) - 0.6 - 1.7 / sqrt(r)

is about 0 in noise that swells, whatever its spectrum, for attacks lie where its power happens to
rise most, and 0.6 to 4 at impacts. Of one impact e is uncertain by 0.5 to 0.9, so the median of
those within a second decides: where they are 10 a second and more and it is less than 0.3, the
log-odds of each are no more than 4 (e - 1).
"""

from __future__ import annotations

import numpy as np

from ._kernels import innovations
from ._nearby import ranked

WITHIN, CROWD = 1.0, 20  # [s], and others within it on either side that make a median
AT_ONCE, SLOWLY = 1e-3, 4e-3  # [s], beside the attack
SHARE, SELECTED, SCATTER = 0.2, 0.6, 1.7  # of e
SWELLS = 0.3  # median of e, less than which is no impact's
SHARP, SLOPE = 1.0, 4.0  # e of even odds among such, and log-odds for each neper more


def crowds(instant: np.ndarray) -> np.ndarray:
    """Which of the instants [s], in order, have a CROWD about them."""
    first, last = np.searchsorted(instant, (instant - WITHIN, instant + WITHIN))
    return np.asarray(last - first > CROWD)


def sharpness(
    x: np.ndarray, attack: np.ndarray, valid: tuple[int, int], rate: float, lag: int, slope: int
) -> np.ndarray:
    """How much more than noise that swells each rise is sudden: e.

    `attack` are places between samples of x, `lag` and `slope` are those of the innovations.
    """
    begin = valid[0] + lag + slope
    energy = np.zeros(max(valid[1] - begin, 0) + 1)
    innovations(x, begin, lag, slope, energy[1:])
    np.cumsum(np.square(energy, out=energy), out=energy)
    at = np.ceil(attack).astype(np.int64) - begin

    def power(first: float, last: float) -> np.ndarray:
        low, high = (np.clip(at + round(t * rate), 0, len(energy) - 1) for t in (first, last))
        total: np.ndarray = (energy[high] - energy[low]) / np.maximum(high - low, 1)
        return np.maximum(total, least)

    least = np.finfo(float).eps * energy[-1] / len(energy) + np.finfo(float).tiny
    sudden = np.log(power(0.0, AT_ONCE) / power(-AT_ONCE, 0.0))
    slow = np.log(power(AT_ONCE, SLOWLY) / power(-SLOWLY, -AT_ONCE))
    chance = SELECTED + SCATTER / np.sqrt(AT_ONCE * rate)
    return np.asarray(sudden - SHARE * np.maximum(slow, 0.0) - chance)


def most_odds(instant: np.ndarray, likely: np.ndarray, sharp: np.ndarray) -> np.ndarray:
    """The greatest log-odds that impacts at these instants [s], in order, may have.

    Those that are `likely` make the medians. `sharp` is e, NaN where it was not asked for.
    """
    known = np.isfinite(sharp)
    pool = known & likely
    near, e = instant[pool], sharp[pool]
    first, last = np.searchsorted(near, (instant - WITHIN, instant + WITHIN))
    middle = ranked(e, first, last, (last - first) // 2)
    swells = known & (last - first > CROWD) & (middle < SWELLS)
    return np.where(swells, SLOPE * (sharp - SHARP), np.inf)
