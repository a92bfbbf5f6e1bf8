"""Gaps of the train that several sensors recorded together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..impacts import Impacts


def gaps_of_stops(
    trains: Sequence[Impacts], delays: Sequence[float], stops: Sequence[int | None]
) -> np.ndarray:
    """The spans in which none of the sensors of some stop recorded [s]."""
    spans = [train.gaps - late for train, late in zip(trains, delays, strict=True)]
    lost = []
    for stop in set(stops) - {None} or {None}:
        own = [gaps for gaps, one in zip(spans, stops, strict=True) if one in (stop, None)]
        lost.append(covered(own, len(own)))
    return covered(lost, 1)


def covered(spans: Sequence[np.ndarray], count: int) -> np.ndarray:
    """Where at least `count` of several sets of spans overlap."""
    opens, closes = np.sort(np.concatenate(spans), axis=0).T
    index = np.arange(len(opens))
    # Spans that meet overlap in one instant: what opens there counts before what closes.
    begins = opens[index + 1 - np.searchsorted(closes, opens, side="left") == count]
    ends = closes[np.searchsorted(opens, closes, side="right") - index == count]
    return np.column_stack((begins, ends))
