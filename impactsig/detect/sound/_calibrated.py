"""Log-odds as they turn out, by what the record as a whole says of its impacts.

The odds of a crest were fitted to records of all kinds together. Where few crests of a record are
in doubt, evidence parts impacts from noise more sharply: odds are even less often than they say,
and then rather of impacts. Where impacts come as densely as the crests of a rattle, they hide each
other's evidence, and most that seem improbable are impacts. With F the F1 that the odds let expect
(`_doubt.py`), c = max(0, 1 - (1 - F) / 0.03) and r likely impacts a second, the log-odds x become

    (1 + s c) x + d (0.7 c^2 min(1, r / 13.5) + min(8 max(0, ln(r / 13.5)), 3)),
    d = (1 - 0.4 c) (1 - c^16),

s = 0.75 where x > 0, else 0.5. Where nothing at all is in doubt, what seems to be none is none. By
synthetic sound of 3 to 28 impacts a second, 6 to 30 dB above noise, at 8 to 44 kHz.
"""

from __future__ import annotations

import math

import numpy as np

from ._doubt import Doubt

SHARPER = 0.75, 0.5  # of the slope, above and below even odds, where nothing is in doubt
DOUBTFUL = 0.03  # expected share of errors from which on the slope is as it was fitted
DENSE = 13.5  # impacts a second that hide each other
SHORTEST = 1.0  # [s], of a record that shows how densely they come
DENSE_SLOPE, DENSE_MOST = 8.0, 3.0  # log-odds for each e-fold beyond that, and at most
SEEN, CERTAIN = 0.4, 16  # share that odds show where little is in doubt; power of c by which all is
EVEN = 0.7  # log-odds of what seems even there, if impacts come as densely


def calibrated(odds: np.ndarray, doubt: Doubt, seconds: float) -> np.ndarray:
    """The log-odds of crests of a record of so many seconds, whose rises leave this doubt."""
    clear = max(0.0, 1.0 - (1.0 - doubt.f1) / DOUBTFUL)
    pace = doubt.right / (DENSE * max(seconds, SHORTEST))
    above, below = SHARPER
    more = EVEN * clear**2 * min(pace, 1.0)
    more += min(DENSE_SLOPE * math.log(max(pace, 1.0)), DENSE_MOST)
    more *= (1.0 - SEEN * clear) * (1.0 - clear**CERTAIN)
    turned: np.ndarray = odds * (1.0 + clear * np.where(odds > 0.0, above, below)) + more
    return turned
