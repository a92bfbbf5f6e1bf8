"""Stability of an orbit under delayed feedback, and the rate of convergence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._arguments import instance, whole
from ..._showing import Shown
from ...dynamics.arguments import parameter_values
from ...dynamics.periodic.collocation import NODES
from ...dynamics.periodic.flow_orbits import FlowOrbit
from ...dynamics.periodic.orbits import PeriodicOrbit
from ...dynamics.tangents.growth import batch_error
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ..feedback import DelayedFeedback
from ..intervals import IntervalFeedback
from ._flow_pieces import of_flow
from ._oscillator_pieces import of_oscillator
from ._variation import State, Variation

if TYPE_CHECKING:
    from ...studies.study import Study

SETTLE = 0.25  # share of the laps that are left out
STARTS = 4  # differences that are followed
MULTIPLIERS = 6  # that are worked out


@dataclass(frozen=True, eq=False, repr=False)
class ControlledStability(Shown):
    """Growth of deviations from an orbit under delayed feedback.

    Attributes
    ----------
    orbit : PeriodicOrbit or FlowOrbit
        The orbit, on which the control force vanishes.
    feedback : DelayedFeedback or IntervalFeedback
        The feedback.
    growth : float
        Factor by which deviations grow in one period of the orbit; the orbit is stable if it is
        below 1. If there are multipliers, the largest modulus.
    error : float
        Standard error of the logarithm of `growth`; 0 if there are multipliers.
    multipliers : ndarray of complex
        The Floquet multipliers of largest modulus over the period of the orbit, in descending
        order. Empty if the map of deviations is not linear, see `orbit_stability`. For an
        autonomous flow, without the trivial multiplier 1 along the orbit.

    See Also
    --------
    orbit_stability, stability_chart

    Examples
    --------
    >>> from impactsig import DelayedFeedback, find_periodic_orbit, flows, orbit_stability
    >>> orbit = find_periodic_orbit(flows.rossler(), period=5.88)
    >>> found = orbit_stability(orbit, DelayedFeedback(0.2, orbit.period, signal="y"))
    >>> found.growth < 1
    True
    """

    orbit: PeriodicOrbit | FlowOrbit
    feedback: DelayedFeedback | IntervalFeedback
    growth: float
    error: float
    multipliers: np.ndarray = field(repr=False)

    @property
    def stable(self) -> bool:
        """Whether deviations shrink."""
        return self.growth < 1

    @property
    def exponent(self) -> float:
        """Greatest Lyapunov exponent, per unit of the oscillator's or the flow's time."""
        orbit = self.orbit
        if self.growth == 0.0:
            return -math.inf
        if isinstance(orbit, FlowOrbit):
            return math.log(self.growth) / orbit.period
        frequency = orbit.system.angular_forcing_frequency
        assert frequency is not None
        return math.log(self.growth) * frequency / (orbit.periods * 2 * math.pi)

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        orbit = self.orbit
        told = f"period {orbit.period:.9g}" if isinstance(orbit, FlowOrbit) else (
            f"period({orbit.impacts}, {orbit.periods})"
        )  # fmt: skip
        return (
            f"ControlledStability({told}, {self.feedback}: "
            f"{kind}; growth {self.growth:.6g} a period of the orbit)"
        )


def orbit_stability(
    orbit: PeriodicOrbit | FlowOrbit,
    feedback: DelayedFeedback | IntervalFeedback,
    *,
    laps: int = 1200,
) -> ControlledStability:
    """Growth or decay of deviations from an orbit under delayed feedback.

    The delay equation is linearised about the orbit, with saltation at the events, and solved
    piecewise by Chebyshev collocation [Trefethen2000]_. For feedback of displacements, for soft
    stops and for flows, the map over a period is linear, and its multipliers are computed. Events
    include those of friction, where the mass reverses, sticks or is released. After a rest at a
    rigid stop no deviation remains; the only multiplier is then the memory, or 0.

    For feedback of velocities at a rigid stop the map is not linear, however small the deviations
    are. An impact that is ds later than the delayed one causes a control force of finite height
    (gain times the jump of the velocity, or the limit) for a time ds. Its impulse is proportional
    to ds, but has the same sign before and after the impact, and an impulse before the impact is
    multiplied by the restitution coefficient. Deviations of opposite signs therefore grow
    differently, there are no multipliers, and the limit affects stability; `growth` is then the
    mean over many periods.

    Under `IntervalFeedback` the map from spike to spike is linearised, with the feedback included.
    An offset counts as part of the system of the orbit.

    Parameters
    ----------
    orbit : PeriodicOrbit or FlowOrbit
        The orbit, stable or unstable.
    feedback : DelayedFeedback or IntervalFeedback
        The feedback. The delay of a DelayedFeedback must be a multiple of the period of the orbit.
        The target of an IntervalFeedback must be the interval between the spikes of the orbit, its
        delay a multiple of their number.
    laps : int
        Periods of the orbit over which the mean is taken.

    Returns
    -------
    ControlledStability

    Raises
    ------
    InvalidInput
        If the orbit was not found, or has a stop whose loss depends on the approach velocity; if
        the delay is not a multiple of the period; or if velocities are fed back on an orbit that
        sticks under friction with a static force greater than the kinetic one.

    See Also
    --------
    stability_chart, find_periodic_orbit, DelayedFeedback

    Examples
    --------
    >>> from impactsig import DelayedFeedback, find_periodic_orbit, orbit_stability, scenes
    >>> orbit = find_periodic_orbit(scenes.karpodinis(20.3355), 1, impacts=1)
    >>> orbit.stable
    False
    >>> found = orbit_stability(orbit, DelayedFeedback(0.15, 1, limit=0.1), laps=200)
    >>> found.growth < 1
    True
    """
    moves = getattr(orbit, "system", None)
    if not isinstance(orbit, (PeriodicOrbit, FlowOrbit)) or not isinstance(
        moves, (Oscillator, Flow)
    ):
        if isinstance(moves, Cantilever):
            why = "A cantilever is controlled in its first mode: scenes.cantilever(...)"
        elif moves is not None and not isinstance(moves, (Oscillator, Flow)):
            why = "That of a Controlled has its multipliers already: orbit.multipliers"
        else:
            why = "find_periodic_orbit finds them"
        raise InvalidInput("orbit", orbit, "an orbit of an Oscillator or a Flow alone", why)
    if not orbit.found:
        raise InvalidInput("orbit", orbit, "an orbit that was found")
    if isinstance(feedback, IntervalFeedback):
        return _of_intervals(orbit, feedback)
    kinds = "a DelayedFeedback or an IntervalFeedback"
    instance("feedback", feedback, DelayedFeedback, kinds, "OGY.multipliers has those under OGY")
    laps = whole("laps", laps, 40)
    variation = _variation(orbit, feedback)
    if variation.forgets:
        return ControlledStability(
            orbit, feedback, feedback.memory, 0.0, np.array([feedback.memory], complex)
        )
    if variation.linear:
        multipliers = _multipliers(variation)
        growth = float(np.abs(multipliers[0]))
        return ControlledStability(orbit, feedback, growth, 0.0, multipliers)
    logs = _logs(variation, laps)
    best = int(logs.mean(axis=0).argmax())
    error = float(batch_error(logs)[best])
    growth = math.exp(logs[:, best].mean())
    return ControlledStability(orbit, feedback, growth, error, np.empty(0, complex))


def stability_chart(
    orbit: PeriodicOrbit | FlowOrbit,
    gains: Sequence[float],
    delays: Sequence[int] | None = None,
    *,
    limit: float | None = None,
    signal: str | int = "velocity",
    memory: float = 0.0,
    laps: int = 400,
    **options: Any,
) -> Study:
    """Growth of deviations from an orbit over gain and delay, by `sweep`.

    Parameters
    ----------
    orbit : PeriodicOrbit or FlowOrbit
        As for `orbit_stability`.
    gains : sequence of float
        Gains.
    delays : sequence of int, optional
        Delays in periods of the orbit; by default 1, 2 and 3.
    limit, signal, memory
        As in `DelayedFeedback`.
    laps : int
        As in `orbit_stability`.
    **options
        As in `sweep`: executor, workers, store.

    Returns
    -------
    Study
        The observable "growth" over the parameters "gain" and "delay" [forcing periods, or the unit
        of time of the flow]; see `impactsig.plot.stability_chart`.

    Raises
    ------
    InvalidInput
        As `orbit_stability` and `sweep` do.

    See Also
    --------
    orbit_stability, plot.stability_chart

    Examples
    --------
    >>> from impactsig import find_periodic_orbit, flows, stability_chart
    >>> orbit = find_periodic_orbit(flows.rossler(), period=5.88)
    >>> chart = stability_chart(orbit, [0.1, 0.2], signal="y", laps=50)
    >>> chart.parameters
    {'gain': array([0.1, 0.2]), 'delay': array([ 5.88108846, 11.76217691, 17.64326537])}
    """
    from ...studies.sweeping import sweep

    values = parameter_values("gains", gains)
    multiples = parameter_values("delays", (1, 2, 3) if delays is None else delays)
    if not ((multiples >= 1) & (multiples == np.round(multiples))).all():
        raise InvalidInput("delays", delays, "whole numbers, 1 or greater: periods of the orbit")
    if not isinstance(orbit, (PeriodicOrbit, FlowOrbit)):
        raise InvalidInput("orbit", orbit, "a PeriodicOrbit or a FlowOrbit")
    period = orbit.period if isinstance(orbit, FlowOrbit) else orbit.periods
    proto = DelayedFeedback(0.0, period, limit, signal, memory)
    orbit_stability(orbit, proto, laps=laps)  # what is wrong is said here, not by every cell

    def growth(gain: float, delay: float) -> dict[str, float]:
        own = replace(proto, gain=float(gain), delay=float(delay))
        return {"growth": orbit_stability(orbit, own, laps=laps).growth}

    grid = {"gain": values, "delay": multiples * period}
    return sweep(growth, grid, **options)


def _of_intervals(
    orbit: PeriodicOrbit | FlowOrbit, feedback: IntervalFeedback
) -> ControlledStability:
    """Multipliers of an orbit under interval feedback."""
    maps, intervals = feedback.maps(orbit)
    feedback.check(intervals)
    multipliers = np.linalg.eigvals(feedback.lap(maps)).astype(complex)
    multipliers = multipliers[np.argsort(-np.abs(multipliers))]
    growth = float(np.abs(multipliers[0]))
    return ControlledStability(orbit, feedback, growth, 0.0, multipliers)


def _variation(orbit: PeriodicOrbit | FlowOrbit, feedback: DelayedFeedback) -> Variation:
    if isinstance(orbit, FlowOrbit):
        return of_flow(orbit, feedback)
    return of_oscillator(orbit, feedback)


def _logs(variation: Variation, laps: int) -> np.ndarray:
    """Log growth in each lap after the first quarter, shape (laps', STARTS)."""
    state = variation.start(np.random.default_rng(0), STARTS)
    logs = np.empty((laps, STARTS))
    for k in range(laps):
        state = variation.lap(state)
        size = state.size()
        logs[k] = np.log(size)
        state = state.divided(size)
    return logs[int(SETTLE * laps) :]


def _multipliers(variation: Variation) -> np.ndarray:
    """Greatest eigenvalues of the map of a lap, without that of the direction along the orbit.

    What is left of the map across that direction, an eigenvector, has all the other eigenvalues.
    """
    from scipy.sparse.linalg import LinearOperator, eigs

    d, shape = variation.dimension, (len(variation.pieces), NODES)
    size = d + variation.laps * shape[0] * shape[1]
    none = [np.zeros((shape[0], 1, 1))] * variation.laps
    along = np.zeros(size)
    if variation.along is not None:
        along = variation.along.flat()
        along /= np.linalg.norm(along)

    def lap(vector: np.ndarray) -> np.ndarray:
        vector = vector - along * (along @ vector)
        late = vector[d:].reshape(variation.laps, *shape, 1)
        after = variation.lap(State(vector[:d, None], list(late), none)).flat()
        return after - along * (along @ after)

    operator = LinearOperator((size, size), matvec=lap, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)
    values = eigs(operator, k=min(MULTIPLIERS, size - 2), v0=start, return_eigenvectors=False)
    return values[np.argsort(-np.abs(values))]
