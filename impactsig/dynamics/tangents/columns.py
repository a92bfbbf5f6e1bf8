"""Kernels on the two columns of a tangent map, and on their totals."""

from __future__ import annotations

import math

from ..._compiling.compiled import inlined
from ...simulation.basis.events import PHASE, TURN, TURNS

# What `place` holds: turns and phase (as a clock) and the mode up to which the columns have been
# carried; whether the mass is held, and by what; the kind of the last event; the instant to take
# the totals at next.
IN_MODE, HELD, LAST, NEXT = range(PHASE + 1, PHASE + 5)
FREE, BY_FRICTION, BY_STOP = range(3)
# What `totals` hold: logarithms of the growth of the first and the second column (or of the common
# scale of both, where they are not made orthonormal), of the determinant; collapses to a line and
# to a point; events that graze so closely that they have no derivative; impacts.
FIRST, SECOND, DETERMINANT, LINES, POINTS, SINGULAR, IMPACTS = range(7)
TOTALS = 7
# A collapse: when, as a clock, and how many dimensions were left.
LEFT = 2


@inlined
def multiply(columns, a, b, c, d):
    """Multiply the columns by [[a, b], [c, d]]."""
    for j in range(2):
        q, v = columns[0, j], columns[1, j]
        columns[0, j], columns[1, j] = a * q + b * v, c * q + d * v


@inlined
def list_collapse(collapses, totals, row, left):
    """Record the instant and the dimensions left, as long as there is room."""
    n = int(totals[LINES] + totals[POINTS])
    if n < len(collapses):
        collapses[n, TURNS], collapses[n, PHASE], collapses[n, LEFT] = row[TURNS], row[PHASE], left
    totals[LINES if left == 1 else POINTS] += 1
    totals[DETERMINANT] = -math.inf


@inlined
def orthonormalize(columns, totals):
    """Gram-Schmidt; a column that has vanished begins anew.

    The area between the columns keeps its digits where their scales differ by orders.
    """
    a, b, c, d = columns[0, 0], columns[1, 0], columns[0, 1], columns[1, 1]
    area = abs(a * d - b * c)
    norm = math.hypot(a, b)
    if norm == 0.0:
        a, b = c, d
        norm = math.hypot(a, b)
    if norm == 0.0:
        columns[0, 0], columns[1, 0], columns[0, 1], columns[1, 1] = 1.0, 0.0, 0.0, 1.0
        return
    totals[FIRST] += math.log(norm)
    if area > 0:
        totals[SECOND] += math.log(area / norm)
    columns[0, 0], columns[1, 0] = a / norm, b / norm
    columns[0, 1], columns[1, 1] = -b / norm, a / norm


@inlined
def rescale(columns, totals):
    """Divide out the common scale of columns that have grown or shrunk too far."""
    size = 0.0
    for j in range(2):
        size = max(size, abs(columns[0, j]), abs(columns[1, j]))
    if size > 0 and not 1e-100 < size < 1e100:
        for j in range(2):
            columns[0, j] /= size
            columns[1, j] /= size
        totals[FIRST] += math.log(size)


@inlined
def due(turns, phase, place, instants):
    """Whether totals are due at or before an instant."""
    k = int(place[NEXT])
    if k >= len(instants):
        return False
    return (instants[k, TURNS] - turns) * TURN + (instants[k, PHASE] - phase) <= 0


@inlined
def take(taken, place, totals):
    """Take the totals, and advance to the next instant."""
    n = int(place[NEXT])
    for k in range(TOTALS):
        taken[n, k] = totals[k]
    place[NEXT] += 1
