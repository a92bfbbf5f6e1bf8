"""The shape that impacts of one machine share, and each of them measured with it.

Skew, flatness, power and length of the edges and the difference of their powers are taken as
normally distributed over the pulses of one span. Mean and spread are estimated from all of them
(`_shared_shape_kernels.py`), each pulse being linear about its fit: clear pulses show the shape,
and faint ones are measured with it. `_misfit.py` corrects what no member of the family follows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiled import allocating, inner
from ..signal.order_kernels import centre_of
from ._misfit import correct_misfit
from ._model import FLAT, LENGTH, SKEW, START, WIDER, parts_of
from ._shared_shape_kernels import BRIEF, SHAPES, estimate_shape, set_free, variance_along
from .edges import ERRORS, FIT
from .fit_errors import BESIDE, EDGE, ESTIMATE, TAKEN, UNIT

LEAST = 5
"""Pulses that a shape is read from."""
ABOUT = np.array([0.0, 0.3, 0.0, 0.0, 0.0])
"""Where the mean shape is expected; its length at that of the matched responses."""
BENT = 0.2
"""Of the way that an instant is moved by: the standard error of taking the fit to be linear."""


class Work(NamedTuple):
    """Room to measure a pulse in."""

    new: np.ndarray  # (WIDER,), its parameters
    along: np.ndarray  # (3, WIDER), derivatives of instant, contact time and peak
    seen: np.ndarray  # (SHAPES,), twice for variances
    moved: np.ndarray


@allocating
def share_shape(rows, timed):
    """Measure the pulses of `rows` anew, in place, each by the shape that they share.

    Parameters
    ----------
    rows : array
        As `impactsig.detect.pulses.pulse.measure_all` fills them.
    timed : bool
        Contact times are those from first to last touch.
    """
    alike = np.empty(len(rows), np.int64)
    count = 0
    for k in range(len(rows)):
        if rows[k, 5] == 0 and rows[k, 6] == 0 and rows[k, FIT + TAKEN] == rows[k, 0]:
            alike[count] = k
            count += 1
    alike = alike[:count]
    if count >= LEAST:
        about = ABOUT.copy()
        edges = np.empty(count)
        for i in range(count):
            edges[i] = rows[alike[i], FIT + EDGE]
        about[LENGTH - SKEW] = centre_of(edges, count)
        fits = set_free(rows[alike, FIT:])
        shape = estimate_shape(fits, about)
        work = Work(np.empty(WIDER), np.zeros((3, WIDER)), np.empty(SHAPES), np.empty(SHAPES))
        for i in range(count):
            _measure(rows[alike[i]], i, fits, shape, timed, work)
    correct_misfit(rows, alike, timed)


@inner
def _measure(row, i, fits, shape, timed, work):
    """Write instant, contact time and peak of pulse i, and their errors, by the shape."""
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
    if abs(moved) >= 0.5 * previous or row[0] + moved < 0.0:
        return
    if not (0.5 < contact / previous < 2.0 and 0.5 < new[0] / old[0] < 2.0):
        return
    along[0, START] = along[2, 0] = 1.0
    along[1, SKEW], along[1, FLAT] = 0.5 * (parts.rise - parts.fall), flat + middle * BRIEF
    along[1, LENGTH] = contact
    start = (
        variance_along(along[0], i, fits, shape, seen, turned) + kept[BESIDE] + (BENT * moved) ** 2
    )
    row[0] += moved
    row[ERRORS] = math.sqrt(start)
    if timed:
        row[1], row[4] = contact, parts.rise + 0.5 * flat
        # That of the baseline hardly moves a length that the shape holds.
        row[ERRORS + 1] = math.sqrt(variance_along(along[1], i, fits, shape, seen, turned))
    if kept[UNIT] > 0.0:
        peak = variance_along(along[2], i, fits, shape, seen, turned) + kept[BESIDE + 2]
        row[2] = new[0] * kept[UNIT]
        row[ERRORS + 2] = math.sqrt(peak) * kept[UNIT]
