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

from .._kernels import BLOCK, GROUP, SAMPLED
from .._nearby import ranked
from ._evidence_kernels import IN_NOISE, TIMES, put_evidence, put_greatest, put_ranks
from .crest_kernels import NEARBY
from .crests import Crests


def octave_evidence(
    crests: Crests, rattle: np.ndarray, spread: float, audible: float, seconds: float
) -> np.ndarray:
    """Evidence of the rise in octaves for each of its crests, with the `rattling` of a passage."""
    out = np.empty(len(crests.place))
    reach = round(NEARBY / (GROUP * seconds))
    put_evidence(*crests, rattle, audible, IN_NOISE * spread, reach, out)
    return out


def rattling(rise: np.ndarray, silent: np.ndarray, seconds: float) -> np.ndarray:
    """Level of C that is often exceeded nearby, for each BLOCK of frames.

    Parameters
    ----------
    rise : ndarray
        C of every SAMPLED-th frame.
    silent : ndarray of bool
        Which of these are digital silence. They are left out: they say nothing of how the rest
        rattles.
    """
    first, last, rank = np.empty((3, len(TIMES) * (len(rise) * SAMPLED // BLOCK + 1)), np.int64)
    put_ranks(silent, round(NEARBY / (BLOCK * seconds)), first, last, rank)
    levels = ranked(rise[~silent] if silent.any() else rise, first, last, rank)
    out = np.empty(len(rank) // len(TIMES))
    put_greatest(levels, out)
    return out
