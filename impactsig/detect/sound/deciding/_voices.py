"""Crests of the rise in octaves that are pulses of a voice: many in a short time.

A voice opens 80 to 300 times a second, for a few tenths of a second, and each opening is a rise in
octaves. It is recognised by n, the number of other crests within 50 ms higher than 0.4 times
this one. If n is at least 5, and the average within a second is at most 0.7 n per 50 ms (a machine
that hits as fast does so all the time), the log-odds of an impact are at most

    0.3 o - 0.76 n + 1.69 ln B + 6.1,

with o the log-odds otherwise and B the greatest rise in narrow bands within two frames, limited to
their threshold. A crest where they reach it is not changed. Fitted by logistic regression to
records of `benchmarks.varied_sound`, seeds 6000 to 6039 and 6100 to 6139, and of
`benchmarks.sound_disturbances`.
"""

from __future__ import annotations

import numpy as np

from .._kernels import GROUP
from .._nearby import heard_share, number_as_high

WITHIN, AS_HIGH, MANY = 50e-3, 0.4, 5  # [s], share of the height, and number of crests
ALWAYS, STEADY = 1.0, 0.7  # [s], and share of the time that such crests fill if they are steady
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
    which = np.flatnonzero(asked)
    number = number_as_high(place, height, which, WITHIN / seconds, AS_HIGH)
    which, number = which[number >= MANY], number[number >= MANY]
    near, end = place[which], GROUP * len(silent)
    rates = []
    for within, count in (
        (WITHIN, number),
        (ALWAYS, number_as_high(place, height, which, ALWAYS / seconds, AS_HIGH)),
    ):
        reach = within / seconds
        time = np.minimum(near + reach, end) - np.maximum(near - reach, 0.0)
        rates.append((count + 1.0) / time)
    here, around = rates
    crowd = around < STEADY * heard_share(silent, near, ALWAYS, seconds) * here
    which, number = which[crowd], number[crowd]
    least = OF_ODDS * odds[which] - OF_NUMBER * number + OFFSET
    least += OF_BANDS * np.log(np.maximum(bands[which], LEAST_BANDS))
    out = odds.copy()
    out[which] = np.minimum(odds[which], least)
    return out
