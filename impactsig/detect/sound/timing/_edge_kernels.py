"""Kernels of filters that sounds have passed, and of modes behind them. See `_edge.py`."""

from __future__ import annotations

import math

import numpy as np

from ...signal.order_kernels import centre_of
from .._lane_kernels import fused

PER_SAMPLE = 16  # values of a response for each sample, for integrals
PARTS = 4  # shifts for each sample
STEP = PER_SAMPLE // PARTS
SIDE = 4  # columns that sounds are projected on together
LANE = 8  # samples that a sum takes at a time
REAL = 1e-9  # imaginary part of an exponent, at most, of a mode that does not oscillate
SMOOTH = 1.0 / 9.0, 2.0 / 9.0, 3.0 / 9.0, 2.0 / 9.0, 1.0 / 9.0  # of a spectrum
WEAKEST_NOISE = 0.1  # of its density, over the median above the edge, that is believed


@fused
def step_modes(exponents, response, taps, first, last):
    """Modes that start at 0, and an impulse and its slope, behind both filters.

    Parameters
    ----------
    exponents : of each mode, for a sample; its imaginary part in [0, 2 pi]
    response : of the filter before the sampler, PER_SAMPLE values to a sample; empty for none
    taps : of the high-pass filter
    first, last : whole samples since the start, between which they are wanted

    Returns
    -------
    modes : int
        Columns of modes: real parts of exp(exponent u) behind the filters, and imaginary ones.
    columns : (PARTS, columns, samples)
        Value [p, c, k] is that of column c at first + k + p / PARTS. The columns after the modes
        are the response and its slope: what modes above the band leave in it. Zeros follow, for
        LANE samples and up to a multiple of SIDE columns.
    """
    modes = len(exponents)
    for exponent in exponents:
        modes += exponent.imag > REAL
    columns = np.zeros((PARTS, -(-(modes + 2) // SIDE) * SIDE, last - first + 1 + LANE))
    reach = (len(response) // PER_SAMPLE + len(taps)) // 2
    begin, end = min(first, -reach), max(last, reach)
    count, skip, wanted = PARTS * (end - begin) + 1, PARTS * (first - begin), PARTS * (last - first)
    source, rings = both_filters(response, taps, begin, count), np.zeros((4, count))
    oscillating = len(exponents)
    for n in range(0, len(exponents), 2):
        pair = exponents[n : n + 2]
        for k in range(len(pair)):
            put_cells(source, pair[k], len(response) > 0, rings[2 * k], rings[2 * k + 1])
        ring(np.exp(pair[0] / PARTS), np.exp(pair[-1] / PARTS), rings)
        for k in range(len(pair)):
            lay_apart(rings[2 * k, skip:], wanted, n + k, columns)
            if pair[k].imag > REAL:
                lay_apart(rings[2 * k + 1, skip:], wanted, oscillating, columns)
                oscillating += 1
    if len(response):
        slope = rings[0]
        for i in range(count):
            after = source[STEP - 1, i + 1] if i + 1 < count else 0.0
            slope[i] = 0.5 * PER_SAMPLE * (after - source[1, i])
        lay_apart(source[0, skip:], wanted, modes, columns)
        lay_apart(slope[skip:], wanted, modes + 1, columns)
    return modes, columns


@fused
def lay_apart(values, last, row, out):
    """Values up to that of `last`, PARTS to a sample, as a column of the result of `step_modes`."""
    for part in range(PARTS):
        own = out[part, row]
        for k in range((last - part) // PARTS + 1):
            own[k] = values[PARTS * k + part]


@fused
def both_filters(response, taps, begin, count):
    """Both filters, out[p, i] at begin + i / PARTS - p / PER_SAMPLE."""
    reach, half = len(taps) // 2, len(response) // PER_SAMPLE // 2
    out = np.zeros((STEP, count))
    if len(response) == 0:
        for n in range(len(taps)):
            out[0, PARTS * (n - reach - begin)] = taps[n]
        return out
    held = len(response) // STEP + 2
    own = np.zeros(held + 6 * PARTS)  # the response, with room for those of three taps before
    for p in range(STEP):
        for m in range(held):
            at = STEP * m - p
            own[3 * PARTS + m] = response[at] if 0 <= at < len(response) else 0.0
        for n in range(0, len(taps), 4):
            begins = PARTS * (n - reach - half - begin)
            low, high = max(begins, 0), min(begins + held + 3 * PARTS, count)
            if low < high:
                four = np.zeros(4)
                four[: len(taps) - n] = taps[n : n + 4]
                add_four(four, own[low - begins :], out[p, low:high])
    return out


@fused
def add_four(factors, values, out):
    """Add so many times the values, each PARTS later than those before."""
    a, b, c, d = factors[0], factors[1], factors[2], factors[3]
    w, x, y, z = values[3 * PARTS :], values[2 * PARTS :], values[PARTS:], values
    for i in range(len(out)):
        out[i] += a * w[i] + b * x[i] + c * y[i] + d * z[i]


@fused
def put_cells(source, exponent, filtered, real, imag):
    """What a source adds to a mode from one of PARTS to the next, by Simpson's rule."""
    if not filtered:
        real[:] = source[0]
        imag[:] = 0.0
        return
    weights = np.empty((2, STEP + 1))
    for k in range(STEP + 1):
        share = 1.0 if k == 0 or k == STEP else 4.0 if k % 2 else 2.0
        turn = share / (3 * PER_SAMPLE) * np.exp(exponent * (k / PER_SAMPLE))
        weights[0, k], weights[1, k] = turn.real, turn.imag
    for n in range(2):
        w, out = weights[n], real if n == 0 else imag
        w0, w1, w2, w3, w4 = w[0], w[1], w[2], w[3], w[4]
        p, q, r, s = source[0], source[1], source[2], source[3]
        out[0] = w0 * p[0] + w1 * q[0] + w2 * r[0] + w3 * s[0]
        later, p1, q1, r1, s1 = out[1:], p[1:], q[1:], r[1:], s[1:]
        for i in range(len(later)):
            later[i] = w0 * p1[i] + w1 * q1[i] + w2 * r1[i] + w3 * s1[i] + w4 * p[i]


@fused
def ring(factor, other, rings):
    """Let two modes ring, y[i] = factor y[i - 1] + cell i, in place of the cells.

    Rows are the real and the imaginary part of one and of the other: neither waits for the other.
    """
    a, b, c, d = rings[0], rings[1], rings[2], rings[3]
    fr, fi, gr, gi = factor.real, factor.imag, other.real, other.imag
    p = q = r = s = 0.0
    for i in range(np.uint64(len(a))):
        p, q = a[i] + fr * p - fi * q, b[i] + fr * q + fi * p
        r, s = c[i] + gr * r - gi * s, d[i] + gr * s + gi * r
        a[i], b[i], c[i], d[i] = p, q, r, s


@fused
def whitening_taps(spectra, count, edge, error, taps, ends, out):
    """Those of `_edge.whitening`, by spectra of so many samples each; whether there is noise.

    What lies below the place `edge` of a spectrum does not count. `ends` tapers the filter that is
    added to that of `taps`.
    """
    last, size, reach = spectra.shape[1] - 1, len(ends), len(ends) // 2
    power, smooth = np.empty(len(spectra)), np.empty(last + 1)
    middles, values = np.empty(last + 1), np.empty(last + 1)
    for j in range(last + 1):
        for i in range(len(spectra)):
            one = spectra[i, j]
            power[i] = one.real * one.real + one.imag * one.imag
        middles[j] = centre_of(power, len(power))
    begin = last + 1
    for j in range(last, -1, -1):
        total = error
        for k in range(5):
            at = abs(j + k - 2)
            total += SMOOTH[k] * middles[at if at <= last else 2 * last - at]
        smooth[j] = values[j] = total
        if j >= edge:
            begin = j
    density = centre_of(values[begin:], last + 1 - begin) if begin <= last else 0.0
    if not density > 0.0:
        return False
    turn, gain, inverse = np.empty(size), np.empty(reach + 1), np.empty(size)
    for m in range(size):
        turn[m] = math.cos(2.0 * math.pi * m / size)
    for m in range(reach + 1):
        at = min(max(m * count / size, begin), last)
        low = min(int(at), last - 1) if last else 0
        known = smooth[low] + (at - low) * (smooth[min(low + 1, last)] - smooth[low])
        gain[m] = 1.0 / math.sqrt(max(known / density, WEAKEST_NOISE))
    for i in range(reach + 1):
        total = gain[0]
        for m in range(1, reach + 1):
            total += 2.0 * gain[m] * turn[m * i % size]
        inverse[reach + i] = inverse[reach - i] = total / size * ends[reach + i]
    mean = 0.0
    for k in range(len(taps)):
        total = 0.0
        for i in range(max(k + reach + 1 - len(taps), 0), min(k + reach + 1, size)):
            total += inverse[i] * taps[k + reach - i]
        out[k] = total
        mean += total
    mean /= len(taps)
    for k in range(len(taps)):
        out[k] -= mean
    return True
