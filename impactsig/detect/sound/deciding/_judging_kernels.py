"""Kernels for `decision.py`: evidence by narrow bands, and the odds by all evidence."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._kernels import GROUP
from .._nearby_kernels import (
    crests_apart,
    ends_about,
    greatest_between,
    nearest,
    strongest_beside,
)
from ._among_kernels import AMONG
from ._voice_kernels import lower_pulses
from .candidates import HOPELESS
from .crest_kernels import rate_of_others

EVIDENT = 1.0, 2.0  # evidence from octaves, of impacts that tell how often they come
OCTAVES_SLOPE, OFTEN_SLOPE = 6.5, 1.5  # of the log-odds by octaves
BANDS_SLOPES = 7.0, 3.0  # of those by narrow bands, below and above an evidence of 1
GROWS_ON = 0.6  # [neper], more than bands of an impact go on to rise by
TINIEST = 1e-9  # C


@allocating
def put_band_evidence(place, height, b, apart, beside, clear, least, by_bands, risen, frame, crest):
    """Evidence of crests of C by narrow bands, and the frames of all candidates.

    Parameters
    ----------
    place, height : (n,) frames of crests, and C there
    b, apart : B, and the GROUPs within which its crests are highest
    beside : frames before and after a crest of B in which a crest of C belongs to it
    clear, least : C that needs no evidence of bands, and B that needs none of octaves
    by_bands : (n,) room for the evidence of crests
    risen : (n,) room for B over what it needs, where it has a crest
    frame : (n + number of crests of B,) room for the frames of crests, and of those of B alone
    crest : room for the crest of each; -1 of B alone

    Returns
    -------
    int
        Number of candidates.
    """
    middle = np.empty(len(b) // (apart + 1) + 1, np.int64)
    middle = middle[: crests_apart(b, apart, 0.0, middle)]
    middle *= GROUP
    first, last = np.empty(len(middle), np.int64), np.empty(len(middle), np.int64)
    best = np.empty(len(middle), np.int64)
    ends_about(place, middle, beside[0], beside[1], first, last)
    greatest_between(height, first, last, best)
    risen[:] = 0.0
    for i in range(len(middle)):
        if best[i] >= 0:
            risen[best[i]] = max(risen[best[i]], b[middle[i] // GROUP] / least)
    total, i = 0, 0
    for k in range(len(place) + 1):
        while i < len(middle) and (k == len(place) or middle[i] < place[k]):
            if best[i] < 0:
                frame[total], crest[total] = middle[i], -1
                total += 1
            i += 1
        if k < len(place):
            by_bands[k] = max(height[k] / clear, risen[k])
            frame[total], crest[total] = place[k], k
            total += 1
    return total


@kernel
def growth_near(b, growth, frame, out):
    """How bands go on to rise [neper] where B is greatest within two GROUPs of each frame."""
    for k in range(len(frame)):
        out[k] = growth[strongest_beside(b, nearest(frame[k], len(b)), 2)]


@allocating
def judge(
    frame, crest, place, height, bands, clear, silence, by_octaves, by_bands, risen, among, dense,
    crowd, b, growth, audible, offset, least, seconds, numbers, flags,
):  # fmt: skip
    """Log-odds of candidates by all evidence.

    Parameters
    ----------
    frame, crest : (m,) by `put_band_evidence`
    place, height, bands, clear, silence : of `Crests`, of which there are n
    by_octaves, by_bands, risen, among, dense, crowd : (n,) their evidence
    b, growth : B, and how bands go on to rise
    audible, offset, least : a, offset of the odds by octaves, and B that an impact needs
    numbers : (4, m) room for log-odds, evidence from octaves, share beyond tails, and 0
    flags : (4, m) bool, room for `coarse`, `pulse`, `crowded` and `narrow` of `Candidates`
    """
    count, total = len(place), len(frame)
    odds, evidence, share, spread = numbers[0], numbers[1], numbers[2], numbers[3]
    coarse, pulse, crowded, narrow = flags[0], flags[1], flags[2], flags[3]
    duration, evident = len(b) * GROUP * seconds, 0
    for k in range(count):
        evident += EVIDENT[0] <= by_octaves[k] < EVIDENT[1]
    own, around, grown = np.empty(count), np.empty(count), np.empty(total)
    asked = np.empty(count, np.bool_)
    growth_near(b, growth, frame, grown)
    for i in range(total):
        k = crest[i]
        coarse[i], evidence[i], steep, share[i], spread[i] = k < 0, 0.0, 0.0, 1.0, 0.0
        grows = grown[i] > GROWS_ON
        if k < 0:
            steep = b[frame[i] // GROUP] / least
        else:
            evidence[i], steep = by_octaves[k], by_bands[k]
            share[i] = clear[k] / max(height[k], TINIEST)
            grows = grows and height[k] < AMONG * audible
        is_evident = EVIDENT[0] <= evidence[i] < EVIDENT[1]
        often = rate_of_others(evident - is_evident, duration)
        odds[i] = OCTAVES_SLOPE * np.log(evidence[i]) + OFTEN_SLOPE * np.log(often) + offset
        if k >= 0:
            odds[i] = max(odds[i], max(among[k], dense[k]))
        by_band = -np.inf if grows else np.log(steep)
        by_band *= BANDS_SLOPES[0] if by_band < 0.0 else BANDS_SLOPES[1]
        narrow[i] = by_band > odds[i]
        odds[i] = max(odds[i], by_band)
        if k >= 0:
            own[k], around[k] = odds[i], min(bands[k], least)
            asked[k] = risen[k] < 1.0 and own[k] > HOPELESS
    lower_pulses(own, asked, place, height, around, len(b), silence, seconds)
    for i in range(total):
        k, likely = crest[i], odds[i] > 0.0
        if k >= 0:
            odds[i] = own[k]
        pulse[i] = likely and odds[i] <= 0.0
        crowded[i] = k >= 0 and not likely and crowd[k]
