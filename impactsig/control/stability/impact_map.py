"""The map from one impact to the next, near an orbit of an oscillator."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...dynamics.periodic.orbits import PeriodicOrbit
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...simulation import RungeKutta, simulate
from ...simulation.basis.events import IMPACT, PHASE, ROW_KIND, ROW_V, TOUCH, TURN, TURNS
from ...simulation.exact.exact import piecewise_linear
from .._differences import slopes
from ..ogy import check_parameter, moved

STEP = 1e-4  # relative, of difference quotients
BEFORE = 0.05  # of the interval before an impact: how long before it neighbours start
FINE = 1e-13  # tolerance of steps, where there are any


class SpikeMap(NamedTuple):
    """Derivatives of the state at a spike, and of the interval that ends with it.

    By the state at the spike before, and by the parameter in between. Of an oscillator the state
    is the instant [forcing periods] and the velocity of an impact, of a flow the coordinates on
    the section.
    """

    matrix: np.ndarray  # (d, d)
    shift: np.ndarray  # (d,)
    interval: np.ndarray  # (d,)
    stretch: float


def impact_maps_of(orbit: PeriodicOrbit, parameter: Any) -> tuple[list[SpikeMap], np.ndarray]:
    """Linearised map of each impact of an orbit, and the interval that it ends.

    By difference quotients of fourth order. Neighbours start a little before an impact, off the
    stop, so that they meet it as any motion does, whatever the law of contact.

    Raises
    ------
    InvalidInput
        If the orbit was not found or has no impact, or the parameter does not belong to it.
    """
    if not isinstance(orbit, PeriodicOrbit) or not isinstance(orbit.system, Oscillator):
        raise InvalidInput("orbit", orbit, "a PeriodicOrbit of an Oscillator, or a FlowOrbit")
    if not orbit.found:
        raise InvalidInput("orbit", orbit, "an orbit that was found")
    if not orbit.impacts:
        raise InvalidInput(
            "orbit", orbit, "an orbit with impacts", "Without there are no intervals"
        )
    machine = orbit.system
    check_parameter(machine, parameter)
    motion = orbit.motion(3, **_method(machine))
    hits = _hits(motion, 2 * orbit.impacts + 1)
    maps = [
        _map(orbit, motion, hits[k : k + 3], parameter)
        for k in range(orbit.impacts)
    ]  # fmt: skip
    return maps, np.diff(hits[1 : orbit.impacts + 2, 0])


def largest_force(machine: Oscillator) -> float:
    """Greatest amplitude of the forces, the scale of parameter changes; 1 without forces."""
    return max([abs(one.amplitude) for one in machine.forces], default=1.0)


def _method(machine: Oscillator) -> dict[str, Any]:
    return {} if piecewise_linear(machine) else {"method": RungeKutta(FINE)}


def _map(orbit: PeriodicOrbit, motion: Any, hits: np.ndarray, parameter: str) -> SpikeMap:
    """Derivatives of the last of three impacts by the middle one."""
    machine, period = orbit.system, orbit.system.forcing_period
    begun = hits[1, 0] - BEFORE * (hits[1, 0] - hits[0, 0])  # [forcing periods from phase 0]
    x, v = motion.sample((begun - orbit.phase / TURN) * period)
    start = np.array([float(x), float(v)])
    scale = np.array([abs(hits[1, 1]) / machine.angular_forcing_frequency, abs(hits[1, 1])])

    def image(by: np.ndarray) -> np.ndarray:
        """Instant and velocity of two impacts, by (position, velocity, parameter)."""
        own = machine if by[2] == 0.0 else moved(machine, parameter, by[2])
        beside = simulate(
            own, periods=2.5 * (hits[2, 0] - begun), initial=tuple(start + by[:2]),
            phase=TURN * (begun % 1.0), **_method(machine),
        )  # fmt: skip
        return _hits(beside, 2).ravel()

    found = slopes(image, STEP * np.append(scale, largest_force(machine)))
    first, second = found[:2], found[2:]
    matrix = np.linalg.solve(first[:, :2].T, second[:, :2].T).T
    shift = second[:, 2] - matrix @ first[:, 2]  # the parameter is moved at the first of the two
    return SpikeMap(matrix, shift, matrix[0] - np.array([1.0, 0.0]), float(shift[0]))


def _hits(motion: Any, count: int) -> np.ndarray:
    """Time [forcing periods, from phase 0] and velocity of the first impacts, shape (n, 2).

    The velocity after it at a rigid stop, at the touch of a soft one.
    """
    rows = motion._segments
    rows = rows[(rows[:, ROW_KIND] == IMPACT) | (rows[:, ROW_KIND] == TOUCH)][:count]
    if len(rows) < count:
        raise InvalidInput(
            "orbit", motion, f"an orbit beside which {count} impacts follow each other",
            f"There are {len(rows)}, as beside grazing and rest",
        )  # fmt: skip
    _, moving = motion._stops_at(rows[:, TURNS], rows[:, PHASE])
    velocity = rows[:, ROW_V] * motion._engine.omega + moving
    return np.column_stack([rows[:, TURNS] + rows[:, PHASE] / TURN, velocity])
