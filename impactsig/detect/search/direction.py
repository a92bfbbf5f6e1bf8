"""Which way the pulses of a force record point."""

from __future__ import annotations

import math

import numpy as np

from ..instrument.survey import Survey
from ..signal.grid import Grid
from ..signal.ladder import MATCH
from .event_kernels import EVENT
from .judging import LEAST_SAMPLES
from .spans import LEAST, Spans

UNDECIDED = 0.2
"""Lead, as a share of the heights of events, that does not decide on the direction."""


def direction(record: Survey, grid: Grid, scale: float, constant: float) -> float:
    """Whether pulses go up or down: the heights of events in the steepest stretches tell.

    What is recorded behind an AC coupling of that time constant [samples] swings either way.
    """
    lean = 0.0
    found = []
    for part in record.strong:
        x = (part.astype(np.float64) - float(part[0])) * scale
        if len(x) < LEAST_SAMPLES:
            continue
        found.append([_events(x, sign, grid, constant) for sign in (1.0, -1.0)])
        middle = float(np.median(x[:: max(1, len(x) // 2048)]))
        extent = float(x.max() - x.min())
        lean += (float(x.max()) + float(x.min()) - 2.0 * middle) / extent if extent else 0.0
    every = (
        np.concatenate([one for both in found for one in both]) if found else np.empty((0, EVENT))
    )
    clear = every[every[:, 3] >= 2 * LEAST, 1]
    # Glitches point either way, and among the steepest stretches they are many.
    least = 2.0 if np.count_nonzero(clear >= 2.0) >= np.count_nonzero(clear < 2.0) else 0.0
    vote = voted = 0.0
    for both in found:
        ups, downs = (one[one[:, 1] >= least] for one in both)
        # What is not clear of the noise counts where nothing is.
        sums = [one[one[:, 3] >= 2 * LEAST, 2].sum() for one in (ups, downs)]
        up, down = sums if any(sums) else (ups[:, 2].sum(), downs[:, 2].sum())
        if up + down:
            vote += (up - down) / (up + down)
            voted += 1.0
    # Close-set pulses have gaps as strong as themselves; the values lean away from their floor.
    return math.copysign(1.0, vote if abs(vote) > UNDECIDED * voted else lean)


def _events(x: np.ndarray, sign: float, grid: Grid, constant: float) -> np.ndarray:
    """Those of a stretch that point one way, no longer than a contact."""
    spans = Spans(grid, len(x), constant=constant)
    for k in range(spans.count):
        first, last = grid.bounds(k, len(x))
        spans.load(x[first:last], 0.0, sign)
    events = np.concatenate([spans.spans[k].events for k in range(spans.count)])
    return events[events[:, 1] <= MATCH * grid.longest]
