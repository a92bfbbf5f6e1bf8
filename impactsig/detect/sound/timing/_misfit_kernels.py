"""Kernel that tells by how much more than their errors models are off along a shift."""

from __future__ import annotations

import math

import numpy as np

from ...signal.order_kernels import centre_of
from .._lane_kernels import fused, reordered, sum_of_products
from ._edge_kernels import PARTS
from ._mode_basis_kernels import Basis

__all__ = ["Basis", "misfit"]


@fused
def misfit(sounds, found, lead, basis, error, prior, step, most, least):
    """Mean square of what is left of a sound in the direction of a shift of others, noise apart.

    It is the median of every `step`-th sound of those that `fit_each` has `found`, and of which no
    more than a fraction of `most` is left, as of one of energy 1; NaN if these are less than
    `least`. Fits begin `lead` samples before an instant; `error` is the model's part of s.
    """
    size, alike, some = basis.size, np.empty(len(found), np.int64), 0
    for i in range(len(found)):
        begin = found[i, 0] - lead
        if found[i, 3] <= most and 0.0 <= begin < len(sounds[i]) - size - 1.0:
            alike[some] = i
            some += 1
    alike = alike[:some:step]
    some = len(alike)
    if some < least:
        return np.nan
    left, change = np.empty((2, some, size))
    for n in range(some):
        i = alike[n]
        begin = found[i, 0] - lead
        first = math.floor(begin + 0.5)
        place, sound = PARTS * (begin - first), sounds[i, first : first + size]
        leave_and_change(sound, place, found[i, 4] + error, prior, basis, left[n], change[n])
    squares = np.zeros(some)
    for n in range(some):
        for other in range(some):
            if other != n:
                one = sum_of_products(change[other], left[n])
                squares[n] += one * one - found[alike[n], 4]
    return centre_of(squares, some) / (some - 1)


@reordered
def leave_and_change(sound, place, error, prior, basis, left, change):
    """What a model leaves of a sound, and how it changes by a shift.

    Both are for a sound of energy 1, fitted at the fine shift nearest to the place; `error` is its
    s. Of the change, what other amplitudes would do as well is taken off, and its size is 1.
    """
    rows, middle, size = basis.modes + 2, len(basis.places) // 2, len(left)
    at = min(max(middle + math.floor(place + 0.5), 1), len(basis.places) - 2)
    amplitudes, fitted = np.empty(rows), np.empty(size)
    scale = 1.0 / math.sqrt(sum_of_products(sound, sound))
    for k in range(size):
        left[k] = scale * sound[k]
    fit_at(left, error, prior, basis, at, amplitudes, fitted)
    change[:] = 0.0
    for c in range(rows):
        later, sooner = basis.places[at + 1], basis.places[at - 1]
        add_times(amplitudes[c], basis.columns[later % PARTS, c, later // PARTS :], change)
        add_times(-amplitudes[c], basis.columns[sooner % PARTS, c, sooner // PARTS :], change)
    for k in range(size):
        left[k] -= fitted[k]
    fit_at(change, error, prior, basis, at, amplitudes, fitted)
    for k in range(size):
        change[k] -= fitted[k]
    square = sum_of_products(change, change)
    scale = 1.0 / math.sqrt(square) if square > 0.0 else 1.0
    for k in range(size):
        change[k] *= scale


@reordered
def fit_at(sound, error, prior, basis, j, amplitudes, out):
    """What the model makes of a sound of energy 1 at shift j, and amplitudes of its columns."""
    modes, factors, gram = basis.modes, basis.factors[:, :, j], basis.grams[:, j]
    values, begin = basis.columns[basis.places[j] % PARTS], basis.places[j] // PARTS
    for c in range(modes + 2):  # first those of Q and K
        total = sum_of_products(sound, values[c, begin:])
        for d in range(min(c, modes)):
            total -= factors[c, d] * amplitudes[d]
        amplitudes[c] = total * factors[c, c] if c < modes else total
    impulse, slope = gram[0] + error / prior[0], gram[1] + error / prior[1]
    first, second = amplitudes[modes], amplitudes[modes + 1]
    det = impulse * slope - gram[2] * gram[2]
    amplitudes[modes] = (first * slope - second * gram[2]) / det
    amplitudes[modes + 1] = (second * impulse - first * gram[2]) / det
    out[:] = 0.0
    for c in range(modes + 1, -1, -1):
        if c < modes:
            total = amplitudes[c]
            for d in range(c + 1, modes + 2):
                total -= factors[d, c] * amplitudes[d]
            amplitudes[c] = total * factors[c, c]
        add_times(amplitudes[c], values[c, begin:], out)


@reordered
def add_times(factor, other, row):
    """Add so many times the begin of the other to a row."""
    for k in range(len(row)):
        row[k] += factor * other[k]
