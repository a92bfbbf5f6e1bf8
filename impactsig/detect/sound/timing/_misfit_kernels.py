"""Kernel that tells by how much more than their errors models are off along a shift."""

from __future__ import annotations

import math

import numpy as np

from ...signal.order_kernels import centre_of
from .._lane_kernels import fused, reordered
from ._candidate_kernels import Starts
from ._edge_kernels import PARTS
from ._mode_basis_kernels import Basis, product
from ._shift_kernels import Shifts, weigh

__all__ = ["Basis", "Shifts", "Starts", "misfit"]


@fused
def misfit(projections, energy, starts, basis, shifts, floor, prior, step, most, least):
    """Mean square of what is left of a sound in the direction of a shift of others, noise apart.

    It is the median of every `step`-th sound of which no more than a fraction of `most` is left, as
    of one of energy 1; NaN if there are not at least so many.
    """
    count = -(-len(energy) // step)
    alike, own, fitted = np.empty(count, np.int64), np.empty(count), np.empty((count, 3))
    some = 0
    for i in range(0, len(energy), step):
        found, noise = fitted[some : some + 1], floor[0] / energy[i]
        weigh(projections[i : i + 1], energy[i : i + 1], shifts, floor, prior, found)
        if found[0, 2] - shifts.freedom * noise <= most:
            alike[some], own[some] = i, noise
            some += 1
    if some < least:
        return np.nan
    left, change = np.empty((2, some, basis.size))
    for n in range(some):
        i = alike[n]
        first = starts.begins[i]
        sound = starts.sounds[starts.which[i], first : first + basis.size]
        place = PARTS * fitted[n, 0]
        leave_and_change(sound, place, own[n] + floor[1], prior, basis, left[n], change[n])
    squares = np.zeros(some)
    for n in range(some):
        for other in range(some):
            if other != n:
                one = product(change[other], left[n])
                squares[n] += one * one - own[n]
    return centre_of(squares, some) / (some - 1)


@reordered
def leave_and_change(sound, place, error, prior, basis, left, change):
    """What a model leaves of a sound, and how it changes by a shift.

    Both are for a sound of energy 1, fitted at the fine shift nearest to the place; `error` is its
    s. Of the change, what other amplitudes would do as well is taken off, and its size is 1.
    """
    middle, later, fitted = len(basis.places) // 2, np.empty(len(left)), np.empty(len(left))
    at = min(max(middle + math.floor(place + 0.5), 1), len(basis.places) - 2)
    scale = 1.0 / math.sqrt(product(sound, sound))
    for k in range(len(left)):
        left[k] = scale * sound[k]
    fit_at(left, error, prior, basis, at - 1, change)
    fit_at(left, error, prior, basis, at + 1, later)
    fit_at(left, error, prior, basis, at, fitted)
    for k in range(len(left)):
        change[k] = later[k] - change[k]
        left[k] -= fitted[k]
    fit_at(change, error, prior, basis, at, fitted)
    for k in range(len(left)):
        change[k] -= fitted[k]
    square = product(change, change)
    scale = 1.0 / math.sqrt(square) if square > 0.0 else 1.0
    for k in range(len(left)):
        change[k] *= scale


@reordered
def fit_at(sound, error, prior, basis, j, out):
    """What the model makes of a sound of energy 1 at shift j."""
    modes, factors, gram = basis.modes, basis.factors[:, :, j], basis.grams[:, j]
    parts = len(basis.columns)
    values, begin = basis.columns[basis.places[j] % parts], basis.places[j] // parts
    amplitudes = np.empty(modes + 2)  # of Q and K, and then of the columns
    for c in range(modes + 2):
        total = product(sound, values[c, begin:])
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
        add_times(amplitudes[c], values[c, begin : begin + len(out)], out)


@reordered
def add_times(factor, other, row):
    """Add so many times the other to a row."""
    for k in range(len(row)):
        row[k] += factor * other[k]
