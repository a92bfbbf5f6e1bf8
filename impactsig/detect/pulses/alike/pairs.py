"""Pulses that touch or overlap, measured with the shape of those that stand alone.

Two half-sines (`pulses/pairs.py`) hardly miss two pulses of another shape, but their ends do: where
feet overlap, a softer or steeper one moves them by a tenth of a contact. So once the pulses of a
span are measured by their shared shape, the mean of those that stand alone is fitted to both of a
pair. Where none do, the shape is unknown: how far pairs of other shapes lie is added to the errors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._trains.impact_flags import UNRESOLVED
from .._knots import Knots
from ..edges import ERRORS, FIT, SHARED
from ..fit_errors import CLEAR, KEPT, MADE, NOISE
from ._alike_kernels import KNOTS, add_to_shape, solve_shape
from ._pairs_of_power import FORGOTTEN, Power, find_power, measure_by_power, shape_of_power
from ._pulses_of_shape import (
    SIZES,
    Shape,
    between,
    fit_shape,
    measure_by_shape,
    put,
    stretch_of,
)

NEAR, FITTED, ALONE, OVERLAP = 1.2, 1.8, 1.5, 1.0
"""Usual contact times between two crests that are a pair, at most, or that half-sines were fitted
to; from others, at least; and of those that overlap, at most."""
FEWEST, TRIED = 3, 6  # pulses that show a shape, and of a span that tell how alike they are
LAST = 32  # pulses that tell their length
SPREAD = 0.03  # of the logarithms of contact times, at least
OFF = 2.0
"""Contact times that ends are off where no two pulses fit, times how far from that of a half-sine
the area is, over height and contact time."""


class Near(NamedTuple):
    """Pulses by their distance."""

    pairs: np.ndarray  # the first of each
    alone: np.ndarray  # that show their shape
    overlap: np.ndarray  # whether each is nearer than a contact to another
    usual: float  # contact time


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


class PairsAlike:
    """Measures pairs by what the spans so far show of single pulses.

    `timed`: contact times are those from first to last touch; only these are measured.
    """

    def __init__(self, timed: bool) -> None:
        self.timed = timed
        self.knots = Knots(*np.zeros((4, KNOTS)))
        self.last = np.empty((0, FIT + KEPT))
        self.off = np.empty((0, 2 * SIZES))
        self.power = Power()

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
            seen = stretch_of(
                rows[k : k + 2], near.usual, *between(rows, k, k + 1), noise, x, origin
            )
            if seen is not None:
                pairs.append((rows[k : k + 2], seen))
        before = rows[:, 0].copy()
        if shape is None:
            self.power = find_power(pairs, near.usual, self.power)
            shape = shape_of_power(self.power.log, near.usual)
            for two, seen in pairs:
                measure_by_power(two, seen, near.usual, self.power)
        else:
            for two, seen in pairs:
                measure_by_shape(two, seen, shape)
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
            seen = stretch_of(one, near.usual, *between(rows, k, k), noise, x, origin)
            if seen is not None and (found := fit_shape(one, seen, shape)) is not None:
                new = one[0].copy()
                put(new, found[0][:3], found[1][:3, :3], seen, shape)
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
