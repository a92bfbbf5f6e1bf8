"""Tangent maps of many oscillators on a GPU, a thread each, by the kernel that CPUs run."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import kernel
from ....simulation.batches.batch_kernels import machine
from ....simulation.batches.gpu import by_work, no_law
from ....simulation.exact.modes import Stack
from ....studies.device_kernels import Each
from .._tangent import carry as carry_one


@kernel
def carry_machine(
    k, slot, many, read, taken, place, columns, totals, collapses, orthonormal,
):  # fmt: skip
    """Advance the columns of machine k through its events."""
    rows, begins, ends, clocks, instants = read
    carry_one(
        machine(many, k), rows[begins[k] : ends[k]], clocks[k], instants[k], taken[k], place[k],
        columns[k], totals[k], collapses[k], orthonormal, no_law, no_law,
    )  # fmt: skip


_carry = Each(carry_machine)


def carry(
    stack: Stack, rows: np.ndarray, ends: np.ndarray, clocks: np.ndarray, going: np.ndarray,
    instants: np.ndarray, taken: np.ndarray, place: np.ndarray, columns: np.ndarray,
    totals: np.ndarray, collapses: np.ndarray, orthonormal: bool,
) -> None:  # fmt: skip
    """Advance the columns of oscillators that are going; the longest lists of events first."""
    begins = np.concatenate([[0], ends[:-1]])
    which = np.flatnonzero(going)
    read = rows, begins, ends, clocks, instants
    _carry(
        which[by_work((ends - begins)[which])], stack.problem, read, taken, place, columns, totals,
        collapses, orthonormal,
    )  # fmt: skip
