"""Kernels that lay sounds of one waveform over each other, to a fraction of a sample.

A sound y is taken for p times a waveform T, shifted by d samples. The whole and half samples by
which the two are most alike come first; what is left follows from weighted linear least squares,

    y[k + l] = p T_j[k] + q S_j[k],      d = l + j / SHIFTS + q / p,

where T_j is T shifted by j / SHIFTS and S_j its slope, by which it changes when shifted further.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

SHIFTS = 16  # shifts of the waveform for each sample
ROWS = SHIFTS + 3  # from half a sample early to half a sample late, and one more on either side
TAPS = 8  # samples on either side that a value between samples is made of
STEPS = 4  # of least squares; three bring the shift to 1e-4 samples


@njit(cache=True, nogil=True)
def between(y, place):
    """Value of y between samples: the sinc under a cosine window."""
    whole = math.floor(place)
    part = place - whole
    if part == 0.0:
        return y[whole]
    sine = math.sin(math.pi * part) / math.pi
    total = 0.0
    for k in range(1 - TAPS, TAPS + 1):
        away = part - k
        sign = -1.0 if k % 2 else 1.0
        total += y[whole + k] * sign * sine / away * math.cos(0.5 * math.pi * away / TAPS) ** 2
    return total


@njit(cache=True, nogil=True)
def shift_wave(wave, pad, shifts):
    """shifts[j]: the wave, but for `pad` samples at both ends, by (j - ROWS // 2) / SHIFTS late."""
    for j in range(ROWS):
        for k in range(shifts.shape[1]):
            shifts[j, k] = between(wave, pad + k - (j - ROWS // 2) / SHIFTS)


@njit(cache=True, nogil=True)
def correlation(y, first, wave, weight):
    """Weighted correlation of the wave with as many samples of y from `first` on."""
    both = own = other = 0.0
    for k in range(len(wave)):
        value = weight[k] * y[first + k]
        both += value * wave[k]
        own += value * y[first + k]
        other += weight[k] * wave[k] * wave[k]
    return both / math.sqrt(own * other) if own * other > 0.0 else 0.0


@njit(cache=True, nogil=True)
def most_alike(y, first, reach, stride, shifts, weight):
    """The shift of at most `reach` by which y is most like the wave, and their correlation.

    Every `stride`-th sample is looked at, or where that is every one, half samples too.
    """
    middle = ROWS // 2
    at, best = 0.0, -2.0
    for lag in range(-(reach // stride) * stride, reach + 1, stride):
        alike = correlation(y, first + lag, shifts[middle], weight)
        if alike > best:
            at, best = float(lag), alike
        if stride == 1 and lag < reach:
            alike = correlation(y, first + lag, shifts[middle + SHIFTS // 2], weight)
            if alike > best:
                at, best = lag + 0.5, alike
    if stride > 1:
        coarse = int(at)
        for lag in range(max(coarse - stride + 1, -reach), min(coarse + stride, reach + 1)):
            alike = correlation(y, first + lag, shifts[middle], weight)
            if alike > best:
                at, best = float(lag), alike
    return at, best


@njit(cache=True, nogil=True)
def fit_shift(y, first, far, shift, shifts, weight):
    """The shift by least squares, from one nearby; factor p, sum of squares left, and of y.

    The shift is NaN where there is none of at most `far`.
    """
    factor = left = own = 0.0
    for _ in range(STEPS):
        lag = math.floor(shift + 0.5)
        if abs(lag) > far:
            return np.nan, factor, left, own
        j = ROWS // 2 + int(math.floor((shift - lag) * SHIFTS + 0.5))
        tt = ts = ss = yt = ys = own = 0.0
        for k in range(shifts.shape[1]):
            sample = y[first + int(lag) + k]
            value = weight[k] * sample
            wave = shifts[j, k]
            slope = 0.5 * SHIFTS * (shifts[j + 1, k] - shifts[j - 1, k])
            tt += weight[k] * wave * wave
            ts += weight[k] * wave * slope
            ss += weight[k] * slope * slope
            yt += value * wave
            ys += value * slope
            own += value * sample
        det = tt * ss - ts * ts
        if not det > 0.0:
            return np.nan, factor, left, own
        factor, q = (yt * ss - ys * ts) / det, (ys * tt - yt * ts) / det
        left = max(own - factor * yt - q * ys, 0.0)
        if not abs(q) < factor:
            return np.nan, factor, left, own
        shift = lag + (j - ROWS // 2) / SHIFTS + q / factor
    return shift, factor, left, own


@njit(cache=True, nogil=True)
def lay_over(sounds, lengths, far, alike, shifts, weight, out):
    """out[i]: shift and factor of sound i, the sum of squares it leaves, its own, that of noise.

    Where no shift of at most `lengths.reach` brings the correlation to `alike`, shifts up to `far`
    are tried. Noise is what precedes all that the wave can be laid over; its sum is scaled to the
    wave's.
    """
    first = lengths.first
    quiet = first - lengths.far
    total = weight.sum()
    for i in range(len(sounds)):
        y = sounds[i]
        shift, best = most_alike(y, first, lengths.reach, lengths.stride, shifts, weight)
        if best < alike and far > lengths.reach:
            shift, best = most_alike(y, first, far, lengths.stride, shifts, weight)
        noise = 0.0
        for k in range(quiet):
            noise += y[k] * y[k]
        shift, factor, left, own = fit_shift(y, first, far, shift, shifts, weight)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = shift, factor, left, own
        out[i, 4] = noise / quiet * total


@njit(cache=True, nogil=True)
def mean_wave(sounds, shift, factor, start, wave):
    """The wave these sounds are shifted multiples of, from sample `start` on, by least squares."""
    wave[:] = 0.0
    total = 0.0
    for i in range(len(sounds)):
        total += factor[i] * factor[i]
        for k in range(len(wave)):
            wave[k] += factor[i] * between(sounds[i], start + k + shift[i])
    for k in range(len(wave)):
        wave[k] /= total
