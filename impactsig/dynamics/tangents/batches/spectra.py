"""Lyapunov exponents of many oscillators, in blocks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...._arguments import number, thread_count
from ...._running.threads import in_threads
from ...._showing import Shown
from ....oscillators.batch import OscillatorBatch
from ....simulation.basis.columns import spread
from ....simulation.basis.events import DONE, MODE, PHASE, STATUS
from ....simulation.basis.frame import first_phase, place_of
from ....simulation.batches.moving import Moving, takes
from ....simulation.exact.modes import Stack, stacks, subset
from ....simulation.run import after, span
from ..growth import edges_of, forget, growth_of, lost_of, measured
from .carrying import carry_all

BLOCK = 64  # machines whose events are kept at a time
BLOCK_OF_GPU = 2**14
TURNS_AT_A_TIME = 1024.0  # as for one oscillator, since the columns are made orthonormal there


@dataclass(frozen=True, eq=False, repr=False)
class LyapunovSpectra(Shown):
    """The Lyapunov exponents of many oscillators.

    Attributes
    ----------
    systems : OscillatorBatch
        The simulated system.
    exponents, error, between_collapses : ndarray, shape (..., 2)
        As in `LyapunovSpectrum`, in the shape of the batch; NaN where a motion ended early.
    expected_sum : ndarray
        Mean of the divergence along each motion; compare ``exponents.sum(axis=-1)``.
    collapses, impacts, grazings : ndarray of int
        As in `LyapunovSpectrum`.
    status : ndarray of str
        As in `Motion`.

    See Also
    --------
    lyapunov_spectrum, results.LyapunovSpectrum, results.OscillatorBatch

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import lyapunov_spectrum, scenes
    >>> beams = scenes.karpodinis(np.array([22.1, 22.2]))
    >>> spectra = lyapunov_spectrum(beams, periods=50, transient=500)
    >>> spectra.exponents.shape
    (2, 2)
    """

    systems: OscillatorBatch
    exponents: np.ndarray
    error: np.ndarray
    between_collapses: np.ndarray
    expected_sum: np.ndarray = field(repr=False)
    collapses: np.ndarray = field(repr=False)
    impacts: np.ndarray = field(repr=False)
    grazings: np.ndarray = field(repr=False)
    status: np.ndarray = field(repr=False)

    def __repr__(self) -> str:
        return f"LyapunovSpectra({len(self.systems)} oscillators)"


def spectra_of(
    batch: OscillatorBatch, *, periods: float | None, duration: float | None,
    transient: float | None, initial: Any, phase: float, chatter: float, gpu: bool,
) -> LyapunovSpectra:  # fmt: skip
    """Exponents of the oscillators of a batch, each equal to that of a single run bit for bit."""
    columns = spread(batch.columns, len(batch))
    forced = columns.form.forces > 0 or columns.form.base is not None
    length, _ = span(periods, duration, 0.0, forced)
    before = number("transient", length / 10 if transient is None else transient, least=0.0)
    chatter = number("chatter", chatter, above=0, most=1e-2)
    place = np.array(place_of((0.0, 0.0) if initial is None else initial))
    n, phase = len(batch), first_phase(phase)
    pairs = np.full((3, n, 2), math.nan)
    expected, status = np.full(n, math.nan), np.zeros(n, np.int64)
    counts = np.zeros((3, n), int)
    together = BLOCK_OF_GPU if gpu else BLOCK
    if gpu:
        takes(columns.form)
    for stack in stacks(columns, chatter, True):

        def block(first: int, stack: Stack = stack) -> None:
            mine = subset(stack, slice(first, first + together))
            many = len(mine.which)
            moving = Moving(mine, np.tile(place, (many, 1)), np.full(many, phase))
            moving.on_gpu = gpu
            found = carried(moving, before, length, duration is not None)
            for into, part in zip((*pairs, expected, *counts, status), found, strict=True):
                into[mine.which] = part

        blocks = range(0, len(stack.which), together)
        in_threads(block, blocks, 1 if gpu else thread_count(None))
    shape = batch.shape
    return LyapunovSpectra(
        batch,
        pairs[0].reshape(*shape, 2),
        pairs[1].reshape(*shape, 2),
        pairs[2].reshape(*shape, 2),
        expected.reshape(shape),
        counts[0].reshape(shape),
        counts[1].reshape(shape),
        counts[2].reshape(shape),
        np.array(STATUS)[status].reshape(shape),
    )


def carried(moving: Moving, before: float, length: float, by_time: bool) -> tuple[Any, ...]:
    """Fields of `LyapunovSpectra` for oscillators in progress, and their statuses."""
    from ..columns import DETERMINANT, IMPACTS, IN_MODE, LINES, NEXT, POINTS, SINGULAR, TOTALS

    stack, n = moving.stack, len(moving.phase)
    per_turn = moving.per_turn(by_time) * np.ones(n)
    columns, totals, place = np.tile(np.eye(2), (n, 1, 1)), np.zeros((n, TOTALS)), np.zeros((n, 6))
    place[:, PHASE], place[:, IN_MODE] = moving.phase, moving.counts[:, MODE]
    unlisted = np.empty((n, 0, 3))
    at = np.zeros(n)

    def to(until: float, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        instants = np.stack(
            after(moving.phase[:, None], edges[None] * per_turn[:, None]), axis=-1
        )  # fmt: skip
        taken = np.empty((n, len(edges), TOTALS))
        place[:, NEXT] = 0
        while True:
            going = (at < until) & (moving.status == DONE)
            if not going.any():
                break
            at[going] = np.minimum(at[going] + TURNS_AT_A_TIME / per_turn[going], until)
            moving.to(at * per_turn, True, 1)
            carry_all(moving, going, instants, taken, place, columns, totals, unlisted, True)
        return instants, taken

    if before > 0:
        to(before, np.empty(0))
    forget(totals, place)
    start = place[:, None, :2].copy()
    edges = edges_of(before, length)
    seen = to(edges[-1], edges)
    omega = stack.forcing.omega[:, None]
    pairs, divergence = np.full((3, n, 2), math.nan), np.full(n, math.nan)
    came = np.flatnonzero(moving.status == DONE)
    time, grown = (np.swapaxes(part[came], 0, 1) for part in measured(omega, start, *seen))
    pairs[:, came] = growth_of(time, grown, lost_of(totals[came]))[:3]
    divergence[came] = totals[came, DETERMINANT] / time[-1]
    counts = totals[:, LINES] + totals[:, POINTS], totals[:, IMPACTS], totals[:, SINGULAR]
    return *pairs, divergence, *(part.astype(int) for part in counts), moving.status
