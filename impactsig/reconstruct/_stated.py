"""Known errors of a series: given by the caller, or by the errors of impacts."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .._arguments import number
from .._trains.interval_errors import errors_in_intervals
from ..impacts import Impacts

FAR_OFF = 5.0
"""Times the root mean square of the others, from which on an error is none of their kind."""


BY_IMPACTS = "by the time_error of the impacts"


class Stated(NamedTuple):
    """Standard errors of instants and of values, with their origin."""

    timing: float
    value: float
    source: str

    @property
    def of_value(self) -> float:
        """Standard error of one value; neighbouring intervals share an instant."""
        return math.hypot(math.sqrt(2) * self.timing, self.value)

    @property
    def steps(self) -> int:
        """Number of steps after which errors are independent."""
        return 2 if self.timing else int(self.value > 0)


def stated_errors(x: Any, timing: float | None, value: float | None) -> Stated | None:
    """The errors as given, else from the `time_error` of impacts; None if unknown."""
    if timing is not None:
        timing = number("timing_error", timing, least=0)
    if value is not None:
        value = number("value_error", value, least=0)
    if timing is not None or value is not None:
        return Stated(timing or 0.0, value or 0.0, "as given")
    if isinstance(x, Impacts) and x.time_error is not None:
        errors = errors_in_intervals(x, x.time_error)
        errors = errors[np.isfinite(errors)]
        if len(errors):
            return Stated(typical(errors), 0.0, BY_IMPACTS)
    return None


def typical(errors: np.ndarray) -> float:
    """Root mean square of errors, without those far beyond it.

    Some impacts are hardly timed: in a record of sound, 1 % of them by up to 265 microseconds, the
    others by 0.2. Their vectors have lost their neighbours, as if they had been missed; with the
    root mean square of all, 12 microseconds, noise would be taken off that is not there.
    """
    kept = np.sort(errors)
    while True:
        unit = float(np.ldexp(1.0, np.frexp(kept[-1])[1] - 1))  # whose multiples can be squared
        level = unit * float(np.sqrt(np.mean((kept / unit) ** 2)))
        count = int(np.searchsorted(kept, FAR_OFF * level, side="right"))
        if count in (0, len(kept)):  # 0 where all squares vanish
            return level
        kept = kept[:count]
