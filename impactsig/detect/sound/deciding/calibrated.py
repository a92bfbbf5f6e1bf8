"""Log-odds calibrated by the statistics of the whole record.

The odds of a crest were fitted to records of all kinds together. If few crests of a record are in
doubt, evidence separates impacts from noise better: even odds are rarer than stated, and then more
often impacts. If impacts are as dense as the crests of a rattle, they mask each other's evidence,
and most that seem improbable are impacts. With F the F1 that the odds imply
(`doubt.py`), c = max(0, 1 - (1 - F) / 0.03), r likely impacts a second and sigma the standard
deviation of the rise in octaves in noise, the log-odds x become

    (1 + s c) x + d (0.7 c^2 min(1, r / 13.5) + min(8 max(0, ln(r / 13.5)), 3) + 2.5 k f g),
    d = (1 - 0.4 c) (1 - c^16),
    k = max(0, ln(sigma / 0.16)),    f = min(1, (r - 6) / 4), 0 where fewer than 6 a second come,
    g = 1 - min(1, ln(r / 13.5) / 0.3) min(1, 2 - (1 - F) / 0.03), each between 0 and 1,

s = 0.75 where x > 0, else 0.5. Where the rise is taken over few octaves (k > 0: rates below 13
kHz), its greatest values in noise are far above usual ones, and impacts stand less above these; but
if they are dense and yet clear (g = 0), crests in doubt are impacts no more often for it. If
nothing is in doubt, improbable crests are not impacts. Fitted to synthetic sound of 3 to 28 impacts
a second, 6 to 30 dB above noise, at 8 to 44 kHz.

In noise, the number of crests decreases with their probability. If at least as many crests lie just
above even odds as just below, they are impacts whose evidence is masked by a room or the next. With
n_1, n_2 and n_3 crests of log-odds from -3 to -1.5, to 0 and to 1.5, t seconds, and, between 0
and 1,

    e = (0.3 - ln((n_2 + 2) / (n_3 + 1))) / 0.6,    h = e f,

the log-odds grow by

    h (2.5 - 1.9 min(1, ln(r / 13.5) / 0.3) + 0.5 ln(10 sigma) + 0.6 ln((1 - F) / 0.03)
       - 1.2 ln((n_1 / t + 0.02) / (n_2 / t + 0.02))),

where negative values of the second and fourth terms are replaced by 0, and the slope for x < 0
grows by 0.27 h. Slower impacts do not overlap: with h = e min(1, r / 12) strokes of drums, 5 a
second, get false ones. Fitted to the same sound, such sound in rooms of 0.1 to 1 s, and
records of `benchmarks.varied_sound`.
"""

from __future__ import annotations

import math

import numpy as np

from .doubt import Doubt

SHARPER = 0.75, 0.5  # of the slope, above and below even odds, where nothing is in doubt
DOUBTFUL = 0.03  # expected share of errors from which on the slope is as it was fitted
DENSE = 13.5  # impacts a second that hide each other
SHORTEST = 1.0  # [s], of a record that shows how densely they come
DENSE_SLOPE, DENSE_MOST = 8.0, 3.0  # log-odds for each e-fold beyond that, and at most
SEEN, CERTAIN = 0.4, 16  # share that odds show where little is in doubt; power of c by which all is
EVEN = 0.7  # log-odds of what seems even there, if impacts come as densely
COARSE, FEWER_OCTAVES = 0.16, 2.5  # sigma of few octaves, and log-odds for each e-fold beyond
RISING, RISING_WITHIN = 0.3, 0.6  # ln of crests below even odds over those above, and its reach
FEW, MANY, DENSELY = 6.0, 10.0, 0.3  # impacts a second, no and all; and e-folds beyond DENSE
MORE, LESS_DENSE, COARSER, HIDDEN, NOISY = 2.5, 1.9, 0.5, 0.6, 1.2  # log-odds, and for an e-fold
USUAL = 0.1  # sigma at 16 kHz
BLURRED = 0.27  # of the slope below even odds
RARE = 0.02  # crests a second that are none
MOST_ERRORS = 0.3  # expected share of errors, and more


def calibrated(odds: np.ndarray, doubt: Doubt, seconds: float, spread: float) -> np.ndarray:
    """The log-odds of crests of a record of so many seconds, whose rises leave this doubt.

    `spread` is the standard deviation of the rise in octaves in noise.
    """
    seconds = max(seconds, SHORTEST)
    clear = max(0.0, 1.0 - (1.0 - doubt.f1) / DOUBTFUL)
    pace = doubt.right / (DENSE * seconds)
    above, below = SHARPER
    more = EVEN * clear**2 * min(pace, 1.0)
    more += min(DENSE_SLOPE * math.log(max(pace, 1.0)), DENSE_MOST)
    many = min(max((doubt.right / seconds - FEW) / (MANY - FEW), 0.0), 1.0)
    dense_but_clear = crowding(pace) * min(max(2.0 - (1.0 - doubt.f1) / DOUBTFUL, 0.0), 1.0)
    coarse = math.log(max(spread / COARSE, 1.0))
    more += FEWER_OCTAVES * coarse * many * (1.0 - dense_but_clear)
    more *= (1.0 - SEEN * clear) * (1.0 - clear**CERTAIN)
    hidden = rising(doubt) * many
    more += hidden * lost(doubt, seconds, spread, pace)
    slope = 1.0 + np.where(odds > 0.0, clear * above, clear * below + BLURRED * hidden)
    turned: np.ndarray = odds * slope + more
    return turned


def rising(doubt: Doubt) -> float:
    """Whether crests are more above even odds than below: from 0, as noise makes them, to 1."""
    falls = math.log((doubt.below + 2.0) / (doubt.above + 1.0))
    return min(max((RISING - falls) / RISING_WITHIN, 0.0), 1.0)


def crowding(pace: float) -> float:
    """How much denser than DENSE impacts are that come `pace` times as densely: from 0 to 1."""
    return min(math.log(max(pace, 1.0)) / DENSELY, 1.0)


def lost(doubt: Doubt, seconds: float, spread: float, pace: float) -> float:
    """Log-odds that impacts lose where they hide each other's evidence."""
    errors = min(max(1.0 - doubt.f1, DOUBTFUL), MOST_ERRORS) / DOUBTFUL
    noisy = math.log((doubt.improbable / seconds + RARE) / (doubt.below / seconds + RARE))
    coarser = math.log(min(max(spread / USUAL, 0.6), 2.7))
    return (
        MORE
        - LESS_DENSE * crowding(pace)
        + COARSER * coarser
        + HIDDEN * math.log(errors)
        - NOISY * min(max(noisy, -2.0), 3.0)
    )
