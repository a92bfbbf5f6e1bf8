"""Rises in many narrow bands above steady noise: faint sounds of many modes.

Such sounds (struck plates and membranes) raise neither the power within 4 ms nor that of a single
band by much, but in steady noise the mean rise B over all bands (`sound.py`) is small: its greatest
crest in an hour is 6.6 to 7.9 times its median, whatever the spectrum of the noise and the rate. A
crest of B that none within 25 ms exceeds, where nothing else is likely, has the log-odds

    x = 2 + 0.5 ln(60 n) - 1.8 ln(max(B_max, 0.1) / B) - 20 max(B' - 0.04, 0)
        - 0.7 max(k - 20, 0) - 30 max(W - W_0, 0) - 5 max(ln(0.015 / M), 0),

but at most 12 ln(B / 8.5 max(M, 0.015)) + 1.5 ln(60 n), which noise keeps below 0 for hours, and
1.6 x if that is negative. B_max is the greatest B within 2 s, and M its median, k the number of
other crests at least half as high and W a width within a second. n is the number per second of
other crests with B above 7 M and B' below 0.35 B, plus 1/60, at most 3.

Noise that swells rises for longer: B' is the greater of B 20 ms before and after the crest, and W
the median, over crests from 5 M to 0.33, of the mean of B 7 ms before and after each, relative to
its own. W_0 is 0.42 if there are 12 such crests or more, else 0.6. An impact lies 2.5 ms before its
crest of B, with an error of 3 ms, and replaces all less likely candidates from 12 ms before to 20
ms after it.

Fitted to plates and membranes 6 to 20 dB above noise, swelling noise, records of
`benchmarks.varied_sound` and `benchmarks.other_sounds`, and drums in noise and behind changes of
gain, codecs and filters.
"""

from __future__ import annotations

import numpy as np

from .._kernels import GROUP
from .._nearby import greatest_within, number_as_high, places_about, ranked, rate_of_others
from .._nearby_kernels import greatest_between
from .candidates import HOPELESS, Candidates, with_others
from .crests import LATER, NEARBY, SOONER

LEAST = 0.06  # B, below which all odds are hopeless
LEAST_MEDIAN, LEAST_LOUD = 0.015, 0.1  # B that most of a second, and the greatest, are at least
NOISE, NOISE_SLOPE, NOISE_OFTEN = 8.5, 12.0, 1.5  # B that noise rarely reaches, over its median
OFTEN, LOUD, OFFSET = 0.5, 1.8, 2.0  # of ln(60 n) and of ln(B_max / B) in the log-odds
LOUD_WITHIN, MOST_OFTEN = 2.0, 3.0  # [s], and n that counts
BESIDE, STEADY, SWELLS = 20e-3, 0.04, 20.0  # [s], B of noise there, and odds for more
AS_HIGH, MANY, EACH = 0.5, 20, 0.7  # share of the height, number of crests, and odds for more
CLEAR, FAINT = 5.0, 0.33  # B over its median, and B, between which the width of a crest counts
NEXT, WIDE, WIDER = 7e-3, 0.42, 0.6  # [s], share of B left there, and that if few crests count
ENOUGH, WIDTH_SLOPE = 12, 30.0  # crests, and odds for more
UNEVEN, BELOW = 5.0, 1.6  # odds for each e-fold of a median below that of noise; slope below 0
EVIDENT, ALONE = 7.0, 0.35  # B over its median, and B' over B, of evident impacts
BEFORE, SPREAD = 2.5e-3, 3e-3  # [s], of the impact before its crest of B


def with_steady(found: Candidates, b: np.ndarray, crest: np.ndarray, seconds: float) -> Candidates:
    """Add rises above steady noise to the candidates where no candidate is as probable.

    Parameters
    ----------
    b, crest : ndarray
        B of every GROUP-th frame, and the indices of its crests.
    """
    per = GROUP * seconds
    crest = crest[b[crest] > LEAST]
    middle = GROUP * crest
    first, last = places_about(found.frame, middle, SOONER / seconds, LATER / seconds)
    best = np.empty(len(crest), np.int64)
    greatest_between(found.odds, first, last, best)
    beside = np.append(found.odds, -np.inf)[best]
    if not (beside < 0.0).any():
        return found
    odds = steady_odds(crest, b, per)
    heard = np.flatnonzero((odds > HOPELESS) & (beside < 0.0) & (odds > beside))
    if not len(heard):
        return found
    out = found.odds.copy()
    for k in heard:
        out[first[k] : last[k]] = -np.inf
    spread = np.full(len(heard), SPREAD)
    place = np.maximum(middle[heard] - BEFORE / seconds, 0.0).astype(np.int64)
    return with_others(found._replace(odds=out), place, spread, odds[heard])


def steady_odds(crest: np.ndarray, b: np.ndarray, per: float) -> np.ndarray:
    """Log-odds of crests, which are indices of `b`: B of frames `per` seconds apart."""
    reach, beside = round(NEARBY / per), round(BESIDE / per)
    height, count = b[crest], len(b)
    padded = np.concatenate((np.zeros(beside), b, np.zeros(beside)))
    around = np.maximum(padded[crest], padded[crest + 2 * beside])
    first, last = np.maximum(crest - reach, 0), np.minimum(crest + reach + 1, count)
    median = ranked(b, first, last, (last - first) // 2)
    usual = np.maximum(median, LEAST_MEDIAN)
    evident = (height > EVIDENT * usual) & (around < ALONE * height)
    often = np.log(60.0 * np.minimum(rate_of_others(evident, count * per), MOST_OFTEN))
    loud = np.maximum(greatest_within(b, round(LOUD_WITHIN / per))[crest], LEAST_LOUD)
    high = number_as_high(crest, height, np.arange(len(crest)), float(reach), AS_HIGH)
    odds = OFFSET + OFTEN * often - LOUD * np.log(loud / height)
    odds -= SWELLS * np.maximum(around - STEADY, 0.0) + EACH * np.maximum(high - MANY, 0)
    faint = (height > CLEAR * usual) & (height < FAINT)
    odds -= WIDTH_SLOPE * np.maximum(excess_width(crest, faint, b, per), 0.0)
    odds -= UNEVEN * np.log(np.maximum(LEAST_MEDIAN / np.maximum(median, 1e-3), 1.0))
    most = NOISE_SLOPE * np.log(height / (NOISE * usual)) + NOISE_OFTEN * often
    odds = np.minimum(odds, most)
    return np.asarray(np.where(odds < 0.0, BELOW * odds, odds))


def excess_width(crest: np.ndarray, counted: np.ndarray, b: np.ndarray, per: float) -> np.ndarray:
    """Median share of B left NEXT to `counted` crests within NEARBY of each, less what is usual."""
    index = np.arange(len(b))
    apart = NEXT / per
    beside = np.interp(crest - apart, index, b) + np.interp(crest + apart, index, b)
    share = 0.5 * beside / b[crest]
    near = NEARBY / per
    first, last = places_about(crest[counted], crest, near, near)
    median = ranked(share[counted], first, last, (last - first) // 2)
    return np.asarray(median - np.where(last - first >= ENOUGH, WIDE, WIDER))
