"""How near a periodic orbit comes to impacts that it has, and to one that it has not."""

from __future__ import annotations

import math

import numpy as np

from ..simulate._frame import base_motion
from .orbits import PeriodicOrbit

LOOKS = 512  # at a forcing period, for its turning points


def seconds_of(orbit: PeriodicOrbit) -> float:
    """Its forcing period [s]."""
    return float(orbit.oscillator.forcing_period)  # type: ignore[arg-type]


def gaps(orbit: PeriodicOrbit) -> tuple[float, float, float]:
    """From the section to the nearest impact, the widest gap between impacts, and its middle."""
    if not orbit.impacts:
        return math.pi, 2 * math.pi, orbit.phase
    angles = np.sort(orbit.impact_phase)
    widths = np.diff(angles, append=angles[0] + 2 * math.pi)
    k = int(widths.argmax())
    away = np.abs((orbit.impact_phase - orbit.phase + math.pi) % (2 * math.pi) - math.pi).min()
    return float(away), float(widths[k]), float((angles[k] + widths[k] / 2) % (2 * math.pi))


def clearance(orbit: PeriodicOrbit) -> float:
    """The least distance at which the orbit turns before a stop, without hitting it."""
    machine, base = orbit.oscillator, orbit.oscillator.base
    motion = orbit.motion()
    assert motion.impacts is not None
    hits = motion.impacts.time

    def state(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity against what carries the stops."""
        x, v = motion.sample(time)
        own = base.frequency if base is not None else 0.0
        angle = own * (
            time / machine.time_unit + orbit.phase / float(machine.forcing_frequency or 1.0)
        )
        at, moving = base_motion(machine, angle)
        return x - at, v - moving

    grid = np.linspace(motion.start, motion.stop, LOOKS * orbit.periods + 1)
    time = np.sort(np.concatenate([grid, hits]))
    _, v = state(time)
    least = math.inf
    for side in (1, -1):
        turns = np.flatnonzero((side * v[:-1] > 0) & (side * v[1:] <= 0))
        # An impact turns the velocity at once; its instant is the latter of the two.
        turns = turns[~np.isin(time[turns + 1], hits)]
        low, high = time[turns], time[turns + 1]
        for _ in range(50):
            middle = (low + high) / 2
            rises = side * state(middle)[1] > 0
            low, high = np.where(rises, middle, low), np.where(rises, high, middle)
        top, _ = state(low)
        for stop in machine.stops_on("upper" if side > 0 else "lower"):
            off = side * (stop.position - top)
            least = min(least, off[off > 0].min(initial=math.inf))
    return least
