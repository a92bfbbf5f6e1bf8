"""Kernels for `_rise_odds.py`: candidates and crests of H beside each other."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._kernels import BLOCK, GROUP, STEP
from .._nearby_kernels import ends_about, greatest_beside, nearest, number_as_high
from .candidates import HOPELESS
from .crest_kernels import rate_of_others

HERE = 5e-3  # [s], of a crest, that its H is taken from
EVIDENT, CLEARLY = 1.0, 20.0  # log-odds and H of evident impacts
FEEBLE = 0.33  # B [neper of power] of what is no rise in narrow bands
SWELLS = 12.0  # H, below which a rise may be that of power that swells
SWELLING_SLOPE, RISEN = 1.5, 4.0  # of the log-odds there, and 1 + H of impacts where bands rise
STAYS = -2.0  # log-odds that stay as they are
ALONE = 10e-3  # [s] from any likelier crest, of a crest of H that is a separate impact
OWN_ODDS = 0.31, -0.81, -2.43, 1.51, 0.7  # of ln(1 + H), n, ln B_max, ln r, and offset
RATTLE_SLOPE = 1.0  # of ln(1 + R / a), taken from those
CROWD, AS_HIGH = 50e-3, 0.4  # [s], and share of the height
NOISE, NOISE_SCALE = 16.0, 3.0  # H that noise rarely exceeds
TAIL, TAIL_SHARE, TAIL_SLOPE = (100e-3, 6e-3), 0.3, 3.0  # [s], before a crest
LOUD_WITHIN = 1.0  # [s]
HEARD_FAR, AT_ONCE, HIGHER = 17e-3, 4e-3, 4.0  # [s], [s], and times as high: a crest to move to


@kernel
def find_higher(frame, odds, place, height, audible, h, crest, b, known, seconds, there):
    """Crests of H that impacts in narrow bands are those of.

    Parameters
    ----------
    frame, odds : (n,) candidates in the order of time, in frames of so many `seconds`
    place, height, audible : crests of C, and how high those are that an impact stays at
    h, crest : H of every STEP-th frame, and its `high_crests`
    b, known : B of every GROUP of frames, and whether it and H are known there
    there : (n,) room for the frame of a crest of H that a likely candidate belongs to; else -1

    Returns
    -------
    bool
        Whether there is any.
    """
    any_higher, c, near, beyond = False, 0, 0, 0
    far, here = HEARD_FAR / (STEP * seconds), round(AT_ONCE / (STEP * seconds))
    for k in range(len(frame)):
        there[k] = -1
        while c < len(place) and place[c] < frame[k]:
            c += 1
        at_crest = c < len(place) and place[c] == frame[k] and height[c] > audible
        group = nearest(frame[k], len(b))
        if at_crest or odds[k] <= 0.0 or not known[group]:
            continue
        if greatest_beside(b, group, 2) < FEEBLE:
            continue
        at = frame[k] / STEP
        while near < len(crest) and crest[near] < at - far:
            near += 1
        best, beyond = -1, near
        while beyond < len(crest) and crest[beyond] < at + far:
            if h[crest[beyond]] > NOISE and (best < 0 or h[crest[beyond]] > h[best]):
                best = crest[beyond]
            beyond += 1
        if best >= 0 and h[best] > HIGHER * greatest_beside(h, frame[k] // STEP, here):
            there[k] = STEP * best
            any_higher = True
    return any_higher


@allocating
def judge_rises(
    frame, odds, place, height, clear, h, crest, b, known, rattle, seconds, out, own_frame, own_odds
):
    """Log-odds of candidates by H, and crests of H beside them.

    Parameters
    ----------
    clear : C that is clear by itself, so that a low H tells nothing
    rattle : R / a of each BLOCK
    out : (n,) room for the log-odds of the candidates
    own_frame, own_odds : room for the frames of crests of H, as many as of `crest`, and their
        log-odds
    frame, odds, place, height, h, crest, b, known, seconds : as of `find_higher`

    Returns
    -------
    int
        Number of crests of H that may be impacts of their own.
    """
    per, groups, c = STEP * seconds, len(b), 0
    duration, evident = groups * GROUP * seconds, 0
    here, likely = np.empty(len(frame)), np.empty(len(frame), np.int64)
    group, number = np.empty(len(frame), np.int64), 0
    for k in range(len(frame)):
        group[k] = nearest(frame[k], groups)
        here[k] = greatest_beside(h, frame[k] // STEP, round(HERE / per))
        evident += odds[k] > EVIDENT and (here[k] > CLEARLY or not known[group[k]])
        if odds[k] > 0.0:
            likely[number] = frame[k]
            number += 1
    for k in range(len(frame)):
        out[k], has_evidence = odds[k], known[group[k]]
        while c < len(place) and place[c] < frame[k]:
            c += 1
        abrupt = c < len(place) and place[c] == frame[k] and height[c] > clear
        if has_evidence and not abrupt and odds[k] > STAYS and here[k] < SWELLS:
            is_evident = odds[k] > EVIDENT and here[k] > CLEARLY
            often = rate_of_others(evident - is_evident, duration)
            less = np.log1p(here[k]) + min(np.log(often), 0.0)
            if greatest_beside(b, group[k], 2) >= FEEBLE:
                less -= np.log(RISEN)
            out[k] += SWELLING_SLOPE * min(less, 0.0)
    count, whole = len(crest), float(int(CROWD / per))
    ends, high = np.empty((4, count), np.int64), np.empty(count)
    ends_about(likely[:number], STEP * crest, ALONE / seconds, ALONE / seconds, ends[0], ends[1])
    ends_about(crest, crest, whole, whole + 1.0, ends[2], ends[3])
    for i in range(count):
        high[i] = h[crest[i]]
    of_h, of_number, of_loud, of_often, offset = OWN_ODDS
    often = rate_of_others(evident, duration)
    tail, reach, number = (round(TAIL[0] / per), round(TAIL[1] / per)), 2, 0
    reach += round(LOUD_WITHIN / (GROUP * seconds))
    for i in range(count):
        at = nearest(STEP * crest[i], groups)
        if high[i] <= NOISE or ends[0, i] < ends[1, i] or not known[at]:
            continue
        before = 0.0
        for j in range(max(crest[i] - tail[0], 0), crest[i] - tail[1] + 1):
            before = max(before, h[j])
        as_high = number_as_high(high, i, ends[2, i], ends[3, i], AS_HIGH) + 1
        loud = greatest_beside(b, at, reach)
        own = of_h * np.log1p(high[i]) + of_number * as_high + of_often * np.log(often) + offset
        own += of_loud * np.log(max(loud, FEEBLE))
        own = min(own, (high[i] - NOISE) / NOISE_SCALE)
        own = min(own, TAIL_SLOPE * np.log(high[i] / (TAIL_SHARE * before)))
        if own > HOPELESS:
            own_frame[number] = STEP * crest[i]
            own_odds[number] = own - RATTLE_SLOPE * np.log1p(rattle[STEP * crest[i] // BLOCK])
            number += 1
    return number
