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

from .._nearby import number_as_high
from .crests import NEARBY, Crests

MANY = 30.0  # crests a second
AS_HIGH, LESS = 0.4, 0.13  # shares of the height
OF_GREATEST = 0.3  # within a second
ODDS, BETWEEN_SLOPE, HEIGHT_SLOPE = 3.0, 15.0, 6.5
LEAST, TAILS = 2.0, 1.5  # times a; what tails are at most, where crests of all are as high


def dense_odds(crests: Crests, audible: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Log-odds of crests, -inf where they are not dense, and which are but for their height.

    Parameters
    ----------
    crests : Crests
        Of the rise in octaves, in frames of `seconds`.
    audible : float
        Rise that noise reaches once in an hour.
    """
    place, height, clear, reach = crests.place, crests.height, crests.clear, NEARBY / seconds
    asked = np.flatnonzero(height >= OF_GREATEST * crests.loudest)
    high = number_as_high(place, height, asked, reach, AS_HIGH)
    many = high >= 2.0 * NEARBY * MANY
    dense, high = asked[many], high[many]
    lower = number_as_high(place, height, dense, reach, LESS)
    odds, alike = np.full(len(place), -np.inf), np.zeros(len(place), bool)
    by_heights = ODDS - BETWEEN_SLOPE * (lower / high - 1.0)
    rise = np.maximum(clear[dense], height[dense] / TAILS)
    odds[dense] = np.minimum(by_heights, HEIGHT_SLOPE * np.log(rise / (LEAST * audible)))
    alike[dense] = (by_heights > 0.0) & (height[dense] > audible)
    return odds, alike
