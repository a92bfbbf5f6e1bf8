"""Crests that come so densely that narrow bands cannot tell them apart, and are all about as high.

Narrow bands hear 10 to 28 ms far: where a machine hits 30 times a second and more they bear out no
crest, and as many crests are what rattling makes. But rattling makes crests of every height. Of
impacts in a background that is heard between them, crests of the rise in octaves are far above
those of noise, and next to none lie in between. With n the number of crests within a second that
are higher than 0.4 times this one, and m of those between 0.13 and 0.4 times it, the log-odds of an
impact are, where n is 30 a second or more and C at least 0.3 times the greatest within a second,

    3 - 15 m / n, no more than 6.5 ln(D / 2 a),

D the greater of what C exceeds the tails of earlier crests by and of C / 1.5, and a what noise
reaches once in an hour (`decision.py`).
"""

from __future__ import annotations

import numpy as np

from .._nearby import greatest_near, number_as_high

WITHIN, MANY = 1.0, 30.0  # [s], crests a second
AS_HIGH, LESS = 0.4, 0.13  # shares of the height
OF_GREATEST = 0.3  # within a second
ODDS, BETWEEN_SLOPE, HEIGHT_SLOPE = 3.0, 15.0, 6.5
LEAST, TAILS = 2.0, 1.5  # times a; what tails are at most, where crests of all are as high


def dense_odds(
    place: np.ndarray, height: np.ndarray, clear: np.ndarray, audible: float, seconds: float
) -> tuple[np.ndarray, np.ndarray]:
    """Log-odds of crests, -inf where they are not dense, and which are but for their height.

    Parameters
    ----------
    place, height, clear : ndarray
        Frames of `seconds`, the rise in octaves there, and by what that exceeds earlier tails.
    audible : float
        Rise that noise reaches once in an hour.
    """
    reach = WITHIN / seconds
    asked = np.flatnonzero(height >= OF_GREATEST * greatest_near(place, height, reach))
    high = number_as_high(place, height, asked, reach, AS_HIGH)
    many = high >= 2.0 * WITHIN * MANY
    dense, high = asked[many], high[many]
    lower = number_as_high(place, height, dense, reach, LESS)
    odds, alike = np.full(len(place), -np.inf), np.zeros(len(place), bool)
    by_heights = ODDS - BETWEEN_SLOPE * (lower / high - 1.0)
    rise = np.maximum(clear[dense], height[dense] / TAILS)
    odds[dense] = np.minimum(by_heights, HEIGHT_SLOPE * np.log(rise / (LEAST * audible)))
    alike[dense] = (by_heights > 0.0) & (height[dense] > audible)
    return odds, alike
