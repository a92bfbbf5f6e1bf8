"""Kinds of series that are told apart before any dimension is counted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from ...intervals import Periodicity

CERTAIN = 0.95
"""Confidence from which on a period of impacts is taken for granted."""


class Kind(NamedTuple):
    """What a series is.

    `period` counts values; `scatter` is the standard deviation about it; `tones` the independent
    frequencies of a quasi-periodic series, 0 where there are more than two.
    """

    name: Literal["constant", "periodic", "quasi-periodic", "noise", "motion"]
    period: int | None = None
    scatter: float = 0.0
    tones: int = 0


def is_certain(period: Periodicity) -> bool:
    """Whether a train recurs beyond doubt, whatever the speed of its forcing does."""
    return period.recurs and period.confidence >= CERTAIN


def of_period(period: Periodicity) -> Kind:
    """The kind of a train that is; its intervals scatter by sqrt(2) times its jitter."""
    return Kind("periodic", period.impacts, math.sqrt(2) * (period.jitter or 0.0))
