"""Change of the body's kinetic energy at impacts, whatever moves the stops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidInput
from .basis.events import (
    IMPACT,
    PART,
    PHASE,
    ROW_APPROACH,
    ROW_KIND,
    ROW_STOP,
    ROW_V,
    TOUCH,
    TURNS,
)

if TYPE_CHECKING:
    from .motion import Motion


def kinetic_energy_gained(motion: Motion) -> float:
    """As `Motion.kinetic_energy_gained`.

    A contact with several stops counts from the first touch to the last. One that the span cuts
    counts with the end that is in it, so that over a whole number of periods of an orbit the sum is
    that of whole contacts.
    """
    if motion.impacts is None:
        raise InvalidInput("keep", "counts", 'simulate(..., keep="all")')
    rows = motion._segments
    _, moving = motion._stops_at(rows[:, TURNS], rows[:, PHASE])
    sides = np.array([float(stop.sign) for stop in motion.system.stops])
    return energy_gained(rows, moving, motion._engine.omega, sides, motion.system.mass)


def energy_gained(
    rows: np.ndarray, moving: np.ndarray, omega: float, sides: np.ndarray, mass: float
) -> float:
    """The same from events and the velocity of the base at each; sides are 1 for upper stops."""
    kind = rows[:, ROW_KIND]
    after = rows[:, ROW_V] * omega + moving

    hit = kind == IMPACT
    approach = rows[hit, ROW_APPROACH] * omega
    before = moving[hit] + sides[rows[hit, ROW_STOP].astype(int)] * approach
    gained = float(np.sum(after[hit] ** 2 - before**2))

    step = (kind == TOUCH).astype(int) - (kind == PART)
    if step.any():
        pushing = np.cumsum(step)
        pushing -= min(int(pushing.min()), 0)  # those that pushed when the span began
        first, last = (step == 1) & (pushing == 1), (step == -1) & (pushing == 0)
        gained += float(np.sum(after[last] ** 2) - np.sum(after[first] ** 2))
    return 0.5 * float(mass) * gained
