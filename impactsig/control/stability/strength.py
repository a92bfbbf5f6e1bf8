"""Parameter change that gives the impacts of an orbit a prescribed approach velocity."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...dynamics.periodic.orbits import PeriodicOrbit, find_periodic_orbit
from ...errors import InvalidInput
from .impact_map import largest_force

MOST = 120  # orbits that are looked for
STRIDE = 0.1  # of the strength: the most that it changes from orbit to orbit
CLOSE = 1e-10  # relative: a strength that was come to


def offset_of(
    orbit: PeriodicOrbit, nudged: Callable[[Any, float], Any], strength: float
) -> tuple[PeriodicOrbit, float]:
    """The orbit with impacts of that approach velocity, and its parameter change.

    By the secant method, each orbit starting from the one before it.

    Raises
    ------
    InvalidInput
        If the orbit has not one impact, or is lost on the way.
    """
    if not isinstance(orbit, PeriodicOrbit) or not orbit.found or orbit.impacts != 1:
        raise InvalidInput("orbit", orbit, "an orbit of one impact that was found")
    machine, offset = orbit.system, 0.0
    largest = largest_force(machine)
    seen, step = _strength(orbit), 1e-3 * largest
    begun = seen
    for _ in range(MOST):
        if abs(strength - seen) <= CLOSE * strength:
            return orbit, offset
        further = find_periodic_orbit(
            nudged(machine, offset + step), orbit.periods, impacts=1, phase=orbit.phase,
            guess=tuple(orbit.state),
        )  # fmt: skip
        if not further.found or further.impacts != 1:
            if abs(step) < 1e-6 * largest:
                break
            step /= 4
            continue
        after = _strength(further)
        slope = (after - seen) / step
        orbit, offset, seen = further, offset + step, after
        if slope == 0.0:
            break
        most = STRIDE * seen
        step = max(min(strength - seen, most), -most) / slope
    raise InvalidInput(
        "strength", strength, "the approach velocity of an orbit of this kind",
        f"The orbit was followed from {begun:.6g} to {seen:.6g}, with the parameter changed by "
        f"{offset:.6g}, and no further",
    )  # fmt: skip


def _strength(orbit: PeriodicOrbit) -> float:
    """Approach velocity of the orbit's impact, in the oscillator's units."""
    impacts = orbit.motion(1.5).impacts
    return float(impacts.approach_velocity[0])
