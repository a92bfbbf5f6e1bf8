"""Kernels for the mean powers of a window that the background is read from."""

from __future__ import annotations

import numpy as np

from ._kernels import BLOCK, GROUP
from ._lane_kernels import fused
from ._rise_kernels import LONG_PART
from .powers.band_kernels import group_means

PART = 8  # frames of the octaves that share one power
PER = BLOCK // GROUP  # frames of the narrow bands that share one background


@fused
def put_known(begin, apart, size, valid, known):
    """Which of the windows of `size` samples, `apart` from one another, lie in the segment.

    The first begins at sample `begin`; those of `valid` are of the segment.
    """
    for g in range(len(known)):
        first = begin + g * apart
        known[g] = valid[0] <= first and first + size <= valid[1]


@fused
def put_levels(power, parts, counted, silent, long_parts, means, sounding):
    """Fill the means of a window from its powers in octaves, low octaves and narrow bands.

    Parameters
    ----------
    power : Powers (`_levels.py`)
    parts, counted, silent : of `part_means`
    long_parts : means in LONG_PARTs of the octaves and the low ones
    means : means in BLOCKs of all, of what is heard there if anything is
    sounding : whether the BLOCKs have bands that are

    Returns whether any of the groups is silent.
    """
    known, low_parts, octaves = power.known, power.low, len(power.octaves)
    groups, narrow = len(known), octaves + len(low_parts)
    part_means(power.octaves, power.left, groups, power.real, parts, counted, silent)
    heard, both = np.empty(groups, np.bool_), np.zeros(low_parts.shape[1], np.bool_)
    for g in range(groups):
        near = silent[g] or silent[g + 1] or silent[g + 2] or silent[g + 3]
        heard[g] = known[g] and not near
        if g % 2:
            both[g // 2] = heard[g - 1] and heard[g]
    for k in range(len(sounding)):
        sounding[k] = heard[k * PER : (k + 1) * PER].any()
    group_means(parts, np.ones(parts.shape[1], np.bool_), BLOCK // PART, means[:octaves])
    group_means(low_parts, both, BLOCK // LONG_PART, means[octaves:narrow])
    group_means(power.bands, heard, PER, means[narrow:])
    for b in range(octaves):
        for i in range(long_parts.shape[1]):
            p = parts[b, LONG_PART // PART * i : LONG_PART // PART * (i + 1)]
            long_parts[b, i] = 0.25 * ((p[0] + p[1]) + (p[2] + p[3]))
    long_parts[octaves:] = low_parts
    return silent[2 : groups + 2].any()


@fused
def part_means(power, first, groups, real, parts, counted, silent):
    """Mean powers of PARTs of frames in so many GROUPs from frame `first` on.

    silent[g]: whether all power of GROUP g - 2 is 0, two before and two after them included;
    counted[i]: whether the frames of part i lie between those of `real` and no silence touches
    them.
    """
    octaves, each = power.shape[0], GROUP // PART
    for g in range(groups + 4):
        at = first + (g - 2) * GROUP
        silent[g] = real[0] <= at and at + GROUP <= real[1]
        for b in range(octaves):
            if silent[g]:
                for j in range(at, at + GROUP):
                    if power[b, j] != 0.0:
                        silent[g] = False
                        break
    for b in range(octaves):
        for i in range(groups * each):
            p = power[b, first + i * PART : first + (i + 1) * PART]
            total = ((p[0] + p[1]) + (p[2] + p[3])) + ((p[4] + p[5]) + (p[6] + p[7]))
            parts[b, i] = total / PART
    for g in range(groups):
        heard = not (silent[g + 1] or silent[g + 2] or silent[g + 3])
        for i in range(g * each, (g + 1) * each):
            at = first + i * PART
            counted[i] = heard and real[0] <= at and at + PART <= real[1]
