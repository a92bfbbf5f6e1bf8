"""The state of interval feedback: spikes one after another, and the parameter change."""

from __future__ import annotations

from typing import Any

import numpy as np


class Listener:
    """Computes the parameter change, spike by spike.

    Parameters
    ----------
    phases : tuple of (float, IntervalFeedback or None)
        Which controller is on from when.
    """

    def __init__(self, phases: tuple[tuple[float, Any], ...]) -> None:
        self._phases = phases
        self._starts = np.array([start for start, _ in phases])
        self._kept = max([own.delay for _, own in phases if own is not None], default=1) + 1
        self._intervals: list[float] = []
        self._on: Any = None
        self._besides = 0.0  # change besides the offset

    def hear(self, interval: float) -> None:
        """Take in a spike that ends an interval."""
        self._intervals.append(interval)
        del self._intervals[: max(len(self._intervals) - self._kept, 0)]

    def moved(self, time: float) -> tuple[Any, float]:
        """The active controller, or None, and the parameter change from now on."""
        k = int(np.searchsorted(self._starts, time, "right")) - 1
        own = self._phases[k][1] if k >= 0 else None
        before = self._besides if own is self._on else 0.0
        self._on = own
        self._besides = 0.0 if own is None else own.move(self._intervals, before)
        return own, 0.0 if own is None else own.offset + self._besides
