"""What a force record shows besides impacts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..impacts import Disturbance
from ._order_kernels import median_of

if TYPE_CHECKING:
    from ._spans import Spans

MOVED = 8.0
"""Times the usual difference of the baseline between chunks that a move of it is."""


def baseline_moves(spans: Spans, k: int) -> list[Disturbance]:
    """Where, in span k, the baseline moves by far more than it does elsewhere."""
    span, chunk = spans.spans[k], spans.grid.chunk
    before = spans.spans[k - 1].medians[-1:] if k > 0 else span.medians[:1]
    steps = np.diff(np.concatenate((before, span.medians)))
    beside = spans.around(k, 2)
    moves, sigmas = np.concatenate([one.moves for one in beside]), [one.sigma for one in beside]
    usual = median_of(moves, len(moves)) if len(moves) else 0.0
    sigma = sorted(sigmas)[len(sigmas) // 2]
    moved = np.abs(steps) > max(MOVED * usual, sigma)
    if not moved.any():
        return []
    found = []
    for i in np.flatnonzero(moved & ~np.concatenate(([False], moved[:-1]))):
        j = i
        while j < len(moved) and moved[j]:
            j += 1
        height = steps[i:j][np.argmax(np.abs(steps[i:j]))]
        start = float(span.first + i * chunk - chunk)
        found.append(Disturbance("baseline", max(start, 0.0), (j - i + 1.0) * chunk, float(height)))
    return found
