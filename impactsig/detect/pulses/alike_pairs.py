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
from ._alike_kernels import (
    BEFORE,
    BOTH,
    KNOTS,
    PER_CONTACT,
    add_to_shape,
    fit_two,
    solve_shape,
)
from ._knots import Knots, no_knots
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
LOG, LOG_SD, STEPS = 0.2, 0.3, (0.35, 0.15, 0.05)
"""Logarithm of the power of a sine that an unknown shape is expected to be, and its standard
deviation; steps to either side in which it is looked for."""
STEP, HIDDEN, HIDES = 0.1, (1.2, 2.2), 3.0
"""Of the logarithm, to see what it moves; contact times that starts and contact times of shapes
outside of a family are off by, times what is left of them over the height; and standard deviations
of chi squared that noise hides of it."""
LOWEST, HIGHEST = -0.3, 0.9  # logarithms of powers
MOST, TRIED = 8, 6  # pairs of a span that tell the power, and pulses that tell how alike they are
NOWHERE = 1e9  # where the second of one pulse begins
MISFIT, SHAPE = 2.0, 0.02  # residual variance over the noise's, or over the height's square
PLACED = 0.4  # contact times that crests may be off from where they were
AS_LONG = 1.8  # times the usual contact, or less by as much, that one of a pair may last
RUNS = 8.0  # runs of alike rest in a contact, where the shape misses more than noise
OFF = 2.0
"""Contact times that ends are off where no two pulses fit, times how far from that of a half-sine
the area is, over height and contact time."""
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
    off: np.ndarray  # by how much single pulses differ from the mean shape in these
    single: np.ndarray  # errors of these by noise, over it
    shared: np.ndarray  # of start and peak


def near_pulses(rows: np.ndarray) -> Near:
    """Sort pulses by their distance, before they are measured by a shared shape.

    Until then a fit is told by its start.
    """
    none = np.empty(0, np.intp)
    apart = np.diff(rows[:, 0] + rows[:, 4])
    if not (apart < FITTED * np.maximum(rows[1:, 1], rows[:-1, 1])).any():
        return Near(none, none, np.zeros(len(rows), np.bool_), 1.0)
    whole = np.isin(rows[:, 5], (0, UNRESOLVED)) & (rows[:, 6] == 0)
    fitted = (rows[:, 5] == 0) & whole & (rows[:, FIT + MADE] == rows[:, 0])
    known = whole & (rows[:, 5] == 0)
    known = known if known.any() else whole
    if not known.any():
        return Near(none, none, np.zeros(len(rows), np.bool_), 1.0)
    usual = float(np.median(rows[known, 1]))
    apart = apart / usual
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


class Power(NamedTuple):
    """Logarithm of the power of a sine that pairs are like, and what is known of it."""

    log: float
    known: float  # over the square of its error
    rest: float = 0.0  # mean square of what it leaves, or noise may hide of it, over the height's


class PairsAlike:
    """Measures pairs by what the spans so far show of single pulses.

    `timed`: contact times are those from first to last touch; only these are measured.
    """

    def __init__(self, timed: bool) -> None:
        self.timed = timed
        self.knots = no_knots(KNOTS)
        self.last = np.empty((0, FIT + KEPT))
        self.off = np.empty((0, 2 * SIZES))
        self.power = Power(LOG, LOG_SD**-2.0)

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
        if not self.timed or not (near.overlap.any() or len(near.pairs)):
            return
        if learn and len(near.alone):
            self._learn(rows, near, x, origin)
        shape = self._shape()
        noise = float(np.median(self.last[:, FIT + NOISE])) if len(self.last) else sigma
        pairs = []
        for k in near.pairs:
            seen = _stretch(
                rows[k : k + 2], near.usual, *_between(rows, k, k + 1), noise, x, origin
            )
            if seen is not None:
                pairs.append((rows[k : k + 2], seen))
        before = rows[:, 0].copy()
        if shape is None:
            self.power = _find_power(pairs, near.usual, self.power)
            shape = _power(self.power.log, near.usual)
            for two, seen in pairs:
                _by_power(two, seen, near.usual, self.power)
        else:
            for two, seen in pairs:
                _by_shape(two, seen, shape)
        missed = near.overlap & (rows[:, 0] == before)
        off = OFF * abs(shape.area - 2.0 / math.pi) * near.usual
        ends = rows[missed, ERRORS : ERRORS + 2]
        rows[missed, ERRORS : ERRORS + 2] = np.hypot(ends, off)

    def _learn(self, rows: np.ndarray, near: Near, x: np.ndarray, origin: int) -> None:
        """Add what the pulses of a span that stand alone show, and how well the shape fits them."""
        self.knots = Knots(*(part * (1.0 - FORGOTTEN) for part in self.knots))
        add_to_shape(rows, near.alone, x, origin, self.knots)
        self.last = np.concatenate((self.last, rows[near.alone]))[-LAST:]
        if (shape := self._shape()) is None:
            return
        off = []
        for k in near.alone[:TRIED]:
            one = rows[k : k + 1]
            noise = float(one[0, FIT + NOISE])
            seen = _stretch(one, near.usual, *_between(rows, k, k), noise, x, origin)
            if seen is not None and (found := _fit(one, seen, shape)) is not None:
                new = one[0].copy()
                _put(new, found[0][:3], found[1][:3, :3], seen, shape)
                sizes = one[0, [1, 1, 2, 3]]
                apart = (new[:SIZES] - one[0, :SIZES]) / sizes
                relative = new[ERRORS : ERRORS + SIZES] * new[2] / sizes
                off.append([*apart, *(relative / (seen.unit * math.sqrt(seen.per)))])
        self.off = np.concatenate((self.off, np.reshape(off, (-1, 2 * SIZES))))[-LAST:]

    def _shape(self) -> Shape | None:
        """The shape, if pulses show it."""
        knots = np.empty(KNOTS)
        some = self.last
        if len(some) < FEWEST or not solve_shape(self.knots, knots):
            return None
        contact, peak = some[:, 1], some[:, 2]
        lengths = np.log(contact)
        sizes = np.column_stack((contact, contact, peak, some[:, 3]))
        shared = np.min(some[:, SHARED : SHARED + 2] / sizes[:, [0, 2]], axis=0)
        shape = Shape(
            knots,
            float(np.median(some[:, 4] / contact)),
            float(np.median(some[:, 3] / (contact * peak))),
            float(np.median(lengths)),
            math.hypot(float(np.std(lengths)), SPREAD),
            np.zeros(SIZES),
            np.zeros(SIZES),
            np.full(SIZES, np.inf),
            shared,
        )
        if not len(self.off):
            return shape
        return shape._replace(
            errors=np.min(some[:, ERRORS : ERRORS + SIZES] / sizes, axis=0),
            off=np.sqrt(np.mean(self.off[:, :SIZES] ** 2, axis=0)),
            single=np.median(self.off[:, SIZES:], axis=0),
        )


class _Stretch(NamedTuple):
    """Means of samples about one or two pulses, in units of their noise."""

    points: np.ndarray  # counted from `zero`
    means: np.ndarray
    zero: float
    unit: float
    per: int
    crests: np.ndarray
    height: float


def _between(rows: np.ndarray, first: int, last: int) -> tuple[float, float]:
    """End of the pulse before some, and start of that after them."""
    before = float(rows[first - 1, 0] + rows[first - 1, 1]) if first > 0 else 0.0
    return before, float(rows[last + 1, 0]) if last + 1 < len(rows) else np.inf


def _stretch(
    some: np.ndarray,
    usual: float,
    first: float,
    last: float,
    noise: float,
    x: np.ndarray,
    origin: int,
) -> _Stretch | None:
    """The samples about one or two pulses between their neighbours, None where they are too few."""
    crests = some[:, 0] + some[:, 4]
    margin = (1.0 + BESIDE) * usual
    begin = max(int(crests[0] - margin), int(first) + 1, origin)
    end = int(min(crests[-1] + margin + 1.0, last, origin + len(x)))
    per = max(int(usual) // POINTS, 1)
    count = (end - begin) // per
    height = float(some[:, 2].max())
    if count < 2 * BOTH or not height > 0.0:
        return None
    unit = max(noise / math.sqrt(per), 1e-3 * height)
    means = x[begin - origin : begin - origin + count * per].reshape(count, per).mean(axis=1) / unit
    # Rounding takes least of times that are counted from here.
    points = per * np.arange(count) + 0.5 * (per - 1)
    return _Stretch(points, means, float(begin), unit, per, crests - begin, height)


def _descend(
    some: np.ndarray, seen: _Stretch, shape: Shape
) -> tuple[np.ndarray, np.ndarray, float]:
    """Parameters of one or two pulses of a shape, their covariance and the misfit."""
    p, covariance = np.zeros(BOTH), np.zeros((BOTH, BOTH))
    p[2] = p[5] = shape.length
    p[4] = NOWHERE
    p[BOTH - 1] = min(seen.means[:3].mean(), seen.means[-3:].mean())
    for m, row in enumerate(some):
        p[3 * m] = max(row[2], 0.1 * seen.height) / seen.unit
        p[3 * m + 1] = seen.crests[m] - shape.crest * math.exp(shape.length)
    misfit = fit_two(
        seen.points, seen.means, shape.knots, shape.length, shape.spread, p, covariance
    )
    runs = math.exp(shape.length) / (seen.per * RUNS)
    covariance *= 1.0 + max(misfit - 1.0, 0.0) * max(runs, 1.0)
    return p, covariance, misfit


def _fit(
    some: np.ndarray, seen: _Stretch, shape: Shape
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """The same; None where pulses of the shape do not fit."""
    p, covariance, misfit = _descend(some, seen, shape)
    high = (SHAPE * seen.height / seen.unit) ** 2
    heights, starts, logs = (p[m : 3 * len(some) : 3] for m in range(3))
    if not misfit <= max(MISFIT, high) or not (heights > 0.0).all():
        return None
    lengths = np.exp(logs)
    off = np.abs(starts + shape.crest * lengths - seen.crests)
    if (off > PLACED * lengths).any() or (np.abs(logs - shape.length) > math.log(AS_LONG)).any():
        return None
    return (p, covariance, misfit) if seen.zero + starts[0] >= 0.0 else None


def _put(
    row: np.ndarray, p: np.ndarray, covariance: np.ndarray, seen: _Stretch, shape: Shape
) -> None:
    """Write one pulse with its errors into a row."""
    length, peak = math.exp(p[2]), p[0] * seen.unit
    impulse = shape.area * peak * length
    row[0], row[1], row[2], row[3] = seen.zero + p[1], length, peak, impulse
    row[4], row[5] = shape.crest * length, 0.0
    relative = covariance[0, 0] / p[0] ** 2
    both = relative + covariance[2, 2] + 2.0 * covariance[2, 0] / p[0]
    own = (covariance[1, 1], length**2 * covariance[2, 2], peak**2 * relative, both * impulse**2)
    sizes = (length, length, peak, impulse)
    noise = seen.unit * math.sqrt(seen.per)
    for q in range(SIZES):
        error = math.sqrt(max(own[q], 0.0))
        # What moves an end by much where only noise does also does where the shape is another.
        less = max(error * peak / (sizes[q] * noise * shape.single[q]), 1.0)
        rest = math.hypot(shape.errors[q], shape.off[q] * less) * sizes[q]
        row[ERRORS + q] = math.hypot(error, rest)
    row[SHARED], row[SHARED_PEAK] = shape.shared[0] * length, shape.shared[1] * peak


def _by_shape(two: np.ndarray, seen: _Stretch, shape: Shape) -> bool:
    """Measure a pair by a shape; whether it fits."""
    if (found := _fit(two, seen, shape)) is None:
        return False
    p, covariance, _ = found
    for m, row in enumerate(two):
        own = slice(3 * m, 3 * m + 3)
        _put(row, p[own], covariance[own, own], seen, shape)
    return True


def _find_power(pairs: list[tuple[np.ndarray, _Stretch]], usual: float, before: Power) -> Power:
    """The power of a sine that fits pairs best; what spans `before` tell is forgotten slowly.

    It is where the parabola through three sums of squares is least, which is looked for twice.
    """
    known = max((1.0 - FORGOTTEN) * before.known, LOG_SD**-2.0)
    log, total = before.log, known
    rest = square = points = 0.0
    for step in STEPS:
        slope, total = known * (log - before.log), known
        rest = square = points = 0.0
        for two, seen in pairs[:MOST]:
            shapes = (_power(log + m * step, usual) for m in (-1, 0, 1))
            low, middle, high = (_descend(two, seen, shape)[2] for shape in shapes)
            least = min(low, middle, high)
            if not math.isfinite(low + middle + high):
                continue
            scale = 0.5 * len(seen.points) / max(least, 1.0)  # of noise, by what is left
            slope += scale * 0.5 * (high - low) / step
            total += scale * max(high - 2.0 * middle + low, 0.0) / step**2
            one = (seen.unit / seen.height) ** 2
            rest, square, points = (
                rest + (least - 1.0) * one,
                square + one,
                points + len(seen.points),
            )
        log -= min(max(slope / total, -1.5 * step), 1.5 * step)
        log = min(max(log, LOWEST), HIGHEST)
    if not points:
        return Power(log, total, before.rest)
    count = min(len(pairs), MOST)
    return Power(log, total, (max(rest, 0.0) + HIDES * math.sqrt(2.0 / points) * square) / count)


def _by_power(two: np.ndarray, seen: _Stretch, usual: float, power: Power) -> None:
    """Measure a pair by a power of a sine, if it fits."""
    before = two.copy()
    if not _by_shape(two, seen, _power(power.log, usual)):
        return
    if not _by_shape(before, seen, _power(power.log + STEP, usual)):
        before = two
    turned = (before[:, :SIZES] - two[:, :SIZES]) / STEP * power.known**-0.5
    ends = math.sqrt(power.rest) * two[:, [1]] * [*HIDDEN, 0.0, 0.0]
    errors = two[:, ERRORS : ERRORS + SIZES]
    two[:, ERRORS : ERRORS + SIZES] = np.hypot(np.hypot(errors, turned), ends)


def _power(log: float, usual: float) -> Shape:
    """The shape of a sine to a power."""
    place = (np.arange(KNOTS) - BEFORE) / PER_CONTACT
    knots = np.maximum(np.sin(np.pi * np.clip(place, 0.0, 1.0)), 0.0) ** math.exp(log)
    area = float(knots.sum()) / PER_CONTACT
    none, every = np.zeros(SIZES), np.full(SIZES, np.inf)
    return Shape(knots, 0.5, area, math.log(usual), LOOSE, none, none, every, none[:2])
