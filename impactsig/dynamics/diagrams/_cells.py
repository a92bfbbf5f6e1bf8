"""The cells of a bifurcation diagram: the motion at each value of the parameter."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..._arguments import Seed
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation.batches.course import Course
from ...simulation.simulation import what_it_is
from ..tangents.lyapunov import lyapunov_spectrum
from ._exponents import Place, exponents_at, exponents_of
from ._flow_sections import Section
from ._whole_motions import checked_whole, whole_motion
from .settling.settling import ground
from .settling.together import Settling, in_blocks, settles


class Cell(NamedTuple):
    """Results at one parameter value; empty if the motion ended early."""

    strobe: np.ndarray = np.empty((0, 2))
    velocity: np.ndarray = np.empty(0)
    periods: int = 0
    impacts: int = -1
    impacts_per_period: float = math.nan
    energy_per_period: float = math.nan
    kinetic_energy_per_period: float = math.nan
    sticking: float = math.nan
    exponents: np.ndarray = np.full(2, math.nan)
    status: str = "complete"


def _made(scene: Callable[[float], Oscillator], value: float) -> Oscillator:
    oscillator = scene(float(value))
    if not isinstance(oscillator, Oscillator):
        required = "a function that makes an Oscillator, where each value goes on from the last"
        raise InvalidInput("scene", oscillator, required)
    return oscillator


class Look(NamedTuple):
    """The quantities to compute in every cell."""

    periods: int
    transient: int
    closed: float
    skip: bool
    exponents: bool
    section: Section | None

    def cells(
        self, machines: list[Any], seeds: Sequence[Seed], threads: int, **start: Any
    ) -> list[Cell]:
        """Cells of systems from one start: oscillators side by side, others one by one."""

        def some(which: list[int]) -> list[Cell]:
            if not settles(machines[which[0]]):
                return [self.whole_cell(machines[k], seeds[k], **start) for k in which]
            return [cell for cell, _ in self.settled([machines[k] for k in which], **start)]

        return in_blocks(some, machines, self.transient, threads)

    def whole_cell(self, system: Any, seed: Seed, **start: Any) -> Cell:
        """The cell of a system that is simulated as a whole."""
        checked_whole(system, self.section, noise=True)
        if self.exponents and (isinstance(system, Oscillator) or system.dimension is None):
            raise InvalidInput(
                "exponents", True, f"False for {what_it_is(system)}",
                "Neither noise nor feedback leaves a map from a start to an end",
            )  # fmt: skip
        found = whole_motion(
            system, self.periods, self.transient, section=self.section, seed=seed, **start
        )
        if isinstance(found, str):
            return Cell(status=found, exponents=np.full(system.dimension or 2, math.nan))
        motion, n = found.motion, found.closed(self.closed)
        span = n or self.periods
        speeds = found.speeds_since(found.since(span))
        cell = Cell(
            strobe=found.strobe[-span:],
            velocity=speeds,
            periods=n,
            impacts=len(speeds) if n else -1,
            impacts_per_period=len(speeds) / span,
            energy_per_period=_lost(motion) / self.periods,
            sticking=found.resting(found.start),
        )
        if self.exponents and isinstance(system, Flow):
            run = {"duration": motion.duration, "transient": 0.0, "initial": motion.final}
            cell = cell._replace(exponents=lyapunov_spectrum(system, **run).exponents)
        elif self.exponents:
            cell = cell._replace(exponents=exponents_at(system, n, self.periods, motion.final))
        return cell

    def cell(self, oscillator: Oscillator, **start: Any) -> tuple[Cell, Place | None]:
        """The cell of an oscillator from a start, and its final state."""
        return self.settled([oscillator], **start)[0]

    def settled(
        self, oscillators: list[Oscillator], **start: Any
    ) -> list[tuple[Cell, Place | None]]:
        """Cells of oscillators from one start, and their final states."""
        if start["initial"] is None:
            start["initial"] = (0.0, 0.0)
        settling = Settling(
            oscillators, self.transient, tolerance=self.closed, ends=self.skip, **start
        )
        settling.close()
        closed = [one.closed for one in settling.settled]
        courses, others = settling.on([n or self.periods for n in closed])
        cells = {k: self._cell(closed[k], motion) for k, motion in others.items()}
        for which, course in courses:
            own = self._cells_of(course, [closed[k] for k in which])
            cells.update(zip(which, own, strict=True))
        if self.exponents:
            at = {k: final for k, (_, final) in cells.items() if final is not None}
            machines, after = [oscillators[k] for k in at], [closed[k] for k in at]
            found = exponents_of(machines, after, self.periods, list(at.values()))
            for k, exponents in zip(at, found, strict=True):
                cells[k] = cells[k][0]._replace(exponents=exponents), at[k]
        return [cells[k] for k in range(len(oscillators))]

    def _cell(self, n: int, motion: Any) -> tuple[Cell, Place | None]:
        """The cell of an oscillator past its transient, over one period of its orbit if closed."""
        if motion.status != "complete":
            return Cell(status=motion.status), None
        assert motion.impacts is not None  # all was kept
        assert motion.sticks is not None
        cell = self._told(
            n,
            np.column_stack(motion.stroboscopic(motion.final[2])),
            np.asarray(motion.impacts.approach_velocity),
            motion.energy_lost,
            motion.kinetic_energy_gained(),
            float(np.diff(motion.sticks).sum() / motion.duration),
        )
        return cell, motion.final

    def _cells_of(self, course: Course, closed: list[int]) -> list[tuple[Cell, Place | None]]:
        """The same of the oscillators of a course."""
        names = "status", "displacement", "velocity", "phase", "energy_lost"
        totals = zip(*(course.totals[name].tolist() for name in names), strict=True)
        strobes, resting = course.strobes(), course.sticking().tolist()
        gained = course.kinetic_energy_gained().tolist()
        cells: list[tuple[Cell, Place | None]] = []
        for k, (status, *final, lost) in enumerate(totals):
            if status != "complete":
                cells.append((Cell(status=status), None))
                continue
            _, speeds, _ = course.hits(k)
            cell = self._told(closed[k], strobes[k], speeds, lost, gained[k], resting[k])
            cells.append((cell, (final[0], final[1], final[2])))
        return cells

    def _told(
        self, n: int, strobe: np.ndarray, speeds: np.ndarray, lost: float, gained: float,
        resting: float,
    ) -> Cell:  # fmt: skip
        span = n or self.periods
        return Cell(
            strobe=strobe[-span:],
            velocity=speeds,
            periods=n,
            impacts=len(speeds) if n else -1,
            impacts_per_period=len(speeds) / span,
            energy_per_period=lost / span,
            kinetic_energy_per_period=gained / span,
            sticking=resting,
        )


def _lost(motion: Any) -> float:
    """Energy lost in the span; NaN if it is known only for the whole run."""
    known = isinstance(motion.system, Cantilever) and motion.energy_lost is not None
    return float(motion.energy_lost) if known else math.nan


def carried(
    scene: Callable[[float], Oscillator], values: np.ndarray, look: Look, start: dict[str, Any]
) -> Iterator[Cell]:
    """Cells one by one, each starting where the last one ended."""
    relative: np.ndarray | None = None
    for value in values:
        oscillator = _made(scene, value)
        if relative is not None:
            origin, unit = ground(oscillator, start["phase"])
            place = relative[0]
            for stop in oscillator.stops:
                if stop.law.rigid:
                    limit = min if stop.side == "upper" else max
                    place = limit(place, stop.position)
            start["initial"] = tuple((origin + unit * (place, relative[1])).tolist())
        cell, final = look.cell(oscillator, **start)
        if final is not None:
            origin, unit = ground(oscillator, final[2])
            relative = (final[:2] - origin) / unit
        yield cell
