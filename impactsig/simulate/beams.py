"""A cantilever in several modes before a stop at its tip: Cantilever -> BeamMotion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import number, whole
from ..errors import InvalidInput
from ..impacts import OPEN_END, Impacts
from ..oscillators import BaseMotion, Cantilever, Force, KelvinVoigt, Rigid, Stop
from ._events import FULL, IMPACT, PART, RELEASE, STATUS, STICK, TOUCH
from .motion import TURN

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ._beam import Beam

CHUNK = 8192  # events that are held at a time
LEGS_PER_PERIOD = 20_000  # work, on average, after which a run is given up
LEGS_AT_LEAST = 100_000
MOST_MODES = 100


@dataclass(frozen=True, eq=False, repr=False)
class BeamMotion:
    """What a beam did, in all its modes.

    Times are in seconds since the start of the simulation, transient included; all else is in SI
    units. Where a moving base carries the stop, displacements and velocities are relative to it,
    else against the ground.

    Attributes
    ----------
    beam : Cantilever
        What moved.
    stop : Stop or None
        What its tip hit.
    frequencies : ndarray, shape (m,)
        Natural frequencies of the modes that were followed [Hz].
    damping_ratios : ndarray, shape (m,)
        Their damping, as shares of the critical.
    forcing_period : float or None
        [s].
    start, duration : float
        The span after the transient [s].
    impacts : Impacts
        Every impact of the tip, with its approach velocity; of a rigid stop with its impulse [N s],
        of a soft one with its contact time. Impacts that follow one another closely are what one
        contact of the beam is made of; see `apparent_restitution`.
    sticks : ndarray, shape (s, 2)
        Spans [s] in which the rigid stop held the tip while the beam behind it moved on.
    energy_lost : float or None
        Energy lost in the impacts on a rigid stop [J]; None for a soft one.
    final : tuple
        Modal displacements [m], modal velocities [m/s] and phase of the forcing at the end: what
        `simulate_beam` takes as `initial` and `phase` to go on.
    status : str
        "complete", "work limit" or "diverged".
    """

    beam: Cantilever
    stop: Stop | None
    frequencies: np.ndarray
    damping_ratios: np.ndarray
    forcing_period: float | None
    start: float
    duration: float
    impacts: Impacts
    sticks: np.ndarray
    energy_lost: float | None
    final: tuple[np.ndarray, np.ndarray, float]
    status: str
    _regimes: Beam = field(repr=False)
    _omega: float = field(repr=False)
    _phase: float = field(repr=False)
    _base: complex = field(repr=False)
    _rows: np.ndarray = field(repr=False)
    _impact_rows: np.ndarray = field(repr=False)

    def modal(self, time: Any) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities at any times of the span, in closed form.

        A modal displacement is what its mode adds to the deflection of the tip [m].

        Parameters
        ----------
        time : array_like
            Times [s].

        Returns
        -------
        q, v : ndarray, shape of `time` and (m,)

        Raises
        ------
        InvalidInput
            If a time is outside the span.
        """
        time = np.asarray(time, float)
        slack = 1e-12 * max(abs(self.start), abs(self.start + self.duration))
        last = self.start + self.duration
        if not ((time >= self.start - slack) & (time <= last + slack)).all():
            raise InvalidInput("time", time, f"times in the span, {self.start:.9g} to {last:.9g} s")
        from ._beam import sample

        turns, phase = self._angle(time)
        which = np.searchsorted(self._begins, turns * TURN + phase, side="right") - 1
        m = len(self.frequencies)
        states = np.empty((time.size, 2 * m))
        rows = np.maximum(which, 0).ravel()
        sample(self._regimes, self._rows, rows, turns.ravel(), phase.ravel(), states)
        shape = (*time.shape, m)
        return states[:, :m].reshape(shape), states[:, m:].reshape(shape) * self._omega

    def sample(self, time: Any) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity of the tip at any times of the span, in closed form.

        At the instant of an impact it is the state after it.

        Raises
        ------
        InvalidInput
            If a time is outside the span.
        """
        q, v = self.modal(time)
        _turns, phase = self._angle(np.asarray(time, float))
        wave = self._base * np.exp(1j * phase)
        return q.sum(axis=-1) + wave.real, v.sum(axis=-1) - self._omega * wave.imag

    def deflection(self, time: float, x: Any) -> np.ndarray:
        """Shape of the beam at one time: its deflection [m] at distances x from the clamp [m].

        Raises
        ------
        InvalidInput
            If the time is outside the span, or a place not on the beam.
        """
        q, _v = self.modal(number("time", time))
        shapes = [self.beam.mode_shape(n + 1, x) for n in range(len(q))]
        return np.tensordot(q, np.array(shapes), axes=1)

    def energy(self, time: Any) -> np.ndarray:
        """Kinetic and elastic energy of each mode [J], shape of `time` and (m,)."""
        q, v = self.modal(time)
        rates = TURN * self.frequencies
        return self.beam.modal_mass / 2 * (v**2 + (rates * q) ** 2)

    def modal_at_impacts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Modal displacements, and velocities before and after each impact, shape (n, m) each.

        Of a soft stop, whose contact lasts, the two velocities are the same: those at the touch.
        """
        m = len(self.frequencies)
        states = self._rows[self._impact_rows, -2 * m :]
        q, after = states[:, :m], states[:, m:] * self._omega
        law = self.stop.law if self.stop else None
        if not isinstance(law, Rigid):
            return q, after, after
        speed = self.impacts.approach_velocity
        assert speed is not None
        jump = self._regimes.side * (1 + self._regimes.restitution) * speed / m
        return q, after + jump[:, None], after

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the way of the tip; see `impactsig.plot.tip_history`."""
        from .. import plot

        return plot.tip_history(self, ax, **options)

    def _seconds(self, rows: np.ndarray) -> np.ndarray:
        """Times of events [s]."""
        return (rows[:, 0] * TURN + (rows[:, 1] - self._phase)) / self._omega

    def _angle(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        passed = time * self._omega
        turns = np.floor((passed + self._phase) / TURN)
        return turns, (passed - TURN * turns) + self._phase

    @cached_property
    def _begins(self) -> np.ndarray:
        """Angle of the reference at the events."""
        return self._rows[:, 0] * TURN + self._rows[:, 1]

    def __repr__(self) -> str:
        text = f"BeamMotion({len(self.frequencies)} modes, {len(self.impacts)} impacts"
        if len(self.sticks):
            text += f", {len(self.sticks)} sticks"
        text += f" in {self.duration:.6g} s"
        return text + ("" if self.status == "complete" else f"; {self.status}") + ")"


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
        With a status: "complete"; "work limit" after 100 000 legs and 20 000 a period; "diverged"
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
    _check_stop(stop)
    ratios = _ratios(damping_ratio, modes)
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
    length = number(name, length, positive=True)
    transient = number("transient", transient, least=0.0)
    phase = math.fmod(number("phase", phase), TURN) % TURN

    rates = TURN * beam.frequencies(modes)
    omega = forcing.frequency if isinstance(forcing, (Force, BaseMotion)) else float(rates[0])
    push, base = _forcing(beam, modes, forcing)
    _check_resonance(rates, ratios, forcing)
    from ._beam_regimes import regimes

    table = regimes(rates, ratios, beam.modal_mass, push, base, omega, stop, chatter)
    q, v = _initial(initial, modes)
    regime = _regime_of(stop, float(q.sum() + (base * np.exp(1j * phase)).real))
    per_turn = 1.0 if duration is None else omega / TURN
    run = _Run(table, np.concatenate([q, v / omega]), phase, regime)
    status, rows = "complete", np.empty((0, 0))
    if transient > 0:
        status, _ = run.move(transient * per_turn, keep=False)
    first = run.clock[:2].copy()
    run.totals[1] = 0.0
    head = run.row()
    if status == "complete":
        status, rows = run.move((transient + length) * per_turn, keep=True)
    rows = np.concatenate([head, rows.reshape(-1, head.shape[1])])
    return _assemble(
        beam, stop, rates, ratios, forcing, base, omega, phase, run, rows, first, status
    )


class _Run:
    """Where a run is."""

    def __init__(self, table: Beam, state: np.ndarray, phase: float, regime: int) -> None:
        self.table, self.state, self.phase = table, state, phase
        self.clock = np.array([0.0, phase, 0.0])
        self.after = np.empty_like(state)
        self.where = np.array([regime, 0])
        self.count = np.zeros(4, np.int64)
        self.totals = np.zeros(2)

    def row(self) -> np.ndarray:
        """Where it is, as the row of an event."""
        from ._events import START

        head = [self.clock[0], self.clock[1], START, *self.where, 0.0]
        return np.concatenate([head, self.state])[None]

    def move(self, turns: float, keep: bool) -> tuple[str, np.ndarray]:
        """Go on until so many turns after the start; status and events."""
        from ._beam import HEAD, run

        whole_turns = math.floor(turns)
        last = self.phase + TURN * (turns - whole_turns)
        more = last >= TURN
        end = float(whole_turns + more), last - TURN * more
        legs = LEGS_AT_LEAST + int(LEGS_PER_PERIOD * (end[0] - self.clock[0]))
        buffer = np.empty((CHUNK if keep else 0, HEAD + len(self.state)))
        parts = []
        self.count[3] = 0
        while True:
            found = run(
                self.table, self.clock, self.state, self.after, self.where, self.count,
                self.totals, buffer, *end, legs - int(self.count[3]),
            )  # fmt: skip
            parts.append(buffer[: self.count[2]].copy())
            if found != FULL:
                return STATUS[found], np.concatenate(parts)


def _assemble(
    beam: Cantilever,
    stop: Stop | None,
    rates: np.ndarray,
    ratios: np.ndarray,
    forcing: Any,
    base: complex,
    omega: float,
    phase: float,
    run: _Run,
    rows: np.ndarray,
    first: np.ndarray,
    status: str,
) -> BeamMotion:
    """A motion from what the kernel left."""

    def seconds(turns: Any, at: Any) -> Any:
        return (turns * TURN + (at - phase)) / omega

    m = len(rates)
    start, end = float(seconds(*first)), float(seconds(run.clock[0], run.clock[1]))
    time = np.clip(seconds(rows[:, 0], rows[:, 1]), start, end)
    kind = rows[:, 2]
    which = np.flatnonzero((kind == IMPACT) | (kind == TOUCH))
    speed = rows[which, 5] * omega
    known: dict[str, Any] = {"time": time[which], "approach_velocity": speed}
    law = stop.law if stop else None
    if isinstance(law, Rigid):
        known["impulse"] = (1 + run.table.restitution) * speed * beam.modal_mass / m
        known["unit"] = "N"
    elif law is not None:
        over = np.append(np.flatnonzero(kind == PART), len(rows))
        over = over[np.searchsorted(over, which)]
        known["contact_time"] = np.append(time, end)[over] - time[which]
        known["flags"] = np.where(over == len(rows), OPEN_END, 0)
    held, release = kind == STICK, time[kind == RELEASE]
    begin = np.minimum(time[held] + rows[held, 5] / omega, end)
    if rows[0, 3] == 1 and isinstance(law, Rigid):  # held from the start on
        begin = np.append(start, begin)
    if len(release) < len(begin):
        release = np.append(release, end)
    impacts = Impacts(start=start, duration=end - start, source=f"cantilever in {m} modes", **known)
    rows.flags.writeable = False
    return BeamMotion(
        beam, stop, rates / TURN, ratios,
        None if forcing is None else TURN / omega,
        start, end - start, impacts, np.stack([begin, release], axis=1),
        float(run.totals[1] * beam.modal_mass * omega**2) if isinstance(law, Rigid) else None,
        (run.state[:m].copy(), run.state[m:] * omega, float(run.clock[1])),
        status, run.table, omega, phase, base, rows, which,
    )  # fmt: skip


def _check_stop(stop: Any) -> None:
    if stop is None:
        return
    if not isinstance(stop, Stop):
        raise InvalidInput("stop", stop, "a Stop(...) at the tip, or None")
    law = stop.law
    if isinstance(law, Rigid) and not callable(law.restitution):
        return
    if not (isinstance(law, KelvinVoigt) and law.ends == "gap"):
        raise InvalidInput(
            "stop.law", law, 'Rigid(a number), or KelvinVoigt(...) that ends at the "gap"',
            "Other laws are for one mode: simulate(scenes.cantilever(...))",
        )  # fmt: skip


def _ratios(given: Any, modes: int) -> np.ndarray:
    try:
        ratios = np.array(given, float)
    except (TypeError, ValueError):
        ratios = np.array(np.nan)
    if ratios.ndim == 0:
        ratios = np.full(modes, float(ratios))
    if ratios.shape != (modes,):
        raise InvalidInput("damping_ratio", given, f"a number, or one for each of {modes} modes")
    if not ((ratios >= 0) & (ratios < 1)).all():
        raise InvalidInput("damping_ratio", given, "shares of the critical, 0 or greater, below 1")
    return ratios


def _forcing(beam: Cantilever, modes: int, forcing: Any) -> tuple[np.ndarray, complex]:
    """Complex amplitudes of the modal forces [N], and of the base's own part of the tip [m]."""
    if forcing is None:
        return np.zeros(modes, complex), 0j
    if isinstance(forcing, Force):
        return np.full(modes, forcing.amplitude * np.exp(1j * forcing.phase)), 0j
    if not isinstance(forcing, BaseMotion):
        raise InvalidInput("forcing", forcing, "Force(...) at the tip, BaseMotion(...) or None")
    if not (forcing.spring and forcing.damper):
        raise InvalidInput("forcing", forcing, "a base that both spring and damper hang on")
    moves = forcing.amplitude * np.exp(1j * forcing.phase)
    push = beam.participation(modes) * beam.modal_mass * forcing.frequency**2 * moves
    return push, 0j if forcing.stops else complex(moves)


def _check_resonance(rates: np.ndarray, ratios: np.ndarray, forcing: Any) -> None:
    if forcing is None:
        return
    ratio = rates / forcing.frequency
    near = np.hypot(ratio**2 - 1, 2 * ratios * ratio) < 1e-6
    if near.any():
        mode = int(np.argmax(near))
        raise InvalidInput(
            "damping_ratio", float(ratios[mode]),
            f"a positive damping of mode {mode + 1}, forced at its natural frequency",
            "Undamped, such a motion grows without bound",
        )  # fmt: skip


def _initial(initial: Any, modes: int) -> tuple[np.ndarray, np.ndarray]:
    required = f"modal displacements and velocities, of up to {modes} modes"
    try:
        parts = [np.atleast_1d(np.asarray(part, float)) for part in initial]
    except (TypeError, ValueError):
        raise InvalidInput("initial", initial, required) from None
    right = len(parts) == 2 and all(part.ndim == 1 and len(part) <= modes for part in parts)
    if not right or not all(np.isfinite(part).all() for part in parts):
        raise InvalidInput("initial", initial, required)
    q, v = (np.pad(part, (0, modes - len(part))) for part in parts)
    return q, v


def _regime_of(stop: Stop | None, tip: float) -> int:
    """The regime in which a tip at that place starts."""
    if stop is None:
        return 0
    depth = (tip - stop.position) * (1 if stop.side == "upper" else -1)
    if isinstance(stop.law, Rigid):
        if depth > 1e-12 * (abs(tip) + abs(stop.position)):
            raise InvalidInput(
                "initial", f"a tip at {tip:.9g} m",
                f"a start on this side of the {stop.side} rigid stop",
                f"It is {depth:.3g} m beyond",
            )  # fmt: skip
        return 0
    return int(depth > 0)
