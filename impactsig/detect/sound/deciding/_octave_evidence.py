"""Evidence of the rise in octaves, C, against the rattle around it.

The rattle r is the greater of 50 times the 0.75-quantile and 12 times the 0.9-quantile of C within
a second, without digital silence. It is at most 4 a, at most 0.3 C_max + r / 10, C_max the greatest
C within a second, or, if that is more, at most 50 times the excess over 0.75 s of the 80th highest
crest of these two seconds (fewer beside digital silence): dense impacts raise the quantiles as
rattling does, but have fewer crests, and weak knocks have weak tails. The evidence of a crest is

    min(C / (a + r) + G / 36, C / (0.25 a + r)),

with C limited to its excess over the tails of earlier crests (`_tails.py`), and G only for the
greatest C within 28 ms. It is at most what bears the crest out (`crests.py`, a and s as well).
"""

from __future__ import annotations

import numpy as np

from .._kernels import BLOCK
from .._nearby import crowd, heard_share, ranked
from .._survey import SAMPLED, Passage
from .crests import NEARBY, Crests, audible_rise

RATTLE = {0.75: 50.0, 0.9: 12.0}  # times these quantiles of C
ABOVE, IN_NOISE = 50.0, 0.75  # times what such a crest is above so many s
FEW = 4.0  # times a: rattle without a number of crests, as of a room that rings
TAIL, STEADY = 0.3, 0.1  # of the greatest C nearby and of the rattle: nor more than their sum
CERTAIN = 36.0  # likelihood of a rise in one narrow band that is evidence of 1
BESIDE_BAND = 0.25  # times a: rise in octaves without which that counts little
FAINT = 0.3  # evidence of nothing


def octave_evidence(
    crests: Crests, rattle: np.ndarray, silent: np.ndarray, spread: float, seconds: float
) -> np.ndarray:
    """Evidence of the rise in octaves for each of its crests, with the `rattling` of a passage."""
    place, borne_out, clear = crests.place, crests.borne_out, crests.clear
    likely = crests.greatest & np.isfinite(crests.likelihood)
    likelihood = np.where(likely, crests.likelihood, 0.0)
    audible = audible_rise(spread)
    evidence = np.minimum(clear / audible + likelihood / CERTAIN, borne_out)
    far = evidence < FAINT
    evidence[far] = 0.0
    near = ~far
    rattle = rattle[place[near] // BLOCK]
    without_crowd = np.minimum(FEW * audible, TAIL * crests.loudest[near] + STEADY * rattle)
    share = heard_share(silent, place[near], NEARBY, seconds)
    first, last = crests.first[near], crests.last[near]
    reached = crowd(crests.height, first, last, NEARBY, share, crests.order)
    crowded = ABOVE * (reached - IN_NOISE * spread)
    rattle = np.minimum(rattle, np.maximum(without_crowd, crowded))
    calm = np.minimum(
        clear[near] / (audible + rattle) + likelihood[near] / CERTAIN,
        clear[near] / (BESIDE_BAND * audible + rattle),
    )
    evidence[near] = np.minimum(calm, borne_out[near])
    return evidence


def rattling(passage: Passage, seconds: float) -> np.ndarray:
    """Level of C that is often exceeded nearby, for each BLOCK of frames.

    Digital silence is left out: it says nothing of how the rest rattles.
    """
    rise, silent = passage.octaves, passage.silent
    per = BLOCK // SAMPLED
    reach = round(NEARBY / (BLOCK * seconds))
    block = np.arange(len(rise) // per + 1)
    first = per * np.maximum(block - reach, 0)
    last = np.minimum(per * (block + reach + 1), len(rise))
    if silent.any():
        heard = np.append(0, np.cumsum(~silent))
        rise, first, last = rise[~silent], heard[first], heard[last]
    ranks = np.outer(last - first, list(RATTLE)).astype(int)
    each = ranks.shape[1]
    quantiles = ranked(rise, np.repeat(first, each), np.repeat(last, each), ranks.ravel())
    times = np.array(list(RATTLE.values()), rise.dtype)
    return np.asarray(np.max(times * quantiles.reshape(-1, each), axis=1), float)
