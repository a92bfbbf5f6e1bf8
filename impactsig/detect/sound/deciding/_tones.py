"""Low tones: impacts in few narrow bands that do not raise the power of an octave.

G is the likelihood of a rise in one narrow band, B the mean rise over all (`sound.py`). A crest of
G that none within 25 ms exceeds has the log-odds

    0.7 ln G + 1.7 ln B - 5.4 ln(G_1/2 + 5) - 1.5 ln(max(B_max, 0.15)) + 12.1,

less 40 (G' / G - 0.1) if that is positive, with G' the G 16 ms later: a swelling note continues to
rise, an impact does not, nor does its power in the rising bands grow by more than 0.6 neper within
17 ms. The log-odds are at most G - 24 - 2 min(n, 5), since noise reaches a G of 20 about once an
hour, and swelling noise, with n crests of 10 to 20 a second, more than 20. B is the greatest within
two frames, G_1/2 the median of G and B_max the greatest B within a second: in varying sound, single
bands sometimes rise. A gate shuts where sound varies least, and G is small there whatever it was:
beside digital silence ln(G_1/2 + 5) is the mean of that of all frames and that of the others. An
impact lies 1.6 ms before its crest of G, with an error of 2 ms, since there its sound fills the
window. It is placed at a crest of C of at least a within 6 ms of that place, if there is one, and
replaces all less likely candidates from 12 ms before to 20 ms after it.

Fitted by logistic regression to records of `benchmarks.varied_sound` and drums, less 1, where the
octaves show no impact.
"""

from __future__ import annotations

import numpy as np

from .._kernels import GROUP
from .._nearby import places_about, separate_crests
from .._nearby_kernels import greatest_between
from .._survey import Passage
from ._judging_kernels import GROWS_ON, growth_near
from ._tone_kernels import FAINTEST, SWELLING, put_onsets, put_tone_odds
from .candidates import Candidates, with_others
from .crest_kernels import LATER, NEARBY, SOONER
from .crests import Crests

APART = 25e-3  # [s], crests of G
BEFORE = 1.6e-3  # [s], of the impact before the crest of G


def with_tones(
    found: Candidates,
    crests: Crests,
    passage: Passage,
    audible: float,
    seconds: float,
) -> Candidates:
    """Add low tones to the candidates where no candidate is as probable.

    A low tone replaces all less likely candidates near it.
    """
    per, b = GROUP * seconds, passage.bands
    g = np.where(passage.known, passage.likelihood, 0.0)
    every = separate_crests(g, round(APART / per), SWELLING)
    crest = every[g[every] > FAINTEST]
    first, last = places_about(found.frame, GROUP * crest, SOONER / seconds, LATER / seconds)
    best = np.empty(len(crest), np.int64)
    greatest_between(found.odds, first, last, best)
    beside = np.append(found.odds, -np.inf)[best]
    asked = beside < 0.0
    if not asked.any():
        return found
    grown = np.empty(len(crest))
    growth_near(b, passage.growth, GROUP * crest, grown)
    asked &= grown <= GROWS_ON
    crest, first, last, beside = (of_crest[asked] for of_crest in (crest, first, last, beside))
    if not len(crest):
        return found
    weak, tones = every[g[every] <= FAINTEST], np.empty(len(crest))
    put_tone_odds(crest, weak, g, b, passage.silent, round(NEARBY / per), beside, tones)
    heard = np.flatnonzero(tones > beside)
    if not len(heard):
        return found
    near = GROUP * crest[heard] - BEFORE / seconds
    place, off, odds = np.empty(len(heard), np.int64), np.empty(len(heard)), found.odds.copy()
    put_onsets(crests.place, crests.height, audible, near, seconds, place, off)
    for k in heard:
        odds[first[k] : last[k]] = -np.inf
    return with_others(found._replace(odds=odds), place, off, tones[heard])
