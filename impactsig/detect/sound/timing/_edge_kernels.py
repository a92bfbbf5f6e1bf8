"""Kernels of filters that sounds have passed, and of modes behind them. See `_edge.py`."""

from __future__ import annotations

import cmath
import math

import numpy as np

from ...signal.order_kernels import centre_of
from .._lane_kernels import fused

REAL = 1e-9  # imaginary part of an exponent, at most, of a mode that does not oscillate
SMOOTH = 1.0 / 9.0, 2.0 / 9.0, 3.0 / 9.0, 2.0 / 9.0, 1.0 / 9.0  # of a spectrum
WEAKEST_NOISE = 0.1  # of its density, over the median above the edge, that is believed


@fused
def step_modes(exponents, response, taps, first, last, per_sample, parts, out):
    """Columns of `_edge.columns_of`, one a row of `out`: `parts` values to a sample.

    The response has `per_sample`; it is empty where there is no filter.
    """
    none = len(response) == 0
    reach = len(taps) // 2 if none else (len(response) // per_sample + len(taps)) // 2
    begin, end = min(first, -reach), max(last, reach)
    before, step = parts * (first - begin), 1 if none else per_sample // parts
    weights, scratch = np.ones(step + 1, np.complex128), np.empty(out.shape[1])
    if none:
        both, at = np.zeros(parts * (end - begin) + 1), -parts * (reach + begin)
        weights = weights[:1]
        for k in range(len(taps)):
            both[at + parts * k] = taps[len(taps) - 1 - k]
    else:
        both, at = np.zeros(per_sample * (end - begin + 1) + 1), per_sample * (1 - reach - begin)
        for n in range(len(taps)):
            part = both[at + n * per_sample : at + n * per_sample + len(response)]
            for k in range(len(response)):
                part[k] += taps[n] * response[k]
    from_first = 0 if none else per_sample  # it begins a sample before `begin`
    oscillating = len(exponents)
    for n in range(len(exponents)):
        for k in range(len(weights)):
            if not none:  # Simpson's rule
                share = 1.0 if k == 0 or k == step else 4.0 if k % 2 else 2.0
                turn = cmath.exp(exponents[n] * (k / per_sample))
                weights[k] = share / (3 * per_sample) * turn
        other = scratch
        if exponents[n].imag > REAL:
            other = out[oscillating]
            oscillating += 1
        factor = cmath.exp(exponents[n] / parts)
        ring(both, from_first, step, weights, factor, before, out[n], other)
    impulse, slope = out[oscillating], out[oscillating + 1]
    impulse[:] = 0.0
    slope[:] = 0.0
    if not none:
        for i in range(out.shape[1]):
            at = from_first + step * (before + i)
            impulse[i] = both[at]
            if 0 < at < len(both) - 1:
                slope[i] = 0.5 * per_sample * (both[at + 1] - both[at - 1])


@fused
def ring(source, first, step, weights, factor, skip, real, imag):
    """Real and imaginary part of a mode that rings to a source.

    y[i] = factor y[i - 1] + sum of weights[k] source[first + i step - k]. The first `skip` values
    of y are left out.
    """
    total = 0.0j
    for i in range(skip + len(real)):
        at, cell = first + i * step, 0.0j
        for k in range(len(weights)):
            cell += weights[k] * source[at - k]
        total = factor * total + cell
        if i >= skip:
            real[i - skip], imag[i - skip] = total.real, total.imag


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
