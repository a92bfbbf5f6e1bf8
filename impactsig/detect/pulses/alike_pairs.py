"""Pulses that touch or overlap, measured with the shape of those that stand alone.

Two half-sines (`pairs.py`) hardly miss two pulses of another shape, but their ends do: where feet
overlap, a softer or steeper one moves them by a tenth of a contact. So once the pulses of a span
are measured by their shared shape, the mean of those that stand alone is fitted to both of a pair.
Where none do, the shape is unknown: how far pairs of other shapes lie is added to the errors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._trains.impact_flags import UNRESOLVED
from ._two_of_a_shape import (
    BEFORE,
    BOTH,
    KNOTS,
    PER_CONTACT,
    add_to_shape,
    fit_two,
    solve_shape,
)
from .edges import ERRORS, FIT, SHARED, SHARED_PEAK
from .fit_errors import CLEAR, KEPT, MADE, NOISE

NEAR, FITTED, ALONE, OVERLAP = 1.2, 1.8, 1.5, 1.0
"""Usual contact times between two crests that are a pair, at most, or that half-sines were fitted
to; from others, at least; and of those that overlap, at most."""
FEWEST = 3  # pulses that show a shape
FORGOTTEN, LAST = 0.3, 32  # of the shape at each span; the last pulses that tell their length
BESIDE = 0.5  # contact times on either side of a pair that are fitted with it
POINTS = 64  # means of samples in a contact, at most
SPREAD = 0.03  # of the logarithms of contact times, at least
LOOSE = 0.25  # of those of pulses of unknown shape
POWERS = (1.0, 1.35, 1.8)  # of a sine: shapes that an unknown one may be
MISFIT, SHAPE = 2.0, 0.02  # residual variance over the noise's, or over the height's square
PLACED = 0.4  # contact times that crests may be off from where they were
AS_LONG = 1.8  # times the usual contact, or less by as much, that one of a pair may last
RUNS = 8.0  # runs of alike rest in a contact, where the shape misses more than noise
OFF = 0.15  # contact times that an end may be off where no two pulses fit
SIZES = 4  # start, contact time, peak and impulse


class Near(NamedTuple):
    """Pulses by their distance."""

    pairs: np.ndarray  # the first of each
    alone: np.ndarray  # that show their shape
    overlap: np.ndarray  # whether each is nearer than a contact to another
    usual: float  # contact time


class Shape(NamedTuple):
    """Shape of the pulses that stand alone."""

    knots: np.ndarray
    crest: float  # contact times since the start
    area: float  # over height and contact time
    length: float  # mean logarithm of the contact time
    spread: float
    errors: np.ndarray  # of start, contact time, peak, impulse: what pulses share of them
    shared: np.ndarray  # of start and peak


def near_pulses(rows: np.ndarray) -> Near:
    """Sort pulses by their distance, before they are measured by a shared shape.

    Until then a fit is told by its start.
    """
    whole = np.isin(rows[:, 5], (0, UNRESOLVED)) & (rows[:, 6] == 0)
    fitted = (rows[:, 5] == 0) & whole & (rows[:, FIT + MADE] == rows[:, 0])
    known = fitted if fitted.any() else whole
    if not known.any():
        none = np.empty(0, np.intp)
        return Near(none, none, np.zeros(len(rows), np.bool_), 1.0)
    usual = float(np.median(rows[known, 1]))
    apart = np.diff(rows[:, 0] + rows[:, 4]) / usual
    before = np.concatenate(([np.inf], apart))
    after = np.concatenate((apart, [np.inf]))
    halves = (rows[:, 5] == 0) & ~fitted
    pair = (apart < NEAR) | (halves[:-1] & halves[1:] & (apart < FITTED))
    pair &= whole[:-1] & whole[1:] & (before[:-1] > ALONE) & (after[1:] > ALONE)
    alone = fitted & (before > ALONE) & (after > ALONE)
    noise = np.where(alone, rows[:, FIT + NOISE], np.inf)
    alone &= rows[:, 2] >= CLEAR * noise
    overlap = whole & (np.minimum(before, after) < OVERLAP)
    return Near(np.flatnonzero(pair), np.flatnonzero(alone), overlap, usual)


class PairsAlike:
    """Measures pairs by what the spans so far show of single pulses.

    `timed`: contact times are those from first to last touch; only these are measured.
    """

    def __init__(self, timed: bool) -> None:
        self.timed = timed
        self.normal, self.right = np.zeros((KNOTS, KNOTS)), np.zeros(KNOTS)
        self.last = np.empty((0, FIT + KEPT))

    def measure(
        self,
        rows: np.ndarray,
        near: Near,
        sigma: float,
        x: np.ndarray,
        origin: int,
        *,
        learn: bool,
    ) -> None:
        """Measure the pairs of a span in its rows; `learn` from those that stand alone."""
        if not self.timed:
            return
        if learn and len(near.alone):
            self.normal *= 1.0 - FORGOTTEN
            self.right *= 1.0 - FORGOTTEN
            add_to_shape(rows, near.alone, x, origin, self.normal, self.right)
            self.last = np.concatenate((self.last, rows[near.alone]))[-LAST:]
        if not near.overlap.any() and not len(near.pairs):
            return
        shape = self._shape()
        noise = float(np.median(self.last[:, FIT + NOISE])) if len(self.last) else sigma
        done = np.zeros(len(rows), np.bool_)
        for k in near.pairs:
            first = rows[k - 1, 0] + rows[k - 1, 1] if k > 0 else 0.0
            last = rows[k + 2, 0] if k + 2 < len(rows) else np.inf
            two = rows[k : k + 2]
            stretch = _stretch(two, near.usual, first, last, noise, x, origin)
            if stretch is None:
                continue
            fits = _by_shape(two, stretch, shape) if shape else _by_any(two, stretch, near.usual)
            done[k : k + 2] = fits
        missed = near.overlap & ~done
        rows[missed, 5] = UNRESOLVED
        ends = rows[missed, ERRORS : ERRORS + 2]
        rows[missed, ERRORS : ERRORS + 2] = np.hypot(ends, OFF * near.usual)

    def _shape(self) -> Shape | None:
        """The shape, if pulses show it."""
        knots = np.empty(KNOTS)
        some = self.last
        if len(some) < FEWEST or not solve_shape(self.normal, self.right, knots):
            return None
        contact, peak = some[:, 1], some[:, 2]
        lengths = np.log(contact)
        sizes = np.column_stack((contact, contact, peak, some[:, 3]))
        return Shape(
            knots,
            float(np.median(some[:, 4] / contact)),
            float(np.median(some[:, 3] / (contact * peak))),
            float(np.median(lengths)),
            math.hypot(float(np.std(lengths)), SPREAD),
            np.min(some[:, ERRORS : ERRORS + SIZES] / sizes, axis=0),
            np.min(some[:, SHARED : SHARED + 2] / sizes[:, [0, 2]], axis=0),
        )


class _Stretch(NamedTuple):
    """Means of samples about a pair, in units of their noise."""

    points: np.ndarray  # counted from `zero`
    means: np.ndarray
    zero: float
    unit: float
    per: int
    crests: np.ndarray
    height: float


def _stretch(
    two: np.ndarray,
    usual: float,
    first: float,
    last: float,
    noise: float,
    x: np.ndarray,
    origin: int,
) -> _Stretch | None:
    """The samples about a pair between its neighbours, None where they are too few."""
    crests = two[:, 0] + two[:, 4]
    margin = (1.0 + BESIDE) * usual
    begin = max(int(crests[0] - margin), int(first) + 1, origin)
    end = min(int(crests[1] + margin) + 1, origin + len(x))
    end = min(end, int(last)) if last < end else end
    per = max(int(usual) // POINTS, 1)
    count = (end - begin) // per
    height = float(two[:, 2].max())
    if count < 2 * BOTH or not height > 0.0:
        return None
    unit = max(noise / math.sqrt(per), 1e-3 * height)
    means = x[begin - origin : begin - origin + count * per].reshape(count, per).mean(axis=1) / unit
    # Rounding takes least of times that are counted from here.
    points = per * np.arange(count) + 0.5 * (per - 1)
    return _Stretch(points, means, float(begin), unit, per, crests - begin, height)


def _fit(
    two: np.ndarray, seen: _Stretch, shape: Shape
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Parameters of two pulses of a shape, their covariance and the misfit; None if none fit."""
    p, covariance = np.zeros(BOTH), np.zeros((BOTH, BOTH))
    p[BOTH - 1] = min(seen.means[:3].mean(), seen.means[-3:].mean())
    for m in range(2):
        p[3 * m], p[3 * m + 2] = max(two[m, 2], 0.1 * seen.height) / seen.unit, shape.length
        p[3 * m + 1] = seen.crests[m] - shape.crest * math.exp(shape.length)
    misfit = fit_two(
        seen.points, seen.means, shape.knots, shape.length, shape.spread, p, covariance
    )
    high = (SHAPE * seen.height / seen.unit) ** 2
    if not misfit <= max(MISFIT, high) or min(p[0], p[3]) <= 0.0:
        return None
    lengths = np.exp(p[[2, 5]])
    off = np.abs(p[[1, 4]] + shape.crest * lengths - seen.crests)
    unlike = np.abs(p[[2, 5]] - shape.length)
    if (off > PLACED * lengths).any() or (unlike > math.log(AS_LONG)).any():
        return None
    if seen.zero + p[1] < 0.0:
        return None
    covariance *= 1.0 + max(misfit - 1.0, 0.0) * max(
        math.exp(shape.length) / (seen.per * RUNS), 1.0
    )
    return p, covariance, misfit


def _by_shape(two: np.ndarray, seen: _Stretch, shape: Shape) -> bool:
    """Measure a pair by a shape; whether it fits."""
    found = _fit(two, seen, shape)
    if found is None:
        return False
    p, covariance, _ = found
    for m, row in enumerate(two):
        a, start, log = 3 * m, 3 * m + 1, 3 * m + 2
        length, peak = math.exp(p[log]), p[a] * seen.unit
        impulse = shape.area * peak * length
        row[0], row[1], row[2], row[3] = seen.zero + p[start], length, peak, impulse
        row[4], row[5] = shape.crest * length, 0.0
        relative = covariance[a, a] / p[a] ** 2
        both = relative + covariance[log, log] + 2.0 * covariance[log, a] / p[a]
        own = (
            covariance[start, start],
            length**2 * covariance[log, log],
            peak**2 * relative,
            impulse**2 * max(both, 0.0),
        )
        sizes = (length, length, peak, impulse)
        for q in range(SIZES):
            row[ERRORS + q] = math.sqrt(own[q] + (shape.errors[q] * sizes[q]) ** 2)
        row[SHARED], row[SHARED_PEAK] = shape.shared[0] * length, shape.shared[1] * peak
    return True


def _by_any(two: np.ndarray, seen: _Stretch, usual: float) -> bool:
    """Measure a pair by the shape that fits it best, with its distance from others as error."""
    best, kept = np.inf, np.empty((0, 0))
    every = []
    for power in POWERS:
        one = two.copy()
        place = (np.arange(KNOTS) - BEFORE) / PER_CONTACT
        knots = np.sin(np.pi * np.clip(place, 0.0, 1.0)) ** power
        area = float(knots.sum()) / PER_CONTACT
        none = np.zeros(SIZES)
        shape = Shape(knots, 0.5, area, math.log(usual), LOOSE, none, none[:2])
        found = _fit(two, seen, shape)
        if found is None or not _by_shape(one, seen, shape):
            continue
        every.append(one)
        if found[2] < best:
            best, kept = found[2], one
    if not every:
        return False
    two[:] = kept
    for one in every:
        off = np.abs(one[:, :SIZES] - kept[:, :SIZES])
        two[:, ERRORS : ERRORS + SIZES] = np.maximum(
            two[:, ERRORS : ERRORS + SIZES], np.hypot(kept[:, ERRORS : ERRORS + SIZES], off)
        )
    return True
