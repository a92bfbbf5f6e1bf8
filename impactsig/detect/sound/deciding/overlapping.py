"""Log-odds of crests where impacts are so dense, and so little clear, that they hide each other.

There, the log-odds x of `calibrated.py` are too low for most crests that octaves show, and lowest
where they are least, since each impact raises a power that others have raised already. With r
likely impacts a second, c the mean of those x above 2 (each counted as 12 at most), and

    h = (r - 14) / 6 times 9.3 - c, each between 0 and 1,

they grow by h times

    0.22 max(x, 0) - 0.6 min(x, 0) + 1.5 ln s + 1.2 m - 0.7 (c - 5) + 2.2,

x limited to -5 and 6. Here s is the share of the rise C that exceeds the tails of earlier crests
(`_tails.py`), at least e^-3. The doubtful crests of a record tell of each other: p is the mean
probability of the n that have x from -3 to 3 and of ten usual ones, p = 0.4, and
m = logit(p) - logit(0.4). Crests that are likelier by narrow bands or a single octave keep their
odds and do not count in p and c: others hide them less.

Fitted by logistic regression to synthetic sound of 8 to 32 impacts a second (6 to 20 dB above
noise, 8 to 48 kHz, rooms of 0 to 0.5 s, own and shared modes, five distributions of strengths).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .candidates import Candidates

FEW, MANY = 14.0, 20.0  # impacts a second that do not overlap, and that do
LIMITS = -5.0, 6.0  # of x
ABOVE, BELOW, OFFSET = 0.22, -0.6, 2.2  # of x on either side of even odds
TAIL_SLOPE, LEAST_SHARE = 1.5, math.exp(-3.0)
DOUBTFUL, PRIOR, USUAL = 3.0, 10.0, 0.4  # |x|, and a number of crests and their mean probability
DOUBT_SLOPE = 1.2
LIKELY, CERTAIN = 2.0, 12.0  # x
CLEAR, USUAL_MEAN, MEAN_SLOPE = 9.3, 5.0, -0.7  # mean x of likely crests that hide none


def with_overlap(every: Sequence[Candidates], pace: float) -> list[Candidates]:
    """The candidates of the passages of a record, whose impacts may overlap.

    Parameters
    ----------
    every : sequence of Candidates
        Those of each passage.
    pace : float
        Likely impacts a second.
    """
    if pace <= FEW:
        return list(every)
    odds = np.concatenate([np.zeros(0), *(found.odds[~found.narrow] for found in every)])
    likely = odds[odds > LIKELY]
    mean = float(np.minimum(likely, CERTAIN).mean()) if len(likely) else CLEAR
    overlap = between_0_and_1((pace - FEW) / (MANY - FEW)) * between_0_and_1(CLEAR - mean)
    if overlap == 0.0:
        return list(every)
    more = OFFSET + DOUBT_SLOPE * likelier(odds) + MEAN_SLOPE * (mean - USUAL_MEAN)
    return [found._replace(odds=raised(found, overlap, more)) for found in every]


def between_0_and_1(value: float) -> float:
    """The nearest number between 0 and 1."""
    return min(max(value, 0.0), 1.0)


def likelier(odds: np.ndarray) -> float:
    """By how much the log-odds of the mean doubtful crest exceed the usual ones."""
    doubtful = odds[np.abs(odds) < DOUBTFUL]
    likely = PRIOR * USUAL + float(np.sum(1.0 / (1.0 + np.exp(-doubtful))))
    return logit(likely / (PRIOR + len(doubtful))) - logit(USUAL)


def raised(found: Candidates, overlap: float, more: float) -> np.ndarray:
    """Log-odds of the candidates of a passage."""
    x = np.clip(found.odds, *LIMITS)
    by = more + ABOVE * np.maximum(x, 0.0) + BELOW * np.minimum(x, 0.0)
    by += TAIL_SLOPE * np.log(np.maximum(found.beyond_tails, LEAST_SHARE))
    return np.where(found.narrow, found.odds, found.odds + overlap * by)


def logit(probability: float) -> float:
    """Log-odds of a probability."""
    return math.log(probability / (1.0 - probability))
