"""Kernel that finds where gates close to a floor."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import njit

# What marks a closing, in powers over those of the noise.
AT_NOISE = 4.5  # ratio after it, at most
NO_SILENCE = 1e-4  # at least, else that is digital silence
FALL = 20.0  # over which the ratio before it is that after it, at least
RELEASE = 2  # parts that it takes, at most
STEADY = 0.35  # greatest change from one part to the next before it, in the mean [neper]
EVEN = 0.5  # standard deviation of the ratio over the octaves, before it [neper]
LOUDER, RECENT = 3.0, 24  # that the loudest of as many parts is over the last before it, at least


@njit(nogil=True)
def closing_levels(parts, noise, weights, out):
    """Fill `out` with the ratios to the noise before each closing of a gate in `parts`.

    Returns the number of closings, and that of all falls to the noise.

    `parts` are mean powers (octaves, parts), and `weights` those of the octaves.
    """
    octaves, length = parts.shape
    ratio = np.zeros(length)
    for b in range(octaves):
        if not noise[b] > 0.0:
            return 0, 0
        share = weights[b] / noise[b]
        for i in range(length):
            ratio[i] += share * parts[b, i]
    falls = 0
    for i in range(length - 1):
        falls += ratio[i] > AT_NOISE >= ratio[i + 1]
    count, i = 0, 2
    while i + 1 < length:  # the gate closes in part i, at its end or before it
        after, i = ratio[i + 1], i + 1
        if not NO_SILENCE < after <= AT_NOISE:
            continue
        for k in range(i - 2, max(i - 2 - RELEASE, 0), -1):
            level = ratio[k]
            if level < FALL * after:
                continue
            loudest = ratio[max(k - RECENT, 0) : k].max()
            if loudest < LOUDER * level:
                continue
            if is_noise(parts[:, k - 1 : k + 1], noise):
                out[count] = level
                count += 1
                i += RELEASE  # parts that tell of the same closing
                break
    return count, falls


@njit(nogil=True)
def is_noise(parts, noise):
    """Whether two parts have the spectrum of the noise, and are as high."""
    octaves = len(parts)
    total = squares = steps = 0.0
    for b in range(octaves):
        before, last = parts[b, 0] / noise[b], parts[b, 1] / noise[b]
        if not min(last, before) > 0.0:
            return False
        height = math.log(last)
        total += height
        squares += height * height
        steps += math.log(before) - height
    mean = total / octaves
    return abs(steps) < STEADY * octaves and squares / octaves - mean * mean < EVEN**2


@njit(nogil=True)
def closed_groups(parts, noise, weights, lowest, out):
    """out[g]: whether the parts of group g have less than `lowest` times the noise.

    `parts` are mean powers (octaves, parts), of which each group has as many; the ratio is the
    mean by the `weights` of the octaves.
    """
    each = parts.shape[1] // len(out)
    for g in range(len(out)):
        total = 0.0
        for b in range(parts.shape[0]):
            for i in range(g * each, (g + 1) * each):
                total += weights[b] * parts[b, i] / noise[b]
        out[g] = total < lowest * each
