"""An oscillator whose parameter is moved at impacts: from impact to impact by its engine."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..oscillators import Oscillator
from ..simulate._events import (
    COLUMNS,
    FULL,
    IMPACT,
    LEG_COUNT,
    PHASE,
    ROW_COUNT,
    ROW_KIND,
    START,
    STATUS,
    TOUCH,
    TURN,
    TURNS,
    row_of,
)
from ..simulate._frame import first_place
from ..simulate._run import LEGS_AT_LEAST, after
from ..simulate.motion import Motion, assemble
from ._nudged import Nudged, _marks

SMALL = 4  # rows of an engine that returns after every event


def run_spiked(
    oscillator: Oscillator,
    phases: tuple[tuple[float, Any], ...],
    length: float,
    *,
    initial: Any,
    phase: float,
    method: Any,
    chatter: float,
) -> tuple[Motion, Nudged]:
    """The motion of an oscillator whose parameter is moved once at each impact."""
    going = Nudged(oscillator, method, chatter, phase)
    q, v = first_place(oscillator, initial, phase)
    state, count = going.engine.begin(q, v, phase)
    clock = np.array([0.0, phase, 0.0])
    first = row_of(START, clock, state, count)
    rows, buffer = [np.array([first])], np.empty((SMALL, COLUMNS))
    # Contacts that are under way take more rows at first.
    ample = np.empty((SMALL + len(oscillator.stops), COLUMNS))
    end = after(phase, length)
    longest = max([own.delay for _, own in phases if own is not None], default=1) + 1
    starts = np.array([start for start, _ in phases])
    intervals: list[float] = []
    last: np.ndarray | None = None
    engine, by, controller = going.period(0.0, phase, None, 0.0), 0.0, None
    engine.run(clock, state, count, ample, *after(phase, 0.0), LEGS_AT_LEAST)
    rows.append(ample[: count[ROW_COUNT]].copy())
    while True:
        count[LEG_COUNT] = 0
        found = engine.run(clock, state, count, buffer, *end, LEGS_AT_LEAST)
        new = buffer[: count[ROW_COUNT]].copy()
        rows.append(new)
        if found != FULL:
            break
        hits = new[(new[:, ROW_KIND] == IMPACT) | (new[:, ROW_KIND] == TOUCH)]
        if not len(hits):
            continue
        for hit in hits[:, [TURNS, PHASE]]:
            if last is not None:
                intervals.append(float(hit[0] - last[0] + (hit[1] - last[1]) / TURN))
            last = hit
        del intervals[: max(len(intervals) - longest, 0)]
        now = clock[TURNS] + (clock[PHASE] - phase) / TURN
        k = int(np.searchsorted(starts, now, "right")) - 1
        own = phases[k][1] if k >= 0 else None
        before = by if own is controller else 0.0
        controller = own
        next_by = 0.0 if own is None else own.move(intervals, before)
        if next_by == by == 0.0:
            continue
        by = next_by
        engine = going.period(clock[TURNS], clock[PHASE], own, by)
        rows += _marks(clock, state, count)
    engine_of_all: Any = going
    motion = assemble(
        oscillator, engine_of_all, phase, first, np.concatenate(rows), clock, state, count,
        STATUS[found],
    )  # fmt: skip
    return motion, going
