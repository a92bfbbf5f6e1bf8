"""Kernels of the first pass: crests of the rise in octaves, and what no rise is known of."""

from __future__ import annotations

from ._kernels import loudness_at
from ._lane_kernels import fused
from ._nearby_kernels import crests


@fused
def put_crests(
    rise, least, after, background, weights, loud_before, loud_last, place, height, loud
):
    """Put frames of a slab, rise and loudness of its crests of at least `least`.

    `rise` begins two spacings before the slab, where the loudness is `loud_before`. What begins
    there and ends a spacing before the end of `rise` is searched. `loud_last` is filled with the
    loudness of the last frames of the slab. Returns the number of crests.
    """
    before, frames = len(loud_before), after.shape[1]
    spacing = before // 2
    count = crests(rise, spacing, least, spacing, len(rise) - spacing, place)
    for k in range(count):
        j = place[k]
        height[k] = rise[j]
        place[k] = j - before
        if j < before:
            loud[k] = loud_before[j]
        else:
            loud[k] = loudness_at(after, background, weights, j - before)
    for i in range(len(loud_last)):
        j = frames - len(loud_last) + i
        loud_last[i] = loudness_at(after, background, weights, j)
    return count


@fused
def clear_unknown(closes, known, rises):
    """Make the rises (2, frames) 0 where a gate closes, or that the segment does not reach."""
    for i in range(len(known)):
        if closes[i] or not known[i]:
            rises[0, i] = rises[1, i] = 0.0
