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
from .._nearby import greatest_beside, places_about, ranked, separate_crests
from .._nearby_kernels import greatest_between
from .._survey import Passage
from ._crest_kernels import LATER, LEAST_OCTAVES, NEARBY, SOONER
from ._judging_kernels import GROWS_ON, growth_near
from .candidates import Candidates, with_others
from .crests import Crests

SLOPES = 0.7, 1.7, 5.4, 1.5  # of ln G, ln B, ln(G_1/2 + 5), ln B_max
OFFSET = 12.1
LEAST_MEDIAN, LEAST_LOUD = 5.0, 0.15
NOISE = 24.0  # G that noise reaches once in a hundred hours
FAINTEST = 20.0  # G, below which the odds are hopeless
SWELLING, PER_CREST, MOST_CRESTS = 10.0, 2.0, 5.0  # G that few noises reach; more for each, at most
AFTER, SWELL, SWELL_SLOPE = 16e-3, 0.1, 40.0  # [s], share of G left then, and odds for more
APART = 25e-3  # [s], crests of G
BEFORE, SPREAD = 1.6e-3, 2e-3  # [s], of the impact before the crest of G


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
    if not len(crest):
        return found
    weak = every[g[every] <= FAINTEST]
    frame, odds = found.frame, found.odds.copy()
    first, last = places_about(frame, GROUP * crest, SOONER / seconds, LATER / seconds)
    best = np.empty(len(crest), np.int64)
    greatest_between(odds, first, last, best)
    beside, grown = np.append(odds, -np.inf)[best], np.empty(len(crest))
    growth_near(b, passage.growth, GROUP * crest, grown)
    asked = (beside < 0.0) & (grown <= GROWS_ON)
    crest, first, last, beside = (of_crest[asked] for of_crest in (crest, first, last, beside))
    if not len(crest):
        return found
    sounding = ~passage.silent
    tones = tone_odds(crest, weak, g, b, sounding, round(NEARBY / per), beside)
    heard = np.flatnonzero(tones > beside)
    if not len(heard):
        return found
    middle = GROUP * crest
    near = middle[heard] - BEFORE / seconds
    reach = 3.0 * SPREAD / seconds
    first_near, last_near = places_about(crests.place, near, reach, reach)
    onset, off = likeliest_onset(crests, audible, near, first_near, last_near, seconds)
    clear = onset >= 0
    for k in heard:
        odds[first[k] : last[k]] = -np.inf
    place = np.maximum(near, 0).astype(np.int64)
    place[clear] = crests.place[onset[clear]]
    return with_others(found._replace(odds=odds), place, off, tones[heard])


def tone_odds(
    crest: np.ndarray,
    weak: np.ndarray,
    g: np.ndarray,
    b: np.ndarray,
    heard: np.ndarray,
    reach: int,
    least: np.ndarray,
) -> np.ndarray:
    """Log-odds of crests of G, relative to all within `reach`; -inf if no more than `least`.

    Parameters
    ----------
    crest, weak : ndarray of int
        Indices of `g`, which is G of each frame: crests above FAINTEST, and all others above
        SWELLING. `reach` is a second.
    b : ndarray
        B of each frame.
    heard : ndarray of bool
        Frames that are no digital silence.
    """
    ln_g, ln_b, ln_median, ln_loud = SLOPES
    low, high = places_about(weak, crest, reach, reach + 1.0)
    swells = PER_CREST * np.minimum(0.5 * (high - low), MOST_CRESTS)
    size = min(2 * reach + 1, len(g))
    first = np.clip(crest - reach, 0, len(g) - size)
    loudest = np.empty(len(crest), np.int64)
    greatest_between(b, np.maximum(first - 2, 0), np.minimum(first + size + 2, len(b)), loudest)
    later = g[np.minimum(crest + round(AFTER * reach), len(g) - 1)] / g[crest]
    with np.errstate(divide="ignore"):
        alone = ln_g * np.log(g[crest]) + ln_b * np.log(greatest_beside(b, crest, 2)) + OFFSET
    loud = ln_loud * np.log(np.maximum(b[loudest], LEAST_LOUD))
    swell = SWELL_SLOPE * np.maximum(later - SWELL, 0.0)
    most = g[crest] - NOISE - swells
    asked = np.minimum(alone - ln_median * np.log(LEAST_MEDIAN) - loud - swell, most) > least
    usual = np.zeros(len(crest))
    usual[asked] = usual_likelihood(g, heard, first[asked], first[asked] + size)
    odds = alone - ln_median * usual - loud - swell
    return np.where(asked, np.minimum(odds, most), -np.inf)


def usual_likelihood(
    g: np.ndarray, heard: np.ndarray, first: np.ndarray, last: np.ndarray
) -> np.ndarray:
    """ln(G_1/2 + 5) from each first to before each last frame.

    With digital silence it is the mean of that and of that of what is `heard`.
    """
    usual = log_median(g, first, last)
    if heard.all():
        return usual
    count = np.append(0, np.cumsum(heard))
    return 0.5 * (usual + log_median(g[heard], count[first], count[last]))


def log_median(g: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """ln(G_1/2 + 5) of G from each first to before each last frame."""
    return np.asarray(np.log(ranked(g, first, last, (last - first) // 2) + LEAST_MEDIAN))


def likeliest_onset(
    crests: Crests,
    audible: float,
    near: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    seconds: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Index of the crest of C at which each low tone begins, -1 if none is audible; its error [s].

    Crests from `first` to before `last` are as likely as they are high, and as a normal
    distribution about `near`; no crest is as likely as one of LEAST_OCTAVES there.
    """
    most, best = np.zeros(len(near)), np.full(len(near), -1)
    beside = []
    for k in range(int((last - first).max(initial=0))):
        at = np.minimum(first + k, len(crests.place) - 1)
        counts = (first + k < last) & (crests.height[at] >= audible)
        place = seconds * crests.place[at]
        away = (place - seconds * near) / SPREAD
        likely = np.where(counts, crests.height[at] * np.exp(-0.5 * away**2), 0.0)
        best = np.where(likely > most, at, best)
        most = np.maximum(likely, most)
        beside.append((likely, place))
    which = np.where(most >= LEAST_OCTAVES * audible, best, -1)
    off, middle = np.full(len(near), SPREAD), seconds * np.append(crests.place, 0)[which]
    squares, total = np.zeros(len(near)), np.zeros(len(near))
    for likely, place in beside:
        squares += likely * (place - middle) ** 2
        total += likely
    clear = which >= 0
    off[clear] = np.sqrt(squares[clear] / total[clear])
    return which, off
