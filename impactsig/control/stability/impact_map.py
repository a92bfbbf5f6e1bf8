"""How an impact depends on the one before it, near an orbit of one impact."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...dynamics.periodic.orbits import PeriodicOrbit
from ...errors import InvalidInput
from ...oscillators import Oscillator, Rigid
from ...simulate import simulate
from ...simulate.basis.events import IMPACT, PHASE, ROW_KIND, ROW_V, TURN, TURNS
from ...simulate.basis.frame import base_motion, pace
from ..ogy import moved

STEP = 1e-4  # relative, of difference quotients


class ImpactMap(NamedTuple):
    """Slopes of (instant [forcing periods], velocity after it) of an impact.

    By those of the impact before, and by the parameter in between.
    """

    matrix: np.ndarray
    shift: np.ndarray


def impact_map_of(orbit: PeriodicOrbit, parameter: str) -> ImpactMap:
    """The linearised impact map of an orbit, by difference quotients of fourth order.

    Raises
    ------
    InvalidInput
        If the orbit was not found, or has not one impact, at a rigid stop.
    """
    if not isinstance(orbit, PeriodicOrbit) or not isinstance(orbit.system, Oscillator):
        raise InvalidInput("orbit", orbit, "a PeriodicOrbit of an Oscillator")
    if not orbit.found:
        raise InvalidInput("orbit", orbit, "an orbit that was found")
    machine = orbit.system
    if orbit.impacts != 1:
        raise InvalidInput(
            "orbit", orbit, "an orbit of one impact",
            "Intervals do not tell which of several impacts was the last",
        )  # fmt: skip
    motion = orbit.motion(1)
    stop = machine.stops[int(motion.impacts.stop_index[0])]
    at = _first_impact(motion)
    if not isinstance(stop.law, Rigid):
        raise InvalidInput("orbit", orbit, "an orbit at a rigid stop")
    if parameter == "amplitude" and not machine.forces:
        raise InvalidInput("parameter", "amplitude", '"load", where it is the base that forces')
    force = max([abs(one.amplitude) for one in machine.forces], default=1.0)

    def image(point: np.ndarray, by: float) -> np.ndarray:
        own = machine if by == 0.0 else moved(machine, parameter, by)
        phase = TURN * (point[0] % 1.0)
        place, _ = base_motion(machine, pace(machine) * phase)
        hit = simulate(
            own, periods=orbit.periods + 0.5, initial=(stop.position + float(place), point[1]),
            phase=phase,
        )  # fmt: skip
        return _first_impact(hit) + np.array([math.floor(point[0]), 0.0])

    def slope(along: np.ndarray, by: float, h: float) -> np.ndarray:
        def quotient(h: float) -> np.ndarray:
            return (image(at + h * along, h * by) - image(at - h * along, -h * by)) / (2 * h)

        return (4 * quotient(h / 2) - quotient(h)) / 3

    none = np.zeros(2)
    columns = [slope(np.eye(2)[k], 0.0, STEP * scale) for k, scale in enumerate((1.0, abs(at[1])))]
    return ImpactMap(np.column_stack(columns), slope(none, 1.0, STEP * force))


def _first_impact(motion: Any) -> np.ndarray:
    """Instant [forcing periods, from phase 0] and velocity after the first impact."""
    rows = motion._segments
    row = rows[rows[:, ROW_KIND] == IMPACT][:1]
    _, moving = motion._stops_at(row[:, TURNS], row[:, PHASE])
    velocity = row[0, ROW_V] * motion._engine.omega + moving[0]
    return np.array([row[0, TURNS] + row[0, PHASE] / TURN, velocity])
