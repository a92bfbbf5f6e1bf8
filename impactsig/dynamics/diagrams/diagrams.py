"""Bifurcation diagrams over one parameter."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..._arguments import Seed, flag, function, number, streams, thread_count, whole
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation.batches.course import Course
from ...simulation.simulation import what_it_is
from ..arguments import parameter_names, parameter_values
from ..tangents.lyapunov import lyapunov_spectrum
from ._exponents import Place, exponents_at, exponents_of
from ._flow_sections import Section, checked_section
from ._whole_motions import SYSTEMS, checked_whole, whole_motion
from .settling.settling import ground
from .settling.together import Settling, in_blocks, settles


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationDiagram(Shown):
    """Bifurcation diagram: section points and impacts over one parameter, after the transient.

    Attributes
    ----------
    values : numpy.ndarray, shape (n,)
        Values of the parameter.
    strobe : tuple of numpy.ndarray
        For each value, displacement and velocity once per forcing period, shape (k, 2), or the
        states of a flow on the section, shape (k, d). For an orbit that has closed, each of its
        points once.
    velocity : tuple of numpy.ndarray
        For each value, the approach velocities of the impacts in the same span; for a flow, the
        rates of change of the coordinate at its crossings.
    periods, impacts : numpy.ndarray of int, shape (n,)
        n and m of period(m, n), m impacts in n forcing periods; 0 and -1 if the orbit did not
        close. For a flow both count returns to the section, and (1, 0) is rest.
    impacts_per_period : numpy.ndarray, shape (n,)
        Mean number of impacts per forcing period, a_i.
    energy_per_period : numpy.ndarray, shape (n,)
        Energy lost at stops, relative to them, and by friction, per forcing period; NaN for a
        cantilever with a soft stop, for a flow, under control and under noise.
    kinetic_energy_per_period : numpy.ndarray, shape (n,)
        Change of the kinetic energy of the body, relative to the ground, in impacts, per forcing
        period (`Motion.kinetic_energy_gained`): a_e of [Okolewski2021]_. NaN for a cantilever, for
        a flow, under control and under noise.
    sticking : numpy.ndarray, shape (n,)
        Fraction of the time at rest at a stop or under friction; NaN for a flow and under noise.
    exponents : numpy.ndarray, shape (n, d), or None
        Lyapunov exponents per unit of time of the oscillator, if requested: from the multipliers of
        an orbit that has closed, otherwise over the span. -inf for a direction that collapses.
    status : tuple of str
        As in `Motion`, for each value; "no return" for a flow that neither crosses its section nor
        comes to rest. Unknown quantities of a motion that ended early are NaN.
    parameter : str
        Name of the parameter, as in the scene.

    See Also
    --------
    bifurcation_diagram, plot.bifurcation_diagram

    Examples
    --------
    >>> from impactsig import bifurcation_diagram, scenes
    >>> found = bifurcation_diagram(scenes.karpodinis, [22.0, 22.1])
    >>> found.parameter, found.impacts, found.periods
    ('frequency', array([1, 1]), array([1, 1]))
    """

    values: np.ndarray
    strobe: tuple[np.ndarray, ...]
    velocity: tuple[np.ndarray, ...]
    periods: np.ndarray
    impacts: np.ndarray
    impacts_per_period: np.ndarray
    energy_per_period: np.ndarray
    kinetic_energy_per_period: np.ndarray
    sticking: np.ndarray
    exponents: np.ndarray | None
    status: tuple[str, ...]
    parameter: str = "parameter"

    def __repr__(self) -> str:
        closed = np.count_nonzero(self.periods)
        failed = sum(status != "complete" for status in self.status)
        told = f"{len(self.values)} values, {closed} of them on closed orbits"
        return f"BifurcationDiagram({told}{f', {failed} failed' if failed else ''})"

    plot = drawn_by("bifurcation_diagram", "one quantity over the parameter")


class _Cell(NamedTuple):
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


def bifurcation_diagram(
    scene: Callable[[float], Any],
    values: Any,
    *,
    periods: int = 100,
    transient: int = 400,
    initial: Any = None,
    phase: float = 0.0,
    section: tuple[str | int, float] | None = None,
    carry: bool = False,
    exponents: bool = False,
    closed: float = 1e-9,
    skip: bool = True,
    seed: Seed = None,
    workers: int | None = None,
) -> BifurcationDiagram:
    """Bifurcation diagram of a system over one parameter.

    The simulation of an oscillator ends as soon as its orbit has closed. Cantilevers and controlled
    oscillators are simulated for the full time, and their orbit is determined from the stroboscopic
    points (of a cantilever in all its modes). A flow is sampled at a section, and its returns count
    as periods. Under noise no orbit closes, and the stroboscopic points are those of one path.

    Parameters
    ----------
    scene : callable
        The `Oscillator`, `Cantilever`, `Flow` or `Controlled` oscillator for a value of the
        parameter, such as ``scenes.karpodinis``.
    values : array_like
        Values of the parameter; with `carry`, in the order of the continuation.
    periods, transient : int
        Numbers of forcing periods, or of returns of a flow, that are evaluated, and that are
        discarded before.
    initial : optional
        State at the start, as for `simulate`; by default at rest, or the initial state of the flow.
    phase : float
        Phase of the forcing at starts and strobes [rad]. Not for flows.
    section : (str or int, float), optional
        Of flows: name or number of a coordinate, and the level that it crosses upwards.
    carry : bool
        Whether to start each value at the final state of the previous one instead of at `initial`,
        with the displacement relative to the stops and the velocity scaled by the forcing
        frequency. The values are then computed one after another. Only for oscillators.
    exponents : bool
        Whether to compute the Lyapunov exponents. Not under control or noise.
    closed : float
        Tolerance of the return of an orbit, relative to the size of displacement and velocity. If
        the transient is too short for it, the orbit is found as in `periodicity_chart`.
    skip : bool
        Whether a simulation ends as soon as its orbit has closed, since the rest follows from it.
    seed : int, SeedSequence or Generator, optional
        Seed of the noise, which differs between values. The same seed gives the same result; a
        Generator is advanced.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    BifurcationDiagram

    Raises
    ------
    InvalidInput
        If an argument is out of range, or the scene does not return a system.

    See Also
    --------
    periodicity_chart, continue_orbit, plot.bifurcation_diagram

    Examples
    --------
    >>> from impactsig import bifurcation_diagram, scenes
    >>> found = bifurcation_diagram(scenes.karpodinis, [22.0, 22.1])
    >>> found.impacts_per_period
    array([1., 1.])
    """
    chosen = parameter_values("values", values)
    options = {"initial": initial, "phase": phase}
    look = _Look(
        whole("periods", periods, 1),
        whole("transient", transient, 1),
        number("closed", closed, above=0, most=1e-2),
        flag("skip", skip),
        flag("exponents", exponents),
        checked_section(section),
    )
    seeds = streams(seed, len(chosen))
    function("scene", scene, f"a function of the parameter that makes {SYSTEMS}", 1)
    threads = thread_count(workers)
    if flag("carry", carry):
        cells = list(_carried(scene, chosen, look, options))
    else:
        machines = [scene(float(at)) for at in chosen]
        cells = look.cells(machines, seeds, threads, **options)

    def column(name: str) -> np.ndarray:
        return np.array([getattr(cell, name) for cell in cells])

    return BifurcationDiagram(
        values=chosen,
        strobe=tuple(cell.strobe for cell in cells),
        velocity=tuple(cell.velocity for cell in cells),
        periods=column("periods"),
        impacts=column("impacts"),
        impacts_per_period=column("impacts_per_period"),
        energy_per_period=column("energy_per_period"),
        kinetic_energy_per_period=column("kinetic_energy_per_period"),
        sticking=column("sticking"),
        exponents=column("exponents") if exponents else None,
        status=tuple(cell.status for cell in cells),
        parameter=parameter_names(scene, 1)[0],
    )


def _made(scene: Callable[[float], Oscillator], value: float) -> Oscillator:
    oscillator = scene(float(value))
    if not isinstance(oscillator, Oscillator):
        required = "a function that makes an Oscillator, where each value goes on from the last"
        raise InvalidInput("scene", oscillator, required)
    return oscillator


class _Look(NamedTuple):
    """The quantities to compute in every cell."""

    periods: int
    transient: int
    closed: float
    skip: bool
    exponents: bool
    section: Section | None

    def cells(
        self, machines: list[Any], seeds: Sequence[Seed], threads: int, **start: Any
    ) -> list[_Cell]:
        """Cells of systems from one start: oscillators side by side, others one by one."""

        def some(which: list[int]) -> list[_Cell]:
            if not settles(machines[which[0]]):
                return [self.whole_cell(machines[k], seeds[k], **start) for k in which]
            return [cell for cell, _ in self.settled([machines[k] for k in which], **start)]

        return in_blocks(some, machines, self.transient, threads)

    def whole_cell(self, system: Any, seed: Seed, **start: Any) -> _Cell:
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
            return _Cell(status=found, exponents=np.full(system.dimension or 2, math.nan))
        motion, n = found.motion, found.closed(self.closed)
        span = n or self.periods
        speeds = found.speeds_since(found.since(span))
        cell = _Cell(
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

    def cell(self, oscillator: Oscillator, **start: Any) -> tuple[_Cell, Place | None]:
        """The cell of an oscillator from a start, and its final state."""
        return self.settled([oscillator], **start)[0]

    def settled(
        self, oscillators: list[Oscillator], **start: Any
    ) -> list[tuple[_Cell, Place | None]]:
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

    def _cell(self, n: int, motion: Any) -> tuple[_Cell, Place | None]:
        """The cell of an oscillator past its transient, over one period of its orbit if closed."""
        if motion.status != "complete":
            return _Cell(status=motion.status), None
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

    def _cells_of(self, course: Course, closed: list[int]) -> list[tuple[_Cell, Place | None]]:
        """The same of the oscillators of a course."""
        names = "status", "displacement", "velocity", "phase", "energy_lost"
        totals = zip(*(course.totals[name].tolist() for name in names), strict=True)
        strobes, resting = course.strobes(), course.sticking().tolist()
        gained = course.kinetic_energy_gained().tolist()
        cells: list[tuple[_Cell, Place | None]] = []
        for k, (status, *final, lost) in enumerate(totals):
            if status != "complete":
                cells.append((_Cell(status=status), None))
                continue
            _, speeds, _ = course.hits(k)
            cell = self._told(closed[k], strobes[k], speeds, lost, gained[k], resting[k])
            cells.append((cell, (final[0], final[1], final[2])))
        return cells

    def _told(
        self, n: int, strobe: np.ndarray, speeds: np.ndarray, lost: float, gained: float,
        resting: float,
    ) -> _Cell:  # fmt: skip
        span = n or self.periods
        return _Cell(
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


def _carried(
    scene: Callable[[float], Oscillator], values: np.ndarray, look: _Look, start: dict[str, Any]
) -> Iterator[_Cell]:
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
