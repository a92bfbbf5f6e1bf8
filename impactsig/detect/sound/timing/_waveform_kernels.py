"""Kernels that tell which sounds are alike, and whether their shifts agree with attacks."""

from __future__ import annotations

import math

import numpy as np

from ...signal.order_kernels import centre_of
from .._lane_kernels import fused
from ._alike_kernels import ANYWHERE, ROWS, is_alike, lay_one, shift_wave, weighted_waves

UNLIKE = 0.05  # of the power of all together that they may leave beyond noise
SURELY = 3.0  # standard errors: fewer of some agree only if not half of all do


@fused
def most_alike(sounds, lengths, taps, taper, weight):
    """Number of the sound to which most are alike, the first of several; -1 if that is to no half.

    A sound is left as soon as it cannot come up to that.
    """
    best, most = -1, -(-len(sounds) // 2) - 1
    laid = np.empty(6)
    shifts = np.empty((ROWS, lengths.size))
    first = lengths.first - lengths.pad
    for leader in range(len(sounds)):
        wave = sounds[leader, first : first + lengths.size + 2 * lengths.pad]
        shift_wave(wave, lengths.pad, taps, shifts)
        weighted, energy, room = weighted_waves(lengths, shifts, taper)
        count = len(sounds) if energy > 0.0 else 0
        for i in range(len(sounds)):
            if count <= most:
                break
            if i != leader:
                lay_one(sounds[i], ANYWHERE, lengths, shifts, weighted, energy, weight, room, laid)
                count -= not is_alike(laid)
        if count > most:
            best, most = leader, count
        if most == len(sounds):
            break
    return best


@fused
def put_differences(laid, expected, apart):
    """Median of the differences of shifts from those expected; how far each is from it."""
    count = len(laid)
    for i in range(count):
        apart[i] = laid[i, 0] - expected[i, 0]
    latency = centre_of(apart[:count].copy(), count)
    for i in range(count):
        apart[i] = abs(apart[i] - latency)
    return latency


@fused
def tolerated(laid, expected, lengths):
    """Tolerated median difference of shifts from those expected, with their standard errors."""
    residual = power = 0.0
    for i in range(len(laid)):
        residual += laid[i, 2] - laid[i, 4]
        power += laid[i, 3] - laid[i, 4]
    if residual > UNLIKE * max(power, 0.0):
        return lengths.agree
    doubtful = 2.0 * centre_of(expected[:, 1].copy(), len(laid))
    return max(lengths.agree, min(doubtful, lengths.agree_in_noise))


@fused
def lay_if_alike(sounds, expected, lengths, shifts, taper, weight, parts, least, out):
    """The result of `lay_over` anywhere; whether as many can be alike, and agree with attacks.

    Less than half of all, or than `least`, are too few. Of `parts`, each a first sound and a
    stride, the next one is not looked at once that is certain.
    """
    count = len(sounds)
    spare, agreeing, known = count - max(least, 0.5 * count), 0, 0
    weighted, energy, room = weighted_waves(lengths, shifts, taper)
    laid, attacks, apart = np.empty((count, 6)), np.empty((count, 2)), np.empty(count)
    for first, stride in parts:
        alike = 0
        for i in range(first, count, stride):
            lay_one(sounds[i], ANYWHERE, lengths, shifts, weighted, energy, weight, room, out[i])
            if is_alike(out[i]):
                laid[alike], attacks[alike] = out[i], expected[i]
                alike += 1
            else:
                spare -= 1
        if spare < 0.0:
            return False
        if alike:
            most = tolerated(laid[:alike], attacks[:alike], lengths)
            put_differences(laid[:alike], attacks[:alike], apart)
            for k in range(alike):
                agreeing += apart[k] <= most
            known += alike
            if agreeing < 0.5 * known - 0.5 * SURELY * math.sqrt(known):
                return False
    return True
