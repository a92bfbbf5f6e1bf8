"""Periodic orbits, stable or not, by Newton's method on the stroboscopic map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from ..._arguments import refuse, unless, whole
from ..._showing import Shown
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation import FixedStep, RungeKutta, simulate
from ...simulation.simulation import what_it_is
from ..arguments import instead_of, recurring
from ..tangents.tangent import TangentMap, differentiated_by
from ._beam_orbits import BeamShooting
from .flow_orbits import FlowOrbit, find_flow_orbit
from .shooting import Found, OscillatorShooting, Shooting

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, repr=False)
class PeriodicOrbit(Shown):
    """A periodic orbit that closes after n forcing periods (`Oscillator.forcing_period`).

    Attributes
    ----------
    system : Oscillator, Cantilever or Controlled
        The system.
    state : ndarray, shape (d,)
        Displacement and velocity at `phase`; for a cantilever those of its modes, displacements [m]
        first.
    phase : float
        Phase of the forcing at the section [rad].
    periods, impacts : int
        period(m, n): m impacts in n forcing periods.
    approach_velocity : ndarray, shape (m,)
        Approach velocity of each impact, relative to the stop.
    impact_phase : ndarray, shape (m,)
        Phase of the forcing at each impact [rad].
    multipliers : ndarray, shape (d,)
        Floquet multipliers over n periods, in descending order of modulus; 0 for a direction that
        collapses by sticking or an impact without rebound. Under delayed feedback the greatest of
        infinitely many, and under interval feedback those of the impact map, as in
        `orbit_stability`.
    residual : float
        Distance of the return from the state, relative to the size of the orbit.
    iterations : int
        Steps of Newton's method.
    status : str
        "found"; "not converged", with the best state of the iteration; "lost" if no step reduced
        the distance, as near a grazing impact.

    See Also
    --------
    find_periodic_orbit, results.FlowOrbit, results.Branch

    Examples
    --------
    >>> from impactsig import find_periodic_orbit, scenes
    >>> orbit = find_periodic_orbit(scenes.karpodinis(22.1))
    >>> orbit.status, orbit.stable, orbit.impacts
    ('found', True, 1)
    """

    system: Any
    state: np.ndarray
    phase: float
    periods: int
    impacts: int
    approach_velocity: np.ndarray = field(repr=False)
    impact_phase: np.ndarray = field(repr=False)
    multipliers: np.ndarray
    residual: float
    iterations: int
    status: str

    @property
    def initial(self) -> tuple[Any, Any]:
        """The initial state for `simulate`: displacement and velocity, or those of all modes."""
        if isinstance(self.system, Cantilever):
            return self.state[: self.system.modes], self.state[self.system.modes :]
        return float(self.state[0]), float(self.state[1])

    @property
    def found(self) -> bool:
        """Whether Newton's method converged to an orbit."""
        return self.status == "found"

    @property
    def stable(self) -> bool:
        """Whether the orbit is stable: all multipliers within the unit circle."""
        return bool(np.abs(self.multipliers).max() < 1)

    @property
    def exponents(self) -> np.ndarray:
        """Lyapunov exponents ``ln |multiplier| / (n T)`` per unit of time, shape (d,)."""
        period = 2 * math.pi / self.system.angular_forcing_frequency
        with np.errstate(divide="ignore"):
            return np.log(np.abs(self.multipliers)) / (self.periods * period)

    def motion(self, cycles: float = 1, **options: Any) -> Any:
        """Simulate a number of periods of the orbit; a motion on an unstable orbit leaves it.

        If feedback vanishes on the orbit, the oscillator is simulated without it.
        """
        periods = cycles * self.periods
        return simulate(
            moving_on_orbits(self.system),
            periods=periods,
            initial=self.initial,
            phase=self.phase,
            **options,
        )

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw it in the phase plane; see `impactsig.plot.phase_portrait`."""
        return self.motion().plot(ax, **options)

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        at = f"x = {self.state[0]:.9g}, v = {self.state[1]:.9g}"
        if len(self.state) > 2:
            at = f"{self.state[: len(self.state) // 2]} in its modes"
        told = f"{kind}; multipliers {_told(self.multipliers)}" if self.found else self.status
        return (
            f"PeriodicOrbit(period({self.impacts}, {self.periods}) at {at}; {told}; "
            f"residual {self.residual:.1g})"
        )


@overload
def find_periodic_orbit(
    system: Oscillator | Cantilever, periods: int = 1, **options: Any
) -> PeriodicOrbit: ...
@overload
def find_periodic_orbit(system: Flow, periods: int = 1, **options: Any) -> FlowOrbit: ...


def find_periodic_orbit(  # type: ignore[misc]
    system: Any,
    periods: int = 1,
    *,
    period: float | None = None,
    guess: Sequence[float] | None = None,
    impacts: int | None = None,
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    tolerance: float | None = None,
) -> Any:
    """Find a periodic orbit, stable or not, by damped Newton iteration.

    For an oscillator the iteration solves ``P^n(s) - s = 0``, where P is the stroboscopic map at
    `phase`, with the derivative from `tangent_map`; for a cantilever the same in all its modes. For
    a flow it solves ``y(T) - y(0) = 0`` for the state and, if the flow is autonomous, for the
    period T, with the change of the state restricted to be transverse to the flow
    ([Cvitanovic2020]_, on fixed points and how to get them). The derivative comes from the
    variational equation along the trajectory, by collocation.

    Parameters
    ----------
    system : Oscillator, Cantilever, Flow or Controlled
        The system. An oscillator or a cantilever must have periodic forcing
        (`Oscillator.forcing_recurs`). Orbits of an oscillator under `OGY` are those of its section
        map with the gains. Under interval feedback, and delayed feedback whose delay is a multiple
        of the n periods, they are orbits of the oscillator alone, on which the feedback vanishes,
        with the multipliers under feedback.
    periods : int
        For an oscillator: n, the number of forcing periods after which the orbit closes. Under
        several frequencies the forcing period is their common period: with 0.9 and 0.45 rad/s an
        orbit of n = 1 has the period of the slower force.
    period : float, optional
        For a flow: approximate period. For a non-autonomous flow, the exact period, which must be a
        period of the flow.
    guess : sequence of float, shape (d,), optional
        Approximate state: displacement and velocity of an oscillator at `phase`, or those of the
        modes of a cantilever. By default the close returns of a long motion are tried, the closest
        first: on a chaotic attractor they lie near its unstable orbits. For an oscillator, a square
        of starts around it is tried next.
    impacts : int, optional
        For an oscillator or a cantilever: m, the number of impacts that an orbit found without a
        guess must have.
    phase : float
        Phase of the forcing at the section [rad]; there must be no impact at this phase.
    method : RungeKutta, optional
        For an oscillator: integration method, as for `simulate`.
    tolerance : float, optional
        Greatest distance of the return, relative to the size of the orbit or attractor; by default
        1e-11 for an oscillator and 1e-10 for a flow. The iteration continues until it is limited by
        rounding.

    Returns
    -------
    PeriodicOrbit or FlowOrbit
        The result; `status` says whether an orbit was found.

    Raises
    ------
    InvalidInput
        If the system has no periodic forcing, an argument is out of its range or does not apply to
        the system, or the map under feedback is not finite-dimensional.

    See Also
    --------
    find_periodic_orbits, continue_orbit, orbit_stability

    Examples
    --------
    >>> from impactsig import find_periodic_orbit, flows, scenes
    >>> orbit = find_periodic_orbit(scenes.karpodinis(20.1), 1, impacts=1)
    >>> orbit.status, orbit.stable
    ('found', False)
    >>> orbit = find_periodic_orbit(flows.rossler(), period=5.88)
    >>> round(orbit.period, 3)
    5.881
    """
    if isinstance(system, Flow):
        refuse(
            "for a flow", "Give period= in its time", impacts=impacts, method=method,
            periods=unless(1, periods), phase=unless(0.0, phase),
        )  # fmt: skip
        return find_flow_orbit(system, period, guess, 1e-10 if tolerance is None else tolerance)
    controlled = differentiated_by(system) is not None
    if not isinstance(system, (Oscillator, Cantilever)) and not controlled:
        raise InvalidInput(
            "system",
            system,
            "an Oscillator, a Cantilever, a Flow or a Controlled oscillator",
            instead_of(system),
        )
    if period is not None and not isinstance(getattr(system, "system", None), Flow):
        raise InvalidInput(
            "period", period, f"no period for {what_it_is(system)}", "Count its orbits by periods="
        )
    tolerance = 1e-11 if tolerance is None else tolerance
    if impacts is not None:
        impacts = whole("impacts", impacts, 0)
    if isinstance(system, Oscillator):
        recurring("system", system)
    shooting: Any = shooting_of(system, periods, phase, method, tolerance)
    if guess is not None:
        (ended,) = shooting.newton(shooting.given(guess))
        return orbit_of(shooting, *ended)
    least: Found | None = None
    for ended in shooting.newton_from(shooting.close_returns(*shooting.tries)):
        if ended.status == "found":
            orbit = orbit_of(shooting, *ended)
            wanted = impacts is None or orbit.impacts == impacts
            if wanted and (isinstance(system, Cantilever) or _primitive(shooting, orbit)):
                return orbit
        elif least is None or ended.residual < least.residual:
            least = ended
    if least is None:
        raise InvalidInput(
            "periods, impacts", f"{periods}, {impacts}", "an orbit that some start leads to",
            "None of those tried does; give guess=",
        )  # fmt: skip
    return orbit_of(shooting, *least)


def find_periodic_orbits(
    oscillator: Oscillator,
    periods: int = 1,
    *,
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    tolerance: float = 1e-11,
    guesses: int = 200,
) -> tuple[PeriodicOrbit, ...]:
    """Find all orbits of a period to which close returns of one long motion lead.

    For a chaotic attractor these are unstable orbits within it; the list may be incomplete. Orbits
    with a shorter period are omitted, and each orbit is listed once.

    Parameters
    ----------
    oscillator, periods, phase, method, tolerance
        As for `find_periodic_orbit`.
    guesses : int
        Number of close returns to try.

    Returns
    -------
    tuple of PeriodicOrbit
        The orbits, the least unstable first.

    Raises
    ------
    InvalidInput
        As `find_periodic_orbit` does.

    See Also
    --------
    find_periodic_orbit, OGY

    Examples
    --------
    >>> from impactsig import find_periodic_orbits, scenes
    >>> found = find_periodic_orbits(scenes.karpodinis(20.1), guesses=20)
    >>> [(orbit.impacts, orbit.stable) for orbit in found]
    [(1, False)]
    """
    shooting = OscillatorShooting(oscillator, periods, phase, method, tolerance)
    found: list[PeriodicOrbit] = []
    points: list[np.ndarray] = []
    for ended in shooting.newton(*shooting.close_returns(whole("guesses", guesses, 1))):
        scale = shooting.scale(ended.state)
        known = any(np.abs((own - ended.state) * scale).max(axis=1).min() < 1e-6 for own in points)
        if ended.status != "found" or known:
            continue
        orbit = orbit_of(shooting, *ended)
        points.append(_returns(orbit))
        if _primitive(shooting, orbit):
            found.append(orbit)
    return tuple(sorted(found, key=lambda orbit: float(np.abs(orbit.multipliers[0]))))


def moving_on_orbits(system: Any) -> Any:
    """The system that moves on periodic orbits: without the feedback that vanishes there."""
    return getattr(system, "moving_on_orbits", system)


def orbit_of(
    shooting: Shooting,
    state: np.ndarray,
    residual: float,
    iterations: int,
    status: str,
    here: TangentMap | None,
) -> PeriodicOrbit:
    """The result for the orbit through a state."""
    speed, angle = np.empty(0), np.empty(0)
    multipliers = np.full(len(state), math.nan)
    system = shooting.moves
    if here is not None:
        multipliers = shooting.multipliers(here, state)
        start = shooting.parts(state)
        motion = simulate(system, periods=shooting.periods, initial=start, **shooting.options)
        hits = motion.impacts
        assert hits is not None
        assert hits.approach_velocity is not None
        speed = np.asarray(hits.approach_velocity)
        turn = hits.time * (shooting.omega / system.time_unit)
        angle = (shooting.phase + turn) % (2 * math.pi)
    return PeriodicOrbit(
        shooting.system, state, shooting.phase, shooting.periods, len(speed), speed, angle,
        multipliers, residual, iterations, status,
    )  # fmt: skip


def shooting_of(
    system: Any, periods: int, phase: float, method: Any, tolerance: float
) -> OscillatorShooting | BeamShooting:
    """The map of an oscillator, a cantilever or a controlled oscillator."""
    home = differentiated_by(system)
    if home is not None:
        return home.shooting_of(system, periods, phase, method, tolerance)
    kind = BeamShooting if isinstance(system, Cantilever) else OscillatorShooting
    return kind(system, periods, phase, method, tolerance)


def _returns(orbit: PeriodicOrbit) -> np.ndarray:
    """The n points of the orbit on the section, shape (n, 2)."""
    x, v = orbit.motion().stroboscopic(orbit.phase)
    return np.stack([x[: orbit.periods], v[: orbit.periods]], axis=1)


def _primitive(shooting: OscillatorShooting, orbit: PeriodicOrbit) -> bool:
    """Whether n is the least period of the orbit."""
    points = _returns(orbit)
    off = np.abs((points[1:] - orbit.state) * shooting.scale(orbit.state)).max(axis=1)
    divisors = [n for n in range(1, orbit.periods) if orbit.periods % n == 0]
    return not any(off[n - 1] < 1e-6 for n in divisors)


def _told(multipliers: np.ndarray) -> str:
    """The two greatest multipliers, as text."""
    first = complex(multipliers[0])
    if first.imag:
        return f"{first.real:.4g} ± {abs(first.imag):.4g}i"
    return ", ".join(f"{value.real:.4g}" for value in multipliers[:2])
