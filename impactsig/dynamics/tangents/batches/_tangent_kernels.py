"""Kernels for tangent maps of many oscillators, from the events of their motions."""

from __future__ import annotations

from ...._compiling.compiled import kernel
from ....simulation.batches.batch_kernels import machine
from .._tangent import carry


@kernel
def carry_range(
    many, rows, ends, clocks, going, instants, taken, place, columns, totals, collapses,
    orthonormal, upper, lower, first, last,
):  # fmt: skip
    """Advance the columns of oscillators `first` to `last` through their events.

    The events of machine k are the rows from ``ends[k - 1]`` (of the first: 0) to ``ends[k]``.
    Those that are not `going` are left as they are; all else is as for `_tangent.carry`, with a
    first axis for the machines.
    """
    begin = 0
    for k in range(first, last):
        if going[k]:
            carry(
                machine(many, k), rows[begin : ends[k]], clocks[k], instants[k], taken[k],
                place[k], columns[k], totals[k], collapses[k], orthonormal, upper, lower,
            )  # fmt: skip
        begin = ends[k]
