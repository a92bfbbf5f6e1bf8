"""Crests of the rise in octaves that come as the pulses of a voice do: in a crowd, for a moment.

A voice opens 80 to 300 times a second, for a few tenths of a second, and each opening is a rise in
octaves. It is known by n, how many other crests within 50 ms are higher than 0.4 times this one.
Where n is 5 or more, and 40 crests a second within a second do not reach half of it (else a machine
hits so fast all of the time), the log-odds of an impact are no more than

    0.3 o - 0.76 n + 1.69 ln B + 6.1,

o what they are otherwise, B the greatest rise in narrow bands within two frames, and less than
these need. Fitted by logistic regression to records of `benchmarks.varied_sound`, seeds 6000 to
6039 and 6100 to 6139, and of `benchmarks.sound_disturbances`.
"""

from __future__ import annotations

import numpy as np

from ._kernels import GROUP, as_high_near
from ._nearby import crowd, heard_share

WITHIN, AS_HIGH, MANY = 50e-3, 0.4, 5  # [s], share of the height, and number of crests
ALWAYS, STEADY = 1.0, 0.5  # [s] within which such crests are steady, and their share of the height
OF_ODDS, OF_NUMBER, OF_BANDS, OFFSET = 0.3, 0.76, 1.69, 6.1
LEAST_BANDS = 0.01  # [neper of power]


def pulse_odds(
    odds: np.ndarray,
    asked: np.ndarray,
    place: np.ndarray,
    height: np.ndarray,
    bands: np.ndarray,
    silent: np.ndarray,
    seconds: float,
) -> np.ndarray:
    """Log-odds of crests, less where they are asked for and may be pulses of a voice.

    Parameters
    ----------
    asked : ndarray of bool
    place, height, bands : ndarray
        Frames of `seconds`, the rise in octaves there and the greatest in narrow bands nearby.
    silent : ndarray of bool
        GROUPs of frames that are digital silence.
    """
    beside = np.empty(len(place), np.int64)
    as_high_near(place, height, WITHIN / seconds, AS_HIGH, beside)
    which = asked & (beside >= MANY)
    reach, end = ALWAYS / seconds, GROUP * len(silent)
    inside = np.minimum(place[which] + reach, end) - np.maximum(place[which] - reach, 0.0)
    share = heard_share(silent, place[which], ALWAYS, seconds) * (0.5 * inside / reach) ** 2
    always = crowd(place, height, which, ALWAYS, seconds, share)
    which[which] = always < STEADY * height[which]
    least = OF_ODDS * odds[which] - OF_NUMBER * beside[which] + OFFSET
    least += OF_BANDS * np.log(np.maximum(bands[which], LEAST_BANDS))
    out = odds.copy()
    out[which] = np.minimum(odds[which], least)
    return out
