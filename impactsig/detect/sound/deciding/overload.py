"""Sound that an overload had pushed aside, distinguished from impacts.

While an overloaded microphone, amplifier or converter is near its limit it passes nothing else, so
each time a loud low tone (a bass drum, a resonating panel) leaves the limit, whatever else sounds
returns at once: narrow bands rise as they do at an impact, but only to what they had before. With
P_b the greatest power of a narrow band from 2 to 26 ms after the attack, and Q_b the greatest of
the band and its neighbours from 45 to 12 ms before it,

    N = 1/m sum_b max(0, ln(P_b / Q_b))

is what is new. If at least 5 % of the samples from 30 ms before the attack to 15 ms after it are
beyond 0.8 of the record's limits, and the evidence from octaves (`_octave_evidence.py`) is below
0.35, the log-odds of an impact are at most

    4 ln((N + 0.02) / 0.07).

Limits are soft as well as hard, so it does not matter whether samples are equal to them. Where
likely rises come 20 a second and more, they are not asked: the last impact is as loud as the next.
"""

from __future__ import annotations

import numpy as np

from .._kernels import GROUP, Scale
from .._nearby import places_about
from ..powers.bands import Spectrum
from ._overload_kernels import number_beyond

NEAR_LIMIT, LOADED = 0.8, 0.05  # of half the range, and share of samples beyond it
LOADED_WITHIN = 30e-3, 15e-3  # [s], before and after the attack
CROWD_WITHIN, CROWD = 0.25, 10  # [s], and others within it on either side that are not asked
OCTAVES = 0.35  # evidence of impacts that do not depend on narrow bands
BEFORE, SINCE, AFTER = (45e-3, 12e-3), 2e-3, 26e-3  # [s]
SLOPE, NONE, EVEN = 4.0, 0.02, 0.07  # of the log-odds, N of nothing, and N + NONE of even odds


def may_be_edges(instant: np.ndarray, by_octaves: np.ndarray) -> np.ndarray:
    """Which rises at these instants [s], in order, are sparse and little shown by octaves."""
    first, last = places_about(instant, instant, CROWD_WITHIN, CROWD_WITHIN)
    return np.asarray((by_octaves < OCTAVES) & (last - first <= CROWD))


def overload_odds(
    x: np.ndarray,
    attack: np.ndarray,
    asked: np.ndarray,
    limits: tuple[float, float],
    spectrum: Spectrum,
    scale: Scale,
    rate: float,
) -> np.ndarray:
    """The greatest log-odds that rises with these attacks, places in x, may have.

    Parameters
    ----------
    asked : ndarray of bool
        Which of them `may_be_edges`.
    limits : least and greatest sample of the record
    """
    out = np.full(len(attack), np.inf)
    place = np.ceil(attack).astype(np.int64)
    hop, size = GROUP * scale.hop, len(spectrum.bands.window)
    early, late = (round(t * rate) for t in LOADED_WITHIN)
    first = -(-round(BEFORE[0] * rate) // hop)
    frames = first + round(AFTER * rate) // hop + 1
    past = first - round(BEFORE[1] * rate) // hop + 1
    fresh = first + -(-round(SINCE * rate) // hop)
    middle, half = 0.5 * (limits[0] + limits[1]), 0.5 * (limits[1] - limits[0])
    begin = place - first * hop - size // 2
    asked = asked & (begin >= 0) & (place + (frames - first) * hop + size // 2 < len(x))
    which = np.flatnonzero(asked)
    if len(which):
        beyond = np.empty(len(which), np.int64)
        number_beyond(x, place[which] - early, early + late, middle, NEAR_LIMIT * half, beyond)
        which = which[beyond >= LOADED * (early + late)]
    if not len(which):
        return out
    # All stretches in a row, since many frames are transformed side by side.
    wide = frames - 1 + -(-size // hop)
    stretches = np.lib.stride_tricks.sliding_window_view(x, wide * hop)
    row = stretches[begin[which]].ravel()
    begins = wide * np.arange(len(which))
    power = spectrum.powers(row, size // 2, begins[-1] + frames)
    ends = np.add.outer(begins, (0, past, fresh, frames)).ravel()
    greatest = np.maximum.reduceat(power, ends[:-1], axis=1)
    padded, after = np.zeros((len(power) + 2, len(which))), greatest[:, 2::4]
    padded[1:-1] = greatest[:, ::4]
    before = np.maximum(np.maximum(padded[:-2], padded[2:]), padded[1:-1])
    heard = before > 0.0
    rise = np.maximum(after, before) / np.where(heard, before, 1.0)
    count = np.count_nonzero(heard, axis=0)
    total = np.sum(np.log(np.where(heard, rise, 1.0)), axis=0)
    some = count > 0
    out[which[some]] = SLOPE * np.log((total[some] / count[some] + NONE) / EVEN)
    return out
