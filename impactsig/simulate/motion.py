"""A simulated motion: its impacts and sticks, and its state at any time, computed when asked."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..errors import InvalidInput
from ..impacts import OPEN_END, Impacts
from ..oscillators import KelvinVoigt, Oscillator
from ._problem import base_motion, reference_frequency

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ._engine import Problem
    from .spectrum import PowerSpectrum

TURN = 2 * math.pi


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """What an oscillator did.

    Times are in seconds since the start of the simulation, transient included; displacements,
    velocities and energies in the oscillator's own units.

    Attributes
    ----------
    oscillator : Oscillator
        What moved.
    start, duration : float
        The span after the transient [s].
    impacts : Impacts or None
        Every impact, with its approach velocity relative to the stop; for soft stops also contact
        time and peak force. None where only counts were kept.
    sticks : ndarray, shape (s, 2), or None
        Spans [s] stuck to a rigid stop.
    impact_count, stick_count : int
        How many there were. The rebounds that a chatter sums are not among the impacts.
    energy_lost : float
        Kinetic energy, relative to the stop, lost in impacts and contacts.
    final : tuple of float
        Displacement, velocity and phase of the reference forcing at the end: what `simulate`
        takes as `initial` and `phase` to go on.
    status : str
        "complete", "work limit" or "diverged".
    """

    oscillator: Oscillator
    start: float
    duration: float
    impacts: Impacts | None
    sticks: np.ndarray | None
    impact_count: int
    stick_count: int
    energy_lost: float
    final: tuple[float, float, float]
    status: str
    _problem: Problem = field(repr=False)
    _phase: float = field(repr=False)
    _segments: np.ndarray = field(repr=False)
    _first: tuple[float, float] = field(repr=False)
    _last: tuple[float, float] = field(repr=False)

    @property
    def stop(self) -> float:
        """End of the span [s]."""
        return self.start + self.duration

    @property
    def impacts_per_period(self) -> float:
        """Impacts in a forcing period, on average.

        Raises
        ------
        InvalidInput
            If there is no forcing, or the span is empty.
        """
        period = self.oscillator.forcing_period
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
        time = np.asarray(time, float)
        slack = 1e-12 * max(abs(self.start), abs(self.stop))
        if not ((time >= self.start - slack) & (time <= self.stop + slack)).all():
            raise InvalidInput(
                "time", time, f"times in the span, {self.start:.9g} to {self.stop:.9g} s"
            )
        passed = time * (reference_frequency(self.oscillator) / self.oscillator.time_unit)
        turns = np.floor((passed + self._phase) / TURN)
        return self._at(turns, (passed - TURN * turns) + self._phase)

    def stroboscopic(self, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity once every forcing period, at a phase of the reference [rad].

        Returns
        -------
        x, v : ndarray, shape (n,)
            One for each time in the span at which the forcing has that phase.
        """
        if not math.isfinite(phase):
            raise InvalidInput("phase", phase, "a finite angle [rad]")
        phase = math.fmod(phase, TURN) % TURN
        (first, early), (last, late) = self._first, self._last
        turns = np.arange(first + (phase < early), last + (phase <= late))
        return self._at(turns, np.full(len(turns), phase))

    def _at(self, turns: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity at instants given as turns and phases of the reference."""
        from ._engine import phases_of, sample

        if not len(self._segments):
            raise InvalidInput("keep", "counts", 'simulate(..., keep="all")')
        key = self._segments[:, 0] * TURN + self._segments[:, 1]
        where = np.searchsorted(key, turns * TURN + phase, side="right") - 1
        q, v = sample(
            self._problem, self._segments, np.maximum(where, 0).ravel(), turns.ravel(),
            phase.ravel(),
        )  # fmt: skip
        omega = reference_frequency(self.oscillator)
        base = self.oscillator.base
        own = phases_of(base.frequency / omega if base else 1.0, turns.ravel(), phase.ravel())
        at, moving = base_motion(self.oscillator, own)
        return (q + at).reshape(turns.shape), (v * omega + moving).reshape(turns.shape)

    def power_spectrum(
        self, quantity: Literal["displacement", "velocity"] = "displacement", **options: Any
    ) -> PowerSpectrum:
        """Power spectral density; see `impactsig.simulate.spectrum.power_spectrum`."""
        from .spectrum import power_spectrum

        return power_spectrum(self, quantity, **options)

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the phase portrait; see `impactsig.plot.phase_portrait`."""
        from .. import plot

        return plot.phase_portrait(self, ax, **options)

    def __repr__(self) -> str:
        parts = [f"{self.impact_count} impacts"]
        if self.stick_count:
            parts.append(f"{self.stick_count} sticks")
        text = f"Motion({', '.join(parts)} in {self.duration:.6g} s"
        if self.oscillator.forcing_period and self.duration > 0:
            text += f"; {self.impacts_per_period:.4g} impacts per forcing period"
        return text + ("" if self.status == "complete" else f"; {self.status}") + ")"


def assemble(
    oscillator: Oscillator,
    problem: Problem,
    phase: float,
    first: Any,
    rows: np.ndarray,
    clock: np.ndarray,
    state: np.ndarray,
    count: np.ndarray,
    status: str,
) -> Motion:
    """A motion from what the engine left."""
    from ._engine import phases_of

    omega = reference_frequency(oscillator)
    unit = oscillator.time_unit / omega

    def seconds(turns: Any, at: Any) -> Any:
        return (turns * TURN + (at - phase)) * unit

    start, stop = seconds(first[0], first[1]), seconds(clock[0], clock[1])
    impacts, sticks = None, None
    if len(rows):
        rows.flags.writeable = False
        time = np.minimum(seconds(rows[:, 0], rows[:, 1]), stop)
        sticks = _sticks(rows, time, stop)
        impacts = _impacts(oscillator, problem, rows, time, start, stop, omega)
    q = state[0] + problem.stop[count[0] - 1] if count[0] else state[0]
    ratio = oscillator.base.frequency / omega if oscillator.base else 1.0
    own = phases_of(ratio, clock[:1], clock[1:2])
    at, moving = base_motion(oscillator, own[0])
    return Motion(
        oscillator,
        float(start),
        float(stop - start),
        impacts,
        sticks,
        int(count[2]),
        int(count[3]),
        float(state[3] * oscillator.mass * omega**2),
        (float(q + at), float(state[1] * omega + moving), float(clock[1])),
        status,
        problem,
        phase,
        rows,
        (float(first[0]), float(first[1])),
        (float(clock[0]), float(clock[1])),
    )


def _sticks(rows: np.ndarray, time: np.ndarray, stop: float) -> np.ndarray:
    from ._engine import RELEASE, STICK

    begin, end = time[rows[:, 2] == STICK], time[rows[:, 2] == RELEASE]
    if len(end) < len(begin):
        end = np.append(end, stop)
    return np.stack([begin, end], axis=1)


def _impacts(
    oscillator: Oscillator,
    problem: Problem,
    rows: np.ndarray,
    time: np.ndarray,
    start: float,
    stop: float,
    omega: float,
) -> Impacts:
    """The impacts among the events; soft ones with contact time and peak force."""
    from ._engine import IMPACT, PART, TOUCH, peak_forces

    which = np.flatnonzero((rows[:, 2] == IMPACT) | (rows[:, 2] == TOUCH))
    known: dict[str, Any] = {}
    laws = [stop.law for stop in oscillator.stops]
    soft = [law for law in laws if isinstance(law, KelvinVoigt)]
    if soft:
        # The event after a touch is its end, unless the run ended first.
        over = np.append(rows[1:, 2] == PART, False)[which]
        after = np.append(time[1:], stop)[which]
        touch = rows[which, 2] == TOUCH
        known["contact_time"] = np.where(touch, after - time[which], 0.0)
        known["flags"] = np.where(touch & ~over, OPEN_END, 0)
        if len(soft) == len(laws):
            law = [
                next(iter(oscillator.stops_on("upper")), None),
                next(iter(oscillator.stops_on("lower")), None),
            ]
            pair = [s.law if s and isinstance(s.law, KelvinVoigt) else KelvinVoigt(1) for s in law]
            stiffness = np.array([one.stiffness for one in pair])
            damping = np.array([one.damping for one in pair]) * omega
            lasts = known["contact_time"] * (omega / oscillator.time_unit)
            known["peak"] = peak_forces(problem, rows, which, lasts, stiffness, damping)
    return Impacts(
        time[which],
        approach_velocity=rows[which, 6] * omega,
        start=float(start),
        duration=float(stop - start),
        source=oscillator.name or "simulated",
        **known,
    )
