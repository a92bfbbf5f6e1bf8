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

HUMS = 2
"""Frames that are looked at for hum, and that show the direction where there is some."""
UNCLEAR = 0.5
"""Lead, as a share of the squares of the heights of events, that longer stretches may turn."""
FEW = 5
"""Clear events: fewer may be steps of the baseline, and longer stretches are looked at."""
UNDECIDED = 0.2
"""Lead that does not decide on the direction."""


def direction(record: Survey, grid: Grid, scale: float, constant: float) -> float:
    """Whether pulses go up or down: the heights of events in the steepest stretches tell.

    What is recorded behind an AC coupling of that time constant [samples] swings either way. Hum
    does so too, and a short stretch does not show it.
    """
    parts, frames = record.strong, [x for x, _ in record.frames]
    if any(_hums(x, scale, grid) for x in frames[:HUMS]):
        parts = frames[:HUMS]
    vote, lean, clear = _vote(parts, grid, scale, constant)
    if abs(vote) <= UNCLEAR or clear < FEW:
        vote, lean, _ = _vote(frames, grid, scale, constant)
    # Close-set pulses have gaps as strong as themselves; the values lean away from their floor.
    return math.copysign(1.0, vote if abs(vote) > UNDECIDED else vote + lean)


def _vote(
    parts: list[np.ndarray], grid: Grid, scale: float, constant: float
) -> tuple[float, float, int]:
    """Lead of what points upward among the events of stretches, and of their values.

    How many events are clear of the noise comes third.
    """
    lean = 0.0
    found = []
    for part in parts:
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
        sums = [_energy(one[one[:, 3] >= 2 * LEAST]) for one in (ups, downs)]
        up, down = sums if any(sums) else (_energy(ups), _energy(downs))
        if up + down:
            vote += (up - down) / (up + down)
            voted += 1.0
    return vote / max(voted, 1.0), lean / max(len(found), 1), len(clear)


def _energy(events: np.ndarray) -> float:
    """Sum of squares of heights: what rings swings back as often, but each time less."""
    return float((events[:, 2] ** 2).sum())


def _hums(x: np.ndarray, scale: float, grid: Grid) -> bool:
    """Whether the first second of a frame shows lines of the mains."""
    first = x[: grid.span]
    spans = Spans(grid, len(first))
    spans.load((first.astype(np.float64) - float(first[0])) * scale, 0.0, 1.0)
    return bool(spans.spans[0].hum)


def _events(x: np.ndarray, sign: float, grid: Grid, constant: float) -> np.ndarray:
    """Those of a stretch that point one way, no longer than a contact."""
    spans = Spans(grid, len(x), constant=constant)
    for k in range(spans.count):
        first, last = grid.bounds(k, len(x))
        spans.load(x[first:last], 0.0, sign)
    events = np.concatenate([spans.spans[k].events for k in range(spans.count)])
    return events[events[:, 1] <= MATCH * grid.longest]
