"""Cells of diagrams, charts and responses of systems that are simulated as a whole.

An oscillator without noise is followed strobe by strobe and ends once its orbit has closed
(`settling`). Cantilevers, controlled oscillators, flows and oscillators under noise run for as
long as is asked, and the orbit is looked for in their strobes, of a flow in its returns to a
section.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..._arguments import Seed
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation import simulate
from ._flow_sections import Section, cut


class Whole(NamedTuple):
    """A motion past its transient, with its stroboscopic points."""

    system: Any
    motion: Any
    start: float  # of the span that is looked at [s]
    points: np.ndarray  # (periods + 1, d): the states that must return, in units of one size
    strobe: np.ndarray  # (periods, d): displacement and velocity; of a flow its coordinates
    returns: np.ndarray | None = None  # of a flow: its instants on the section
    speeds: np.ndarray | None = None  # and the rates at which it crosses; empty at rest

    def closed(self, tolerance: float) -> int:
        """Forcing periods after which the strobes repeat, twice over; 0 if they do not."""
        points = self.points
        if len(points) < 3:
            return 0
        size = np.abs(points - points.mean(axis=0)).max(initial=0.0)
        size = max(size, np.abs(points).max(initial=0.0), 1e-300)
        for n in range(1, (len(points) - 1) // 2 + 1):
            if np.abs(points[-n:] - points[-2 * n : -n]).max() <= tolerance * size:
                return n
        return 0

    def since(self, periods: int) -> float:
        """Beginning of the last so many periods or returns."""
        if self.returns is not None:
            return float(self.returns[-1 - periods])
        return float(self.motion.stop - periods * self.system.forcing_period)

    def speeds_since(self, start: float) -> np.ndarray:
        """Approach velocities of impacts since an instant; for a flow, rates at crossings."""
        if self.returns is not None and self.speeds is not None:
            return self.speeds[self.returns[1:][: len(self.speeds)] > start]
        return np.asarray(self.motion.impacts.between(start).approach_velocity)

    def resting(self, start: float) -> float:
        """Share of the time at rest since an instant; NaN if the motion does not record it."""
        if not hasattr(self.motion, "sticks"):
            return math.nan
        sticks = np.diff(np.maximum(self.motion.sticks, start)).sum()
        return float(sticks) / float(self.motion.stop - start)


SYSTEMS = "an Oscillator, a Cantilever with forcing, a Flow or a Controlled oscillator"
NO_PERIOD = "What has no forcing period cannot be strobed by it"
ONE_PATH = "Under noise no orbit closes: bifurcation_diagram shows its strobes"


def checked_whole(
    system: Any, section: Section | None, noise: bool = False, name: str = "scene"
) -> Any:
    """Validate a system that is simulated as a whole.

    Raises
    ------
    InvalidInput
        If it is none, or a flow comes without a section.
    """
    if isinstance(system, Flow):
        if section is None:
            raise InvalidInput(
                "section", None, "a coordinate of the flow and a level, such as ('x', 0.0)",
                "A flow has no forcing period to strobe it by: it is cut where it crosses one",
            )  # fmt: skip
        return system
    if isinstance(system, Oscillator) and system.noise is None:
        raise InvalidInput("scene", system, "a function that makes systems of one kind")
    if isinstance(system, Oscillator) and not noise:
        raise InvalidInput(name, system, "an Oscillator without noise", ONE_PATH)
    moved = isinstance(system, (Cantilever, Oscillator))
    controlled = isinstance(getattr(system, "system", None), Oscillator)
    if not (moved or controlled) or system.forcing_period is None:
        made = "a function that makes " if name == "scene" else ""
        raise InvalidInput(name, system, made + SYSTEMS, NO_PERIOD)
    return system


def whole_motion(
    system: Any,
    periods: int,
    transient: int,
    initial: Any,
    phase: float,
    section: Section | None = None,
    seed: Seed = None,
) -> Whole | str:
    """The motion past its transient; the status if it ended early."""
    if isinstance(system, Flow):
        assert section is not None  # by checked_whole
        found = cut(system, section, periods, transient, initial)
        if isinstance(found, str):
            return found
        flown, returns, points, speeds = found
        return Whole(system, flown, returns[0], points, points[1:], returns, speeds)
    period = system.forcing_period
    start = {} if initial is None else {"initial": initial}
    motion: Any
    if isinstance(system, Oscillator):
        motion = simulate(
            system, periods=periods, transient=transient, phase=phase, every=period, seed=seed,
            **start,
        )  # fmt: skip
        if motion.status != "complete":
            return str(motion.status)
        strobe = np.column_stack(motion.stroboscopic(phase))
        return Whole(system, motion, motion.start, strobe[:0], strobe)
    if isinstance(system, Cantilever):
        motion = simulate(system, periods=periods, transient=transient, phase=phase, **start)
        if motion.status != "complete":
            return str(motion.status)
        times = np.minimum(motion.start + period * np.arange(periods + 1), motion.stop)
        q, v = motion.modal(times)
        unit = 2 * np.pi * motion.frequencies
        points = np.concatenate([q, v / unit], axis=1)
        x, speed = motion.sample(times)
        begin = motion.start
    else:
        # A controlled motion is kept from t = 0 on, as what is fed back is.
        motion = simulate(system, periods=periods + transient, phase=phase, **start)
        if motion.status != "complete":
            return str(motion.status)
        begin = transient * period
        x, speed = motion.sample(np.minimum(begin + period * np.arange(periods + 1), motion.stop))
        points = np.stack([x, speed * period / (2 * np.pi * system.time_unit)], axis=1)
    return Whole(system, motion, begin, points, np.stack([x, speed], axis=1)[1:])
