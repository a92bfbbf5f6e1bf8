"""Kernels for `_growth.py`: mean power of sounds about their beginnings, and how it grows."""

from __future__ import annotations

import numpy as np

from ._lane_kernels import FAINTEST, fused, sum_of, sum_of_squares

SLICE = 0.125e-3  # [s]
SPANS = 1, 2, 4  # slices in each of the two times
NOISE = 2, 8  # slices before the attack in which noise is measured
AFTER = 24  # slices after the attack in which the greatest power of two is looked for
VARIED = 0.5  # standard deviation of the logarithm of the power of sounds at the same age


@fused
def add_powers(sounds, first, lead, total):
    """Add the power of each sound from first[k] on to `total`; returns how many sounds count.

    Each is divided by its energy `lead` samples later and on. Sounds that do not hold all that, or
    of no more than the FAINTEST energy, do not count.
    """
    count, size = 0, len(total)
    for k in range(len(sounds)):
        if first[k] < 0 or first[k] + size > sounds.shape[1]:
            continue
        near = sounds[k, first[k] : first[k] + size]
        energy = sum_of_squares(near[lead:])
        if energy > FAINTEST:
            count += 1
            weight = 1.0 / energy
            for i in range(size):
                total[i] += weight * near[i] * near[i]
    return count


@fused
def spread_of(total, before, rate):
    """Standard deviation [samples] of instants about which sounds have this power in `total`.

    It is 0 where the rate is too low, or `total` too short before `before`, to tell.
    """
    size = SLICE * rate
    last = min(AFTER, int((len(total) - before) / size))
    edges = before + np.rint(size * np.arange(-NOISE[1], last + 1)).astype(np.int64)
    if size < 1.0 or edges[0] < 0 or last < 2:
        return 0.0
    begin, end = edges[0], edges[NOISE[1] - NOISE[0]]
    noise, power = sum_of(total[begin:end]) / (end - begin), np.empty(last)
    for k in range(last):
        begin, end = edges[NOISE[1] + k], edges[NOISE[1] + k + 1]
        power[k] = sum_of(total[begin:end]) / (end - begin) - noise
    growth = 0.0
    for span in SPANS:
        if span < last:
            first, second = power[:span].mean(), power[span : 2 * span].mean()
            if second > first > 0.0:
                growth = max(growth, np.log(second / first) / (span * size))
    level = 0.5 * (power[:-1] + power[1:])
    at, greatest = level.argmax(), level.max()
    if not (greatest > level[0] > 0.0 and growth > 0.0):
        return 0.0
    rise = np.log(greatest / level[0])
    growth = max(growth, rise / (at * size))  # as it is until then on the mean
    return -VARIED / growth * np.expm1(-(rise**2))
