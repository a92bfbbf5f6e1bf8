"""Simulation of an oscillator whose parameter changes at impacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...oscillators import Oscillator
from ...simulation.basis.events import (
    COLUMNS,
    FULL,
    IMPACT,
    LEG_COUNT,
    PHASE,
    ROW_KIND,
    TOUCH,
    TURN,
    TURNS,
)
from ...simulation.motion import Motion
from ...simulation.run import LEGS_AT_LEAST, after
from .listening import Listener
from .nudged import Nudged, SpannedRun

SMALL = 4  # rows of an engine that returns after every event


def run_spiked(
    oscillator: Oscillator,
    phases: tuple[tuple[float, Any], ...],
    length: float,
    *,
    phase: float,
    **options: Any,
) -> tuple[Motion, Nudged]:
    """Simulate an oscillator under interval feedback, with one parameter change per impact."""
    going = SpannedRun(oscillator, phases, phase=phase, **options)
    clock, _state, count = going.now
    buffer, end = np.empty((SMALL, COLUMNS)), after(phase, length)
    listener = Listener(phases)
    last: np.ndarray | None = None
    engine, by = going.span(None, 0.0, marked=False), 0.0
    # Contacts that are under way take more rows at first.
    ample = np.empty((SMALL + len(oscillator.stops), COLUMNS))
    going.run(engine, ample, after(phase, 0.0), LEGS_AT_LEAST)
    while True:
        count[LEG_COUNT] = 0
        found, new = going.run(engine, buffer, end, LEGS_AT_LEAST)
        if found != FULL:
            break
        hits = new[(new[:, ROW_KIND] == IMPACT) | (new[:, ROW_KIND] == TOUCH)]
        if not len(hits):
            continue
        for hit in hits:
            if last is not None:
                since = hit[TURNS] - last[TURNS] + (hit[PHASE] - last[PHASE]) / TURN
                listener.hear(float(since))
            last = hit
        own, next_by = listener.moved(clock[TURNS] + (clock[PHASE] - phase) / TURN)
        if next_by == by == 0.0:
            continue
        by = next_by
        engine = going.span(own, by, marked=True)
    return going.motion(found), going.engines
