"""Reverberant tails of impacts, and the part of a crest that they do not explain.

With S the loudness after a frame, the mean over the octaves of max(0, ln(F_b / 2 L_b)), weighted as
the rise in octaves is, a record decays by r nepers a second: the median, over the crests louder
than 0.7 neper, of S there less its mean from 7 ms after them until 60 ms after them or the next
such crest, over the mean time until then. Times without audible sound do not count; if there are no
others, the first does. A crest k exceeds the tails of those before it by

    S_k - max_{j < k} (S_j - r (t_k - t_j)).

A sound of few modes swells and fades in its tail, since they beat. It rises there repeatedly, as at
an impact, but never above the decay.
"""

from __future__ import annotations

import math

import numpy as np

from .._nearby import middle
from .._survey import SAMPLED, Passage

LOUD = 0.7  # [neper], of crests whose tails are measured
HEARD = 0.1  # [neper]
AFTER = 7e-3, 60e-3  # [s], of a tail
BEFORE_NEXT = 6e-3  # [s]
ENOUGH = 3  # tails


def beyond_tails(passage: Passage, place: np.ndarray, seconds: float) -> np.ndarray:
    """Excess of each crest over the tails of those before it [neper]."""
    loud = np.concatenate(passage.loud)
    rate = decay_rate(place, loud, np.concatenate(passage.loudness), seconds)
    if not len(place) or not math.isfinite(rate):
        return np.full(len(place), np.inf)
    undecayed = loud + rate * seconds * place
    before = np.concatenate(([-np.inf], np.maximum.accumulate(undecayed)[:-1]))
    return np.asarray(undecayed - before)


def decay_rate(place: np.ndarray, loud: np.ndarray, loudness: np.ndarray, seconds: float) -> float:
    """Median decay after loud crests [neper/s]; infinite if there are too few.

    `loud` is the loudness after crests, `loudness` that after every SAMPLED-th frame.
    """
    which = np.flatnonzero(loud > LOUD)
    start, height = place[which], loud[which]
    following = np.append(start[1:], len(loudness) * SAMPLED) - BEFORE_NEXT / seconds
    first = np.ceil((start + AFTER[0] / seconds) / SAMPLED).astype(int)
    last = (np.minimum(start + AFTER[1] / seconds, following) // SAMPLED).astype(int)
    measured = last > first
    if np.count_nonzero(measured) < ENOUGH:
        return math.inf
    start, height, first, last = (v[measured] for v in (start, height, first, last))
    heard = np.flatnonzero(loudness > HEARD)
    begin, end = np.searchsorted(heard, (first, last))
    left, index = (
        total[end] - total[begin]
        for total in (np.append(0.0, np.cumsum(values)) for values in (loudness[heard], heard))
    )
    count = np.maximum(end - begin, 1)
    frames = SAMPLED * np.where(begin == end, first, index / count) - start
    fallen = height - left / count
    return middle(fallen / (seconds * frames))
