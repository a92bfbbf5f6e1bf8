"""OGY control (Ott, Grebogi and Yorke): a parameter is changed once per forcing period."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from .._arguments import choice, instance
from ..dynamics.periodic.flow_orbits import FlowOrbit
from ..dynamics.periodic.orbits import PeriodicOrbit
from ..dynamics.tangents.tangent import tangent_map
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..oscillators.parts import numbers
from ..simulation import simulate
from ._differences import slope as derivative

NUDGE = 1e-4  # share of the size of a parameter, for the difference quotient
RETURNS = 1e-6  # relative: an orbit returns to within this


@dataclass(frozen=True, eq=False, repr=False)
class OGY:
    """OGY control: once per period a parameter moves the state to the stable direction.

    The method of [OttGrebogiYorke1990]_. Once per forcing period, at the phase of the section of
    the orbit, the state s is compared with the nearest point s_k of the orbit. For the following
    period the parameter is changed by ``p = -gain_k . (s - s_k)``, such that to first order
    ``f . (s' - s_(k+1)) = 0`` for the next state s', where f is the left eigenvector of the
    unstable multiplier there; the remaining deviation decays with the stable multiplier. If abs(p)
    exceeds the limit, the parameter is not changed, since a chaotic motion comes near the orbit
    again. If the orbit lies between the bands of the attractor, a larger limit is needed.

    Parameters
    ----------
    orbit : PeriodicOrbit
        An orbit of saddle type, for example one found by `find_periodic_orbit` in a chaotic
        attractor.
    limit : float
        Greatest change of the parameter, in the oscillator's unit of force.
    parameter : {"amplitude", "load"}
        Amplitude of the first of the oscillator's forces, or a constant force.

    Attributes
    ----------
    points : ndarray, shape (n, 2)
        Displacement and velocity of the orbit at its n sections.
    gain : ndarray, shape (n, 2)
        gain_k at each section.
    multipliers : ndarray, shape (2,)
        Multipliers of the controlled orbit over its n periods, in descending order of modulus; the
        unstable one has become 0 up to rounding.

    Raises
    ------
    InvalidInput
        If the orbit is not a PeriodicOrbit of saddle type, the limit is not positive, or the
        parameter has no effect in the unstable direction.

    See Also
    --------
    DelayedFeedback, Controlled, find_periodic_orbit

    Examples
    --------
    >>> from impactsig import OGY, Controlled, find_periodic_orbit, scenes, simulate
    >>> beam = scenes.karpodinis(20.3355)
    >>> orbit = find_periodic_orbit(beam, 1, impacts=1)
    >>> nudging = OGY(orbit, limit=0.02)
    >>> orbit.multipliers.round(2)
    array([-1.88, -0.01])
    >>> bool(abs(nudging.multipliers).max() < 0.02)
    True
    >>> motion = simulate(Controlled(beam, nudging), periods=100)
    """

    orbit: PeriodicOrbit
    limit: float
    parameter: Literal["amplitude", "load"] = "amplitude"
    points: np.ndarray = field(init=False)
    gain: np.ndarray = field(init=False)
    multipliers: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        orbit = self.orbit
        if isinstance(orbit, FlowOrbit):
            raise InvalidInput(
                "orbit", orbit, "an orbit of an Oscillator, whose state is seen once in a period",
                "Use IntervalFeedback.fastest for flows, by crossings of a level",
            )  # fmt: skip
        instance("orbit", orbit, PeriodicOrbit, "a PeriodicOrbit, as find_periodic_orbit finds")
        instance("orbit", orbit.system, Oscillator, "an orbit of an Oscillator")
        if not orbit.found:
            raise InvalidInput(
                "orbit", orbit, "an orbit that was found",
                "It may not exist at these parameters, or a better guess= may lead to it",
            )  # fmt: skip
        large, small = orbit.multipliers
        if np.iscomplex(orbit.multipliers).any() or not abs(large) > 1 > abs(small):
            raise InvalidInput(
                "orbit", orbit, "a saddle: multipliers on either side of the unit circle",
                "A stable orbit needs no control" if orbit.stable
                else "One parameter, moved once in a period, tames one unstable direction",
            )  # fmt: skip
        numbers(self, "limit", above=0)
        check_parameter(orbit.system, self.parameter)
        for name, value in zip(("points", "gain", "multipliers"), self._linear(), strict=True):
            object.__setattr__(self, name, value)

    def nudged(self, oscillator: Oscillator, by: float) -> Oscillator:
        """The oscillator with the parameter changed."""
        return moved(oscillator, self.parameter, by)

    def check(self, oscillator: Oscillator) -> None:
        """Raise an error if the orbit is not an orbit of the oscillator.

        Raises
        ------
        InvalidInput
            If the oscillator does not return to its state on the orbit.
        """
        if oscillator == self.orbit.system:
            return
        points = np.concatenate([self.points, self.points[:1]])
        for here, there in pairwise(points):
            end = self._image(oscillator, here)
            if not np.abs(end - there).max() <= RETURNS * np.abs(points).max():
                raise InvalidInput(
                    "orbit", self.orbit, f"an orbit of {oscillator.name or 'this oscillator'}",
                    "It does not return there; find one at these parameters",
                )  # fmt: skip

    def _image(self, oscillator: Oscillator, state: np.ndarray) -> np.ndarray:
        start = (float(state[0]), float(state[1]))
        motion = simulate(
            oscillator, periods=1, initial=start, phase=self.orbit.phase, keep="counts"
        )
        return np.array(motion.final[:2])

    def _pushed(self, state: np.ndarray, by: float) -> np.ndarray:
        """The same with the parameter changed."""
        return self._image(self.nudged(self.orbit.system, by), state)

    def _linear(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Section points, gains and the multipliers under control."""
        orbit, n = self.orbit, self.orbit.periods
        oscillator = orbit.system
        points, slopes, shifts = [orbit.state], [], []
        largest = max([abs(force.amplitude) for force in oscillator.forces], default=0.0)
        h = NUDGE * max(largest, self.limit)
        for k in range(n):
            start = (float(points[k][0]), float(points[k][1]))
            here = tangent_map(oscillator, periods=1, initial=start, phase=orbit.phase)
            slopes.append(here.matrix)
            points.append(np.array(here.final[:2]))
            shifts.append(derivative(partial(self._pushed, points[k]), h))
        whole = np.eye(2)
        for slope in slopes:
            whole = slope @ whole
        unstable = orbit.multipliers[0]
        values, vectors = np.linalg.eig(whole.T)
        left = np.real(vectors[:, int(np.argmin(np.abs(values - unstable)))])
        gains = np.empty((n, 2))
        rows = [left]  # left eigenvectors, from the last section back to the first
        for slope in reversed(slopes):
            row = rows[-1] @ slope
            rows.append(row / np.hypot(*row))
        rows.reverse()
        closed = np.eye(2)
        for k in range(n):
            moved = rows[k + 1] @ shifts[k]
            if not abs(moved) > 1e-9 * np.hypot(*shifts[k]):
                raise InvalidInput(
                    "parameter", self.parameter, "one that affects the unstable direction",
                    "Take another, or an orbit found at another phase=",
                )  # fmt: skip
            gains[k] = rows[k + 1] @ slopes[k] / moved
            closed = (slopes[k] - np.outer(shifts[k], gains[k])) @ closed
        multipliers = np.linalg.eigvals(closed)
        multipliers = multipliers[np.argsort(-np.abs(multipliers))]
        return np.array(points[:n]), gains, np.real(multipliers)

    def __repr__(self) -> str:
        orbit = self.orbit
        return (
            f"OGY(period({orbit.impacts}, {orbit.periods}), limit={self.limit:g}, "
            f"parameter={self.parameter!r})"
        )


def check_parameter(machine: Oscillator, parameter: Any) -> None:
    """Refuse a parameter that the oscillator does not have.

    Raises
    ------
    InvalidInput
        If it is the number of one of a flow, or the amplitude where no force is.
    """
    choice("parameter", parameter, ("amplitude", "load"))
    if parameter == "amplitude" and not machine.forces:
        raise InvalidInput("parameter", "amplitude", '"load", where it is the base that forces')


def moved(oscillator: Oscillator, parameter: str, by: float) -> Oscillator:
    """An oscillator with a changed parameter: the amplitude of its first force, or the load."""
    if parameter == "load":
        return replace(oscillator, load=oscillator.load + by)
    first = oscillator.forces[0]
    larger = replace(first, amplitude=first.amplitude + by)
    return replace(oscillator, forces=(larger, *oscillator.forces[1:]))
