"""Rises in many narrow bands above steady noise: faint sounds of many modes.

Such sounds (struck plates and membranes) raise neither the power within 4 ms nor that of a single
band by much, but in steady noise the mean rise B over all bands (`sound.py`) is small: its greatest
crest in an hour is 6.6 to 7.9 times its median, whatever the spectrum of the noise and the rate. A
crest of B that none within 25 ms exceeds, where nothing else is likely, has the log-odds

    x = 2 + 0.5 ln(60 n) - 1.8 ln(max(B_max, 0.1) / B) - 20 max(B' - 0.04, 0)
        - 5 max(ln(0.015 / M), 0),

but at most 12 ln(B / 8.5 max(M, 0.015)) + 1.5 ln(60 n), which noise keeps below 0 for hours, and
1.6 x if that is negative. B_max is the greatest B within 2 s, M its median within 1 s, and B' the
greater of B 20 ms before and after the crest. n is the number per second of other crests with B
above 7 M and B' below 0.35 B, plus 1/60, at most 3.

Noise that swells raises B as far, but also falls below its mean, which no impact makes it do. The
log-odds are less by 30 max(D - 1.7, 0), where D is how far 2 sqrt(S) / s falls below its median in
a twentieth of the 4 s around: S is the mean over the bands of min(P_b / L_b, 1.5), with power and
background, and s the standard deviation it has in noise if bands were independent. In steady noise
D is 1.4 to 1.75, where noise swells 5 to 100 times a second by 0.15 to 0.8 mostly above 2.

An impact lies 2.5 ms before its crest of B, with an error of 3 ms, and replaces all less likely
candidates from 12 ms before to 20 ms after it.

Fitted to plates and membranes 6 to 20 dB above noise, swelling noise, records of
`benchmarks.varied_sound` and `benchmarks.other_sounds`, and drums in noise and behind changes of
gain, codecs and filters.
"""

from __future__ import annotations

import numpy as np

from .._kernels import GROUP
from .._nearby import greatest_within, places_about, ranked, rate_of_others
from .._nearby_kernels import greatest_between
from .candidates import HOPELESS, Candidates, with_others
from .crests import LATER, NEARBY, SOONER

LEAST = 0.06  # B, below which all odds are hopeless
LEAST_MEDIAN, LEAST_LOUD = 0.015, 0.1  # B that most of a second, and the greatest, are at least
NOISE, NOISE_SLOPE, NOISE_OFTEN = 8.5, 12.0, 1.5  # B that noise rarely reaches, over its median
OFTEN, LOUD, OFFSET = 0.5, 1.8, 2.0  # of ln(60 n) and of ln(B_max / B) in the log-odds
LOUD_WITHIN, MOST_OFTEN = 2.0, 3.0  # [s], and n that counts
BESIDE, STEADY, SWELLS = 20e-3, 0.04, 20.0  # [s], B of noise there, and odds for more
STEADY_WITHIN = 2.0  # [s], of which the unsteadiness is
ROUGH, SWELLING = 1.7, 30.0  # unsteadiness of noise, and odds for more
UNEVEN, BELOW = 5.0, 1.6  # odds for each e-fold of a median below that of noise; slope below 0
EVIDENT, ALONE = 7.0, 0.35  # B over its median, and B' over B, of evident impacts
BEFORE, SPREAD = 2.5e-3, 3e-3  # [s], of the impact before its crest of B


def with_steady(
    found: Candidates, b: np.ndarray, level: np.ndarray, crest: np.ndarray, seconds: float
) -> Candidates:
    """Add rises above steady noise to the candidates where no candidate is as probable.

    Parameters
    ----------
    b, crest : ndarray
        B of every GROUP-th frame, and the indices of its crests.
    level : ndarray
        Twice the root of the mean level, in its standard deviations, at these frames.
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
    odds[heard] -= SWELLING * np.maximum(unsteadiness(level, crest[heard], per) - ROUGH, 0.0)
    heard = heard[(odds[heard] > HOPELESS) & (odds[heard] > beside[heard])]
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
    odds = OFFSET + OFTEN * often - LOUD * np.log(loud / height)
    odds -= SWELLS * np.maximum(around - STEADY, 0.0)
    odds -= UNEVEN * np.log(np.maximum(LEAST_MEDIAN / np.maximum(median, 1e-3), 1.0))
    most = NOISE_SLOPE * np.log(height / (NOISE * usual)) + NOISE_OFTEN * often
    odds = np.minimum(odds, most)
    return np.asarray(np.where(odds < 0.0, BELOW * odds, odds))


def unsteadiness(level: np.ndarray, at: np.ndarray, per: float) -> np.ndarray:
    """How far the level near each place falls below its median, in a twentieth of the time."""
    reach = round(STEADY_WITHIN / per)
    first, last = np.maximum(at - reach, 0), np.minimum(at + reach + 1, len(level))
    order = np.argsort(level)
    usual = ranked(level, first, last, (last - first) // 2, order)
    return np.asarray(usual - ranked(level, first, last, (last - first) // 20, order))
