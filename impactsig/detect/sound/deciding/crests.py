"""Crests of C, the rise in octaves, with what lies around each (`../sound.py`).

With s the standard deviation of C in noise, a = s (1.9 + 9 s) is about the greatest C of an hour of
noise, which is skewed the more the fewer coefficients it has. A crest is borne out by the greatest
B beside it over the greater of 0.035 and the mean of B around it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._kernels import GROUP
from .._nearby import greatest_beside, greatest_near, local_mean, nearest_group, places_about
from .._survey import Passage
from ._tails import beyond_tails

SIGMAS, SKEW = 1.9, 9.0  # a = s (SIGMAS + SKEW s), s the standard deviation of C in noise
NEARBY = 1.0  # [s], within which crests are compared
ALONE = 28e-3  # [s] within which C must be greatest for G to count: the extent of G
BORNE_OUT = 0.035  # rise in narrow bands that a rise in octaves needs
AROUND = 0.15, 0.05  # [s] before and after, of the mean of B
SOONER, LATER = 12e-3, 20e-3  # [s], of a crest of C beside one of B or G that it belongs to
LEAST_OCTAVES = 0.35  # times a: rise in octaves of what others do not hide


class Crests(NamedTuple):
    """Crests of the rise in octaves, with their evidence."""

    place: np.ndarray  # frame
    height: np.ndarray  # C
    bands: np.ndarray  # the greatest B nearby
    borne_out: np.ndarray  # this over what a rise in octaves needs
    likelihood: np.ndarray  # the greatest G nearby
    greatest: np.ndarray  # bool: none within ALONE exceeds it
    loudest: np.ndarray  # the greatest C within NEARBY
    clear: np.ndarray  # C, but no more than it exceeds the tails of those before it by
    order: np.ndarray  # sorts the heights
    first: np.ndarray  # of those within NEARBY of each
    last: np.ndarray  # and before which they end


def audible_rise(spread: float) -> float:
    """About the greatest C of an hour of noise, in which its standard deviation is `spread`."""
    return spread * (SIGMAS + SKEW * spread)


def octave_crests(passage: Passage, b: np.ndarray, seconds: float) -> Crests:
    """Crests of C, with the evidence of the rise `b` in narrow bands."""
    per = GROUP * seconds
    place, height = passage.place, passage.height
    beside = nearest_group(place, len(b))
    known = passage.known[beside]
    around = local_mean(b, beside, round(AROUND[0] / per), round(AROUND[1] / per))
    needed = np.maximum(BORNE_OUT, around)
    bands = greatest_beside(b, beside, 2)
    likelihood = greatest_beside(passage.likelihood, beside, 2)
    likelihood[~known] = np.inf
    greatest = height >= greatest_near(place, height, ALONE / seconds)
    loudest = greatest_near(place, height, NEARBY / seconds)
    borne_out = np.where(known, bands / needed, np.inf)
    clear = np.minimum(np.maximum(beyond_tails(passage, place, seconds), 0.0), height)
    near = places_about(place, place, NEARBY / seconds, NEARBY / seconds)
    evidence = bands, borne_out, likelihood, greatest, loudest, clear
    return Crests(place, height, *evidence, np.argsort(height), *near)
