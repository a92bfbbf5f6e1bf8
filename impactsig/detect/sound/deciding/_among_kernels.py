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

from ...._compiling.compiled import allocating
from .._kernels import GROUP
from .._nearby_kernels import ends_about, greatest_about
from .candidates import HOPELESS
from .crest_kernels import LEAST_OCTAVES, NEARBY, heights_reached

AMONG = 2.0  # times a: height of crests with which others are compared, and that octaves show
SHORTLY = 0.25  # [s], beside NEARBY, in which crests are counted
LEAST_CROWD = 0.05  # times a
LEAST_LOUD = 0.01  # greatest rise in narrow bands nearby [neper of power]
OTHERS_SLOPES = 3.6, 0.6, 1.9, 1.3, 1.1  # of e, L, m, k K and B_max
MOST_SLOPE = 6.5  # of the logarithm of the least, for the greatest odds
LIKELY = 7.0  # likelihood of a rise in one narrow band, less than which is likely to be noise
NEXT, BESIDE_OTHER = 40e-3, 0.1  # [s], and share of the greatest C so near that one must reach


@allocating
def put_odds_among(
    place, height, bands, borne_out, likelihood, loudest, clear, greatest, first, last, order,
    silence, by_bands, audible, offset, seconds, out,
):  # fmt: skip
    """Log-odds of `Crests` with the evidence `by_bands`, in frames of `seconds`.

    `offset` is the last summand. The odds are -inf if they are far below 0.
    """
    count, near = len(place), SHORTLY / seconds
    bands_slope, likelihood_slope, often_slope, crowd_slope, loud_slope = OTHERS_SLOPES
    queue, strong = np.empty(count, np.int64), np.zeros(count + 1, np.int64)
    greatest_next, loud, most, reached = (
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty(count),
    )
    greatest_about(place, height, NEXT / seconds, queue, greatest_next)
    greatest_about(place, bands, NEARBY / seconds, queue, loud)
    for k in range(count):
        strong[k + 1] = strong[k] + (height[k] > AMONG * audible)
    asked = np.empty(count, np.bool_)
    for k in range(count):
        needed = max(LEAST_OCTAVES * audible, BESIDE_OTHER * greatest_next[k])
        least = min(min(borne_out[k], likelihood[k] / LIKELY), clear[k] / needed)
        most[k] = MOST_SLOPE * np.log(least)
        odds = bands_slope * np.log(by_bands[k]) + offset
        if greatest[k] and np.isfinite(likelihood[k]):
            odds += likelihood_slope * np.log(max(likelihood[k], 1.0))
        others = strong[last[k]] - strong[first[k]] - (height[k] > AMONG * audible)
        odds += often_slope * np.log(others / (2.0 * NEARBY) + 0.5)
        out[k] = odds - loud_slope * np.log(max(loud[k], LEAST_LOUD))
        possible = min(most[k], out[k] - 2.0 * crowd_slope * np.log(LEAST_CROWD))
        asked[k] = possible > HOPELESS
    begin, end = np.empty(count, np.int64), np.empty(count, np.int64)
    ends_about(place, place, near, near, begin, end)
    for within, low, high in ((NEARBY, first, last), (SHORTLY, begin, end)):
        reach = round(within / (GROUP * seconds))
        heights_reached(place, height, order, low, high, silence, reach, within, asked, reached)
        for k in range(count):
            if asked[k]:
                out[k] -= crowd_slope * np.log(max(reached[k] / audible, LEAST_CROWD))
    for k in range(count):
        out[k] = min(most[k], out[k]) if asked[k] else -np.inf
