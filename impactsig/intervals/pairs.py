"""Interspike intervals and pairs of them, from an array or from Impacts with gaps."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .._arguments import reals, whole
from ..errors import InvalidInput
from ..impacts import Impacts

Intervals = Impacts | Iterable[float]


def as_intervals(data: Intervals, least: int) -> np.ndarray:
    """Validate intervals [s]: at least `least`, finite and not negative."""
    values = data.intervals() if isinstance(data, Impacts) else _array(data)
    if len(values) < least:
        raise InvalidInput("intervals", f"{len(values)} intervals", f"{least} or more")
    return values


def interval_pairs(data: Intervals, lag: int, least: int) -> tuple[np.ndarray, np.ndarray]:
    """Intervals and those `lag` later, without pairs that span a gap."""
    whole("lag", lag, 1)
    if isinstance(data, Impacts):
        values, unbroken = np.diff(data.time), unbroken_pairs(data, lag)
    else:
        values = _array(data)
        unbroken = np.ones(max(len(values) - lag, 0), bool)
    first, later = values[:-lag][unbroken], values[lag:][unbroken]
    if len(first) < least:
        raise InvalidInput(
            "intervals", f"{len(first)} pairs at lag {lag}", f"{least} or more", "Use a longer run"
        )
    return first, later


def unbroken_pairs(impacts: Impacts, lag: int) -> np.ndarray:
    """Mask of the pairs of intervals at a lag between which there is no gap."""
    lost = np.concatenate(([0], np.cumsum(impacts.interval_spans_gap())))
    whole: np.ndarray = lost[lag + 1 :] == lost[: max(len(lost) - lag - 1, 0)]
    return whole


def _array(data: Iterable[float]) -> np.ndarray:
    values = reals("intervals", data, "an array of real numbers, or Impacts")
    if values.ndim != 1:
        raise InvalidInput("intervals", f"shape {values.shape}", "shape (n,)")
    wrong = ~(np.isfinite(values) & (values >= 0))
    if wrong.any():
        where = int(np.argmax(wrong))
        raise InvalidInput(
            "intervals", f"{values[where]} at index {where}", "finite intervals >= 0 [s]"
        )
    return values
