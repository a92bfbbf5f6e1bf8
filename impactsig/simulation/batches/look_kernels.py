"""Kernels: states of many machines at instants that they have passed."""

from __future__ import annotations

from ..._compiling.compiled import kernel
from ..basis.events import PHASE, TURN, TURNS
from ..exact.look import sample
from .batch_kernels import machine


@kernel
def sample_range(many, scratch, rows, ends, lasts, turns, phase, where, q, v):
    """Position and velocity of machines at instants, which ascend.

    The rows of machine k end before row ``ends[k]``, its instants before ``lasts[k]``; `where` is
    room for the rows that they follow.
    """
    begin = first = 0
    for k in range(len(ends)):
        end, last, row = ends[k], lasts[k], begin
        for n in range(first, last):
            angle = turns[n] * TURN + phase[n]
            while row + 1 < end and rows[row + 1, TURNS] * TURN + rows[row + 1, PHASE] <= angle:
                row += 1
            where[n] = row - begin
        sample(
            machine(many, k), scratch, rows[begin:end], where[first:last], turns[first:last],
            phase[first:last], q[first:last], v[first:last],
        )  # fmt: skip
        begin, first = end, last
