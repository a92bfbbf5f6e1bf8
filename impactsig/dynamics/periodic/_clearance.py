"""Distance of a periodic orbit from its impacts, and from an impact that it misses."""

from __future__ import annotations

import math

import numpy as np

from ...oscillators import Cantilever, Stop
from ...simulation.basis.frame import swings
from .orbits import PeriodicOrbit

LOOKS = 512  # at a period of the first force, for its turning points


def seconds_of(orbit: PeriodicOrbit) -> float:
    """Its forcing period [s]."""
    return float(orbit.system.forcing_period)


def gaps(orbit: PeriodicOrbit) -> tuple[float, float, float]:
    """Distance of the section from the nearest impact, and the widest gap between impacts."""
    if not orbit.impacts:
        return math.pi, 2 * math.pi, orbit.phase
    angles = np.sort(orbit.impact_phase)
    widths = np.diff(angles, append=angles[0] + 2 * math.pi)
    k = int(widths.argmax())
    away = np.abs((orbit.impact_phase - orbit.phase + math.pi) % (2 * math.pi) - math.pi).min()
    return float(away), float(widths[k]), float((angles[k] + widths[k] / 2) % (2 * math.pi))


def clearance(orbit: PeriodicOrbit) -> float:
    """Least distance from a stop at which the orbit turns without hitting it."""
    motion = orbit.motion()
    machine = motion.system
    assert motion.impacts is not None
    hits = motion.impacts.time
    if isinstance(machine, Cantilever):
        # Its highest mode is the fastest; its tip is seen from what its stop hangs on.
        swung, seen = math.ceil(motion.frequencies[-1] * seconds_of(orbit)), motion.sample
        stops: dict[str, list[Stop]] = {"upper": [], "lower": []}
        if machine.stop is not None:
            stops[machine.stop.side].append(machine.stop)
    else:
        swung, seen = round(swings(machine)), motion._from_stops
        stops = {side: list(machine.stops_on(side)) for side in ("upper", "lower")}
    looks = LOOKS * orbit.periods * max(swung, 1)
    grid = np.linspace(motion.start, motion.stop, looks + 1)
    time = np.sort(np.concatenate([grid, hits]))
    _, v = seen(time)
    least = math.inf
    for side in (1, -1):
        turns = np.flatnonzero((side * v[:-1] > 0) & (side * v[1:] <= 0))
        # An impact turns the velocity at once; its instant is the latter of the two.
        turns = turns[~np.isin(time[turns + 1], hits)]
        low, high = time[turns], time[turns + 1]
        for _ in range(50):
            middle = (low + high) / 2
            rises = side * seen(middle)[1] > 0
            low, high = np.where(rises, middle, low), np.where(rises, high, middle)
        top, _ = seen(low)
        for stop in stops["upper" if side > 0 else "lower"]:
            off = side * (stop.position - top)
            least = min(least, off[off > 0].min(initial=math.inf))
    return least
