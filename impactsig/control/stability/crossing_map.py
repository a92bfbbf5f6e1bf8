"""The map from one crossing of a level to the next, near an orbit of a flow."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...dynamics.periodic.flow_orbits import FlowOrbit
from ...errors import InvalidInput
from ...oscillators.flows import Flow
from .._differences import slopes
from ..running.crossings import Crossings
from .impact_map import SpikeMap

STEP = 1e-4  # relative, of difference quotients


def check_flow(flow: Flow, parameter: Any, level: float | None) -> None:
    """Refuse a parameter that the flow lacks, and spikes without a level.

    Raises
    ------
    InvalidInput
        If it is that of an oscillator or out of range, or there is no level.
    """
    count = len(flow.parameters)
    if isinstance(parameter, str) or parameter >= count:
        numbers = f"the place of one of the flow's parameters, 0 to {count - 1}"
        raise InvalidInput("parameter", parameter, numbers if count else "a flow with parameters")
    if level is None:
        raise InvalidInput(
            "level",
            None,
            "a level of a flow",
            "Its spikes are where the signal= crosses it upwards",
        )


def crossing_maps_of(
    orbit: FlowOrbit, parameter: Any, signal: str | int, level: float | None
) -> tuple[list[SpikeMap], np.ndarray]:
    """Linearised map of each crossing of an orbit, and the interval that it ends.

    By difference quotients of fourth order, of the coordinates on the section.

    Raises
    ------
    InvalidInput
        If the orbit was not found or crosses no level, or the flow depends on time.
    """
    if not orbit.found:
        raise InvalidInput("orbit", orbit, "an orbit that was found")
    flow = orbit.system
    if orbit.forced:
        raise InvalidInput(
            "orbit", orbit, "an orbit of a flow whose rates do not depend on time",
            "The state at a crossing has the phase of the forcing too",
        )  # fmt: skip
    check_flow(flow, parameter, level)
    assert level is not None
    from_orbit = Crossings(flow, signal, level)
    across = from_orbit.across
    start = orbit.state
    for _ in range(2):  # the first lap finds the section, the second is on it
        states, times, now = [], [], 0.0
        while now < orbit.period * (1 - 1e-6):
            found = from_orbit.next(start, now, orbit.period * (1 + 1e-6))
            if found is None:
                break
            now, start = found
            times.append(now)
            states.append(start)
        if not times:
            low, high = np.sort(orbit.sample(np.linspace(0, orbit.period, 200)), axis=0)[[0, -1]]
            k = from_orbit.signal
            raise InvalidInput(
                "level", level, f"between {low[k]:.6g} and {high[k]:.6g}, which the orbit crosses"
            )
        start = states[0]
    # Times count from a crossing, to which the orbit returns after its period.
    states = [states[-1], *states]
    size = np.ptp(orbit.sample(np.linspace(0, orbit.period, 200)), axis=0)[across]
    unit = max(abs(flow.parameters[parameter]), 1e-3)

    def map_of(here: np.ndarray) -> SpikeMap:
        def image(by: np.ndarray) -> np.ndarray:
            values = list(flow.parameters)
            values[parameter] += by[-1]
            beside = here.copy()
            beside[across] += by[:-1]
            found = Crossings(flow, signal, level, tuple(values)).next(
                beside, 0.0, 3 * orbit.period
            )
            if found is None:
                raise InvalidInput("orbit", orbit, "one whose neighbours cross the level as well")
            return np.append(found[1][across], found[0])

        found, d = slopes(image, STEP * np.append(size, unit)), len(across)
        return SpikeMap(found[:d, :d], found[:d, d], found[d, :d], float(found[d, d]))

    return [map_of(here) for here in states[:-1]], np.diff([0.0, *times])
