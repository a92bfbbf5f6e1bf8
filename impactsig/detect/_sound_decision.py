"""Which crests are impacts, and how likely each is one.

C is the rise in octaves, B that in narrow bands (`_sound.py`). An impact is a crest of C. It is
borne out by

- narrow bands: B has a crest here that none within 30 ms exceeds, and C none greater nearby. Its
  evidence is B over the greater of 0.3 and 1.1 times the mean of B around it;
- octaves where all else is calm: C over s (0.9 + 14 s), s being the standard deviation of C in
  noise, which is skewed the more the fewer coefficients it has, and 12 times the 0.9-quantile of
  C within a second; provided that B is above its mean and 0.02, else B over these;
- octaves alone: C over 1.4.

The greatest of the three, e, is the evidence, and e^4 / (1 + e^4) the probability of an impact:
about the share of the impacts with such evidence that are right, in drums and in synthetic sound.
Where B has a crest and C has none, the impact lies at the crest of B.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._sound_kernels import BLOCK, GROUP, Scale
from ._sound_survey import SAMPLED, Passage

APART = 30e-3  # [s], crests of B
LEAST_BANDS = 0.3  # rise in the mean over narrow bands [neper of power]
AROUND = 0.15, 0.05  # [s] before and after, of the mean of B
TIMES_AROUND = 1.1
SIGMAS, SKEW = 0.9, 14.0  # least rise in octaves: s (SIGMAS + SKEW s), s its deviation in noise
RATTLE = 12.0  # times the quantile of C
RATTLE_QUANTILE, RATTLE_WITHIN = 0.9, 1.0  # [s]
BORNE_OUT = 0.02  # rise in narrow bands that a rise in octaves needs
CLEAR = 1.4  # rise in octaves that needs none [neper of power]
SOONER, LATER = 12e-3, 20e-3  # [s], of a crest of C beside one of B that it belongs to
STEEPNESS = 4.0  # of the probability in the logarithm of the evidence


class Candidates(NamedTuple):
    """Crests of a passage in order of time."""

    frame: np.ndarray  # of the octaves
    coarse: np.ndarray  # bool: from narrow bands alone, and so only known to some 10 ms
    evidence: np.ndarray


def probability(evidence: np.ndarray) -> np.ndarray:
    """That crests with such evidence are impacts."""
    with np.errstate(divide="ignore", over="ignore"):
        return 1.0 / (1.0 + evidence**-STEEPNESS)


def least_evidence(least_probability: float) -> float:
    """The evidence from which on the probability is as great as that."""
    return math.exp(math.log(least_probability / (1.0 - least_probability)) / STEEPNESS)


def candidates(
    passage: Passage, least: float, spread: float, scale: Scale, rate: float
) -> Candidates:
    """The crests of a passage and their evidence.

    Parameters
    ----------
    least : float
        Evidence that is enough: less of it need not be exact.
    spread : float
        Standard deviation of C in noise.
    """
    seconds = scale.hop / rate
    per = GROUP * seconds
    b = np.concatenate(passage.bands)
    place, height = np.concatenate(passage.place), np.concatenate(passage.height)
    around = local_mean(b, round(AROUND[0] / per), round(AROUND[1] / per))
    beside = np.clip(np.round(place / GROUP).astype(int), 0, len(b) - 1)
    near = greatest_within(b, 2)[beside]
    needed = np.maximum(BORNE_OUT, around[beside])
    known = np.concatenate(passage.known)[beside]
    borne_out = np.where(known, near / needed, np.inf)
    audible = spread * (SIGMAS + SKEW * spread)
    calm = np.full(len(place), audible)
    high = height >= least * calm
    calm[high] += RATTLE * rattling(np.concatenate(passage.octaves), place[high], seconds)
    clear = max(CLEAR, audible)
    evidence = np.maximum(np.minimum(height / calm, borne_out), height / clear)
    crest = separate_crests(b, round(APART / per))
    by_bands = b[crest] / np.maximum(LEAST_BANDS, TIMES_AROUND * around[crest])
    alone = np.zeros(len(crest), np.bool_)
    for k, frame in enumerate(GROUP * crest):
        reach = frame - SOONER / seconds, frame + LATER / seconds
        low, high = np.searchsorted(place, reach)
        if low == high:
            alone[k] = True
        else:
            best = low + int(np.argmax(height[low:high]))
            evidence[best] = max(evidence[best], by_bands[k])
    frame = np.concatenate((place, GROUP * crest[alone]))
    order = np.argsort(frame, kind="stable")
    coarse = np.arange(len(frame)) >= len(place)
    return Candidates(
        frame[order], coarse[order], np.concatenate((evidence, by_bands[alone]))[order]
    )


def rattling(rise: np.ndarray, place: np.ndarray, seconds: float) -> np.ndarray:
    """0.9-quantile of C within a second of frames, from every SAMPLED-th of them."""
    per = BLOCK // SAMPLED
    reach = round(RATTLE_WITHIN / (BLOCK * seconds))
    blocks, which = np.unique(place // BLOCK, return_inverse=True)
    quantile = np.empty(len(blocks))
    for k, block in enumerate(blocks):
        part = rise[per * max(block - reach, 0) : per * (block + reach + 1)]
        order = int(RATTLE_QUANTILE * len(part))
        quantile[k] = np.partition(part, order)[order]
    return quantile[which]


def local_mean(values: np.ndarray, before: int, after: int) -> np.ndarray:
    """Mean of each value and of those so many before and after it."""
    total = np.concatenate(([0.0], np.cumsum(values)))
    index = np.arange(len(values))
    low, high = np.maximum(index - before, 0), np.minimum(index + after + 1, len(values))
    return np.maximum(total[high] - total[low], 0.0) / (high - low)


def greatest_within(values: np.ndarray, reach: int) -> np.ndarray:
    """The greatest of each value and of those at most `reach` away."""
    from scipy import ndimage

    return ndimage.maximum_filter1d(values, 2 * reach + 1, mode="nearest")


def separate_crests(values: np.ndarray, reach: int) -> np.ndarray:
    """Indices of positive values that none within `reach` exceeds; the first of equal ones."""
    kept: list[int] = []
    for k in np.flatnonzero((values > 0) & (values == greatest_within(values, reach))):
        if not kept or k - kept[-1] > reach:
            kept.append(int(k))
    return np.array(kept, np.intp)
