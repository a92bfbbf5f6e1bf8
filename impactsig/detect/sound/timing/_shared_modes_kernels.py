"""Kernels of sounds that share modes: filters, crossings, and what modes are learned from."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import kernel
from .._attack_kernels import innovations
from .._lane_kernels import fused, sum_of_squares
from ._filter_kernels import filtered_at, taps_at

NEAR_TAPS = 8  # samples on either side from which a crossing is interpolated
FINE = 4  # places between two samples that a crossing is looked for at
FAINTEST = 1e-300  # energy whose reciprocal is finite


@fused
def high_passed(samples, first, taps, out):
    """out[i, k]: the filtered sample first[i] + k + len(taps) // 2; 0 if first[i] is negative."""
    for i in range(len(first)):
        if first[i] < 0:
            out[i] = 0.0
        else:
            filtered_at(samples, first[i], taps, out[i])


@fused
def ring(source, first, step, weights, factors, skip, out):
    """Real and imaginary part of modes that ring to a source, out[0, n, i] and out[1, n, i].

    y[i] = factors[n] y[i - 1] + sum of weights[n, k] source[first + i step - k]. The first `skip`
    values of y are left out.
    """
    for n in range(len(factors)):
        total, own = 0.0j, weights[n]
        for i in range(skip + out.shape[2]):
            at, cell = first + i * step, 0.0j
            for k in range(len(own)):
                cell += own[k] * source[at - k]
            total = factors[n] * total + cell
            if i >= skip:
                out[0, n, i - skip], out[1, n, i - skip] = total.real, total.imag


@kernel
def add_moved(response, factors, apart, out):
    """Add the response to `out` with each of the factors, every so many values."""
    for n in range(len(factors)):
        factor, at = factors[n], n * apart
        part = out[at : at + len(response)]
        for k in range(len(response)):
            part[k] += factor * response[k]


@fused
def add_rings(sounds, first, size, noise, rows, total):
    """Add the lagged products of the ring of each sound over its energy, and return the noise.

    A ring is the part of `size` samples from first[i] on; those that a sound does not hold, or of
    no more than the FAINTEST energy, do not count. The noise is that of so many rows. Of a ring y,
    total[i, j], i <= j, grows by H'H, H[k, i] = y[k + i] with so many rows.
    """
    floor, products, few = 0.0, np.zeros((size, size)), np.zeros((4, size))
    held = 0
    for i in range(len(sounds)):
        if first[i] < 0 or first[i] + size > sounds.shape[1]:
            continue
        ring = sounds[i, first[i] : first[i] + size]
        energy = sum_of_squares(ring)
        if energy > FAINTEST:
            scale = 1.0 / math.sqrt(energy)
            for k in range(size):
                few[held, k] = scale * ring[k]
            floor += rows * noise / energy
            held += 1
        if held == len(few):
            add_outer_products(few[0], few[1], few[2], few[3], products)
            held = 0
    few[held:] = 0.0
    add_outer_products(few[0], few[1], few[2], few[3], products)
    # Along a diagonal one product comes and one goes: from its end on, for sounds decay, and sums
    # lose no digits as terms are added that are greater.
    width = len(total)
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
def add_outer_products(p, q, r, s, out):
    """Add to out[i, j], i <= j, the product of elements i and j of each of four rows."""
    for i in range(len(p)):
        a, b, c, d = p[i], q[i], r[i], s[i]
        row, pi, qi, ri, si = out[i, i:], p[i:], q[i:], r[i:], s[i:]
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
        noise = greatest = 0.0
        for k in range(quiet):
            noise += sounds[i, k] * sounds[i, k]
        sizes[0] = sounds[i, begin:end]
        peak[:] = 0.0
        for part in range(FINE):
            between = sizes[part]
            if part:
                filtered_at(sounds[i], begin + 1 - NEAR_TAPS, taps[part], between)
            for k in range(len(peak)):
                between[k] = abs(between[k])
                peak[k] = between[k] if between[k] > peak[k] else peak[k]
        for k in range(len(peak)):
            greatest = max(greatest, peak[k])
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
