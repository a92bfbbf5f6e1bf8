"""Decision which crests are impacts, and with which probabilities.

C is the rise in octaves, B that in narrow bands, G the likelihood of a rise in one of them
(`sound.py`). With s the standard deviation of C in noise, a = s (1.9 + 9 s) is about the greatest
C of an hour of noise, which is skewed the more the fewer coefficients it has. The rattle r is the
greater of 50 times the 0.75-quantile and 12 times the 0.9-quantile of C within a second, without
digital silence. It is at most 4 a, at most 0.3 C_max + r / 10, C_max the greatest C within a
second, or, if that is more, at most 50 times the excess over 0.75 s of the 80th highest crest of
these two seconds (fewer beside digital silence): dense impacts raise the quantiles as rattling
does, but have fewer crests, and weak knocks have weak tails. The evidence of a crest of C from
octaves is

    min(C / (a + r) + G / 36, C / (0.25 a + r)),

with C limited to its excess over the tails of earlier crests (`_tails.py`), and G only for the
greatest C within 28 ms. It is at most B over the greater of 0.035 and the mean of B around it.
Its evidence from bands is C over the greater of 1.65 and 10 s; or B / 0.33 if that is more, B has a
crest here that is the highest within 25 ms, and C has no greater one nearby. If B has a crest and C
has none, the impact lies at the crest of B.

The probability of an impact is that of the greatest log-odds of three:

    by octaves  6.5 ln e + 1.5 ln n + 3,
    by bands    3 ln e, or 7 ln e if e < 1,
    by others   3.6 ln e + 0.6 ln L + 1.9 ln (m + 1/2) - 1.3 ln (k K / a^2) - 1.1 ln B_max - 7.3,

with B_max the greatest B within a second, at least 0.01. Here n is the number per second of other
crests with an evidence from octaves of 1 to 2, with 10 s of silence added, plus 1/60: without such
crests there are no weaker impacts either, and with many, most weaker crests are impacts as well.

The third expression compares a crest with those around it, for records in which a room or many
impacts cause continuous sound. Its e is the evidence from bands, L is G for the greatest C within
28 ms and 1 for others, m the number per second of other crests above 2 a within a second, and K and
k the height that 40 crests a second exceed within 1 and 0.25 s, at least a / 20 each. These odds
are at most 6.5 times the logarithm of the least of C / (0.35 a), C over a tenth of the greatest
within 40 ms (both C limited to the excess over tails), G / 7 and B over its required value.

Evidence from bands does not count if the rising bands continue to rise, by 0.6 neper or more within
17 ms, and C is less than 2 a: notes of music swell, impacts do not. Many crests in a short time are
pulses of a voice (`_voices.py`).

Dense crests of about the same height have separate odds (`_dense.py`).

If none of these is above 0, a crest of G may be a low tone (`_tones.py`). It replaces all crests
from 12 ms before it until 20 ms after it, and is placed at a crest of C of at least a within 6 ms
of its expected place, if there is one. Finally, rises in one octave change all odds and add
impacts that only they show (`_rise_odds.py`).

The first two were fitted to synthetic sound 6 to 20 dB above noise, those of bands to drums; the
third to synthetic sound and drums, also in rooms and noise, by logistic regression. The record as a
whole corrects them in `calibrated.py`, and `overlapping.py` where impacts are dense.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._kernels import BLOCK, GROUP, Scale
from .._nearby import (
    crowd,
    greatest_near,
    greatest_within,
    heard_share,
    local_mean,
    nearest_group,
    ranked,
    rate_of_others,
    separate_crests,
)
from .._nearby_kernels import greatest_between
from .._survey import SAMPLED, Passage
from ._dense import dense_odds
from ._rise_odds import ALONE as RISES_ALONE
from ._rise_odds import (
    BESIDE_SILENCE,
    RATTLE_SLOPE,
    Own,
    by_octave,
    high_crests,
    one_of_each,
    settled,
)
from ._rise_odds import SPREAD as RISE_SPREAD
from ._tails import beyond_tails
from ._tones import BEFORE, GROWS_ON, SPREAD, SWELLING, tone_odds
from ._voices import pulse_odds

APART = 25e-3  # [s], crests of B
LEAST_BANDS = 0.33  # rise in the mean over narrow bands [neper of power]
SIGMAS, SKEW = 1.9, 9.0  # a = s (SIGMAS + SKEW s), s the standard deviation of C in noise
RATTLE = {0.75: 50.0, 0.9: 12.0}  # times these quantiles of C
RATTLE_WITHIN = 1.0  # [s]
ABOVE, IN_NOISE = 50.0, 0.75  # times what such a crest is above so many s
FEW = 4.0  # times a: rattle without a number of crests, as of a room that rings
TAIL, STEADY = 0.3, 0.1  # of the greatest C nearby and of the rattle: nor more than their sum
CERTAIN = 36.0  # likelihood of a rise in one narrow band that is evidence of 1
BESIDE_BAND = 0.25  # times a: rise in octaves without which that counts little
LEAST_OCTAVES = 0.35  # times a: rise in octaves of what others do not hide
ALONE = 28e-3  # [s] within which C must be greatest for that to count: the extent of G
BORNE_OUT = 0.035  # rise in narrow bands that a rise in octaves needs
AROUND = 0.15, 0.05  # [s] before and after, of the mean of B
CLEAR, CLEAR_SIGMAS = 1.65, 10.0  # rise in octaves that needs none [neper of power], or in s
SOONER, LATER = 12e-3, 20e-3  # [s], of a crest of C beside one of B that it belongs to
OCTAVES_SLOPE, OFTEN_SLOPE, OFFSET = 6.5, 1.5, 3.0  # of the log-odds by octaves
BANDS_SLOPES = 7.0, 3.0  # of those by narrow bands, below and above an evidence of 1
FAINT = 0.3  # evidence of nothing
AMONG = 2.0  # times a: height of crests with which others are compared, and that octaves show
SHORTLY = 0.25  # [s], beside RATTLE_WITHIN, in which CRESTS a second are counted
LEAST_CROWD = 0.05  # times a
LEAST_LOUD = 0.01  # greatest rise in narrow bands nearby [neper of power]
OTHERS_SLOPES = 3.6, 0.6, 1.9, 1.3, 1.1  # of e, L, m, k K and B_max in the log-odds by others
OTHERS_OFFSET = -7.3
LIKELY = 7.0  # likelihood of a rise in one narrow band, less than which is likely to be noise
NEXT, BESIDE_OTHER = 40e-3, 0.1  # [s], and share of the greatest C so near that one must reach
HOPELESS = -4.0  # log-odds that are worked out no further
TINIEST = 1e-9  # C


class Candidates(NamedTuple):
    """Candidate impacts of a passage in order of time."""

    frame: np.ndarray  # of the octaves
    coarse: np.ndarray  # bool: from narrow bands alone, and so only known to some 10 ms
    spread: np.ndarray  # standard deviation of the instant as given by the frame [s]
    odds: np.ndarray  # logarithm of those of an impact
    pulse: np.ndarray  # bool: no impact because it is one of many, as pulses of a voice
    crowded: np.ndarray  # bool: none because many come as densely, though little lies in between
    by_octaves: np.ndarray  # evidence
    narrow: np.ndarray  # bool: likelier by narrow bands or a single octave than by all octaves
    beyond_tails: np.ndarray  # share of C that exceeds the tails of earlier crests

    @property
    def probability(self) -> np.ndarray:
        """Probability that each is an impact."""
        likely: np.ndarray = 1.0 / (1.0 + np.exp(-np.clip(self.odds, -50.0, 50.0)))
        return likely


class Crests(NamedTuple):
    """Crests of the rise in octaves, with their evidence."""

    place: np.ndarray  # frame
    height: np.ndarray  # C
    bands: np.ndarray  # the greatest B nearby
    borne_out: np.ndarray  # this over what a rise in octaves needs
    likelihood: np.ndarray  # the greatest G nearby
    greatest: np.ndarray  # bool: none within ALONE exceeds it
    clear: np.ndarray  # C, but no more than it exceeds the tails of those before it by
    order: np.ndarray  # sorts the heights
    first: np.ndarray  # of those within RATTLE_WITHIN of each
    last: np.ndarray  # and before which they end


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


def candidates(passage: Passage, spread: float, scale: Scale, rate: float) -> Candidates:
    """The crests of a passage with their probabilities.

    Parameters
    ----------
    spread : float
        Standard deviation of C in noise.
    """
    seconds = scale.hop / rate
    b = np.concatenate(passage.bands)
    audible = spread * (SIGMAS + SKEW * spread)
    crests = octave_crests(passage, b, seconds)
    place, height = crests.place, crests.height
    by_octaves = octave_evidence(passage, crests, spread, seconds)
    by_bands = height / max(CLEAR, CLEAR_SIGMAS * spread)
    crest = separate_crests(b, round(APART / (GROUP * seconds)))
    middle = GROUP * crest
    first, last = np.searchsorted(place, (middle - SOONER / seconds, middle + LATER / seconds))
    best = np.empty(len(crest), np.int64)
    greatest_between(height, first, last, best)
    alone = best < 0
    risen = np.zeros(len(place))  # B over what it needs, where it has a crest
    np.maximum.at(risen, best[~alone], b[crest[~alone]] / LEAST_BANDS)
    by_bands = np.maximum(by_bands, risen)
    silent = np.concatenate(passage.silent)
    among = odds_among(crests, by_bands, audible, silent, seconds)
    frame = np.concatenate((place, GROUP * crest[alone]))
    by_octaves = np.concatenate((by_octaves, np.zeros(int(alone.sum()))))
    by_bands = np.concatenate((by_bands, b[crest[alone]] / LEAST_BANDS))
    evident = (by_octaves >= 1.0) & (by_octaves < 2.0)
    often = rate_of_others(evident, len(b) * GROUP * seconds)
    grows = growth_near(passage, b, frame) > GROWS_ON
    grows[: len(place)] &= height < AMONG * audible
    odds = octave_odds(by_octaves, often)
    dense, crowd = dense_odds(place, height, crests.clear, audible, seconds)
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
    return with_rises(found, crests, passage, b, audible, seconds)


def with_tones(
    found: Candidates,
    crests: Crests,
    passage: Passage,
    b: np.ndarray,
    audible: float,
    seconds: float,
) -> Candidates:
    """Add low tones to the candidates where no candidate is as probable.

    A low tone replaces all less likely candidates near it.
    """
    per = GROUP * seconds
    g = np.where(np.concatenate(passage.known), np.concatenate(passage.likelihood), 0.0)
    crest = separate_crests(g, round(APART / per))
    crest = crest[g[crest] > SWELLING]
    growth = growth_near(passage, b, GROUP * crest)
    crest, tones = tone_odds(crest, g, greatest_within(b, 2), growth, round(RATTLE_WITHIN / per))
    frame, odds = found.frame, found.odds.copy()
    middle = GROUP * crest
    first, last = np.searchsorted(frame, (middle - SOONER / seconds, middle + LATER / seconds))
    best = np.empty(len(crest), np.int64)
    greatest_between(odds, first, last, best)
    beside = np.full(len(crest), -np.inf)
    beside[best >= 0] = odds[best[best >= 0]]
    heard = np.flatnonzero((tones > beside) & (beside < 0.0))
    if not len(heard):
        return found
    near = middle[heard] - BEFORE / seconds
    first_near, last_near = np.searchsorted(
        crests.place, (near - 3.0 * SPREAD / seconds, near + 3.0 * SPREAD / seconds)
    )
    onset, off = likeliest_onset(crests, audible, near, first_near, last_near, seconds)
    clear = onset >= 0
    for k in heard:
        odds[first[k] : last[k]] = -np.inf
    place = np.maximum(near, 0).astype(np.int64)
    place[clear] = crests.place[onset[clear]]
    return with_others(found._replace(odds=odds), place, off, tones[heard])


def with_rises(
    found: Candidates,
    crests: Crests,
    passage: Passage,
    b: np.ndarray,
    audible: float,
    seconds: float,
) -> Candidates:
    """Change the log-odds by rises in one octave, and add impacts that only these show."""
    h = np.concatenate(passage.rises)
    silent = np.concatenate(passage.silent)
    known = np.concatenate(passage.known)
    if silent.any():
        known &= ~greatest_within(silent, BESIDE_SILENCE)
    beside = nearest_group(found.frame, len(b))
    bands, crest = greatest_within(b, 2), high_crests(h, seconds)
    vague = bands[beside] >= LEAST_BANDS
    loud = np.append(crests.place[crests.height > audible], -1)
    vague[vague] = loud[np.searchsorted(loud[:-1], found.frame[vague])] != found.frame[vague]
    frame, moved, kept = settled(found.frame, found.odds, vague, h, crest, known, seconds)
    if moved.any():
        spread = np.where(moved, RISE_SPREAD, found.spread)
        found = found._replace(frame=frame, coarse=found.coarse & ~moved, spread=spread)
        order = np.flatnonzero(kept)[np.argsort(frame[kept], kind="stable")]
        found = Candidates(*(column[order] for column in found))
    odds, own = by_octave(found.frame, found.odds, h, crest, bands, known, seconds)
    own = Own(*(column[own.odds > HOPELESS] for column in own))
    if not len(own.frame):
        return found._replace(odds=odds)
    rattle = rattling(np.concatenate(passage.octaves), silent, own.frame, seconds)
    own = own._replace(odds=own.odds - RATTLE_SLOPE * np.log1p(rattle / audible))
    by_all = odds
    odds, own = one_of_each(found.frame, by_all, own, RISES_ALONE / seconds)
    spread = np.full(len(own.frame), RISE_SPREAD)
    found = found._replace(odds=odds, narrow=found.narrow | (odds > by_all))
    return with_others(found, own.frame, spread, own.odds)


def with_others(
    found: Candidates, frame: np.ndarray, spread: np.ndarray, odds: np.ndarray
) -> Candidates:
    """Add candidates, in ascending order, to which rules for pulses and crowds do not apply."""
    at = np.searchsorted(found.frame, frame)
    no, none = np.zeros(len(frame), bool), np.zeros(len(frame))
    new = Candidates(frame, no, spread, odds, no, no, none, ~no, none + 1.0)
    pairs = zip(found, new, strict=True)
    return Candidates(*(np.insert(column, at, values) for column, values in pairs))


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


def growth_near(passage: Passage, b: np.ndarray, at: np.ndarray) -> np.ndarray:
    """How bands go on to rise [neper] where `b` is greatest within two GROUPs of each frame."""
    padded = np.concatenate(([0.0, 0.0], b, [0.0, 0.0]))
    place = nearest_group(at, len(b))
    strongest = place - 2 + np.argmax(padded[place[:, None] + np.arange(5)], axis=1)
    strongest = np.minimum(np.maximum(strongest, 0), len(b) - 1)
    return np.concatenate(passage.growth)[strongest]


def octave_crests(passage: Passage, b: np.ndarray, seconds: float) -> Crests:
    """Crests of C, with the evidence of the rise `b` in narrow bands."""
    per = GROUP * seconds
    place, height = np.concatenate(passage.place), np.concatenate(passage.height)
    beside = nearest_group(place, len(b))
    known = np.concatenate(passage.known)[beside]
    around = local_mean(b, round(AROUND[0] / per), round(AROUND[1] / per))
    needed = np.maximum(BORNE_OUT, around[beside])
    bands = greatest_within(b, 2)[beside]
    likelihood = greatest_within(np.concatenate(passage.likelihood), 2)[beside]
    likelihood[~known] = np.inf
    greatest = height >= greatest_near(place, height, ALONE / seconds)
    borne_out = np.where(known, bands / needed, np.inf)
    clear = np.clip(beyond_tails(passage, place, seconds), 0.0, height)
    order, reach = np.argsort(height), RATTLE_WITHIN / seconds
    first, last = np.searchsorted(place, (place - reach, place + reach))
    return Crests(place, height, bands, borne_out, likelihood, greatest, clear, order, first, last)


def octave_evidence(passage: Passage, crests: Crests, spread: float, seconds: float) -> np.ndarray:
    """Evidence of the rise in octaves for each of its crests."""
    place, height, _, borne_out, likelihood, greatest, clear, order, first, last = crests
    likelihood = np.where(greatest & np.isfinite(likelihood), likelihood, 0.0)
    audible = spread * (SIGMAS + SKEW * spread)
    evidence = np.minimum(clear / audible + likelihood / CERTAIN, borne_out)
    far = evidence < FAINT
    evidence[far] = 0.0
    near = ~far
    silent = np.concatenate(passage.silent)
    rattle = rattling(np.concatenate(passage.octaves), silent, place[near], seconds)
    loudest = greatest_near(place, height, RATTLE_WITHIN / seconds)[near]
    without_crowd = np.minimum(FEW * audible, TAIL * loudest + STEADY * rattle)
    share = heard_share(silent, place[near], RATTLE_WITHIN, seconds)
    reached = crowd(height, first[near], last[near], RATTLE_WITHIN, share, order)
    crowded = ABOVE * (reached - IN_NOISE * spread)
    rattle = np.minimum(rattle, np.maximum(without_crowd, crowded))
    calm = np.minimum(
        clear[near] / (audible + rattle) + likelihood[near] / CERTAIN,
        clear[near] / (BESIDE_BAND * audible + rattle),
    )
    evidence[near] = np.minimum(calm, borne_out[near])
    return evidence


def rattling(rise: np.ndarray, silent: np.ndarray, place: np.ndarray, seconds: float) -> np.ndarray:
    """Level of C that is often exceeded nearby, at frames.

    Digital silence is left out: it says nothing of how the rest rattles.
    """
    per = BLOCK // SAMPLED
    reach = round(RATTLE_WITHIN / (BLOCK * seconds))
    block = place // BLOCK
    new = np.ones(len(place), bool)
    new[1:] = block[1:] != block[:-1]  # places ascend
    blocks, which = block[new], np.cumsum(new) - 1
    first = per * np.maximum(blocks - reach, 0)
    last = np.minimum(per * (blocks + reach + 1), len(rise))
    if silent.any():
        heard = np.append(0, np.cumsum(~silent))
        rise, first, last = rise[~silent], heard[first], heard[last]
    ranks = np.outer(last - first, list(RATTLE)).astype(int)
    each = ranks.shape[1]
    quantiles = ranked(rise, np.repeat(first, each), np.repeat(last, each), ranks.ravel())
    times = np.array(list(RATTLE.values()), rise.dtype)
    return np.asarray(np.max(times * quantiles.reshape(-1, each), axis=1)[which], float)


def odds_among(
    crests: Crests, by_bands: np.ndarray, audible: float, silent: np.ndarray, seconds: float
) -> np.ndarray:
    """Log-odds of crests among all others around them; -inf if far below 0."""
    place, height, bands, borne_out, likelihood, greatest, clear, order, first, last = crests
    bands_slope, likelihood_slope, often_slope, crowd_slope, loud_slope = OTHERS_SLOPES
    with np.errstate(divide="ignore"):
        needed = np.maximum(
            LEAST_OCTAVES * audible, BESIDE_OTHER * greatest_near(place, height, NEXT / seconds)
        )
        most = np.log(np.minimum(np.minimum(borne_out, likelihood / LIKELY), clear / needed))
        odds = bands_slope * np.log(by_bands) + OTHERS_OFFSET
    counted = np.where(greatest & np.isfinite(likelihood), likelihood, 1.0)
    odds += likelihood_slope * np.log(np.maximum(counted, 1.0))
    reach = RATTLE_WITHIN / seconds
    strong = height > AMONG * audible
    index = np.append(0, np.cumsum(strong))
    others = (index[last] - index[first] - strong) / (2.0 * RATTLE_WITHIN)
    odds += often_slope * np.log(others + 0.5)
    odds -= loud_slope * np.log(np.maximum(greatest_near(place, bands, reach), LEAST_LOUD))
    possible = np.minimum(OCTAVES_SLOPE * most, odds - 2.0 * crowd_slope * np.log(LEAST_CROWD))
    asked = possible > HOPELESS
    at, near = place[asked], SHORTLY / seconds
    for within, (begin, end) in (
        (RATTLE_WITHIN, (first[asked], last[asked])),
        (SHORTLY, np.searchsorted(place, (at - near, at + near))),
    ):
        share = heard_share(silent, at, within, seconds)
        reached = crowd(height, begin, end, within, share, order) / audible
        odds[asked] -= crowd_slope * np.log(np.maximum(reached, LEAST_CROWD))
    return np.where(asked, np.minimum(OCTAVES_SLOPE * most, odds), -np.inf)
