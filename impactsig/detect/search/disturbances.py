"""Disturbances in a force record: what is not an impact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...impacts import Disturbance
from ..signal.order_kernels import median_of

if TYPE_CHECKING:
    from .spans import Spans

MOVED = 8.0
"""Times the usual difference of the baseline between chunks that a move of it is."""


def disturbances(spans: Spans, k: int, wide: np.ndarray) -> list[Disturbance]:
    """Disturbances of span k, given its events that are longer than a contact."""
    span = spans.spans[k]
    found = []
    if len(span.glitches):
        found += [Disturbance("glitch", float(i), 1.0, 0.0) for i in span.first + span.glitches]
    if len(wide):
        found += [Disturbance("wide", one[0] - 0.5 * one[1], one[1], one[2]) for one in wide]
    found += _baseline_moves(spans, k)
    for a, b in span.dropouts:
        found.append(Disturbance("dropout", float(span.first + a), float(b - a), 0.0))
    return found


def joined(found: list[Disturbance]) -> list[Disturbance]:
    """Disturbances of a record, in order, with dropouts joined across spans."""
    out: list[Disturbance] = []
    last = -1  # place of the last dropout
    for one in found:
        if one.kind == "dropout":
            if last >= 0 and out[last].start + out[last].duration == one.start:
                out[last] = out[last]._replace(duration=out[last].duration + one.duration)
                continue
            last = len(out)
        out.append(one)
    return out


def _baseline_moves(spans: Spans, k: int) -> list[Disturbance]:
    """Places in span k where the baseline moves unusually far."""
    span, chunk = spans.spans[k], spans.grid.chunk
    before = spans.spans[k - 1].medians[-1] if k > 0 else span.medians[0]
    beside = spans.around(k, 2)
    sigmas = sorted(one.sigma for one in beside)
    least = sigmas[len(sigmas) // 2]
    greatest = max(abs(span.medians[0] - before), span.moves.max(initial=0.0))
    if greatest <= least:
        return []
    moves = np.concatenate([one.moves for one in beside])
    least = max(MOVED * median_of(moves, len(moves)) if len(moves) else 0.0, least)
    if greatest <= least:
        return []
    steps = np.diff(span.medians, prepend=before)
    moved = np.abs(steps) > least
    found = []
    for i in np.flatnonzero(moved & ~np.concatenate(([False], moved[:-1]))):
        j = i
        while j < len(moved) and moved[j]:
            j += 1
        height = steps[i:j][np.argmax(np.abs(steps[i:j]))]
        start = float(span.first + i * chunk - chunk)
        found.append(Disturbance("baseline", max(start, 0.0), (j - i + 1.0) * chunk, float(height)))
    return found
