"""Log-odds of impacts by H, the likelihood of a rise in one octave (`_rises.py`).

With H the greatest within 5 ms and r how often evident impacts come (log-odds above 1 and H above
20; as in `decision.py`), the log-odds x of a crest where H is below 12 become

    min(x, x + 1.5 ln((1 + H) min(r, 1) / c)),

c = 4 where narrow bands rise by 0.33 and more, else 1: swelling power rises in narrow bands, and by
more than noise in octaves, but in no single octave abruptly. Where C is clear by itself
(`decision.py`), x stays: a sound that rings on for 0.1 s and more is itself the median that H
compares it with, and power that swells does not rise by as much within 4 ms.

A crest of H of 16 and more that none within 8 ms exceeds and no likely crest within 10 ms explains
is an impact with log-odds of

    0.31 ln(1 + H) - 0.81 n - 2.43 ln(max(B_max, 0.33)) + 1.51 ln r + 0.7,

but no more than (H - 16) / 3, which noise keeps below 0 for hours, nor than 3 ln(H / (0.3 H')):
sound of few modes swells and fades in its tail. ln(1 + R / a) is subtracted, since in a reverberant
room single octaves sometimes rise. n is the number of crests of H within 50 ms that are at least
0.4 times this one, including itself, B_max the greatest B within a second, H' the greatest H from
100 to 6 ms before, R the rattle (`_octave_evidence.py`) and a the greatest C of noise
(`crests.py`). The likeliest crest within 10 ms takes these odds, if there is one.

Narrow bands extend over 23 ms, so an impact detected by them is placed at any nearby crest of C. If
it is likely, C does not exceed noise there, and another crest of H within 17 ms is four times as
high as any within 4 ms, the impact is moved to that crest; of two that coincide then, the likelier
is kept.

Nothing is changed beside digital silence, where H is unknown. Fitted by logistic regression to
records of `benchmarks.varied_sound`, seeds 23000 to 23023, `recordings.microphone` at 6 to 20 dB,
rooms, drums and sound without impacts.
"""

from __future__ import annotations

import numpy as np

from .._kernels import STEP
from .._nearby import greatest_within, places_about, separate_crests
from .._nearby_kernels import greatest_between
from .._survey import Passage
from ._rise_odds_kernels import ALONE, AS_HIGH, NOISE, STAYS, find_higher, judge_rises
from .candidates import Candidates, with_others
from .crests import Crests

WITHIN = 8e-3  # [s], of a crest of H, that none exceeds
BESIDE_SILENCE = 5  # GROUPs from a digital silence in which H is not known
SPREAD = 2e-3  # [s], of the impact about a crest of H


def with_rises(
    found: Candidates,
    crests: Crests,
    passage: Passage,
    rattle: np.ndarray,
    audible: float,
    clear: float,
    seconds: float,
) -> Candidates:
    """Change the log-odds by rises in one octave, and add impacts that only these show.

    `rattle` is R / a of each BLOCK; `clear` is the C of a rise that needs no other evidence.
    """
    h, b, known = passage.rises, passage.bands, passage.known
    if passage.silent.any():
        known = known & ~greatest_within(passage.silent, BESIDE_SILENCE)
    at_c, crest = (crests.place, crests.height), high_crests(h, seconds)
    there = np.empty(len(found.frame), np.int64)
    if find_higher(found.frame, found.odds, *at_c, audible, h, crest, b, known, seconds, there):
        frame, moved, kept = settled(found.frame, found.odds, there, seconds)
        spread = np.where(moved, SPREAD, found.spread)
        found = found._replace(frame=frame, coarse=found.coarse & ~moved, spread=spread)
        order = np.flatnonzero(kept)[np.argsort(frame[kept], kind="stable")]
        found = Candidates(*(column[order] for column in found))
    by_all, place, own = np.empty(len(found.frame)), np.empty_like(crest), np.empty(len(crest))
    number = judge_rises(
        found.frame, found.odds, *at_c, clear, h, crest, b, known, rattle, seconds,
        by_all, place, own,
    )  # fmt: skip
    if not number:
        return found._replace(odds=by_all)
    odds, alone = one_of_each(found.frame, by_all, place[:number], own[:number], ALONE / seconds)
    found = found._replace(odds=odds, narrow=found.narrow | (odds > by_all))
    place, own = place[:number][alone], own[:number][alone]
    return with_others(found, place, np.full(len(place), SPREAD), own)


def high_crests(h: np.ndarray, seconds: float) -> np.ndarray:
    """Indices of H that none within WITHIN exceeds, as high as counts; the first of equal ones."""
    return separate_crests(h, round(WITHIN / (STEP * seconds)), AS_HIGH * NOISE)


def settled(
    frame: np.ndarray, odds: np.ndarray, there: np.ndarray, seconds: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frames of candidates, some at crests of H that are theirs; which are moved, and kept.

    `there` are the frames of these, as of `find_higher`.
    """
    moved, kept = there >= 0, np.ones(len(frame), bool)
    out = np.where(moved, there, frame)
    for k in np.flatnonzero(moved):
        beside = np.abs(out - out[k]) <= WITHIN / seconds
        beside[k] = False
        if (kept & beside & (odds >= odds[k])).any():
            if abs(out[k] - frame[k]) > ALONE / seconds:
                kept[k] = False
            else:  # it may be another impact
                out[k], moved[k] = frame[k], False
    return out, moved, kept


def one_of_each(
    frame: np.ndarray, odds: np.ndarray, place: np.ndarray, own: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """The odds of candidates, raised to those of crests of H within `reach`; which are alone."""
    first, last = places_about(frame, place, reach, reach)
    best = np.empty(len(place), np.int64)
    greatest_between(odds, first, last, best)
    alone = best < 0
    alone[~alone] = odds[best[~alone]] <= STAYS
    odds = odds.copy()
    np.maximum.at(odds, best[~alone], own[~alone])
    return odds, alone
