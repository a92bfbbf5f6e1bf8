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
    edges = sorted(
        (float(at), -change)
        for one in spans
        for span in one
        for at, change in zip(span, (1, -1), strict=True)
    )
    found, open_, begin = [], 0, 0.0
    for at, change in edges:
        before, open_ = open_, open_ - change
        if before < count <= open_:
            begin = at
        elif open_ < count <= before:
            found.append((begin, at))
    return np.array(found).reshape(-1, 2)
