"""Simulation of a cantilever in several modes with a stop at its tip."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._arguments import number
from ..._running.watched import following
from ...errors import InvalidInput
from ...oscillators import Cantilever
from ..basis.contract import run_on
from ..basis.events import COUNTERS, HEAD, PHASE, SPENT, STATUS, TURN, TURNS
from ..run import span
from .beam_arguments import check_resonance, forces_of, initial_state, regime_at
from .beam_motion import BeamMotion, Setting, assemble

if TYPE_CHECKING:
    from .beam_flow import Beam

CHUNK = 8192  # events that are held at a time
LEGS_PER_PERIOD = 20_000  # work, on average, after which a run is given up
LEGS_AT_LEAST = 100_000


def move(
    beam: Cantilever,
    *,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: tuple[Any, Any] = (0.0, 0.0),
    phase: float = 0.0,
    chatter: float = 1e-6,
) -> BeamMotion:
    """Simulate a cantilever with a stop at its tip, exact up to rounding in every mode.

    Between contacts each mode is an oscillator of its own. At a rigid stop the tip's velocity is
    turned round by an impulse p, which changes every modal velocity at once by -p / m, m the modal
    mass [WaggBishop2000]_:

        v+ = -r v-,    p = (1 + r) v- m / (number of modes),    v the velocity of the tip.

    r is of the two materials where they touch. The tip alone is light, so it comes back at once
    while the rest of the beam still moves on: what is one contact of the beam is many impacts of
    its tip, or a chatter after which the stop holds it, and the beam as a whole comes back more
    slowly than r would have it (`apparent_restitution`). A soft stop couples the modes while it is
    touched; its contact is solved by the eigenvectors of the coupled beam.
    """
    if not 0 < number("chatter", chatter) <= 1e-2:
        raise InvalidInput("chatter", chatter, "0 < chatter <= 0.01")
    length, transient = span(periods, duration, transient, beam.forcing is not None)
    phase = math.fmod(number("phase", phase), TURN) % TURN

    rates, ratios = TURN * beam.frequencies(beam.modes), np.array(beam.damping_ratios)
    omega = beam.angular_forcing_frequency or float(rates[0])
    push, base = forces_of(beam)
    check_resonance(rates, ratios, beam.forcing)
    from ._beam_regimes import regimes

    table = regimes(rates, ratios, beam.modal_mass, push, base, omega, beam.stop, chatter)
    q, v = initial_state(initial, beam.modes)
    regime = regime_at(beam.stop, float(q.sum() + (base * np.exp(1j * phase)).real))
    per_turn = 1.0 if duration is None else omega / TURN
    run = _Run(table, np.concatenate([q, v / omega]), phase, regime)
    status, rows = "complete", np.empty((0, 0))
    if transient > 0:
        status, _ = run.move(transient * per_turn, keep=False)
    first = run.clock[:2].copy()
    run.totals[SPENT] = 0.0
    head = run.row()
    if status == "complete":
        status, rows = run.move((transient + length) * per_turn, keep=True)
    rows = np.concatenate([head, rows.reshape(-1, head.shape[1])])
    setting = Setting(beam, rates, ratios, base, omega, phase, table)
    return assemble(setting, run.state, run.clock, run.totals[SPENT], rows, first, status)


class _Run:
    """State of a run."""

    def __init__(self, table: Beam, state: np.ndarray, phase: float, regime: int) -> None:
        self.table, self.state, self.phase = table, state, phase
        self.clock = np.array([0.0, phase, 0.0])
        self.after = np.empty_like(state)
        self.where = np.array([regime, 0])
        self.count = np.zeros(COUNTERS, np.int64)
        self.totals = np.zeros(2)

    def row(self) -> np.ndarray:
        """The present state as an event row."""
        from ..basis.events import START

        head = [self.clock[TURNS], self.clock[PHASE], START, *self.where, 0.0]
        return np.concatenate([head, self.state])[None]

    def move(self, turns: float, keep: bool) -> tuple[str, np.ndarray]:
        """Advance to so many turns after the start; status and events."""
        from .beam import run

        whole_turns = math.floor(turns)
        last = self.phase + TURN * (turns - whole_turns)
        more = last >= TURN
        end = float(whole_turns + more), last - TURN * more
        legs = LEGS_AT_LEAST + int(LEGS_PER_PERIOD * (end[0] - self.clock[TURNS]))
        buffer = np.empty((CHUNK if keep else 0, HEAD + len(self.state)))

        def on(left: int) -> int:
            return run(
                self.table, self.clock, self.state, self.after, self.where, self.count,
                self.totals, buffer, *end, left,
            )  # fmt: skip

        first = self.clock[TURNS]
        with following(end[0] - first, " turns", lambda: self.clock[TURNS] - first):
            found, parts = run_on(on, self.count, buffer, legs)
        return STATUS[found], np.concatenate(parts)
