"""Kernels that read and write the delay line row by row.

A row ends where the control force reaches its limit or comes back from it, and one delay after
each place where what is fed back was not smooth; each time an order smoother, until the method
takes no notice of it.
"""

from __future__ import annotations

import math

from ...._compiling.compiled import kernel
from ....simulation.basis.delay import Past, read
from ....simulation.basis.events import BEGUN, LENGTH, LOW, PHASE, TURNS
from .line import cut, scale, since

# Counters after those of `simulate._events`: rows of the delay line; the row that what is fed
# back now comes from; the first row of the phase; delays for which the beginning of the next row
# is no smooth place; side of the limit that the force is beyond, and that it is at.
ROWS, AT, FIRST, LAPS, REGION, EDGE = range(BEGUN + 1, BEGUN + 7)
COUNTS = EDGE + 1
REACHED = 1e-14  # of the phase: rounding


@kernel
def recall(feedback, line, count, clock):
    """Locate the delayed signal, and the time for which it is smooth."""
    number = count[ROWS]
    if not feedback.on:
        return Past(0, 0, 0, 0.0), math.inf
    turns, phase = clock[TURNS] - feedback.turns, clock[PHASE] - feedback.phase
    j = count[AT]
    while j + 1 < number:
        ahead = since(line, j + 1, turns, phase) + clock[LOW]
        if ahead < -REACHED or (ahead < 0 and line.laps[j + 1] == 0):
            break
        j += 1
        if line.laps[j] > 0:
            count[LAPS] = max(count[LAPS], line.laps[j] - 1)
            count[EDGE] = 0
    count[AT] = j
    last = j
    while last + 1 < number and line.laps[last + 1] == 0:
        last += 1
    smooth = feedback.delay
    if last + 1 < number:
        smooth = min(smooth, -since(line, last + 1, turns, phase) - clock[LOW])
    offset = max(since(line, j, turns, phase) + clock[LOW], 0.0)
    return Past(j, last, count[FIRST], offset), smooth


@kernel
def side_of_limit(feedback, line, past, count, own):
    """The limit that the force exceeds, and the limit that it is exactly at; 0 if none."""
    region, edge = 0, 0
    if feedback.on:
        control = feedback.gain * (read(feedback, line, past, 0.0) - own)
        edge = count[EDGE]
        if edge != 0:
            region = count[REGION]
        elif abs(control) > feedback.limit:
            region = 1 if control > 0 else -1
        count[EDGE] = 0
    return region, edge


@kernel
def begin_row(line, count, clock, h):
    """Begin a row for a step of h; its polynomials are `line.course[count[ROWS] - 1]`."""
    j = count[ROWS]
    line.when[j, TURNS], line.when[j, PHASE], line.when[j, LENGTH] = (
        clock[TURNS],
        clock[PHASE] + clock[LOW],
        h,
    )
    line.laps[j] = count[LAPS]
    count[LAPS] = 0
    count[ROWS] = j + 1


@kernel
def end_row(line, count, share):
    """Cut the row to its first share."""
    course = line.course[count[ROWS] - 1]
    for m in range(len(course)):
        if line.powers is None:
            cut(course[m], share)
        else:
            scale(course[m], share)
    line.when[count[ROWS] - 1, LENGTH] *= share


@kernel
def cross_limit(line, laps, count, share, region, side):
    """End the row where the force reaches or leaves a limit."""
    end_row(line, count, share)
    mark_limit(laps, count, region, side)


@kernel
def mark_limit(laps, count, region, side):
    """Record that the force is at a limit, so that the next row does not begin smoothly."""
    count[EDGE] = side
    count[REGION] = side if region == 0 else 0
    count[LAPS] = laps[1]


@kernel
def turn_back(line, count, region, edge):
    """Discard the row: the force turned back at its limit, and stays on this side of it."""
    count[ROWS] -= 1
    count[LAPS] = line.laps[count[ROWS]]
    count[REGION], count[EDGE] = edge if region == 0 else 0, edge
