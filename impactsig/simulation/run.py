"""One run of an engine: initial state, present state, and the motions made on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arguments import flag, instance, number, one_of_them
from .._running.watched import following
from ..errors import InvalidInput
from ..oscillators import Oscillator
from .basis.contract import Engine, Moment, run_on
from .basis.events import (
    COLUMNS,
    CONTACT_COUNT,
    DONE,
    IMPACT_COUNT,
    LOST,
    START,
    STATUS,
    STICK,
    STUCK,
    TURN,
    TURNS,
    row_of,
)
from .basis.frame import first_phase, forcing_of_one
from .exact.exact import ExactEngine, piecewise_linear
from .exact.starts import first_place
from .motion import Motion, assemble
from .stepping.runge_kutta import FixedStep, RungeKutta, SteppingEngine

CHUNK = 65536  # events that are held at a time
LONGEST = 1e15  # a run, in periods or seconds: beyond it one more would be rounded away
LEGS_PER_PERIOD = 10_000  # work, on average, after which a run is given up
LEGS_AT_LEAST = 100_000
NONE = np.empty((0, COLUMNS))


class Run:
    """A run past its transient; the arguments are those of `simulate`."""

    def __init__(
        self,
        oscillator: Oscillator,
        *,
        periods: float | None = None,
        duration: float | None = None,
        transient: float = 0.0,
        initial: tuple[float, float] = (0.0, 0.0),
        phase: float = 0.0,
        method: RungeKutta | FixedStep | None = None,
        chatter: float = 1e-6,
        skip_unreachable: bool = True,
    ) -> None:
        instance("oscillator", oscillator, Oscillator, "an Oscillator, as impactsig.scenes makes")
        without_noise(oscillator)
        forced = bool(oscillator.angular_frequencies)
        self.length, self.before = span(periods, duration, transient, forced)
        chatter = number("chatter", chatter, above=0, most=1e-2)
        self.phase = first_phase(phase)
        self.oscillator = oscillator
        self.engine = engine_of(
            oscillator, method, chatter, flag("skip_unreachable", skip_unreachable)
        )
        self.unit = " s" if periods is None else " periods"
        omega = self.engine.omega
        self.per_turn = 1.0 if duration is None else omega / (TURN * oscillator.time_unit)

        if isinstance(self.engine, ExactEngine):
            columns, forcing = self.engine.stack.columns, self.engine.stack.forcing
        else:
            columns, forcing = forcing_of_one(oscillator)
        q, v = first_place(columns, forcing, initial, self.phase)
        clock = np.array([0.0, self.phase, 0.0])
        self.now = Moment(clock, *self.engine.begin(q, v, self.phase))
        self.status = STATUS[DONE]
        if self.before > 0:
            self.status, _ = self._move(self.before, NONE)

    def motion(self, until: float, keep: bool = True) -> Motion:
        """The motion from here to `until`, counted from the end of the transient."""
        _clock, state, count = self.now
        count[IMPACT_COUNT : CONTACT_COUNT + 1], state[LOST] = 0, 0.0
        kind = STICK if count[STUCK] else START
        first = row_of(kind, *self.now)
        rows = NONE
        if self.status == "complete":
            buffer = np.empty((CHUNK, COLUMNS)) if keep else NONE
            self.status, rows = self._move(self.before + until, buffer)
        if keep:
            rows = np.concatenate([[first], rows])
        return assemble(
            self.oscillator, self.engine, self.phase, first, rows, *self.now, self.status
        )

    def _move(self, until: float, buffer: np.ndarray) -> tuple[str, np.ndarray]:
        """Call the engine until it is done; its status, and the events of all calls."""
        end = after(self.phase, until * self.per_turn)
        clock = self.now.clock
        legs = int(work(end[0] - clock[TURNS]))

        def run(left: int) -> int:
            return self.engine.run(self.now, buffer, end, left)

        begin = _turns(*clock[:2])

        def done(turns: float, phase: float) -> float:
            return (_turns(turns, phase) - begin) / self.per_turn

        with following(done(*end), self.unit, lambda: done(*clock[:2])):
            found, parts = run_on(run, self.now.counts, buffer, legs)
        return STATUS[found], np.concatenate(parts)


def span(
    periods: float | None, duration: float | None, transient: float, forced: bool
) -> tuple[float, float]:
    """Duration and transient, in forcing periods or seconds.

    Raises
    ------
    InvalidInput
        If both or none are given, or one is out of its range.
    """
    name, length = one_of_them(periods=periods, duration=duration)
    if name == "periods" and not forced:
        raise InvalidInput(
            "periods", periods, "a system with forcing",
            "Without forcing, give duration= (--duration) in seconds",
        )  # fmt: skip
    return (
        number(name, length, above=0, most=LONGEST),
        number("transient", transient, least=0.0, most=LONGEST),
    )


def count_of_periods(system: Any, periods: float | None, duration: float | None) -> float:
    """Duration in forcing periods of a system that has them; raises as `span` does."""
    length, _ = span(periods, duration, 0.0, True)
    return length if duration is None else length / float(system.forcing_period)


def without_noise(oscillator: Oscillator, name: str = "oscillator") -> Oscillator:
    """Refuse an oscillator with noise.

    Raises
    ------
    InvalidInput
        If it has noise.
    """
    if oscillator.noise is not None and oscillator.noise.intensity > 0:
        raise InvalidInput(
            name, repr(oscillator.noise), "an oscillator without noise",
            "Under noise, simulate_ensemble() gives densities and simulate() a path; "
            "replace(oscillator, noise=None) removes the noise",
        )  # fmt: skip
    return oscillator


def engine_of(
    oscillator: Oscillator, method: RungeKutta | FixedStep | None, chatter: float, skip: bool
) -> Engine:
    """The exact engine if it applies, unless a Runge-Kutta method is asked for."""
    if method is None:
        if piecewise_linear(oscillator):
            return ExactEngine(oscillator, chatter, skip)
        method = RungeKutta()
    if not isinstance(method, (RungeKutta, FixedStep)):
        raise InvalidInput("method", method, "RungeKutta(...), FixedStep(...) or None")
    return SteppingEngine(oscillator, method, chatter)


def _turns(turns: float, phase: float) -> float:
    return float(turns + phase / TURN)


def after(phase: Any, turns: Any) -> tuple[Any, Any]:
    """Clock after so many turns more; whole turns leave the phase unchanged."""
    whole = np.floor(turns)
    last = phase + TURN * (turns - whole)
    more = last >= TURN
    return whole + more, last - TURN * more


def work(turns: Any) -> Any:
    """Number of legs that a run may take before it is given up."""
    legs = np.minimum(LEGS_PER_PERIOD * np.maximum(turns, 0.0), 2.0**62)
    return LEGS_AT_LEAST + legs.astype(np.int64)
