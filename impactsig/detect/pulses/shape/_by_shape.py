"""Measurement of each pulse by the shape that all of a span share."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._model import FLAT, LENGTH, SKEW, START, WIDER, parts_of
from ..edges import ERRORS, FIT, SHARED, SHARED_PEAK
from ..fit_errors import BESIDE, EDGE, ESTIMATE, NOW, SHORT, UNIT, ZERO
from ._common_rest import is_clear
from ._shared_shape_kernels import BRIEF, SHAPES, estimate_shape, set_free, variance_along

BENT = 0.2
"""Of the way that an instant is moved by: the standard error of taking the fit to be linear."""
AS_LONG = 8.0
"""Times as long as the matched response, or as short, a pulse may become."""


class Work(NamedTuple):
    """Work arrays for the measurement of a pulse."""

    new: np.ndarray  # (WIDER,), its parameters
    along: np.ndarray  # (3, WIDER), derivatives of instant, contact time and peak
    seen: np.ndarray  # (SHAPES,), twice for variances
    moved: np.ndarray


@allocating
def share(rows, alike, timed, alone, about, told, before, rounds):
    """Estimate the shape that pulses share, and measure them by it; `alone`, with its error."""
    count = len(alike)
    fits = set_free(rows, alike)
    shape = estimate_shape(fits, about, told, before, rounds)
    work = Work(np.empty(WIDER), np.zeros((3, WIDER)), np.empty(SHAPES), np.empty(SHAPES))
    for i in range(count):
        _measure(rows[alike[i]], i, fits, shape, timed, alone, work)
    return shape


@kernel
def _measure(row, i, fits, shape, timed, alone, work):
    """Write instant, contact time and peak of pulse i, with errors, by the shared shape."""
    kept = row[FIT:]
    old = kept[ESTIMATE : ESTIMATE + WIDER]
    new, along, seen, turned = work
    for m in range(WIDER):
        new[m] = old[m] + fits.step[m, i]
    for m in range(SKEW, WIDER):
        new[m] = min(max(new[m], old[m] - 1.0), old[m] + 1.0)
    before = parts_of(old)
    change, new[FLAT] = new[FLAT] - old[FLAT], old[FLAT]
    parts = parts_of(new)
    middle = math.exp(new[LENGTH])
    flat = middle * BRIEF * (math.exp(fits.shape[FLAT - SKEW, i] + change) - 1.0)
    contact = parts.rise + flat + parts.fall
    previous = before.rise + before.flat + before.fall
    moved = new[START] - old[START]
    near = abs(moved) < 0.5 * previous and 0.5 < contact / previous < 2.0
    near &= 0.5 < new[0] / old[0] < 2.0 and _is_as_long(contact, kept)
    if not near or kept[ZERO] + new[START] < 0.0:
        if not is_clear(row):
            _begin_again(kept, shape, previous, new)
        return
    new[FLAT] = math.log(max(flat / middle, 1e-9))
    along[0, START] = along[2, 0] = 1.0
    along[1, SKEW], along[1, FLAT] = 0.5 * (parts.rise - parts.fall), flat + middle * BRIEF
    along[1, LENGTH] = contact
    start, shared = variance_along(along[0], i, fits, shape, seen, turned)
    # That of the baseline hardly moves a length that the shape holds.
    lasting, by_shape = variance_along(along[1], i, fits, shape, seen, turned)
    peak, of_peaks = variance_along(along[2], i, fits, shape, seen, turned)
    if not alone:
        shared = by_shape = 0.0  # touches are read off the mean edge
    start, lasting, peak = start + shared, lasting + by_shape, peak + of_peaks
    if not (start >= 0.0 and lasting >= 0.0 and peak >= 0.0):
        return  # rounding is all that is left of them
    for m in range(WIDER):
        kept[NOW + m] = new[m]
    kept[SHORT] = min(flat, 0.0)
    row[0] = kept[ZERO] + new[START]
    row[ERRORS] = math.sqrt(start + kept[BESIDE] + (BENT * moved) ** 2)
    row[SHARED] = math.sqrt(max(shared, 0.0))
    if timed:
        row[1], row[4] = contact, parts.rise + 0.5 * flat
        row[ERRORS + 1] = math.sqrt(lasting)
    if kept[UNIT] > 0.0:
        row[2] = new[0] * kept[UNIT]
        row[ERRORS + 2] = math.sqrt(peak + kept[BESIDE + 2]) * kept[UNIT]
        row[SHARED_PEAK] = math.sqrt(max(of_peaks, 0.0)) * kept[UNIT]


@kernel
def _is_as_long(length, kept):
    """Whether a length is near that of the response that found the pulse."""
    ratio = length / (2.0 * math.exp(kept[EDGE]))
    return 1.0 / AS_LONG < ratio < AS_LONG


@kernel
def _begin_again(kept, shape, length, new):
    """Take a pulse for one of the mean shape, where it is and with its impulse.

    A fit of a faint pulse may be that of one crest of its noise: far from the shape of the others
    it says nothing of where it is to be linear. `new` is room for the parameters.
    """
    old = kept[ESTIMATE : ESTIMATE + WIDER]
    for m in range(SKEW, WIDER):
        new[m] = shape.mean[m - SKEW]
    new[FLAT] = math.log(max(BRIEF * (math.exp(new[FLAT]) - 1.0), 1e-9))
    parts = parts_of(new)
    longer = parts.rise + parts.flat + parts.fall
    if not _is_as_long(longer, kept):
        return
    new[START] = max(old[START] + 0.5 * (length - longer), -kept[ZERO])
    new[0] = old[0] * length / longer
    for m in range(WIDER):
        kept[NOW + m] = new[m]
    kept[SHORT] = 0.0
