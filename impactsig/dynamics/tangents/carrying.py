"""Tangent maps of many oscillators through the events that they have just passed."""

from __future__ import annotations

import numpy as np

from ...simulate.batches.moving import Moving


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
    from .tangent_batch import carry_range

    for block, rows in enumerate(moving.rows):
        first = block * moving.size
        carry_range(
            stack.problem, rows, moving.ends, clocks, going, instants, taken, place, columns,
            totals, collapses, orthonormal, *stack.laws, first, min(first + moving.size, n),
        )  # fmt: skip
