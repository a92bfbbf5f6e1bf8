"""Kinds of series that are recognised before a dimension is estimated."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from ...intervals import Periodicity

CERTAIN = 0.95
"""Confidence from which on a period of impacts is taken for granted."""


class Kind(NamedTuple):
    """Kind of a series.

    `period` counts values; `scatter` is the standard deviation about it; `tones` the independent
    frequencies of a quasi-periodic series, 0 where there are more than two.
    """

    name: Literal["constant", "periodic", "quasi-periodic", "noise", "motion"]
    period: int | None = None
    scatter: float = 0.0
    tones: int = 0


def is_certain(period: Periodicity) -> bool:
    """Whether a train is certainly periodic, even if its forcing drifts."""
    return period.recurs and period.confidence >= CERTAIN


def of_period(period: Periodicity) -> Kind:
    """The kind of a periodic train; its intervals scatter by sqrt(2) times its jitter."""
    return Kind("periodic", period.impacts, math.sqrt(2) * (period.jitter or 0.0))
