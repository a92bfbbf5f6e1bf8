"""Crests of C, the rise in octaves, with what lies around each (`../sound.py`).

With s the standard deviation of C in noise, a = s (1.9 + 9 s) is about the greatest C of an hour of
noise, which is skewed the more the fewer coefficients it has. A crest is borne out by the greatest
B beside it over the greater of 0.035 and the mean of B around it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._kernels import GROUP
from .._nearby_kernels import put_totals
from .._survey import Passage
from ._tails import decay_rate
from .crest_kernels import NEARBY, crest_evidence

SIGMAS, SKEW = 1.9, 9.0  # a = s (SIGMAS + SKEW s), s the standard deviation of C in noise
ALONE = 28e-3  # [s] within which C must be greatest for G to count: the extent of G
BORNE_OUT = 0.035  # rise in narrow bands that a rise in octaves needs
AROUND = 0.15, 0.05  # [s] before and after, of the mean of B


class Crests(NamedTuple):
    """Crests of the rise in octaves, with their evidence."""

    place: np.ndarray  # frame
    height: np.ndarray  # C
    bands: np.ndarray  # the greatest B nearby
    borne_out: np.ndarray  # this over what a rise in octaves needs
    likelihood: np.ndarray  # the greatest G nearby
    loudest: np.ndarray  # the greatest C within NEARBY
    clear: np.ndarray  # C, but no more than it exceeds the tails of those before it by
    greatest: np.ndarray  # bool: none within ALONE exceeds it
    first: np.ndarray  # of those within NEARBY of each
    last: np.ndarray  # and before which they end
    order: np.ndarray  # sorts the heights
    silence: np.ndarray  # number of GROUPs of digital silence before each; empty if there is none


def audible_rise(spread: float) -> float:
    """About the greatest C of an hour of noise, in which its standard deviation is `spread`."""
    return spread * (SIGMAS + SKEW * spread)


def octave_crests(passage: Passage, seconds: float) -> Crests:
    """Crests of C, with the evidence of narrow bands, in frames of `seconds`."""
    place, height, loud = passage.place, passage.height, passage.loud
    count, per = len(place), GROUP * seconds
    evidence, greatest = np.empty((5, count)), np.empty(count, np.bool_)
    ends = np.empty((2, count), np.int64)
    crest_evidence(
        place, height, loud, seconds * decay_rate(place, loud, passage.loudness, seconds),
        passage.bands, passage.likelihood, passage.known, BORNE_OUT,
        (round(AROUND[0] / per), round(AROUND[1] / per)), (ALONE / seconds, NEARBY / seconds),
        evidence, greatest, ends,
    )  # fmt: skip
    silence = np.empty(0)
    if passage.silent.any():
        silence = np.empty(len(passage.silent) + 1)
        put_totals(passage.silent, silence)
    bands, borne_out, likelihood, loudest, clear = evidence
    first, last = ends
    return Crests(
        place, height, bands, borne_out, likelihood, loudest, clear, greatest, first, last,
        np.argsort(height), silence,
    )  # fmt: skip
