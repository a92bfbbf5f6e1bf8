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

from .._kernels import SAMPLED
from .._nearby import middle
from ._tail_kernels import decays_after

LOUD = 0.7  # [neper], of crests whose tails are measured
HEARD = 0.1  # [neper]
AFTER = 7e-3, 60e-3  # [s], of a tail
BEFORE_NEXT = 6e-3  # [s]
ENOUGH = 3  # tails


def decay_rate(place: np.ndarray, loud: np.ndarray, loudness: np.ndarray, seconds: float) -> float:
    """Median decay after loud crests [neper/s]; infinite if there are too few.

    `loud` is the loudness after crests, `loudness` that after every SAMPLED-th frame.
    """
    found = np.empty(len(place))
    count = decays_after(
        place, loud, loudness, SAMPLED, seconds, (LOUD, HEARD), AFTER, BEFORE_NEXT, found
    )
    return middle(found[:count]) if count >= ENOUGH else math.inf
