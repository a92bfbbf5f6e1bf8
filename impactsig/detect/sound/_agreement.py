"""Log-odds of impacts that narrow bands, one of them and one octave agree on.

The evidence of each alone is bounded by what else makes as much of it: narrow bands by rattling,
rises in one band by beats, those in one octave by tails. Where B, G and H (`sound.py`) rise at one
time, and nothing else is likely within 30 ms, the log-odds are

    6 ln min(B / 0.18, B / 3 A, G / 30, H / 20),

A the mean of B around. So soft strokes beside ringing cymbals are found. Power that grows further
(`_tones.py`) does not count. Of 8600 unlikely crests of drums, rooms and `benchmarks.varied_sound`
(seeds 50000 to 50007), 15 % impacts, more than 95 % of those that this makes likely are impacts.
"""

from __future__ import annotations

import numpy as np

from ._nearby import greatest_near

ALONE = 30e-3  # [s]
BANDS, TIMES_AROUND, LIKELIHOOD, OCTAVE = 0.18, 3.0, 30.0, 20.0  # B, B over A, G and H of even odds
SLOPE = 6.0
LEAST_AROUND = 0.01  # [neper of power]


def unexplained(frame: np.ndarray, odds: np.ndarray, seconds: float) -> np.ndarray:
    """Indices of unlikely candidates that none within ALONE exceeds."""
    greatest = greatest_near(frame, odds, ALONE / seconds)
    return np.flatnonzero((odds < 0.0) & np.isfinite(odds) & (odds >= greatest))


def agreed_odds(
    bands: np.ndarray, around: np.ndarray, likelihood: np.ndarray, octave: np.ndarray
) -> np.ndarray:
    """Log-odds of candidates with these B, mean B around, G and H."""
    least = np.minimum(bands / BANDS, bands / (TIMES_AROUND * np.maximum(around, LEAST_AROUND)))
    least = np.minimum(least, np.minimum(likelihood / LIKELIHOOD, octave / OCTAVE))
    with np.errstate(divide="ignore"):
        return np.asarray(SLOPE * np.log(least))
