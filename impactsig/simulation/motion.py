"""The simulated motion of an oscillator: impacts, sticks, and its state at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from .._arguments import number, times_within
from .._showing import drawn_by
from ..errors import InvalidInput
from ..impacts import OPEN_END, Impacts, exact
from ..oscillators import Oscillator
from .basis.contract import Engine
from .basis.events import (
    IMPACT,
    IMPACT_COUNT,
    LOST,
    LOW,
    MODE,
    PART,
    PHASE,
    RELEASE,
    ROW_APPROACH,
    ROW_KIND,
    ROW_STOP,
    STICK,
    STICK_COUNT,
    TOUCH,
    TURN,
    TURNS,
    Q,
    V,
)
from .basis.frame import base_motion, pace
from .moved import Moved


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Moved):
    """The simulated motion of an oscillator.

    Times are in seconds since the start of the simulation, transient included, or in the
    oscillator's unit of time where that has none (`Oscillator.in_seconds`); displacements,
    velocities and energies in the oscillator's own units.

    Attributes
    ----------
    system : Oscillator
        The simulated system.
    start, duration : float
        The span after the transient [s].
    impacts : Impacts or None
        Every impact, with its approach velocity relative to the stop; for soft stops also contact
        time and peak force. None where only counts were kept.
    sticks : ndarray, shape (s, 2), or None
        Spans [s] at rest at a rigid stop or under friction.
    impact_count, stick_count : int
        Numbers of impacts and sticks. Rebounds that are summed as chatter are not counted.
    energy_lost : float
        Kinetic energy, relative to the stop, lost in impacts and contacts; and the work of
        friction. A contact with several stops counts from the first touch to the last.
    final : tuple of float
        Displacement, velocity and phase of the forcing at the end; pass them to `simulate` as
        `initial` and `phase` to continue.
    status : str
        "complete", "work limit", "diverged" or "broken law"; see `simulate`.

    See Also
    --------
    simulate, results.BeamMotion, plot.phase_portrait

    Examples
    --------
    >>> from impactsig import scenes, simulate
    >>> motion = simulate(scenes.karpodinis(22.1), periods=50, transient=200)
    >>> x, v = motion.stroboscopic()
    >>> motion.impact_count, x.shape
    (50, (51,))
    """

    system: Oscillator
    start: float
    duration: float
    impacts: Impacts | None
    sticks: np.ndarray | None
    impact_count: int
    stick_count: int
    energy_lost: float
    final: tuple[float, float, float]
    status: str
    _engine: Engine = field(repr=False)
    _phase: float = field(repr=False)
    _segments: np.ndarray = field(repr=False)
    _first: tuple[float, float] = field(repr=False)
    _last: tuple[float, float] = field(repr=False)

    @property
    def impacts_per_period(self) -> float:
        """Impacts in a forcing period, on average.

        Raises
        ------
        InvalidInput
            If there is no forcing, or the span is empty.
        """
        period = self.system.forcing_period
        if period is None or self.duration <= 0:
            raise InvalidInput("motion", repr(self), "a forced motion of some duration")
        return self.impact_count / (self.duration / period)

    def sample(self, time: Any) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity at any times of the span, in closed form.

        At the instant of an impact it is the state after it.

        Parameters
        ----------
        time : array_like
            Times [s].

        Returns
        -------
        x, v : ndarray, shape of `time`
            In the oscillator's units, against the ground.

        Raises
        ------
        InvalidInput
            If a time is outside the span, or only counts were kept.
        """
        time = times_within(time, self.start, self.stop, " s")
        return self._at(*self._instants(time))

    def stroboscopic(self, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity once every forcing period, at a phase of the forcing [rad].

        Returns
        -------
        x, v : ndarray, shape (n,)
            Displacement and velocity at each time in the span at which the forcing has that phase.

        Raises
        ------
        InvalidInput
            If the phase is not a finite number, or only counts were kept.
        """
        phase = number("phase", phase, "a finite angle [rad]")
        phase = math.fmod(phase, TURN) % TURN
        (first, early), (last, late) = self._first, self._last
        turns = np.arange(first + (phase < early), last + (phase <= late))
        return self._at(turns, np.full(len(turns), phase))

    def _instants(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Turns and phases of the reference at times."""
        passed = time * (self._engine.omega / self.system.time_unit)
        turns = np.floor((passed + self._phase) / TURN)
        return turns, (passed - TURN * turns) + self._phase

    @cached_property
    def _begins(self) -> np.ndarray:
        """Angle of the reference at the events."""
        return self._segments[:, TURNS] * TURN + self._segments[:, PHASE]

    def _at(self, turns: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity at instants given as turns and phases of the reference."""
        if not len(self._segments):
            raise InvalidInput("keep", "counts", 'simulate(..., keep="all")')
        where = np.searchsorted(self._begins, turns * TURN + phase, side="right") - 1
        q, v = self._engine.sample(
            self._segments, np.maximum(where, 0).ravel(), turns.ravel(), phase.ravel()
        )
        at, moving = self._stops_at(turns, phase)
        return q.reshape(turns.shape) + at, (v * self._engine.omega).reshape(turns.shape) + moving

    def _from_stops(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity relative to the base of the stops, at times."""
        (x, v), (at, moving) = self.sample(time), self._stops_at(*self._instants(time))
        return x - at, v - moving

    def _stops_at(self, turns: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity of the base of the stops, at instants as in `_at`."""
        from .exact.flow import phases_of

        own = phases_of(pace(self.system), turns.ravel(), phase.ravel())
        at, moving = base_motion(self.system, own)
        return at.reshape(turns.shape), moving.reshape(turns.shape)

    def kinetic_energy_gained(self) -> float:
        """Change of the body's kinetic energy in impacts and contacts, against the ground.

        `energy_lost` is the energy that a stop dissipates, relative to the stop. A moving stop also
        does work on the body, and this is the sum of both: at an elastic stop no energy is lost,
        but the body may gain energy. The average a_e of [Okolewski2021]_ is its modulus per forcing
        period.

        Returns
        -------
        float
            The change, positive if the body gains energy, in the units of the oscillator.

        Raises
        ------
        InvalidInput
            If only counts were kept.
        """
        from ._body_energy import kinetic_energy_gained

        return kinetic_energy_gained(self)

    plot = drawn_by("phase_portrait", "the phase portrait")

    def __repr__(self) -> str:
        parts = [f"{self.impact_count} impacts"]
        if self.stick_count:
            parts.append(f"{self.stick_count} sticks")
        unit = " s" if self.system.in_seconds else ""
        text = f"Motion({', '.join(parts)} in {self.duration:.6g}{unit}"
        if self.system.forcing_period and self.duration > 0:
            text += f"; {self.impacts_per_period:.4g} impacts per forcing period"
        return text + ("" if self.status == "complete" else f"; {self.status}") + ")"


def assemble(
    oscillator: Oscillator,
    engine: Engine,
    phase: float,
    first: Any,
    rows: np.ndarray,
    clock: np.ndarray,
    state: np.ndarray,
    count: np.ndarray,
    status: str,
) -> Motion:
    """Make a motion from the events of the engine."""
    from .exact.flow import phases_of

    omega = engine.omega
    unit = oscillator.time_unit / omega

    def seconds(turns: Any, at: Any) -> Any:
        return (turns * TURN + (at - phase)) * unit

    start, stop = seconds(first[TURNS], first[PHASE]), seconds(clock[TURNS], clock[PHASE])
    impacts, sticks = None, None
    if len(rows):
        rows.flags.writeable = False
        time = np.minimum(seconds(rows[:, TURNS], rows[:, PHASE]), stop)
        sticks = _sticks(rows, time, stop)
        end = float(clock[TURNS]), float(clock[PHASE])
        known = _impacts(oscillator, engine, rows, time, end, stop)
        impacts = Impacts(
            start=float(start),
            duration=float(stop - start),
            source=oscillator.name or "simulated",
            **known,
        )
    own = phases_of(pace(oscillator), clock[:PHASE], clock[PHASE:LOW])
    at, moving = base_motion(oscillator, own[0])
    q = float(engine.place(count[MODE], state[Q]))
    return Motion(
        oscillator,
        float(start),
        float(stop - start),
        impacts,
        sticks,
        int(count[IMPACT_COUNT]),
        int(count[STICK_COUNT]),
        float(state[LOST] * oscillator.mass * (omega * omega)),
        (float(q + at), float(state[V] * omega + moving), float(clock[PHASE])),
        status,
        engine,
        phase,
        rows,
        (float(first[TURNS]), float(first[PHASE])),
        (float(clock[TURNS]), float(clock[PHASE])),
    )


def _sticks(rows: np.ndarray, time: np.ndarray, stop: float) -> np.ndarray:
    kind = rows[:, ROW_KIND]
    begin, end = time[kind == STICK], time[kind == RELEASE]
    spans = np.full((len(begin), 2), stop)
    spans[:, 0], spans[: len(end), 1] = begin, end
    return spans


def _impacts(
    oscillator: Oscillator,
    engine: Engine,
    rows: np.ndarray,
    time: np.ndarray,
    end: tuple[float, float],
    stop: float,
) -> dict[str, Any]:
    """`Impacts` from the event rows."""
    kind, which_stop = rows[:, ROW_KIND], rows[:, ROW_STOP]
    which = ((kind == IMPACT) | (kind == TOUCH)).nonzero()[0]
    known: dict[str, Any] = {
        "time": time[which],
        "approach_velocity": rows[which, ROW_APPROACH] * engine.omega,
        "stop_index": which_stop[which],
        **exact(len(which)),
    }
    soft = [n for n, own in enumerate(oscillator.stops) if not own.law.rigid]
    if soft:
        last = which.copy()  # the row that ends the contact
        for n in soft:
            touches = np.flatnonzero((kind == TOUCH) & (which_stop == n))
            parts = np.append(np.flatnonzero((kind == PART) & (which_stop == n)), len(rows))
            last[np.searchsorted(which, touches)] = parts[np.searchsorted(parts, touches)]
        known["contact_time"] = np.append(time, stop)[last] - time[which]
        known["flags"] = np.where(last == len(rows), OPEN_END, 0)
        if len(soft) == len(oscillator.stops):
            known["peak"] = engine.peaks(rows, which, last, end)
    return known
