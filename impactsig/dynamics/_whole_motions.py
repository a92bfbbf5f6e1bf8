"""Cells of a diagram, chart or response of cantilevers and controlled oscillators.

An oscillator is followed strobe by strobe and ends once its orbit has closed (`_settling`); these
are run for as long as is asked, and the orbit is looked for in their strobes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidInput
from ..oscillators import Cantilever, Oscillator
from ..simulate import simulate


class Whole(NamedTuple):
    """A motion past its transient, strobed."""

    system: Any
    motion: Any
    start: float  # of the span that is looked at [s]
    points: np.ndarray  # (periods + 1, d): the states that must return, in units of one size
    strobe: np.ndarray  # (periods, 2): displacement and velocity

    def closed(self, tolerance: float) -> int:
        """Forcing periods after which the strobes return, twice over; 0 where they do not."""
        points = self.points
        size = np.abs(points - points.mean(axis=0)).max(initial=0.0)
        size = max(size, np.abs(points).max(initial=0.0), 1e-300)
        for n in range(1, (len(points) - 1) // 2 + 1):
            if np.abs(points[-n:] - points[-2 * n : -n]).max() <= tolerance * size:
                return n
        return 0


SYSTEMS = "an Oscillator, a Cantilever with forcing or a Controlled oscillator"
NO_PERIOD = "A flow has no forcing period to strobe it by: threshold_crossings cuts it"


def checked_whole(system: Any) -> Any:
    """A system that is simulated whole.

    Raises
    ------
    InvalidInput
        If it is none.
    """
    controlled = isinstance(getattr(system, "system", None), Oscillator)
    if not (isinstance(system, Cantilever) or controlled) or system.forcing_period is None:
        raise InvalidInput("scene", system, f"a function that makes {SYSTEMS}", NO_PERIOD)
    return system


def whole_motion(
    system: Any, periods: int, transient: int, initial: Any, phase: float
) -> Whole | str:
    """The motion of a system past its transient; the status where it ended early."""
    period = system.forcing_period
    if isinstance(system, Cantilever):
        motion = simulate(
            system, periods=periods, transient=transient, initial=initial, phase=phase
        )
        if motion.status != "complete":
            return motion.status
        times = np.minimum(motion.start + period * np.arange(periods + 1), motion.stop)
        q, v = motion.modal(times)
        unit = 2 * np.pi * motion.frequencies
        points = np.concatenate([q, v / unit], axis=1)
        x, speed = motion.sample(times)
        start = motion.start
    else:
        # A controlled motion is kept from t = 0 on, as what is fed back is.
        motion = simulate(system, periods=periods + transient, initial=initial, phase=phase)
        if motion.status != "complete":
            return motion.status
        start = transient * period
        x, speed = motion.sample(np.minimum(start + period * np.arange(periods + 1), motion.stop))
        points = np.stack([x, speed * period / (2 * np.pi * system.time_unit)], axis=1)
    return Whole(system, motion, start, points, np.stack([x, speed], axis=1)[1:])
