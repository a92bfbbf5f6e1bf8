"""Kernels that align sounds of one waveform to a fraction of a sample.

A sound y is modelled as p times a waveform T, shifted by d samples. The best shift by whole and
half samples is found first; the remainder follows from weighted linear least squares,

    y[k + l] = p T_j[k] + q S_j[k],      d = l + j / SHIFTS + q / p,

where T_j is T shifted by j / SHIFTS and S_j its slope, by which it changes when shifted further.
"""

from __future__ import annotations

import math

import numpy as np

from .._lane_kernels import fused, sum_of_squares
from ._filter_kernels import TAPS, add_products, between, filtered_at, product, taps_at

SHIFTS = 16  # shifts of the waveform for each sample
ROWS = SHIFTS + 3  # from half a sample early to half a sample late, and one more on either side
UNSURE = 1.5  # factor of noise for shifts far from each other, as its colour is uncertain
TAIL = 0.3  # weight of the power after a wave, less than 1 as successive samples are correlated
ALIKE = 0.9  # correlation with the waveform
ANYWHERE = 0.0, np.inf, 0.0, 1.0, 0.0  # of a sound of which nothing is known, for `lay_one`
STEPS = 3  # of least squares; from within a quarter of a sample two come to 1e-3 samples


@fused
def shift_taps():
    """Interpolation weights at all shifts of a grid, one set a row."""
    taps = np.empty((ROWS, 2 * TAPS))
    for j in range(ROWS):
        later = (ROWS // 2 - j) / SHIFTS
        taps_at(later - math.floor(later), taps[j])
    return taps


@fused
def shift_wave(wave, pad, taps, shifts):
    """The wave at these shifts, by their `taps`, without `pad` samples at both ends."""
    for j in range(ROWS):
        whole = math.floor((ROWS // 2 - j) / SHIFTS)
        filtered_at(wave, pad + int(whole) + 1 - TAPS, taps[j], shifts[j])


@fused
def respond(y, first, reach, stride, weighted, sums):
    """Responses of matched filters at every `stride`-th shift of at most `reach`.

    That of weighted wave `row` at the shift (k - reach // stride) stride is out[k rows + row].
    `sums` is scratch with room for four parts of each shift.
    """
    count, rows = 2 * (reach // stride) + 1, len(weighted)
    out = np.empty(count * rows)
    for row in range(rows):
        add_products(y, first - reach // stride * stride, stride, weighted[row], count, sums)
        for k in range(count):
            out[k * rows + row] = (sums[0, k] + sums[1, k]) + (sums[2, k] + sums[3, k])
    return out


@fused
def coarse_shift(y, first, reach, stride, weighted, response):
    """Shift of at most `reach` with the greatest `response` of a matched filter.

    Every `stride`-th sample is tried, then all near the best; where that is every one, as many
    shifts a sample as there are weighted waves. This is the likeliest shift. The one at which wave
    and sound correlate best is not: late by a period of a decaying tone, they do as well.
    """
    rows = len(weighted)
    best, greatest = len(response) // 2, -np.inf
    for k in range(len(response)):
        if response[k] > greatest:
            best, greatest = k, response[k]
    lag = (best // rows - reach // stride) * stride
    if stride == 1:
        return lag + (best % rows - (rows - 1) // 2) / rows
    at = float(lag)
    for near in range(max(lag - stride + 1, -reach), min(lag + stride, reach + 1)):
        one = product(y, first + near, weighted[0])
        if one > greatest:
            at, greatest = float(near), one
    return at


@fused
def fit_shift(y, first, far, shift, shifts, weight):
    """Least-squares shift from a nearby one; factor, residual and total sums of squares.

    The shift is NaN where there is none of at most `far`.
    """
    factor = left = own = 0.0
    for _ in range(STEPS):
        lag = math.floor(shift + 0.5)
        if abs(lag) > far:
            return np.nan, factor, left, own
        j = ROWS // 2 + math.floor((shift - lag) * SHIFTS + 0.5)
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
        if not (abs(q) < factor and factor * factor > 0.0):
            return np.nan, factor, left, own
        shift = lag + (j - ROWS // 2) / SHIFTS + q / factor
    return shift, factor, left, own


@fused
def likeliest(response, after, far, stride, rows, power, expected, spread):
    """Most probable shift of at most `far`, and the posterior mean square about it.

    The logarithm of the probability of a shift is the squared positive `response` of the matched
    filter over twice the `power` of its noise, plus that of a Cauchy distribution about the
    `expected` shift with the width `spread`. The power `after` the wave, at every whole shift from
    -far on, is added to the square, since a wave shifted too early leaves the end of a ringing
    sound unexplained. Maxima more than a sample apart count; a parabola through three responses
    gives the height of one. Shifts are those of `respond`, with `rows` waves.
    """
    offset = (rows - 1) // 2 / rows
    most, at = -np.inf, np.nan
    for turn in range(2):
        total = second = 0.0
        for k in range(1, len(response) - 1):
            a, b, c = max(response[k - 1], 0.0), max(response[k], 0.0), max(response[k + 1], 0.0)
            if b < a or b <= c:
                continue
            part = 0.5 * (a - c) / (a - 2.0 * b + c)
            height = b - 0.25 * (a - c) * part
            place = (k + part) * stride / rows - far // stride * stride - offset
            whole = min(max(int(place + far + 0.5), 0), 2 * far)
            value = 0.5 * (height * height + after[whole]) / power
            value -= math.log(1.0 + ((place - expected) / spread) ** 2)
            if turn == 0:
                if value > most:
                    most, at = value, place
                continue
            weight = math.exp(value - most)
            total += weight
            if abs(place - at) > 1.0:
                second += weight * (place - at) ** 2
    return at, (second / total if total > 0.0 else 0.0)


@fused
def lay_over(sounds, expected, lengths, clear, colour, misfit, shifts, taper, weight, out):
    """Shift, factor, residual, total and noise sums of squares of each sound.

    The last column is the mean square distance of other possible shifts. If a shift of at most
    `lengths.reach` leaves more than the fraction `clear`, all up to `lengths.far` are tried, with
    the `expected` shift of each sound and its spread (first and second column) as prior. `taper`
    weights the coarse shift, `weight` the least squares. Noise is measured before the earliest
    place of the wave, scaled to the wave's sum; a response contains `colour` times white noise of
    its power. Sounds differ from the wave by `misfit` of its square in any one direction.
    """
    weighted, energy, room = weighted_waves(lengths, shifts, taper)
    for i in range(len(sounds)):
        place, spread = expected[i]
        known = place, spread, clear, colour, misfit
        lay_one(sounds[i], known, lengths, shifts, weighted, energy, weight, room, out[i])


@fused
def weighted_waves(lengths, shifts, taper):
    """Waves at the shifts tried first, weighted, the energy of one, and room for `lay_one`."""
    middle, energy = shifts[ROWS // 2], 0.0
    for k in range(len(middle)):
        energy += (taper[k] * middle[k]) ** 2
    weighted = np.empty((lengths.parts, len(middle)))
    for row in range(lengths.parts):
        move = (row - (lengths.parts - 1) // 2) * SHIFTS // lengths.parts
        moved = shifts[ROWS // 2 + move]
        for k in range(len(moved)):
            weighted[row, k] = taper[k] * moved[k]
    far, stride = lengths.far, lengths.stride
    return weighted, energy, (np.empty((4, 2 * (far // stride) + 1)), np.empty(2 * far + 1))


@fused
def lay_one(y, known, lengths, shifts, weighted, energy, weight, room, out):
    """What `lay_over` does with one sound."""
    first, reach, far, stride = lengths.first, lengths.reach, lengths.far, lengths.stride
    (place, spread, clear, colour, misfit), (sums, after) = known, room
    quiet, total, size = first - far, weight.sum(), shifts.shape[1]
    end = first + size - size // 6  # the taper is at a half there
    tail = TAIL * energy if clear > 0.0 else 0.0  # the end of a wave being learned is uncertain
    noise = sum_of_squares(y[:quiet]) * (total / quiet)
    shift, factor, left, own, beyond = np.nan, 0.0, 0.0, 0.0, 0.0
    if clear > 0.0:
        response = respond(y, first, reach, stride, weighted, sums)
        start = coarse_shift(y, first, reach, stride, weighted, response)
        shift, factor, left, own = fit_shift(y, first, far, start, shifts, weight)
    if not (np.isfinite(shift) and left <= clear * own):
        response = respond(y, first, far, stride, weighted, sums)
        start = coarse_shift(y, first, far, stride, weighted, response)
        shift, factor, left, own = fit_shift(y, first, far, start, shifts, weight)
        # At the wrong shift noise is taken for sound, and less than there is of it is left.
        sample = max(left, noise) / total
        power = UNSURE * energy * (colour * sample + misfit * factor * factor)
        if np.isfinite(shift) and power > 0.0:
            after[2 * far], least = 0.0, min(left, noise) / total
            for k in range(2 * far - 1, -1, -1):
                here = y[end - far + k]
                after[k] = after[k + 1] + tail * (here * here - least)
            start, beyond = likeliest(
                response, after, far, stride, len(weighted), power, place, spread
            )
            if abs(start - shift) > 1.0:
                shift, factor, left, own = fit_shift(y, first, far, start, shifts, weight)
    out[0], out[1], out[2], out[3] = shift, factor, left, own
    out[4], out[5] = noise, beyond


@fused
def put_expected(spread, out):
    """Where no shift is known by other means: none, with the standard error of the attack."""
    for i in range(len(out)):
        if not math.isfinite(out[i, 0]):
            out[i, 0], out[i, 1] = 0.0, spread[i]


@fused
def is_alike(laid):
    """Whether the residual of a sound, by what `lay_over` finds, is noise and 1 - ALIKE^2 at most.

    The greater part is explained in any case.
    """
    left, own, noise = laid[2], laid[3], laid[4]
    clear = left <= (1.0 - ALIKE**2) * own + 2.0 * ALIKE**2 * noise
    return math.isfinite(laid[0]) and clear and left <= 0.75 * own


@fused
def mark_alike(laid, out):
    """The same of each sound."""
    for i in range(len(laid)):
        out[i] = is_alike(laid[i])


@fused
def unexplained(sounds, shift, factor, start, wave, weight, out):
    """out[i]: what the wave leaves of sound i from its sample `start` on, over its factor.

    Samples are multiplied by the root of their weight, so that squares add up to weighted ones.
    """
    taps = np.empty(2 * TAPS)
    for i in range(len(sounds)):
        between(sounds[i], start + shift[i], taps, out[i])
        for k in range(len(wave)):
            out[i, k] = math.sqrt(weight[k]) * (out[i, k] / factor[i] - wave[k])


@fused
def mean_wave(sounds, shift, factor, start, wave):
    """Least-squares common waveform of shifted and scaled sounds, from sample `start` on."""
    wave[:] = 0.0
    total = 0.0
    taps, moved = np.empty(2 * TAPS), np.empty(len(wave))
    for i in range(len(sounds)):
        total += factor[i] * factor[i]
        between(sounds[i], start + shift[i], taps, moved)
        for k in range(len(wave)):
            wave[k] += factor[i] * moved[k]
    for k in range(len(wave)):
        wave[k] /= total
