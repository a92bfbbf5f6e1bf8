"""Kernels for crests of C: what lies around each, and how high crests are there."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import allocating, inlined, kernel
from .._nearby_kernels import (
    ends_about,
    greatest_about,
    greatest_beside,
    nearest,
    put_totals,
    ranked_between,
)
from ._tail_kernels import beyond_tails

NEARBY = 1.0  # [s], within which crests are compared
SOONER, LATER = 12e-3, 20e-3  # [s], of a crest of C beside one of B or G that it belongs to
LEAST_OCTAVES = 0.35  # times a: rise in octaves of what others do not hide
CRESTS = 40.0  # a second, that only rattling makes
UNHEARD = 10.0  # [s], without impacts, by which a stretch counts as longer
RAREST = 1.0 / 60.0  # impacts a second that may come where none is evident


@inlined
def rate_of_others(others, duration):
    """How many a second so many other evident impacts are, in a stretch of that duration."""
    return RAREST + others / (duration + UNHEARD)


@allocating
def crest_evidence(
    place, height, loud, decay, b, likelihood, known, least, around, within, out, greatest, ends
):
    """Evidence of crests in the order of time.

    Parameters
    ----------
    place, height, loud : frames of crests, C there, and the loudness after them
    decay : loudness that tails lose in a frame
    b, likelihood, known : B and G of every GROUP of frames, and whether they are known
    least : rise in narrow bands that a crest needs at least
    around : GROUPs before and after, over which B is averaged
    within : frames within which C must be greatest for G to count, and within which it is compared
    out : (5, n), room for `bands`, `borne_out`, `likelihood`, `loudest` and `clear` of `Crests`
    greatest : (n,) room for whether no other within the first of `within` is higher
    ends : (2, n) room for the first of those within the second of each, and their end
    """
    count, groups = len(place), len(b)
    queue, total = np.empty(count, np.int64), np.empty(groups + 1)
    put_totals(b, total)
    bands, borne_out, certain, loudest, clear = out[0], out[1], out[2], out[3], out[4]
    greatest_about(place, height, within[0], queue, loudest)
    for k in range(count):
        greatest[k] = height[k] >= loudest[k]
    greatest_about(place, height, within[1], queue, loudest)
    beyond_tails(place, loud, decay, clear)
    ends_about(place, place, within[1], within[1], ends[0], ends[1])
    for k in range(count):
        at = nearest(place[k], groups)
        low, high = max(at - around[0], 0), min(at + around[1] + 1, groups)
        mean = max(total[high] - total[low], 0.0) / (high - low)
        bands[k] = greatest_beside(b, at, 2)
        borne_out[k] = bands[k] / max(least, mean) if known[at] else np.inf
        certain[k] = greatest_beside(likelihood, at, 2) if known[at] else np.inf
        clear[k] = min(max(clear[k], 0.0), height[k])


@kernel
def heard_about(silence, place, reach):
    """Fraction of the GROUPs at most `reach` from a frame that are no digital silence.

    `silence` is their number before each GROUP; it is empty if there are none.
    """
    groups = len(silence) - 1
    if groups < 0:
        return 1.0
    at = nearest(place, groups)
    low, high = max(at - reach, 0), min(at + reach + 1, groups)
    return 1.0 - (silence[high] - silence[low]) / (high - low)


@allocating
def heights_reached(place, height, order, first, last, silence, reach, within, asked, out):
    """Height that CRESTS a second reach `within` seconds of crests; 0 if there are fewer.

    Those are the crests from `first` to before `last`. Only part of their time is heard, as in
    `heard_about`: the rank is the geometric mean of that share of them and of all. `order` sorts
    the heights. Only crests that are `asked` for are looked at.
    """
    begin, end, rank = np.empty((3, len(place)), np.int64)
    number = 0
    for k in range(len(place)):
        if asked[k]:
            heard = np.sqrt(heard_about(silence, place[k], reach))
            begin[number], end[number] = first[k], last[k]
            most = max(np.rint(2.0 * within * CRESTS * heard), 1.0)
            rank[number] = last[k] - first[k] - np.int64(most)
            number += 1
    found = np.empty(number, np.int64)
    if number:
        ranked_between(order, begin[:number], end[:number], rank[:number], found)
    number = 0
    for k in range(len(place)):
        if asked[k]:
            out[k] = height[found[number]] if found[number] >= 0 else 0.0
            number += 1
