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

from typing import NamedTuple

import numpy as np

from .._kernels import BLOCK, GROUP, STEP
from .._nearby import (
    greatest_beside,
    greatest_within,
    nearest_group,
    number_as_high,
    places_about,
    rate_of_others,
    separate_crests,
)
from .._nearby_kernels import greatest_between
from .._survey import Passage
from .candidates import HOPELESS, Candidates, with_others
from .crests import Crests

WITHIN = 8e-3  # [s], of a crest of H, that none exceeds
HERE = 5e-3  # [s], of a crest, that its H is taken from
BESIDE_SILENCE = 5  # GROUPs from a digital silence in which H is not known
EVIDENT, CLEARLY = 1.0, 20.0  # log-odds and H of evident impacts
FEEBLE = 0.33  # B [neper of power] of what is no rise in narrow bands
SWELLS = 12.0  # H, below which a rise may be that of power that swells
SWELLING_SLOPE, RISEN = 1.5, 4.0  # of the log-odds there, and 1 + H of impacts where bands rise
STAYS = -2.0  # log-odds that stay as they are
ALONE = 10e-3  # [s] from any likelier crest, of a crest of H that is an impact of its own
OWN_ODDS = 0.31, -0.81, -2.43, 1.51, 0.7  # of ln(1 + H), n, ln B_max, ln r, and offset
RATTLE_SLOPE = 1.0  # of ln(1 + R / a), taken from those
CROWD, AS_HIGH = 50e-3, 0.4  # [s], and share of the height
NOISE, NOISE_SCALE = 16.0, 3.0  # H that noise rarely exceeds
TAIL, TAIL_SHARE, TAIL_SLOPE = (100e-3, 6e-3), 0.3, 3.0  # [s], before a crest
LOUD_WITHIN = 1.0  # [s]
SPREAD = 2e-3  # [s], of the impact about a crest of H
HEARD_FAR, AT_ONCE, HIGHER = 17e-3, 4e-3, 4.0  # [s], [s], and times as high: a crest to move to


class Own(NamedTuple):
    """Crests of H that are separate candidates."""

    frame: np.ndarray
    odds: np.ndarray


def with_rises(
    found: Candidates,
    crests: Crests,
    passage: Passage,
    b: np.ndarray,
    rattle: np.ndarray,
    audible: float,
    clear: float,
    seconds: float,
) -> Candidates:
    """Change the log-odds by rises in one octave, and add impacts that only these show.

    `rattle` is R / a of each BLOCK; `clear` is the C of a rise that needs no other evidence.
    """
    h, known = passage.rises, passage.known
    if passage.silent.any():
        known = known & ~greatest_within(passage.silent, BESIDE_SILENCE)
    beside = nearest_group(found.frame, len(b))
    bands, crest = greatest_within(b, 2), high_crests(h, seconds)
    vague = (bands[beside] >= FEEBLE) & ~at_crests(found.frame, crests, audible)
    frame, moved, kept = settled(found.frame, found.odds, vague, h, crest, known, seconds)
    if moved.any():
        spread = np.where(moved, SPREAD, found.spread)
        found = found._replace(frame=frame, coarse=found.coarse & ~moved, spread=spread)
        order = np.flatnonzero(kept)[np.argsort(frame[kept], kind="stable")]
        found = Candidates(*(column[order] for column in found))
    abrupt = at_crests(found.frame, crests, clear)
    odds, own = by_octave(found.frame, found.odds, abrupt, h, crest, bands, known, seconds)
    own = Own(*(column[own.odds > HOPELESS] for column in own))
    if not len(own.frame):
        return found._replace(odds=odds)
    own = own._replace(odds=own.odds - RATTLE_SLOPE * np.log1p(rattle[own.frame // BLOCK]))
    by_all = odds
    odds, own = one_of_each(found.frame, by_all, own, ALONE / seconds)
    spread = np.full(len(own.frame), SPREAD)
    found = found._replace(odds=odds, narrow=found.narrow | (odds > by_all))
    return with_others(found, own.frame, spread, own.odds)


def at_crests(frame: np.ndarray, crests: Crests, height: float) -> np.ndarray:
    """Whether each frame is that of a crest of C above this height."""
    high = np.append(crests.place[crests.height > height], -1)
    return np.asarray(high[np.searchsorted(high[:-1], frame)] == frame)


def settled(
    frame: np.ndarray,
    odds: np.ndarray,
    vague: np.ndarray,
    h: np.ndarray,
    crest: np.ndarray,
    known: np.ndarray,
    seconds: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frames of crests, the `vague` ones at crests of H that are theirs; which are moved, and kept.

    The parameters are those of `by_octave`.
    """
    per = STEP * seconds
    crest = crest[h[crest] > NOISE]
    group = nearest_group(frame, len(known))
    which = np.flatnonzero(vague & (odds > 0.0) & known[group])
    at = frame[which] / STEP
    first, last = places_about(crest, at, HEARD_FAR / per, HEARD_FAR / per)
    best = np.empty(len(which), np.int64)
    greatest_between(h[crest], first, last, best)
    here = greatest_beside(h, frame[which] // STEP, round(AT_ONCE / per))
    there = np.append(crest, 0)[best]
    far = (best >= 0) & (h[there] > HIGHER * here)
    out, moved = frame.copy(), np.zeros(len(frame), bool)
    out[which[far]], moved[which[far]] = STEP * there[far], True
    kept = np.ones(len(frame), bool)
    for k in which[far]:
        beside = np.abs(out - out[k]) <= WITHIN / seconds
        beside[k] = False
        if (kept & beside & (odds >= odds[k])).any():
            if abs(out[k] - frame[k]) > ALONE / seconds:
                kept[k] = False
            else:  # it may be another impact
                out[k], moved[k] = frame[k], False
    return out, moved, kept


def high_crests(h: np.ndarray, seconds: float) -> np.ndarray:
    """Indices of H that none within WITHIN exceeds, as high as counts; the first of equal ones."""
    return separate_crests(h, round(WITHIN / (STEP * seconds)), AS_HIGH * NOISE)


def by_octave(
    frame: np.ndarray,
    odds: np.ndarray,
    abrupt: np.ndarray,
    h: np.ndarray,
    crest: np.ndarray,
    bands: np.ndarray,
    known: np.ndarray,
    seconds: float,
) -> tuple[np.ndarray, Own]:
    """Log-odds of crests, and crests of H beside them.

    Parameters
    ----------
    frame, odds : ndarray
        Frames of `seconds` each at which crests lie, in order, and their log-odds so far.
    abrupt : ndarray
        Whether C is clear by itself there, so that a low H tells nothing.
    h : ndarray
        H of every STEP-th frame.
    crest : ndarray
        Indices of its crests, by `high_crests`.
    bands, known : ndarray
        The greatest B beside every GROUP-th frame, and whether it and H are known there.
    """
    per, group = STEP * seconds, GROUP * seconds
    beside = nearest_group(frame, len(bands))
    here = greatest_beside(h, frame // STEP, round(HERE / per))
    duration = len(bands) * group
    told = known[beside]
    evident = (odds > EVIDENT) & ((here > CLEARLY) | ~told)
    turned = turned_odds(odds, here, bands[beside], rate_of_others(evident, duration))
    out = np.where(told & (odds > STAYS) & ~abrupt, turned, odds)
    place = STEP * crest
    at = nearest_group(place, len(bands))
    likely = frame[odds > 0.0]
    low, high = places_about(likely, place, ALONE / seconds, ALONE / seconds)
    which = np.flatnonzero((h[crest] > NOISE) & (low == high) & known[at])
    crest_h = h[crest]
    number = number_as_high(crest, crest_h, which, CROWD / per, AS_HIGH) + 1
    before = greatest_before(h, crest[which], round(TAIL[0] / per), round(TAIL[1] / per))
    crest_h = crest_h[which]
    loud = greatest_beside(bands, at[which], round(LOUD_WITHIN / group))
    often = rate_of_others(np.append(evident, False), duration)[-1]
    of_h, of_number, of_loud, of_often, offset = OWN_ODDS
    own = of_h * np.log1p(crest_h) + of_number * number + of_often * np.log(often) + offset
    own += of_loud * np.log(np.maximum(loud, FEEBLE))
    own = np.minimum(own, (crest_h - NOISE) / NOISE_SCALE)
    with np.errstate(divide="ignore"):
        own = np.minimum(own, TAIL_SLOPE * np.log(crest_h / (TAIL_SHARE * before)))
    return out, Own(place[which], own)


def one_of_each(
    frame: np.ndarray, odds: np.ndarray, own: Own, reach: float
) -> tuple[np.ndarray, Own]:
    """The odds of crests, raised to those of crests of H within `reach`, and the others of H."""
    first, last = places_about(frame, own.frame, reach, reach)
    best = np.empty(len(own.frame), np.int64)
    greatest_between(odds, first, last, best)
    alone = best < 0
    alone[~alone] = odds[best[~alone]] <= STAYS
    odds = odds.copy()
    np.maximum.at(odds, best[~alone], own.odds[~alone])
    return odds, Own(own.frame[alone], own.odds[alone])


def turned_odds(
    odds: np.ndarray, h: np.ndarray, bands: np.ndarray, often: np.ndarray
) -> np.ndarray:
    """Log-odds of crests of that H and B."""
    less = np.log1p(h) + np.minimum(np.log(often), 0.0)
    less -= np.where(bands >= FEEBLE, np.log(RISEN), 0.0)
    return np.where(h < SWELLS, odds + SWELLING_SLOPE * np.minimum(less, 0.0), odds)


def greatest_before(values: np.ndarray, at: np.ndarray, first: int, last: int) -> np.ndarray:
    """The greatest value from `first` to `last` before each place; 0 if there is none."""
    padded = np.concatenate((np.zeros(first), values))
    reach = np.arange(first - last + 1)
    return padded[at[:, None] + reach].max(axis=1)
