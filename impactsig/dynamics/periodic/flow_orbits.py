"""Periodic orbits of flows, stable or not, by Newton's method on state and period."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..._arguments import number
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...oscillators.flows import Flow
from ...simulation.flows.course import Running, state_of
from .flow_shooting import PARTS, converged, depends_on_time, rate_at, recurs, shoot

ITERATIONS = 40
RETURNS, TURNS, PER_TURN = 12, 400, 100  # close returns that are tried; where they are looked for
WIDTH = 0.2  # of the period: how far from the one asked for a close return may be
AT_REST = 1e-6  # of the size of the attractor, in a period


@dataclass(frozen=True, eq=False, repr=False)
class FlowOrbit(Shown):
    """A periodic orbit of a flow.

    Attributes
    ----------
    system : Flow
        The flow.
    state : ndarray, shape (d,)
        A state on the orbit; for a non-autonomous flow, that at t = 0.
    period : float
        Period, in the unit of time of the flow.
    multipliers : ndarray, shape (d,)
        Floquet multipliers, in descending order of modulus. For an autonomous flow one of them is
        1, for the direction along the orbit.
    forced : bool
        Whether the flow is non-autonomous.
    residual : float
        Distance of the return from the state, relative to the size of the attractor.
    iterations : int
        Steps of Newton's method.
    status : str
        "found"; "not converged", with the best state of the iteration; "at rest", if the state is
        an equilibrium.

    See Also
    --------
    find_periodic_orbit, results.PeriodicOrbit, plot.flow_orbit

    Examples
    --------
    >>> from impactsig import find_periodic_orbit, flows
    >>> orbit = find_periodic_orbit(flows.rossler(), period=5.88)
    >>> orbit.status, round(orbit.period, 3)
    ('found', 5.881)
    """

    system: Flow
    state: np.ndarray
    period: float
    multipliers: np.ndarray
    forced: bool
    residual: float
    iterations: int
    status: str
    _parts: int = field(repr=False)

    @property
    def found(self) -> bool:
        """Whether Newton's method converged to an orbit."""
        return self.status == "found"

    @property
    def stable(self) -> bool:
        """Whether the orbit is stable: all multipliers but the trivial one in the unit circle."""
        across = self.multipliers
        if not self.forced:
            across = np.delete(across, np.argmin(np.abs(across - 1)))
        return bool((np.abs(across) < 1).all())

    def sample(self, time: Any) -> np.ndarray:
        """States on the orbit, at times from 0 on, shape of `time` and (d,).

        Raises
        ------
        InvalidInput
            If no orbit was found, and the flow diverges from the final state of the search.
        """
        time = np.asarray(time, float) % self.period
        flat, back = np.unique(time, return_inverse=True)
        states, _ = Running(self.system, None, self.state.tolist()).sample(flat)
        if len(states) < len(flat):
            raise InvalidInput(
                "time", time, f"times before {flat[len(states)]:.6g}, where the flow is lost",
                f"No orbit was found: {self.status}",
            )  # fmt: skip
        return states[back.ravel()].reshape(*time.shape, self.system.dimension)

    plot = drawn_by("flow_orbit", "it in a plane of two coordinates")

    def __repr__(self) -> str:
        told = ", ".join(f"{value:.4g}" for value in self.multipliers)
        kind = "stable" if self.stable else "unstable"
        told = f"{kind}; multipliers {told}" if self.found else self.status
        return (
            f"FlowOrbit({self.system!r}, period {self.period:.9g}; {told}; "
            f"residual {self.residual:.1g})"
        )


def find_flow_orbit(
    flow: Flow, period: Any, guess: Sequence[float] | None, tolerance: Any
) -> FlowOrbit:
    """Find a periodic orbit of a flow; arguments as in `find_periodic_orbit`."""
    period = number("period", period, above=0)
    tolerance = number("tolerance", tolerance, above=0)
    Running(flow)  # what is wrong with the function is said here
    forced = depends_on_time(flow, period)
    if forced and not recurs(flow, period):
        raise InvalidInput(
            "period", period, "a period of the flow's rates, which depend on time",
            "They are not the same at that distance of time; give a multiple of their own period",
        )  # fmt: skip
    if guess is not None:
        start = state_of(flow, guess)
        return _settled(flow, start, period, np.maximum(np.abs(start), 1e-3), forced, tolerance)
    least: FlowOrbit | None = None
    for start, after, scale in _close_returns(flow, period, forced):
        orbit = _settled(flow, start, after, scale, forced, tolerance)
        near = abs(orbit.period - period) <= 2 * WIDTH * period
        if orbit.found and near and not _closes_sooner(orbit, scale):
            return orbit
        if not orbit.found and (least is None or orbit.residual < least.residual):
            least = orbit
    if least is None:
        raise InvalidInput(
            "period", period, "one after which an orbit of the flow closes, for the first time",
            "Of the close returns tried none leads to one of about that period; give guess=",
        )  # fmt: skip
    return least


def _settled(
    flow: Flow, start: np.ndarray, period: float, scale: np.ndarray, forced: bool, tolerance: float
) -> FlowOrbit:
    """The orbit to which Newton's method converges from a start."""
    d = flow.dimension

    def off(end: np.ndarray, state: np.ndarray) -> float:
        size = float((np.abs(end - state) / scale).max())
        return size if np.isfinite(size) else np.inf

    state, parts, asked = np.array(start), PARTS, period
    end, tangent = shoot(flow, state, period, parts)
    residual = off(end, state)
    iterations = 0
    for _ in range(ITERATIONS):
        if not np.isfinite(residual):
            break
        border = np.zeros((d + 1, d + 1))
        border[:d, :d] = tangent - np.eye(d)
        border[d, d] = 1.0
        if not forced:
            border[:d, d], border[d, d] = rate_at(flow, period, end), 0.0
            border[d, :d] = rate_at(flow, 0.0, state) / scale**2
        step, *_ = np.linalg.lstsq(border, np.append(state - end, 0.0), rcond=None)
        for share in 0.5 ** np.arange(8):
            then, after = state + share * step[:d], period + share * step[d]
            if not asked / 2 < after < 2 * asked:
                continue
            came, moved = shoot(flow, then, after, parts)
            if off(came, then) < residual:
                break
        else:
            break  # to rounding, or not any nearer
        iterations += 1
        state, period, end, tangent, residual = then, after, came, moved, off(came, then)
    if np.isfinite(residual):
        end, tangent, parts, _ = converged(flow, state, period)
        residual = residual if np.isfinite(end).all() else np.inf
    status = "found" if residual <= tolerance else "not converged"
    values = np.full(d, np.nan + 0j)
    if np.isfinite(residual):
        values = np.linalg.eigvals(tangent)
        values = values[np.argsort(-np.abs(values), kind="stable")]
    if status == "found" and not forced:
        moves = float((np.abs(rate_at(flow, 0.0, state)) / scale).max()) * period
        status = status if moves > AT_REST else "at rest"
    return FlowOrbit(
        flow, state, float(period), values, forced, float(residual), iterations, status, parts
    )


def _closes_sooner(orbit: FlowOrbit, scale: np.ndarray) -> bool:
    """Whether the orbit is a multiple of a shorter one."""
    if orbit.forced:
        return False
    apart = np.abs(orbit.sample(orbit.period / np.arange(2, 9)) - orbit.state) / scale
    return bool((apart.max(axis=1) < 1e-6).any())


def _close_returns(
    flow: Flow, period: float, forced: bool
) -> Iterator[tuple[np.ndarray, float, np.ndarray]]:
    """States of a long trajectory that nearly return, the return times, and its size."""
    count, start = TURNS * PER_TURN, 20 * period
    instants = start + period / PER_TURN * np.arange(count)
    states, _ = Running(flow).sample(instants)
    if len(states) < 4 * PER_TURN or not np.isfinite(states).all():
        return
    scale = np.maximum(states.std(axis=0), 1e-9 * np.maximum(np.abs(states).max(axis=0), 1e-9))
    around = 0 if forced else round(WIDTH * PER_TURN)
    lags = np.arange(PER_TURN - around, PER_TURN + around + 1)
    number = len(states) - lags[-1]
    best, lag = np.full(number, np.inf), np.zeros(number, int)
    for own in lags:
        apart = (np.abs(states[own : own + number] - states[:number]) / scale).max(axis=1)
        nearer = apart < best
        best[nearer], lag[nearer] = apart[nearer], own
    if forced:  # an orbit begins at t = 0, so a multiple of its period later
        best[np.arange(number) % PER_TURN != 0] = np.inf
    for _ in range(RETURNS):
        k = int(best.argmin())
        if not np.isfinite(best[k]):
            return
        yield states[k], period * lag[k] / PER_TURN, scale
        best[max(k - PER_TURN // 2, 0) : k + PER_TURN // 2 + 1] = np.inf
