"""Low tones: impacts in few narrow bands that do not raise the power of an octave.

G is the likelihood of a rise in one narrow band, B the mean rise over all (`sound.py`). A crest of
G that none within 25 ms exceeds has the log-odds

    0.7 ln G + 1.7 ln B - 5.4 ln(G_1/2 + 5) - 1.5 ln(max(B_max, 0.15)) + 12.1,

less 40 (G' / G - 0.1) if that is positive, with G' the G 16 ms later: a swelling note continues to
rise, an impact does not, nor does its power in the rising bands grow by more than 0.6 neper within
17 ms. The log-odds are at most G - 24 - 2 min(n, 5), since noise reaches a G of 20 about once an
hour, and swelling noise, with n crests of 10 to 20 a second, more than 20. B is the greatest within
two frames, G_1/2 the median of G and B_max the greatest B within a second: in varying sound, single
bands sometimes rise. An impact lies 1.6 ms before its crest of G, with an error of 2 ms, since
there its sound fills the window.

Fitted by logistic regression to records of `benchmarks.varied_sound` and drums, less 1, where the
octaves show no impact.
"""

from __future__ import annotations

import numpy as np

from .._nearby import ranked

SLOPES = 0.7, 1.7, 5.4, 1.5  # of ln G, ln B, ln(G_1/2 + 5), ln B_max
OFFSET = 12.1
LEAST_MEDIAN, LEAST_LOUD = 5.0, 0.15
NOISE = 24.0  # G that noise reaches once in a hundred hours
FAINTEST = 20.0  # G, below which the odds are hopeless
SWELLING, PER_CREST, MOST_CRESTS = 10.0, 2.0, 5.0  # G that few noises reach; more for each, at most
LATER, SWELL, SWELL_SLOPE = 16e-3, 0.1, 40.0  # [s], share of G left then, and odds for more
GROWS_ON = 0.6  # [neper], more than bands of an impact go on to rise by
BEFORE, SPREAD = 1.6e-3, 2e-3  # [s], of the impact before the crest of G


def tone_odds(
    crests: np.ndarray, g: np.ndarray, b: np.ndarray, growth: np.ndarray, reach: int
) -> tuple[np.ndarray, np.ndarray]:
    """Crests of G that may be impacts, with log-odds relative to those within `reach`.

    Parameters
    ----------
    crests : ndarray of int
        Indices of `g`, which is G of each frame; `reach` is a second.
    b : ndarray
        B, the greatest within two frames.
    growth : ndarray
        By how much the bands that rise go on to rise [neper], of each crest.
    """
    ln_g, ln_b, ln_median, ln_loud = SLOPES
    crest = crests[(g[crests] > FAINTEST) & (growth <= GROWS_ON)]
    weak = crests[(g[crests] > SWELLING) & (g[crests] <= FAINTEST)]
    low, high = np.searchsorted(weak, (crest - reach, crest + reach + 1))
    swells = PER_CREST * np.minimum(0.5 * (high - low), MOST_CRESTS)
    size = min(2 * reach + 1, len(g))
    first = np.clip(crest - reach, 0, len(g) - size)
    median = ranked(g, first, first + size, np.full(len(crest), size // 2))
    loud = np.maximum.reduceat(
        np.append(b, -np.inf), np.stack((first, first + size), axis=1).ravel()
    )[::2]
    later = g[np.minimum(crest + round(LATER * reach), len(g) - 1)] / g[crest]
    with np.errstate(divide="ignore"):
        odds = ln_g * np.log(g[crest]) + ln_b * np.log(b[crest]) + OFFSET
    odds -= ln_median * np.log(median + LEAST_MEDIAN)
    odds -= ln_loud * np.log(np.maximum(loud, LEAST_LOUD))
    odds -= SWELL_SLOPE * np.maximum(later - SWELL, 0.0)
    return crest, np.minimum(odds, g[crest] - NOISE - swells)
