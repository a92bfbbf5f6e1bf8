"""Periodic orbits, stable or not, by Newton's method on the stroboscopic map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import number, whole
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..simulate import FixedStep, Motion, RungeKutta, simulate
from .tangent import TangentMap, tangent_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEPS = 60  # of Newton's iteration
HALVINGS = 14  # of a step that leads away
GUESSES = 24  # close returns that are tried
LOOK, SETTLE = 3000, 300  # periods that are looked through for them, and before


@dataclass(frozen=True, eq=False, repr=False)
class PeriodicOrbit:
    """An orbit that closes after n forcing periods.

    Attributes
    ----------
    oscillator : Oscillator
        What moves.
    state : ndarray, shape (2,)
        Displacement and velocity at `phase`, as `simulate` takes them.
    phase : float
        Phase of the reference forcing there [rad].
    periods, impacts : int
        period(m, n): m impacts in n forcing periods.
    approach_velocity : ndarray, shape (m,)
        Of each impact, relative to the stop.
    impact_phase : ndarray, shape (m,)
        Phase of the reference forcing at each [rad].
    multipliers : ndarray, shape (2,)
        Floquet multipliers over n periods, the greater in modulus first; 0 where a stick or an
        impact without rebound ends what neighbours differ by.
    residual : float
        How far from the state its return is, relative to the size of the orbit.
    iterations : int
        Steps of Newton's method.
    status : str
        "found"; "not converged", where the state is the best that was met; "lost", where no step
        brought it nearer, as beside a grazing impact.
    """

    oscillator: Oscillator
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
    def found(self) -> bool:
        """Whether it is an orbit."""
        return self.status == "found"

    @property
    def stable(self) -> bool:
        """Whether neighbours come closer: all multipliers within the unit circle."""
        return bool(np.abs(self.multipliers).max() < 1)

    @property
    def exponents(self) -> np.ndarray:
        """Lyapunov exponents per unit of the oscillator's time, ``ln |multiplier| / (n T)``."""
        period = 2 * math.pi / self.oscillator.forcing_frequency  # type: ignore[operator]
        with np.errstate(divide="ignore"):
            return np.log(np.abs(self.multipliers)) / (self.periods * period)

    def motion(self, cycles: float = 1, **options: Any) -> Motion:
        """The motion along it, so many times round; an unstable one is left in the end."""
        periods = cycles * self.periods
        start = (float(self.state[0]), float(self.state[1]))
        return simulate(
            self.oscillator, periods=periods, initial=start, phase=self.phase, **options
        )

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw it in the phase plane; see `impactsig.plot.phase_portrait`."""
        return self.motion().plot(ax, **options)

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        told = f"{kind}; multipliers {_told(self.multipliers)}" if self.found else self.status
        return (
            f"PeriodicOrbit(period({self.impacts}, {self.periods}) at x = {self.state[0]:.9g}, "
            f"v = {self.state[1]:.9g}; {told}; residual {self.residual:.1g})"
        )


def find_periodic_orbit(
    oscillator: Oscillator,
    periods: int = 1,
    *,
    guess: Sequence[float] | None = None,
    impacts: int | None = None,
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    tolerance: float = 1e-11,
) -> PeriodicOrbit:
    """A periodic orbit, stable or not.

    Newton's method on ``P^n(s) - s``, P the stroboscopic map at `phase`, with its derivative from
    `tangent_map`; a step that leads away is halved.

    Parameters
    ----------
    oscillator : Oscillator
        What moves; it must be forced.
    periods : int
        n, forcing periods in which the orbit closes.
    guess : (float, float), optional
        Displacement and velocity near it, at `phase`. Without one, the close returns of a long
        motion are tried, the closest first: on a chaotic attractor they lie near its unstable
        orbits.
    impacts : int, optional
        m, to be had by an orbit found without a guess.
    phase : float
        Phase of the reference forcing at the section [rad]; not one at which the orbit hits.
    method : RungeKutta, optional
        How to step; as for `simulate`.
    tolerance : float
        What the return may be off by, relative to the size of the orbit; the iteration goes on
        until rounding ends it.

    Returns
    -------
    PeriodicOrbit
        Whose `status` says whether it is one.

    Raises
    ------
    InvalidInput
        If the oscillator is not forced, or an argument is out of its range.

    Examples
    --------
    >>> orbit = find_periodic_orbit(scenes.karpodinis(20.1), 1, impacts=1)
    >>> orbit.stable, orbit.approach_velocity
    """
    shooting = _Shooting(oscillator, periods, phase, method, tolerance)
    if guess is not None:
        return shooting.orbit(_two("guess", guess))
    least: PeriodicOrbit | None = None
    for start in shooting.close_returns():
        orbit = shooting.orbit(start)
        if orbit.found and (impacts is None or orbit.impacts == impacts):
            if shooting.primitive(orbit):
                return orbit
        elif not orbit.found and (least is None or orbit.residual < least.residual):
            least = orbit
    if least is None:
        raise InvalidInput(
            "periods, impacts", f"{periods}, {impacts}", "an orbit that a close return leads to",
            "None of the motion's does; give guess=",
        )  # fmt: skip
    return least


def find_periodic_orbits(
    oscillator: Oscillator,
    periods: int = 1,
    *,
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    tolerance: float = 1e-11,
    guesses: int = 200,
) -> tuple[PeriodicOrbit, ...]:
    """All orbits of that period that the close returns of one long motion lead to.

    Of a chaotic attractor these are unstable orbits within it; there is no proof that they are all.
    Orbits that close sooner are left out, and each is listed once, whichever of its n points the
    iteration came to.

    Parameters
    ----------
    oscillator, periods, phase, method, tolerance
        As for `find_periodic_orbit`.
    guesses : int
        Close returns to try.

    Returns
    -------
    tuple of PeriodicOrbit
        The least unstable first.

    Raises
    ------
    InvalidInput
        As `find_periodic_orbit` does.
    """
    shooting = _Shooting(oscillator, periods, phase, method, tolerance)
    found: list[PeriodicOrbit] = []
    points: list[np.ndarray] = []
    for start in shooting.close_returns(whole("guesses", guesses, 1)):
        orbit = shooting.orbit(start)
        if not orbit.found or not shooting.primitive(orbit):
            continue
        scale = shooting.scale(orbit.state)
        if any(np.abs((own - orbit.state) * scale).max(axis=1).min() < 1e-6 for own in points):
            continue
        found.append(orbit)
        points.append(shooting.returns(orbit))
    return tuple(sorted(found, key=lambda orbit: float(np.abs(orbit.multipliers[0]))))


class _Shooting:
    """The section map over n periods, and Newton's method on it."""

    def __init__(
        self, oscillator: Oscillator, periods: int, phase: float, method: Any, tolerance: float
    ) -> None:
        if not isinstance(oscillator, Oscillator) or oscillator.forcing_frequency is None:
            raise InvalidInput(
                "oscillator", oscillator, "an Oscillator with forcing, to count its periods"
            )
        self.oscillator = oscillator
        self.omega = oscillator.forcing_frequency
        self.periods = whole("periods", periods, 1)
        self.phase = number("phase", phase)
        self.tolerance = number("tolerance", tolerance, positive=True, most=0.1)
        self.options: dict[str, Any] = {"phase": self.phase, "method": method}

    def scale(self, state: np.ndarray) -> np.ndarray:
        """What makes displacement and velocity one, and 1 in size."""
        size = max(math.hypot(state[0], state[1] / self.omega), 1e-12)
        return np.array([1.0, 1 / self.omega]) / size

    def map(self, state: np.ndarray) -> TangentMap:
        """The section map and its derivative."""
        start = (float(state[0]), float(state[1]))
        return tangent_map(self.oscillator, periods=self.periods, initial=start, **self.options)

    def off(self, state: np.ndarray) -> tuple[float, np.ndarray, TangentMap | None]:
        """Residual, how far the return is off, and the map; inf where there is none."""
        try:
            here = self.map(state)
        except InvalidInput as error:
            if error.argument != "initial":
                raise
            return math.inf, state, None
        gap = np.array(here.final[:2]) - state
        if here.status != "complete" or not np.isfinite(gap).all():
            return math.inf, state, None
        return float(np.abs(gap * self.scale(state)).max()), gap, here

    def orbit(self, start: np.ndarray) -> PeriodicOrbit:
        """Newton's method from a start."""
        state = start
        residual, gap, here = self.off(state)
        status = "not converged" if here is not None else "lost"
        iterations = 0
        while here is not None and residual > 0 and iterations < STEPS:
            iterations += 1
            try:
                step = np.linalg.solve(np.eye(2) - here.matrix, gap)
            except np.linalg.LinAlgError:
                break
            if not np.isfinite(step).all():
                break
            share = 1.0
            for _ in range(HALVINGS):
                better = self.off(state + share * step)
                if better[0] < residual:
                    break
                share /= 2
            else:
                status = "lost"
                break
            state = state + share * step
            residual, gap, here = better
        if here is not None and residual <= self.tolerance:
            status = "found"
        return self._told(state, residual, iterations, status, here)

    def _told(
        self,
        state: np.ndarray,
        residual: float,
        iterations: int,
        status: str,
        here: TangentMap | None,
    ) -> PeriodicOrbit:
        speed, angle = np.empty(0), np.empty(0)
        multipliers = np.full(2, math.nan)
        if here is not None:
            multipliers = here.multipliers
            start = (float(state[0]), float(state[1]))
            motion = simulate(self.oscillator, periods=self.periods, initial=start, **self.options)
            hits = motion.impacts
            assert hits is not None
            assert hits.approach_velocity is not None
            speed = np.asarray(hits.approach_velocity)
            turn = hits.time * (self.omega / self.oscillator.time_unit)
            angle = (self.phase + turn) % (2 * math.pi)
        return PeriodicOrbit(
            self.oscillator, state, self.phase, self.periods, len(speed), speed, angle,
            multipliers, residual, iterations, status,
        )  # fmt: skip

    def returns(self, orbit: PeriodicOrbit) -> np.ndarray:
        """Its n points on the section, shape (n, 2)."""
        x, v = orbit.motion().stroboscopic(self.phase)
        return np.stack([x[: self.periods], v[: self.periods]], axis=1)

    def primitive(self, orbit: PeriodicOrbit) -> bool:
        """Whether it does not close sooner."""
        points = self.returns(orbit)
        off = np.abs((points[1:] - orbit.state) * self.scale(orbit.state)).max(axis=1)
        divisors = [n for n in range(1, self.periods) if self.periods % n == 0]
        return not any(off[n - 1] < 1e-6 for n in divisors)

    def close_returns(self, count: int = GUESSES) -> list[np.ndarray]:
        """Points of a long motion that come back near themselves after n periods."""
        motion = simulate(
            self.oscillator, periods=LOOK + self.periods, transient=SETTLE, **self.options
        )
        x, v = motion.stroboscopic(self.phase)
        points = np.stack([x, v], axis=1)
        scale = np.array([1.0, 1 / self.omega])
        off = np.hypot(*((points[self.periods :] - points[: -self.periods]) * scale).T)
        apart = 0.02 * max(np.hypot(*(np.ptp(points, axis=0) * scale)), 1e-300)
        chosen: list[np.ndarray] = []
        for k in np.argsort(off, kind="stable"):
            if len(chosen) == count:
                break
            if all(np.hypot(*((points[k] - other) * scale)) > apart for other in chosen):
                chosen.append(points[k])
        return chosen


def _two(name: str, values: Any) -> np.ndarray:
    required = "two finite numbers: displacement and velocity"
    try:
        given = np.array([float(value) for value in values])
    except (TypeError, ValueError):
        raise InvalidInput(name, values, required) from None
    if given.shape != (2,) or not np.isfinite(given).all():
        raise InvalidInput(name, values, required)
    return given


def _told(multipliers: np.ndarray) -> str:
    if np.iscomplex(multipliers).any():
        return f"{multipliers[0].real:.4g} ± {abs(multipliers[0].imag):.4g}i"
    return ", ".join(f"{value:.4g}" for value in multipliers.real)
