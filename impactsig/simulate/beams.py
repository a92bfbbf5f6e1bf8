"""A cantilever in several modes before a stop at its tip: Cantilever -> BeamMotion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import number, whole
from ..errors import InvalidInput
from ..oscillators import BaseMotion, Cantilever, Force, Stop
from ._beam_arguments import (
    check_resonance,
    check_stop,
    forces_of,
    initial_state,
    ratios_of,
    regime_at,
)
from ._events import COUNTERS, FULL, HEAD, LEG_COUNT, PHASE, ROW_COUNT, SPENT, STATUS, TURN, TURNS
from ._run import LONGEST
from .beam_motion import BeamMotion, Setting, assemble

if TYPE_CHECKING:
    from ._beam_flow import Beam

CHUNK = 8192  # events that are held at a time
LEGS_PER_PERIOD = 20_000  # work, on average, after which a run is given up
LEGS_AT_LEAST = 100_000
MOST_MODES = 100


def simulate_beam(
    beam: Cantilever,
    stop: Stop | None,
    *,
    modes: int = 8,
    forcing: Force | BaseMotion | None = None,
    damping_ratio: float | Sequence[float] = 0.03,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: tuple[Any, Any] = (0.0, 0.0),
    phase: float = 0.0,
    chatter: float = 1e-6,
) -> BeamMotion:
    """The motion of a cantilever before a stop at its tip, exact up to rounding in every mode.

    Between contacts each mode is an oscillator of its own. At a rigid stop the tip's velocity is
    turned round by an impulse p, which changes every modal velocity at once by -p / m, m the modal
    mass [WaggBishop2000]_:

        v+ = -r v-,    p = (1 + r) v- m / (number of modes),    v the velocity of the tip.

    r is of the two materials where they touch. The tip alone is light, so it comes back at once
    while the rest of the beam still moves on: what is one contact of the beam is many impacts of
    its tip, or a chatter after which the stop holds it, and the beam as a whole comes back more
    slowly than r would have it (`apparent_restitution`). A soft stop couples the modes while it is
    touched; its contact is solved by the eigenvectors of the coupled beam.

    There is no time step and no tolerance; the first contact cannot be missed.

    Parameters
    ----------
    beam : Cantilever
        What moves.
    stop : Stop or None
        What stands at its tip: rigid with a number as restitution coefficient, or a Kelvin-Voigt
        stop whose contact ends at the gap.
    modes : int
        How many modes, from the first, to follow; with 1 it is `scenes.cantilever`.
    forcing : Force or BaseMotion, optional
        A force at the tip [N], or a motion of the clamp [m], which with ``stops=True`` carries the
        stop.
    damping_ratio : float or sequence of float
        Of all modes, or of each, as a share of the critical. By default our choice, as for
        `scenes.karpodinis`.
    periods, duration : float
        How long to look: in forcing periods, or in seconds. Give one of them.
    transient : float
        How long to let it run before, in the same unit.
    initial : (float or sequence, float or sequence)
        Modal displacements [m] and velocities [m/s] at t = 0, from the first mode on; those not
        given are 0.
    phase : float
        Phase of the forcing at t = 0 [rad].
    chatter : float
        Rebounds of the tip slower than this share of the greatest approach velocity so far are
        taken as over where the tip is pressed on the rigid stop. It decides how many of them are
        listed one by one; the motion changes by its square.

    Returns
    -------
    BeamMotion
        With a status: "complete"; "work limit" after 100 000 legs and 20 000 a period, as where a
        tip without any loss, r = 1, is pressed on its stop and bounces without end; "diverged"
        where a number overflowed.

    Raises
    ------
    InvalidInput
        If an argument is out of its range, the beam starts beyond a rigid stop, or an undamped
        mode is forced at its natural frequency.
    """
    if not isinstance(beam, Cantilever):
        raise InvalidInput("beam", beam, "a Cantilever")
    modes = whole("modes", modes, 1)
    if modes > MOST_MODES:
        raise InvalidInput("modes", modes, f"at most {MOST_MODES}")
    check_stop(stop)
    ratios = ratios_of(damping_ratio, modes)
    if (periods is None) == (duration is None):
        raise InvalidInput(
            "periods, duration", f"{periods}, {duration}", "one of them, and only one"
        )
    if not 0 < number("chatter", chatter) <= 1e-2:
        raise InvalidInput("chatter", chatter, "0 < chatter <= 0.01")
    if periods is not None and forcing is None:
        raise InvalidInput(
            "periods", periods, "a forcing to count by",
            "There is no forcing: give duration= in seconds",
        )  # fmt: skip
    name, length = ("periods", periods) if duration is None else ("duration", duration)
    length = number(name, length, above=0, most=LONGEST)
    transient = number("transient", transient, least=0.0, most=LONGEST)
    phase = math.fmod(number("phase", phase), TURN) % TURN

    rates = TURN * beam.frequencies(modes)
    omega = forcing.frequency if isinstance(forcing, (Force, BaseMotion)) else float(rates[0])
    push, base = forces_of(beam, modes, forcing)
    check_resonance(rates, ratios, forcing)
    from ._beam_regimes import regimes

    table = regimes(rates, ratios, beam.modal_mass, push, base, omega, stop, chatter)
    q, v = initial_state(initial, modes)
    regime = regime_at(stop, float(q.sum() + (base * np.exp(1j * phase)).real))
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
    setting = Setting(beam, stop, rates, ratios, forcing is not None, base, omega, phase, table)
    return assemble(setting, run.state, run.clock, run.totals[SPENT], rows, first, status)


class _Run:
    """Where a run is."""

    def __init__(self, table: Beam, state: np.ndarray, phase: float, regime: int) -> None:
        self.table, self.state, self.phase = table, state, phase
        self.clock = np.array([0.0, phase, 0.0])
        self.after = np.empty_like(state)
        self.where = np.array([regime, 0])
        self.count = np.zeros(COUNTERS, np.int64)
        self.totals = np.zeros(2)

    def row(self) -> np.ndarray:
        """Where it is, as the row of an event."""
        from ._events import START

        head = [self.clock[TURNS], self.clock[PHASE], START, *self.where, 0.0]
        return np.concatenate([head, self.state])[None]

    def move(self, turns: float, keep: bool) -> tuple[str, np.ndarray]:
        """Go on until so many turns after the start; status and events."""
        from ._beam import run

        whole_turns = math.floor(turns)
        last = self.phase + TURN * (turns - whole_turns)
        more = last >= TURN
        end = float(whole_turns + more), last - TURN * more
        legs = LEGS_AT_LEAST + int(LEGS_PER_PERIOD * (end[0] - self.clock[TURNS]))
        buffer = np.empty((CHUNK if keep else 0, HEAD + len(self.state)))
        parts = []
        self.count[LEG_COUNT] = 0
        while True:
            found = run(
                self.table, self.clock, self.state, self.after, self.where, self.count,
                self.totals, buffer, *end, legs - int(self.count[LEG_COUNT]),
            )  # fmt: skip
            parts.append(buffer[: self.count[ROW_COUNT]].copy())
            if found != FULL:
                return STATUS[found], np.concatenate(parts)
