"""Pulses of seconds that hold too few of them to show their shape, until there are enough.

Alone, a pulse without a flat top is taken to have one more often than not, for there is none that
is shorter than nothing: its height is read a standard error and more too low.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..edges import FIT
from ..fit_errors import FROM, MADE, SEEN, TAKEN, TO, ZERO
from .shared_shape import share_shape
from .told import nothing_told

MANY = 32
"""Pulses that are measured together; the last ones, with all that are left."""
BEGIN = 2**20
"""Place of the first of their samples: no instant is taken for one before the record."""


class Held(NamedTuple):
    """A pulse that waits for others."""

    row: np.ndarray  # of the results, as a view
    start: float  # of the pulse, as it was measured alone
    fit: np.ndarray  # the row with all that is kept of its fit
    samples: np.ndarray  # that it was fitted to


class FewPulses:
    """Pulses that wait for others; `timed`: contact times are those from first to last touch."""

    def __init__(self, timed: bool) -> None:
        self.timed = timed
        self.told = nothing_told()
        self.held: list[Held] = []

    def add(self, rows: np.ndarray, x: np.ndarray, origin: int) -> None:
        """Hold pulses, rows that `share_shape` would be given; later these are changed in place."""
        for row in rows:
            kept = row[FIT:]
            if kept[MADE] != row[0]:
                continue  # without a fit
            first, last = (int(kept[ZERO] + kept[end]) - origin for end in (FROM, TO))
            if 0 <= first < last <= len(x):
                self.held.append(Held(row, float(row[0]), row.copy(), x[first:last].copy()))
        if len(self.held) >= 2 * MANY:
            self._measure(MANY)

    def finish(self) -> None:
        """Measure all that are left."""
        if self.held:
            self._measure(len(self.held))

    def _measure(self, count: int) -> None:
        """Measure the first of them anew, as if they had followed each other."""
        some, self.held = self.held[:count], self.held[count:]
        rows = np.array([one.fit for one in some])
        at = BEGIN + np.cumsum([0, *(len(one.samples) for one in some[:-1])])
        kept = rows[:, FIT:]
        moved = at - (kept[:, ZERO] + kept[:, FROM])
        for column in (rows[:, 0], kept[:, ZERO], kept[:, TAKEN], kept[:, MADE], kept[:, SEEN]):
            column += moved
        begun = rows[:, 0].copy()
        samples = np.concatenate([one.samples for one in some])
        share_shape(rows, samples, BEGIN, self.timed, self.told)
        for one, row, start in zip(some, rows, begun, strict=True):
            one.row[0] += row[0] - start
            one.row[1:FIT] = row[1:FIT]
