"""Tangent maps of many oscillators through the events that they have just passed."""

from __future__ import annotations

import numpy as np

from ....simulation.basis.events import MODE, PHASE
from ....simulation.batches.moving import Moving


def multiplied_over(moving: Moving, turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Move oscillators so many turns from their starts; columns of their tangent maps, and totals.

    The columns, in the engine's units, are to be multiplied by the exponential of the total FIRST.
    """
    from ..columns import IN_MODE, TOTALS

    n = len(moving.phase)
    place = np.zeros((n, 6))
    place[:, PHASE], place[:, IN_MODE] = moving.phase, moving.counts[:, MODE]
    moving.to(turns, True, 1)
    columns, totals = np.tile(np.eye(2), (n, 1, 1)), np.zeros((n, TOTALS))
    instants, taken = np.empty((n, 0, 2)), np.empty((n, 0, TOTALS))
    carry_all(
        moving, np.ones(n, bool), instants, taken, place, columns, totals, np.empty((n, 0, 3)),
        False,
    )  # fmt: skip
    return columns, totals


def carry_all(
    moving: Moving, going: np.ndarray, instants: np.ndarray, taken: np.ndarray, place: np.ndarray,
    columns: np.ndarray, totals: np.ndarray, collapses: np.ndarray, orthonormal: bool,
) -> None:  # fmt: skip
    """Advance the columns of oscillators to where they are; arrays as for `carry_range`."""
    stack, n = moving.stack, len(going)
    clocks = np.ascontiguousarray(moving.clocks[:, :2])
    if moving.on_gpu:
        from .gpu import carry

        carry(
            stack, moving.rows[0], moving.ends, clocks, going, instants, taken, place, columns,
            totals, collapses, orthonormal,
        )  # fmt: skip
        return
    from ._tangent_kernels import carry_range

    for block, rows in enumerate(moving.rows):
        first = block * moving.size
        carry_range(
            stack.problem, rows, moving.ends, clocks, going, instants, taken, place, columns,
            totals, collapses, orthonormal, *stack.laws, first, min(first + moving.size, n),
        )  # fmt: skip
