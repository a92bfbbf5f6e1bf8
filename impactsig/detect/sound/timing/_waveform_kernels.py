"""Kernels that tell whether sounds are alike, and whether their shifts agree with attacks."""

from __future__ import annotations

import math

import numpy as np

from ...signal.order_kernels import centre_of
from .._lane_kernels import fused
from ._alike_kernels import is_alike, lay_over

UNLIKE = 0.05  # of the power of all together that they may leave beyond noise
SURELY = 3.0  # standard errors: fewer of some agree only if not half of all do


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
    own, anywhere = np.empty_like(sounds), np.zeros((count, 2))
    anywhere[:, 1] = np.inf
    laid, attacks, apart = np.empty((count, 6)), np.empty((count, 2)), np.empty(count)
    for first, stride in parts:
        some = 0
        for i in range(first, count, stride):
            own[some] = sounds[i]
            some += 1
        here = own[:some], anywhere[:some], lengths, 0.0, 1.0, 0.0, shifts, taper, weight
        lay_over(*here, laid[:some])
        alike = 0
        for k in range(some):
            i = first + k * stride
            out[i] = laid[k]
            if is_alike(laid[k]):
                laid[alike], attacks[alike] = laid[k], expected[i]
                alike += 1
        spare -= some - alike
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
