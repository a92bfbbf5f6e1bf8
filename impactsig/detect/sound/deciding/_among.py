"""Log-odds of crests of C by those around them.

They serve records in which a room or many impacts cause continuous sound:

    3.6 ln e + 0.6 ln L + 1.9 ln (m + 1/2) - 1.3 ln (k K / a^2) - 1.1 ln B_max - 7.3.

Here e is the evidence from bands (`decision.py`), L is G for the greatest C within 28 ms and 1 for
others, m the number per second of other crests above 2 a within a second, B_max the greatest B
within a second, at least 0.01, and K and k the height that 40 crests a second exceed within 1 and
0.25 s, at least a / 20 each. The odds are at most 6.5 times the logarithm of the least of
C / (0.35 a), C over a tenth of the greatest within 40 ms (both C limited to the excess over tails),
G / 7 and B over its required value.

Fitted by logistic regression to synthetic sound and drums, also in rooms and noise.
"""

from __future__ import annotations

import numpy as np

from .._nearby import crowd, greatest_near, heard_share, places_about
from .candidates import HOPELESS
from .crests import LEAST_OCTAVES, NEARBY, Crests

AMONG = 2.0  # times a: height of crests with which others are compared, and that octaves show
SHORTLY = 0.25  # [s], beside NEARBY, in which crests are counted
LEAST_CROWD = 0.05  # times a
LEAST_LOUD = 0.01  # greatest rise in narrow bands nearby [neper of power]
OTHERS_SLOPES = 3.6, 0.6, 1.9, 1.3, 1.1  # of e, L, m, k K and B_max
OTHERS_OFFSET = -7.3
MOST_SLOPE = 6.5  # of the logarithm of the least, for the greatest odds
LIKELY = 7.0  # likelihood of a rise in one narrow band, less than which is likely to be noise
NEXT, BESIDE_OTHER = 40e-3, 0.1  # [s], and share of the greatest C so near that one must reach


def odds_among(
    crests: Crests, by_bands: np.ndarray, audible: float, silent: np.ndarray, seconds: float
) -> np.ndarray:
    """Log-odds of crests among all others around them; -inf if far below 0."""
    place, height, bands, borne_out, likelihood, greatest, _, clear, order, first, last = crests
    bands_slope, likelihood_slope, often_slope, crowd_slope, loud_slope = OTHERS_SLOPES
    with np.errstate(divide="ignore"):
        needed = np.maximum(
            LEAST_OCTAVES * audible, BESIDE_OTHER * greatest_near(place, height, NEXT / seconds)
        )
        most = np.log(np.minimum(np.minimum(borne_out, likelihood / LIKELY), clear / needed))
        odds = bands_slope * np.log(by_bands) + OTHERS_OFFSET
    counted = np.where(greatest & np.isfinite(likelihood), likelihood, 1.0)
    odds += likelihood_slope * np.log(np.maximum(counted, 1.0))
    reach = NEARBY / seconds
    strong = height > AMONG * audible
    index = np.append(0, np.cumsum(strong))
    others = (index[last] - index[first] - strong) / (2.0 * NEARBY)
    odds += often_slope * np.log(others + 0.5)
    odds -= loud_slope * np.log(np.maximum(greatest_near(place, bands, reach), LEAST_LOUD))
    possible = np.minimum(MOST_SLOPE * most, odds - 2.0 * crowd_slope * np.log(LEAST_CROWD))
    asked = possible > HOPELESS
    at, near = place[asked], SHORTLY / seconds
    for within, (begin, end) in (
        (NEARBY, (first[asked], last[asked])),
        (SHORTLY, places_about(place, at, near, near)),
    ):
        share = heard_share(silent, at, within, seconds)
        reached = crowd(height, begin, end, within, share, order) / audible
        odds[asked] -= crowd_slope * np.log(np.maximum(reached, LEAST_CROWD))
    return np.where(asked, np.minimum(MOST_SLOPE * most, odds), -np.inf)
