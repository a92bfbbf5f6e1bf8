"""The simulated motion of a beam: impacts, and its state at any time."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._arguments import number, times_within
from ..._showing import drawn_by
from ...impacts import OPEN_END, Impacts, exact
from ...oscillators import Cantilever, Stop
from ..basis.events import (
    BEAM_APPROACH,
    IMPACT,
    PART,
    PHASE,
    RELEASE,
    ROW_KIND,
    ROW_REGIME,
    STICK,
    TOUCH,
    TURN,
    TURNS,
)
from ..basis.frame import strobe_times
from ..moved import Moved

if TYPE_CHECKING:
    from .beam_flow import Beam


@dataclass(frozen=True, eq=False, repr=False)
class BeamMotion(Moved):
    """The simulated motion of a beam, in all its modes.

    Times are in seconds since the start of the simulation, transient included; all else is in SI
    units. Where a moving base carries the stop, displacements and velocities are relative to it,
    else against the ground.

    Attributes
    ----------
    system : Cantilever
        The simulated system.
    frequencies : ndarray, shape (m,)
        Natural frequencies of the simulated modes [Hz].
    damping_ratios : ndarray, shape (m,)
        Their damping ratios.
    start, duration : float
        The span after the transient [s].
    impacts : Impacts
        Every impact of the tip, with its approach velocity; for a rigid stop with its impulse [N
        s], for a soft one with contact time and peak force [N]. One contact of the beam consists of
        impacts in quick succession; see `apparent_restitution`.
    sticks : ndarray, shape (s, 2)
        Spans [s] in which the tip stayed at the rigid stop while the beam moved.
    energy_lost : float or None
        Energy lost in the impacts on a rigid stop [J]; None for a soft one.
    final : tuple
        Modal displacements [m], modal velocities [m/s] and phase of the forcing at the end; pass
        them to `simulate` as `initial` and `phase` to continue.
    status : str
        "complete", "work limit" or "diverged".

    See Also
    --------
    Cantilever, results.Motion, plot.tip_history

    Examples
    --------
    >>> from impactsig import BaseMotion, Cantilever, Rigid, Stop, simulate
    >>> stop, base = Stop(1e-3, Rigid(0.6)), BaseMotion(2e-4, 130.0)
    >>> ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, stop=stop, forcing=base, modes=3)
    >>> motion = simulate(ruler, periods=40)
    >>> motion.status, motion.frequencies.round(1)
    ('complete', array([ 20.9, 130.9, 366.5]))
    """

    system: Cantilever
    frequencies: np.ndarray
    damping_ratios: np.ndarray
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

        A modal displacement is the contribution of its mode to the deflection of the tip [m].

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
        time = times_within(time, self.start, self.stop, " s")
        from .beam_flow import sample

        turns, phase = self._angle(time)
        which = np.searchsorted(self._begins, turns * TURN + phase, side="right") - 1
        m = len(self.frequencies)
        states = np.empty((time.size, 2 * m))
        rows = np.maximum(which, 0).ravel()
        sample(self._regimes, self._rows, rows, turns.ravel(), phase.ravel(), states)
        shape = (*time.shape, m)
        return states[:, :m].reshape(shape), states[:, m:].reshape(shape) * self._omega

    def sample(self, time: Any) -> tuple[np.ndarray, np.ndarray]:
        """Displacement [m] and velocity [m/s] of the tip at any times of the span, in closed form.

        They have the shape of `time`. At the instant of an impact it is the state after it.

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
        """Deflection [m] at one time [s] and distances x from the clamp [m], shape of `x`.

        Raises
        ------
        InvalidInput
            If the time is outside the span, or a position is not on the beam.
        """
        q, _v = self.modal(number("time", time))
        shapes = [self.system.mode_shape(n + 1, x) for n in range(len(q))]
        return np.tensordot(q, np.array(shapes), axes=1)

    def energy(self, time: Any) -> np.ndarray:
        """Kinetic and elastic energy of each mode [J], shape of `time` and (m,)."""
        q, v = self.modal(time)
        rates = TURN * self.frequencies
        return self.system.modal_mass / 2 * (v**2 + (rates * q) ** 2)

    def modal_at_impacts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Modal displacements, and velocities before and after each impact, shape (n, m) each.

        For a soft stop the two velocities are the same, those at the touch.
        """
        m = len(self.frequencies)
        states = self._rows[self._impact_rows, -2 * m :]
        q, after = states[:, :m], states[:, m:] * self._omega
        if not _is_rigid(self.system.stop):
            return q, after, after
        speed = self.impacts.approach_velocity
        assert speed is not None
        jump = self._regimes.side * (1 + self._regimes.restitution) * speed / m
        return q, after + jump[:, None], after

    def stroboscopic(self, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity of the tip once every forcing period.

        Parameters
        ----------
        phase : float
            Phase of the forcing [rad].

        Returns
        -------
        x, v : ndarray, shape (n,)

        Raises
        ------
        InvalidInput
            If the phase is not a finite number, or there is no forcing.
        """
        omega = None if self.system.forcing_period is None else self._omega
        return self.sample(strobe_times(self, phase, omega, self.start, self.stop))

    plot = drawn_by("tip_history", "the displacement of the tip over time")

    def _seconds(self, rows: np.ndarray) -> np.ndarray:
        """Times of events [s]."""
        return (rows[:, TURNS] * TURN + (rows[:, PHASE] - self._phase)) / self._omega

    def _angle(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        passed = time * self._omega
        turns = np.floor((passed + self._phase) / TURN)
        return turns, (passed - TURN * turns) + self._phase

    @cached_property
    def _begins(self) -> np.ndarray:
        """Angle of the reference at the events."""
        return self._rows[:, TURNS] * TURN + self._rows[:, PHASE]

    def __repr__(self) -> str:
        text = f"BeamMotion({len(self.frequencies)} modes, {len(self.impacts)} impacts"
        if len(self.sticks):
            text += f", {len(self.sticks)} sticks"
        text += f" in {self.duration:.6g} s"
        return text + ("" if self.status == "complete" else f"; {self.status}") + ")"


class Setting(NamedTuple):
    """A cantilever with its forcing, as the kernel takes them."""

    beam: Cantilever
    rates: np.ndarray  # angular frequencies of the modes [rad/s]
    ratios: np.ndarray
    base: complex  # amplitude of the base's part of the tip [m]
    omega: float  # angular frequency of the reference [rad/s]
    phase: float  # of the reference at t = 0
    table: Beam


def assemble(
    setting: Setting,
    state: np.ndarray,
    clock: np.ndarray,
    lost: float,
    rows: np.ndarray,
    first: np.ndarray,
    status: str,
) -> BeamMotion:
    """Make a motion from the events of the kernel."""
    beam, rates, ratios, base, omega, phase, table = setting
    stop = beam.stop

    def seconds(turns: Any, at: Any) -> Any:
        return (turns * TURN + (at - phase)) / omega

    m = len(rates)
    start, end = float(seconds(*first)), float(seconds(clock[TURNS], clock[PHASE]))
    time = np.clip(seconds(rows[:, TURNS], rows[:, PHASE]), start, end)
    kind = rows[:, ROW_KIND]
    which = np.flatnonzero((kind == IMPACT) | (kind == TOUCH))
    speed = rows[which, BEAM_APPROACH] * omega
    known: dict[str, Any] = {"time": time[which], "approach_velocity": speed, "unit": "N"}
    known |= {"stop_index": np.zeros(len(which)), **exact(len(which))}
    if _is_rigid(stop):
        known["impulse"] = (1 + table.restitution) * speed * beam.modal_mass / m
    elif stop is not None:
        over = np.append(np.flatnonzero(kind == PART), len(rows))
        over = over[np.searchsorted(over, which)]
        known["contact_time"] = np.append(time, end)[over] - time[which]
        known["flags"] = np.where(over == len(rows), OPEN_END, 0)
        known["peak"] = _peaks(setting, rows, which, known["contact_time"])
    held, release = kind == STICK, time[kind == RELEASE]
    begin = np.minimum(time[held] + rows[held, BEAM_APPROACH] / omega, end)
    if rows[0, ROW_REGIME] == 1 and _is_rigid(stop):  # held from the start on
        begin = np.append(start, begin)
    if len(release) < len(begin):
        release = np.append(release, end)
    impacts = Impacts(start=start, duration=end - start, source=f"cantilever in {m} modes", **known)
    rows.flags.writeable = False
    return BeamMotion(
        beam, rates / TURN, ratios, start, end - start, impacts, np.stack([begin, release], axis=1),
        float(lost * beam.modal_mass * omega**2) if _is_rigid(stop) else None,
        (state[:m].copy(), state[m:] * omega, float(clock[PHASE])),
        status, table, omega, phase, base, rows, which,
    )  # fmt: skip


def _is_rigid(stop: Stop | None) -> bool:
    return stop is not None and stop.law.rigid


def _peaks(
    setting: Setting, rows: np.ndarray, which: np.ndarray, contact_time: np.ndarray
) -> np.ndarray:
    """Greatest force of soft contacts [N], of 16 instants in the fastest period and finer ones."""
    from .beam_flow import sample

    stop, table, omega = setting.beam.stop, setting.table, setting.omega
    assert stop is not None
    m, fastest = table.modes, float(np.abs(table.rates[1].imag).max())

    def force(row: int, tau: np.ndarray) -> np.ndarray:
        states = np.empty((len(tau), 2 * m))
        turns = np.full(len(tau), rows[row, TURNS])
        angle = rows[row, PHASE] + tau
        sample(table, rows, np.full(len(tau), row), turns, angle, states)
        wave = setting.base * np.exp(1j * angle)
        depth = states[:, :m].sum(axis=1) + wave.real - stop.position
        rate = omega * (states[:, m:].sum(axis=1) - wave.imag)
        return table.side * stop.law.push(depth, rate)

    peaks = np.empty(len(which))
    for k, row in enumerate(which):
        low, high = 0.0, contact_time[k] * omega
        count = 17 + min(int(16 * high * fastest / TURN), 100_000)
        for _ in range(6):
            tau = np.linspace(low, high, count)
            found = force(row, tau)
            best = int(np.argmax(found))
            low, high = tau[max(best - 1, 0)], tau[min(best + 1, count - 1)]
            count = 17
        peaks[k] = max(found[best], 0.0)
    return peaks
