"""Crests too dense to be separated by narrow bands, and of about the same height.

Narrow bands extend over 10 to 28 ms: if a machine hits 30 times a second or more, they confirm no
crest, and rattling has as many crests. But rattling has crests of all heights, whereas for impacts
with an audible background between them, the crests of the rise in octaves are far above those of
noise, with hardly any in between. With n the number of crests within a second that are higher than
0.4 times this one, and m that of those between 0.13 and 0.4 times it, the log-odds of an impact,
if n is at least 30 a second and C at least 0.3 times the greatest within a second, are

    3 - 15 m / n, no more than 6.5 ln(D / 2 a),

with D the greater of the excess of C over the tails of earlier crests and of C / 1.5, and a the
greatest value in an hour of noise (`crests.py`).
"""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import allocating
from .._nearby_kernels import ends_about, number_as_high
from .crest_kernels import NEARBY

MANY = 30.0  # crests a second
AS_HIGH, LESS = 0.4, 0.13  # shares of the height
OF_GREATEST = 0.3  # within a second
ODDS, BETWEEN_SLOPE, HEIGHT_SLOPE = 3.0, 15.0, 6.5
LEAST, TAILS = 2.0, 1.5  # times a; what tails are at most, where crests of all are as high


@allocating
def put_dense_odds(place, height, loudest, clear, audible, seconds, odds, alike):
    """Log-odds of crests, and which are dense but for their height.

    Parameters
    ----------
    place, height, loudest, clear : (n,) of `Crests`, in frames of so many `seconds`
    audible : C that noise reaches once in an hour
    odds : (n,) room for the log-odds; -inf where crests are not dense
    alike : (n,) bool
    """
    first, last = np.empty(len(place), np.int64), np.empty(len(place), np.int64)
    reach, many = float(int(NEARBY / seconds)), 2.0 * NEARBY * MANY
    ends_about(place, place, reach, reach + 1.0, first, last)
    for k in range(len(place)):
        odds[k], alike[k] = -np.inf, False
        if last[k] - first[k] <= many or height[k] < OF_GREATEST * loudest[k]:
            continue
        high = number_as_high(height, k, first[k], last[k], AS_HIGH)
        if high >= many:
            lower = number_as_high(height, k, first[k], last[k], LESS)
            by_heights = ODDS - BETWEEN_SLOPE * (lower / high - 1.0)
            rise = max(clear[k], height[k] / TAILS)
            odds[k] = min(by_heights, HEIGHT_SLOPE * np.log(rise / (LEAST * audible)))
            alike[k] = by_heights > 0.0 and height[k] > audible
