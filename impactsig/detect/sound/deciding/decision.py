"""Decision which crests are impacts, and with which probabilities.

C is the rise in octaves, B that in narrow bands, G the likelihood of a rise in one of them
(`sound.py`); s and a describe C in noise (`crests.py`). A crest of C has an evidence from octaves
(`_octave_evidence.py`). Its evidence from bands is C over the greater of 1.65 and 10 s; or B / 0.33
if that is more, B has a crest here that is the highest within 25 ms, and C has no greater one
nearby. If B has a crest and C has none, the impact lies at the crest of B.

The probability of an impact is that of the greatest log-odds of four:

    by octaves  6.5 ln e + 1.5 ln n + 3,
    by bands    3 ln e, or 7 ln e if e < 1,
    by others   those of `_among.py`,
    dense       those of `_dense.py`, for dense crests of about the same height.

Here n is the number per second of other crests with an evidence from octaves of 1 to 2, with 10 s
of silence added, plus 1/60: without such crests there are no weaker impacts either, and with many,
most weaker crests are impacts as well.

Evidence from bands does not count if the rising bands continue to rise, by 0.6 neper or more within
17 ms, and C is less than 2 a: notes of music swell, impacts do not. Many crests in a short time are
pulses of a voice (`_voices.py`). If none of these odds is above 0, a crest of G may be a low tone
(`_tones.py`). Finally, rises in one octave change all odds and add impacts that only they show
(`_rise_odds.py`).

The first two were fitted to synthetic sound 6 to 20 dB above noise, those of bands to drums. The
record as a whole corrects all of them in `calibrated.py`, and `overlapping.py` where impacts are
dense.
"""

from __future__ import annotations

import numpy as np

from .._kernels import GROUP, Scale
from .._nearby import places_about, rate_of_others, separate_crests
from .._nearby_kernels import greatest_between
from .._survey import Passage
from ._among import AMONG, odds_among
from ._dense import dense_odds
from ._octave_evidence import octave_evidence, rattling
from ._rise_odds import with_rises
from ._tones import GROWS_ON, growth_near, with_tones
from ._voices import pulse_odds
from .candidates import HOPELESS, Candidates
from .crests import LATER, SOONER, audible_rise, octave_crests

APART = 25e-3  # [s], crests of B
LEAST_BANDS = 0.33  # rise in the mean over narrow bands [neper of power]
CLEAR, CLEAR_SIGMAS = 1.65, 10.0  # rise in octaves that needs none [neper of power], or in s
OCTAVES_SLOPE, OFTEN_SLOPE, OFFSET = 6.5, 1.5, 3.0  # of the log-odds by octaves
BANDS_SLOPES = 7.0, 3.0  # of those by narrow bands, below and above an evidence of 1
TINIEST = 1e-9  # C


def candidates(passage: Passage, spread: float, scale: Scale, rate: float) -> Candidates:
    """The crests of a passage with their probabilities.

    Parameters
    ----------
    spread : float
        Standard deviation of C in noise.
    """
    seconds = scale.hop / rate
    b = passage.bands
    audible = audible_rise(spread)
    crests = octave_crests(passage, b, seconds)
    place, height = crests.place, crests.height
    rattle, silent = rattling(passage, seconds), passage.silent
    by_octaves = octave_evidence(crests, rattle, silent, spread, seconds)
    clear = max(CLEAR, CLEAR_SIGMAS * spread)
    by_bands = height / clear
    crest = separate_crests(b, round(APART / (GROUP * seconds)))
    middle = GROUP * crest
    first, last = places_about(place, middle, SOONER / seconds, LATER / seconds)
    best = np.empty(len(crest), np.int64)
    greatest_between(height, first, last, best)
    alone = best < 0
    risen = np.zeros(len(place))  # B over what it needs, where it has a crest
    np.maximum.at(risen, best[~alone], b[crest[~alone]] / LEAST_BANDS)
    by_bands = np.maximum(by_bands, risen)
    among = odds_among(crests, by_bands, audible, silent, seconds)
    frame = np.concatenate((place, GROUP * crest[alone]))
    by_octaves = np.concatenate((by_octaves, np.zeros(int(alone.sum()))))
    by_bands = np.concatenate((by_bands, b[crest[alone]] / LEAST_BANDS))
    evident = (by_octaves >= 1.0) & (by_octaves < 2.0)
    often = rate_of_others(evident, len(b) * GROUP * seconds)
    grows = growth_near(passage, b, frame) > GROWS_ON
    grows[: len(place)] &= height < AMONG * audible
    odds = octave_odds(by_octaves, often)
    dense, crowd = dense_odds(crests, audible, seconds)
    odds[: len(place)] = np.maximum(odds[: len(place)], np.maximum(among, dense))
    bands = band_odds(np.where(grows, 0.0, by_bands))
    narrow, odds = bands > odds, np.maximum(bands, odds)
    likely = odds > 0.0
    pulses = (risen < 1.0) & (odds[: len(place)] > HOPELESS)
    around = np.minimum(crests.bands, LEAST_BANDS)
    odds[: len(place)] = pulse_odds(
        odds[: len(place)], pulses, place, height, around, silent, seconds
    )
    coarse = np.arange(len(frame)) >= len(place)
    order = np.argsort(frame, kind="stable")
    pulse = likely & (odds <= 0.0)
    crowded = np.append(crowd, np.zeros(len(frame) - len(place), bool)) & ~likely
    share = np.ones(len(frame))
    share[: len(place)] = crests.clear / np.maximum(height, TINIEST)
    exact = np.zeros(len(frame))
    columns = (frame, coarse, exact, odds, pulse, crowded, by_octaves, narrow, share)
    found = Candidates(*(column[order] for column in columns))
    found = with_tones(found, crests, passage, b, audible, seconds)
    return with_rises(found, crests, passage, b, rattle / audible, audible, clear, seconds)


def octave_odds(by_octaves: np.ndarray, often: np.ndarray) -> np.ndarray:
    """Log-odds of crests with this evidence from octaves, given the rate of evident impacts."""
    with np.errstate(divide="ignore"):
        odds: np.ndarray = OCTAVES_SLOPE * np.log(by_octaves) + OFTEN_SLOPE * np.log(often) + OFFSET
    return odds


def band_odds(by_bands: np.ndarray) -> np.ndarray:
    """Log-odds of crests with this evidence from narrow bands."""
    with np.errstate(divide="ignore"):
        bands = np.log(by_bands)
    return np.asarray(np.where(bands < 0.0, BANDS_SLOPES[0], BANDS_SLOPES[1]) * bands)
