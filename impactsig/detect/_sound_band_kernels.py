"""Kernels of the narrow bands of a sound, of their rise, and of its background."""

from __future__ import annotations

import numpy as np

from .._compiled import njit

TIMES_BACKGROUND = 2.0  # a power that counts
RANGE = 1e-4  # of the strongest nearby, below which nothing counts: 40 dB


@njit(nogil=True)
def gather(spectrum, scale, first, width, weights, at, power):
    """Powers of the bands of a batch of frames, the first of which is frame `at`.

    `spectrum` holds real and imaginary parts by turns.
    """
    size = spectrum.shape[1] // 2
    square = np.empty(size, np.float32)
    for f in range(min(spectrum.shape[0], power.shape[1] - at)):
        row = spectrum[f]
        # Less the weighted mean: a Hann window spreads it over two coefficients.
        row[2] += np.float32(0.5) * row[0]
        row[0] = 0.0
        for k in range(size):
            square[k] = row[2 * k] * row[2 * k] + row[2 * k + 1] * row[2 * k + 1]
        begin = 0
        for b in range(len(first)):
            total = np.float32(0.0)
            for k in range(width[b]):
                total += weights[begin + k] * square[first[b] + k]
            begin += width[b]
            power[b, at + f] = scale * total


@njit(nogil=True)
def band_rise(power, lag, begin, background, freedom, per, out):
    """Rise of frame begin + i over `lag` frames before it, in the narrow bands.

    out[0, i]: the mean over the bands of max(0, ln(max(P_b, F_b) / max(Q_b, F_b))) with F_b twice
    the background, Q_b the greatest of the bands b - 1, b, b + 1 before.
    out[1, i]: the greatest over the bands of n_b / 2 (x_b - 1 - ln x_b), the logarithm of the
    likelihood ratio of a rise by x_b = P_b / max(Q'_b / 2, L_b) > 1; Q'_b is of the band itself,
    n_b its `freedom`.

    `background` has a column for `per` frames.
    """
    bands = power.shape[0]
    for i in range(out.shape[1]):
        total = greatest = 0.0
        for b in range(bands):
            noise = background[b, i // per]
            least = TIMES_BACKGROUND * noise
            now, then = power[b, begin + i], power[b, begin + i - lag]
            base = max(0.5 * then, noise)
            half = 0.5 * freedom[b]
            if base > 0.0 and half * (now - base) > greatest * base:
                ratio = now / base
                greatest = max(greatest, half * (ratio - 1.0 - np.log(ratio)))
            if now <= least:
                continue
            before = max(then, least)
            if b > 0:
                before = max(before, power[b - 1, begin + i - lag])
            if b < bands - 1:
                before = max(before, power[b + 1, begin + i - lag])
            if now > before > 0.0:
                total += np.log(now / before)
        out[0, i] = total / bands
        out[1, i] = greatest


@njit(nogil=True)
def background(noise, means, first, nearby, out):
    """out[b, g]: L of the band b in group first + g, from the means of it and those beside."""
    for b in range(out.shape[0]):
        for g in range(out.shape[1]):
            strongest = 0.0
            begin, end = first + g - nearby, first + g + nearby + 1
            for k in range(max(begin, 0), min(end, means.shape[1])):
                strongest = max(strongest, means[b, k])
            out[b, g] = max(noise[b], RANGE * strongest)


@njit(nogil=True)
def group_means(power, heard, per, out):
    """out[b, g]: mean power of the frames of a group that are `heard`, or of all if none is."""
    for g in range(out.shape[1]):
        begin, end = g * per, min((g + 1) * per, power.shape[1])
        count = heard[begin:end].sum()
        for b in range(out.shape[0]):
            total = 0.0
            for k in range(begin, end):
                if heard[k] or count == 0:
                    total += power[b, k]
            out[b, g] = total / (count if count else end - begin)
