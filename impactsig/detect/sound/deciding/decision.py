"""Decision which crests are impacts, and with which probabilities.

C is the rise in octaves, B that in narrow bands, G the likelihood of a rise in one of them
(`sound.py`); s and a describe C in noise (`crests.py`). A crest of C has an evidence from octaves
(`_octave_evidence.py`). Its evidence from bands is C over the greater of 1.65 and 10 s; or B / 0.33
if that is more, B has a crest here that is the highest within 25 ms, and C has no greater one
nearby. If B has a crest and C has none, the impact lies at the crest of B.

The probability of an impact is that of the greatest log-odds of four:

    by octaves  6.5 ln e + 1.5 ln n + 3,
    by bands    3 ln e, or 7 ln e if e < 1,
    by others   those of `_among_kernels.py`,
    dense       those of `_dense_kernels.py`, for dense crests of about the same height.

Here n is the number per second of other crests with an evidence from octaves of 1 to 2, with 10 s
of silence added, plus 1/60: without such crests there are no weaker impacts either, and with many,
most weaker crests are impacts as well.

Evidence from bands does not count if the rising bands continue to rise, by 0.6 neper or more within
17 ms, and C is less than 2 a: notes of music swell, impacts do not. Many crests in a short time are
pulses of a voice (`_voice_kernels.py`). If none of these odds is above 0, a crest of G may be a low
tone (`_tones.py`). Finally, rises in one octave change all odds and add impacts that only they show
(`_rise_odds.py`).

The first two were fitted to synthetic sound 6 to 20 dB above noise, those of bands to drums. The
record as a whole corrects all of them in `calibrated.py`, and `overlapping.py` where impacts are
dense.
"""

from __future__ import annotations

import numpy as np

from .._kernels import GROUP, Scale
from .._survey import Passage
from ._among_kernels import put_odds_among
from ._dense_kernels import put_dense_odds
from ._judging_kernels import judge, put_band_evidence
from ._octave_evidence import octave_evidence, rattling
from ._rise_odds import with_rises
from ._tones import with_tones
from .candidates import Candidates
from .crest_kernels import LATER, SOONER
from .crests import audible_rise, octave_crests

APART = 25e-3  # [s], crests of B
LEAST_BANDS = 0.33  # rise in the mean over narrow bands [neper of power]
CLEAR, CLEAR_SIGMAS = 1.65, 10.0  # rise in octaves that needs none [neper of power], or in s
OFFSET, OTHERS_OFFSET = 3.0, -7.3  # of the log-odds by octaves, and by other crests


def candidates(passage: Passage, spread: float, scale: Scale, rate: float) -> Candidates:
    """The crests of a passage with their probabilities.

    Parameters
    ----------
    spread : float
        Standard deviation of C in noise.
    """
    seconds = scale.hop / rate
    b, audible = passage.bands, audible_rise(spread)
    crests = octave_crests(passage, seconds)
    place, height, count = crests.place, crests.height, len(crests.place)
    rattle = rattling(passage.octaves, passage.silent, seconds)
    by_octaves = octave_evidence(crests, rattle, spread, audible, seconds)
    clear = max(CLEAR, CLEAR_SIGMAS * spread)
    reach = round(APART / (GROUP * seconds))
    by_bands, risen = np.empty(count), np.empty(count)
    frame, crest = np.empty((2, count + len(b) // (reach + 1) + 1), np.int64)
    total = put_band_evidence(
        place, height, b, reach, (SOONER / seconds, LATER / seconds), clear, LEAST_BANDS,
        by_bands, risen, frame, crest,
    )  # fmt: skip
    frame, crest = frame[:total], crest[:total]
    among, dense, crowd = np.empty(count), np.empty(count), np.empty(count, np.bool_)
    put_odds_among(*crests, by_bands, audible, OTHERS_OFFSET, seconds, among)
    put_dense_odds(place, height, crests.loudest, crests.clear, audible, seconds, dense, crowd)
    numbers, flags = np.empty((4, total)), np.empty((4, total), np.bool_)
    judge(
        frame, crest, place, height, crests.bands, crests.clear, crests.silence, by_octaves,
        by_bands, risen, among, dense, crowd, b, passage.growth, audible, OFFSET, LEAST_BANDS,
        seconds, numbers, flags,
    )  # fmt: skip
    odds, evidence, share, exact = numbers
    coarse, pulse, crowded, narrow = flags
    found = Candidates(frame, coarse, exact, odds, pulse, crowded, evidence, narrow, share)
    found = with_tones(found, crests, passage, audible, seconds)
    return with_rises(found, crests, passage, rattle / audible, audible, clear, seconds)
