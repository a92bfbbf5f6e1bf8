"""Kernels of sounds that share modes: filters, crossings, and what modes are learned from."""

from __future__ import annotations

import math

import numpy as np

from .._attack_kernels import innovations
from .._lane_kernels import FAINTEST, fused, greatest_of, sum_of_squares
from ._filter_kernels import filtered_at, taps_at

NEAR_TAPS = 8  # samples on either side from which a crossing is interpolated
FINE = 4  # places between two samples that a crossing is looked for at


@fused
def put_begins(attacks, before, length, count, out):
    """First sample of each wave, `before` an attack, which lies halfway between two of so many.

    It is -1 where these do not hold the wave's `length`.
    """
    for k in range(len(attacks)):
        first = math.ceil(attacks[k]) - before
        out[k] = first if first >= 0 and first + length <= count else -1


@fused
def gather(samples, first, out, heard):
    """The samples from each of the first on, and whether one is not 0; 0 if that is negative."""
    for i in range(len(first)):
        own, some = out[i], False
        if first[i] < 0:
            own[:] = 0.0
        else:
            part = samples[first[i] : first[i] + len(own)]
            for k in range(len(own)):
                own[k] = part[k]
                some |= part[k] != 0.0
        heard[i] = some


@fused
def high_passed(samples, first, taps, out):
    """out[i, k]: the filtered sample first[i] + k + len(taps) // 2; 0 if first[i] is negative."""
    for i in range(len(first)):
        if first[i] < 0:
            out[i] = 0.0
        else:
            filtered_at(samples, first[i], taps, out[i])


@fused
def add_rings(sounds, guess, skip, size, rows, total):
    """Add the lagged products of the ring of each sound over its energy; those of white noise.

    A ring is the part of `size` samples from `skip` after guess[i] on; those that a sound does not
    hold, or of no more than the FAINTEST energy, do not count; nor do those of no guess. What is
    returned is the diagonal that noise of power 1 would add. Of a ring y, total[i, j], i <= j,
    grows by H'H, H[k, i] = y[k + i] with so many rows.
    """
    floor, products, few = 0.0, np.zeros((size, size)), np.zeros((4, size))
    width = len(total)
    held = 0
    for i in range(len(sounds)):
        if not 0.0 <= guess[i] < sounds.shape[1] - skip - size + 1:
            continue
        first = int(guess[i]) + skip
        ring = sounds[i, first : first + size]
        energy = sum_of_squares(ring)
        if energy > FAINTEST:
            scale = 1.0 / math.sqrt(energy)
            for k in range(size):
                few[held, k] = scale * ring[k]
            floor += rows / energy
            held += 1
        if held == len(few):
            add_outer_products(few[0], few[1], few[2], few[3], width, products)
            held = 0
    few[held:] = 0.0
    add_outer_products(few[0], few[1], few[2], few[3], width, products)
    # Along a diagonal one product comes and one goes: from its end on, for sounds decay, and sums
    # lose no digits as terms are added that are greater.
    for apart in range(width):
        value = 0.0
        for k in range(size - 1 - apart, -1, -1):
            value += products[k, k + apart]
            if k + rows + apart < size:
                value -= products[k + rows, k + rows + apart]
            if k + apart < width:
                total[k, k + apart] += value
    return floor


@fused
def add_outer_products(p, q, r, s, width, out):
    """Add to out[i, j], i <= j < i + width, the products of elements i and j of four rows."""
    for i in range(len(p)):
        a, b, c, d = p[i], q[i], r[i], s[i]
        row, pi, qi, ri, si = out[i, i : i + width], p[i:], q[i:], r[i:], s[i:]
        for j in range(len(row)):
            row[j] += a * pi[j] + b * qi[j] + c * ri[j] + d * si[j]


@fused
def crossings(sounds, quiet, begin, end, shares, out):
    """First crossing of a fraction of each sound's greatest modulus, and its duration.

    The crossing and the greatest are looked for from sample `begin` to `end`, between samples as
    well. The share is the first of `shares`, or more where noise reaches it (the second is a
    multiple of the noise before sample `quiet`), but no more than the third.

    out : (n, 3), room for both and for the standard error that this noise gives the crossing; NaN
        where a sound is silent
    """
    taps = np.empty((FINE, 2 * NEAR_TAPS))
    for part in range(FINE):
        taps_at(part / FINE, taps[part])
    sizes, peak = np.empty((FINE, end - begin)), np.empty(end - begin)
    for i in range(len(sounds)):
        noise = sum_of_squares(sounds[i, :quiet])
        sizes[0] = sounds[i, begin:end]
        peak[:] = 0.0
        for part in range(FINE):
            between = sizes[part]
            if part:
                filtered_at(sounds[i], begin + 1 - NEAR_TAPS, taps[part], between)
            for k in range(len(peak)):
                between[k] = abs(between[k])
                peak[k] = between[k] if between[k] > peak[k] else peak[k]
        greatest = greatest_of(peak)
        out[i, 0] = out[i, 1] = out[i, 2] = np.nan
        level = max(shares[0] * greatest, shares[1] * math.sqrt(noise / quiet))
        level = min(level, shares[2] * greatest)
        if greatest > 0.0:
            k = part = 0
            while peak[k] < level:
                k += 1
            while sizes[part, k] < level:
                part += 1
            at = FINE * k + part
            rise = sizes[part, k] - sizes[(at - 1) % FINE, (at - 1) // FINE] if at else np.inf
            last = at + 1
            while last < sizes.size and sizes[last % FINE, last // FINE] >= level:
                last += 1
            out[i, 0] = begin + (at - (sizes[part, k] - level) / rise) / FINE
            out[i, 1] = (last - at) / FINE
            out[i, 2] = math.sqrt(noise / quiet) / (FINE * rise)


@fused
def abruptness(waves, split, lag, slope, count, out):
    """Power of two innovations of each wave at `split` over the greatest two of `count`."""
    innovation = np.empty(count)
    for i in range(len(waves)):
        innovations(waves[i], split, lag, slope, innovation)
        first = greatest = 0.0
        for k in range(count - 1):
            power = innovation[k] * innovation[k] + innovation[k + 1] * innovation[k + 1]
            if k == 0:
                first = power
            greatest = max(greatest, power)
        out[i] = first / greatest if greatest > 0.0 else 1.0


@fused
def shift_each(crossed, latency, spread, fits, strange, wider, attack, out):
    """Shift of each sound from `attack`, and its standard error.

    By fits that leave no more than a `strange` fraction, whose errors are made `wider`, and else by
    results of `crossings`, which are late by `latency` and scatter by `spread` besides.

    fits : (n, 3), instant, standard error and residual fraction; (0, 3) if there are none
    """
    for i in range(len(crossed)):
        out[i, 0] = crossed[i, 0] - latency - attack
        out[i, 1] = math.hypot(spread, crossed[i, 2])
        if len(fits) and fits[i, 2] <= strange:
            out[i, 0] = fits[i, 0] - attack
            out[i, 1] = math.hypot(fits[i, 1], wider)
