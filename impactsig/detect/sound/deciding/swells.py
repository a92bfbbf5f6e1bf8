"""Noise that swells repeatedly, as that of a fan or a compressor, distinguished from impacts.

Noise that swells 5 to 100 times a second rises within 4 ms as much as at an impact, but evenly over
these milliseconds. With P(a, b) the mean square of the innovations from a to b
milliseconds after the attack, and r the samples in a millisecond,

    e = ln(P(0, 1) / P(-1, 0)) - 0.2 max(0, ln(P(1, 4) / P(-4, -1))) - 0.6 - 1.7 / sqrt(r)

is about 0 in swelling noise of any spectrum, since attacks lie where its power rises most by
chance, and 0.6 to 4 at impacts. For one impact e is uncertain by 0.5 to 0.9, so the median within a
second is used: if there are 10 a second or more and it is less than 0.2 and less than R / 2 - 0.45,
with R the median of the second logarithm, the log-odds of each are at most 4 (e - 1). Low tones in
noise and dense overlapping impacts hardly raise innovations: they have an R of 0.2 to 1. Clear
impacts smeared by a filter, whose e may be 0 as well, have an R of 9 and more, swelling noise up to
7.
"""

from __future__ import annotations

import math

import numpy as np

from .._nearby import places_about, ranked
from ._swell_kernels import put_sharpness

WITHIN, CROWD = 1.0, 20  # [s], and others within it on either side that make a median
AT_ONCE, SLOWLY = 1e-3, 4e-3  # [s], beside the attack
EDGES = -SLOWLY, -AT_ONCE, 0.0, AT_ONCE, SLOWLY
SELECTED, SCATTER = 0.6, 1.7  # of e
SWELLS = 0.2  # e of no impact
SHOWS, HIDDEN = 0.5, 0.45  # and share of R that bounds e where little shows in innovations
STEEP = 7.5  # R of no swelling
SHARP, SLOPE = 1.0, 4.0  # e of even odds among such, and log-odds for each neper more


def crowds(instant: np.ndarray) -> np.ndarray:
    """Which of the instants [s], in order, have a CROWD about them."""
    if len(instant) <= CROWD:
        return np.zeros(len(instant), np.bool_)
    first, last = places_about(instant, instant, WITHIN, WITHIN)
    return np.asarray(last - first > CROWD)


def sharpness(power: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Abruptness e of each rise relative to swelling noise, and R, by its powers between EDGES."""
    sharp, rise = np.empty((2, power.shape[1]))
    inside = round(AT_ONCE * rate) / round(SLOWLY * rate)
    put_sharpness(power, inside, SELECTED + SCATTER / math.sqrt(AT_ONCE * rate), sharp, rise)
    return sharp, rise


def most_odds(
    instant: np.ndarray, likely: np.ndarray, sharp: np.ndarray, rise: np.ndarray
) -> np.ndarray:
    """The greatest log-odds that impacts at these instants [s], in order, may have.

    Those that are `likely` make the medians. `sharp` is e and `rise` R, NaN where it was not asked
    for them.
    """
    known = np.isfinite(sharp)
    if not known.any():
        return np.full(len(instant), np.inf)
    pool = known & likely
    first, last = places_about(instant[pool], instant, WITHIN, WITHIN)
    middle = (last - first) // 2
    median = ranked(sharp[pool], first, last, middle)
    swells = known & (last - first > CROWD) & (median < SWELLS)
    if swells.any():
        slow = ranked(rise[pool], first, last, middle)
        swells &= (median < SHOWS * slow - HIDDEN) & (slow < STEEP)
    return np.where(swells, SLOPE * (sharp - SHARP), np.inf)
