"""Crest and extent of a pulse in its record, and the baseline beside it."""

from __future__ import annotations

from typing import NamedTuple

from ..._compiling.compiled import kernel
from ..._trains.impact_flags import OPEN_END, OPEN_START, UNRESOLVED
from .edges import Baseline, remove_baseline, valley, walk


class Place(NamedTuple):
    """Peaks of a pulse and its neighbours in the segment, and the ends of the segment.

    A neighbour that is not there is at -1, or `total`; lo and hi bound what is looked at.
    """

    before: int
    peak: int
    after: int
    lo: int
    hi: int
    total: int


class Extent(NamedTuple):
    """Bounds within which a pulse stands out, and those of the search, in samples of x."""

    left: int
    right: int
    left_limit: int
    right_limit: int


@kernel
def summit(x, place, base, width, sigma):
    """Position and height of the crest in x."""
    end = len(x) - 1
    top = place.peak - place.lo
    # Not past half-way to a neighbour: one crest is never measured twice.
    first = max(0, top - width, (place.before + place.peak) // 2 + 1 - place.lo)
    last = min(end, top + width, (place.peak + place.after) // 2 - place.lo)
    for i in range(first, last + 1):
        if x[i] > x[top]:
            top = i
    crest = x[top]
    if crest - base < 12.0 * sigma:
        # The greatest sample of a faint pulse is noise's choice; the response knows the middle.
        top = place.peak - place.lo
        first, last = max(0, top - width // 4), min(end, top + width // 4)
        crest = 0.0
        for i in range(first, last + 1):
            crest += x[i]
        crest /= last + 1 - first
    return top, crest


@kernel
def stands_out(x, top, width, low):
    """Whether the samples on either side fall to `low`.

    A stretch beside a pulse of the other sign has a low flank, but does not stand out.
    """
    end = len(x) - 1
    if top >= width:
        i = top - 1
        while x[i] > low:
            if i == 0:
                return False
            i -= 1
    if end - top >= width:
        i = top + 1
        while x[i] > low:
            if i == end:
                return False
            i += 1
    return True


@kernel
def extent_of(x, top, place, base, height, width, sigma):
    """Extent of the pulse, at least its typical width, and its flags."""
    before, after, lo, hi = place.before, place.after, place.lo, place.hi
    stop = base + max(0.1 * height, min(2.0 * sigma, 0.5 * height))
    left_limit, right_limit = 0, len(x) - 1
    if before >= lo and before - lo + 1 < top:
        left_limit = valley(x, before - lo, top)
    if after < hi and top + 1 < after - lo:
        right_limit = valley(x, top, after - lo)
    left = walk(x, top, -1, left_limit, stop)
    right = walk(x, top, 1, right_limit, stop)
    flags = 0
    for index, limit in ((left, left_limit), (right, right_limit)):
        if index != limit:
            continue
        if lo + index == 0:
            flags |= OPEN_START if x[index] >= stop else 0
        elif lo + index == place.total - 1:
            flags |= OPEN_END if x[index] >= stop else 0
        elif x[index] > base + 0.25 * height:
            flags |= UNRESOLVED
    left = max(min(left, top - (width + 1) // 2), left_limit)
    right = min(max(right, top + (width + 1) // 2), right_limit)
    return Extent(left, right, left_limit, right_limit), flags


@kernel
def level_out(x, top, extent, place, width, sigma, colour, height, room):
    """Subtract the baseline beside the pulse, clear of its neighbours."""
    left, right = extent.left, extent.right
    margin = 2 + (right - left) // 4
    reach = 4 * (right - left)
    first, last = max(0, left - margin - reach), min(len(x), right + margin + 1 + reach)
    if place.before >= place.lo:
        first = max(first, place.before - place.lo + 2 * width)
    if place.after < place.hi:
        last = min(last, place.after - place.lo - 2 * width)
    a, d = left - margin, right + margin + 1
    line = remove_baseline(x, first, a, d, last, sigma, height, top, room)
    return Baseline(line.at_top, line.centre, colour * line.level, colour * line.slope, line.tilt)
