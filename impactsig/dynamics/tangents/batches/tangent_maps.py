"""Tangent maps of many oscillators, each from its start, by one compiled call a layout."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ....oscillators import Oscillator
from ....simulation.basis.columns import columns_of_forms
from ....simulation.basis.frame import first_phase
from ....simulation.batches.moving import Moving
from ....simulation.exact.modes import Stack, stacks, subset, tables
from ....simulation.exact.starts import allowed
from ....simulation.simulation import CHATTER
from ..tangent import TangentMap, map_from
from .carrying import multiplied_over


def tangent_maps(
    oscillators: Sequence[Oscillator], starts: np.ndarray, phase: float, periods: int
) -> list[TangentMap | None]:
    """Tangent maps of oscillators that are linear between events, with the bits of `tangent_map`.

    Parameters
    ----------
    oscillators : sequence of Oscillator
        One for all starts, or one each.
    starts : ndarray, shape (n, 2)
        Displacements and velocities.
    phase : float
        Phase of the forcing at the starts [rad].
    periods : int
        Forcing periods, the same for all.

    Returns
    -------
    list of TangentMap or None
        None where a start is beyond a rigid stop, or not finite.
    """
    n = len(starts)
    phases = np.full(n, first_phase(phase))
    found: list[TangentMap | None] = [None] * n
    for which, whole in _stacked(oscillators, n):
        own = maps_of(whole, starts[which], phases[which], np.full(len(which), periods))
        for k, there in zip(which.tolist(), own, strict=True):
            found[k] = there
    return found


def _stacked(oscillators: Sequence[Oscillator], n: int) -> Iterator[tuple[np.ndarray, Stack]]:
    """Numbers and tables of the oscillators of each layout; of one the tables of its last run."""
    if len(oscillators) == 1:
        alone = tables(oscillators[0], CHATTER, True).stack
        yield np.arange(n), alone if n == 1 else subset(alone, np.zeros(n, int))
        return
    for which, columns in columns_of_forms(oscillators):
        for stack in stacks(columns, CHATTER, True):
            yield which[stack.which], stack


def maps_of(
    whole: Stack, starts: np.ndarray, phases: np.ndarray, periods: np.ndarray
) -> list[TangentMap | None]:
    """The same of oscillators of one stack, with a phase within a turn and periods of each."""
    able = allowed(whole.columns, whole.forcing, starts, phases)
    found: list[TangentMap | None] = [None] * len(starts)
    if able.any():
        stack = whole if able.all() else subset(whole, able)
        own = maps_over(Moving(stack, starts[able], phases[able]), periods[able].astype(float))
        for k, there in zip(np.flatnonzero(able).tolist(), own, strict=True):
            found[k] = there
    return found


def maps_over(moving: Moving, periods: np.ndarray) -> list[TangentMap]:
    """Tangent maps over so many forcing periods each, from where oscillators start."""
    from ..columns import DETERMINANT, FIRST, IMPACTS, LINES, POINTS, SINGULAR

    columns, totals = multiplied_over(moving, periods)
    omega = moving.stack.forcing.omega
    unit = np.ones((len(omega), 2, 2))
    unit[:, 0, 1], unit[:, 1, 0] = 1 / omega, omega
    ends = moving.totals()
    final = zip(
        *(ends[name].tolist() for name in ("displacement", "velocity", "phase")), strict=True
    )
    return [
        map_from(
            scaled, float(total[FIRST]), float(total[DETERMINANT]), state, int(total[IMPACTS]),
            int(total[LINES] + total[POINTS]), int(total[SINGULAR]), status,
        )
        for scaled, total, state, status in zip(
            unit * columns, totals, final, ends["status"].tolist(), strict=True
        )
    ]  # fmt: skip
