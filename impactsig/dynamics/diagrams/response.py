"""Response of a system over one parameter: extremes of the displacement once settled."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from ..._arguments import function, number, thread_count, whole
from ..._showing import Shown, drawn_by
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation.batches.course import Course
from ...simulation.flows.course import coordinate_of
from ..arguments import parameter_names, parameter_values
from ._flow_sections import checked_section
from ._whole_motions import SYSTEMS, checked_whole, whole_motion
from .settling.together import Settling, in_blocks, settles

SAMPLES = 256  # of a period of the first force, between which a turn is looked for
WITHIN = 64  # of the interval that has one
SAMPLED = 2000  # periods of the first force that are sampled together


@dataclass(frozen=True)
class ResponseSpectrum(Shown):
    """Response of a system over one parameter: extremes of the displacement, once settled.

    Attributes
    ----------
    values : numpy.ndarray, shape (n,)
        Values of the parameter.
    greatest, least : numpy.ndarray, shape (n,)
        Greatest and least displacement; NaN where a motion ended early.
    sticking : numpy.ndarray, shape (n,)
        Fraction of the time at rest at a stop or under friction; NaN where a motion ended early.
    periods : numpy.ndarray of int, shape (n,)
        Forcing periods of the orbit; 0 if it did not close, in which case the extremes are those of
        the evaluated periods.
    status : tuple of str
        As in `Motion`, for each value.
    parameter : str
        Name of the parameter, as in the scene.

    See Also
    --------
    response_spectrum, plot.response_spectrum

    Examples
    --------
    >>> from impactsig import response_spectrum, scenes
    >>> found = response_spectrum(scenes.karpodinis, [22.0, 22.1])
    >>> found.greatest.round(6)  # the stop is at 1
    array([1., 1.])
    """

    values: np.ndarray = field(repr=False)
    greatest: np.ndarray = field(repr=False)
    least: np.ndarray = field(repr=False)
    sticking: np.ndarray = field(repr=False)
    periods: np.ndarray = field(repr=False)
    status: tuple[str, ...] = field(repr=False)
    parameter: str

    @property
    def amplitude(self) -> np.ndarray:
        """Half of the difference of the extremes, shape (n,)."""
        return (self.greatest - self.least) / 2

    plot = drawn_by("response_spectrum", "both extremes")


def response_spectrum(
    scene: Callable[[float], Any],
    values: Any,
    *,
    periods: int = 20,
    transient: int = 400,
    initial: Any = None,
    section: tuple[str | int, float] | None = None,
    closed: float = 1e-9,
    workers: int | None = None,
) -> ResponseSpectrum:
    """Extremes of the displacement over one parameter, once the motion has settled.

    For a cantilever it is the displacement of the tip, for a flow the coordinate of the section.

    Parameters
    ----------
    scene : callable
        The `Oscillator`, `Cantilever`, `Flow` or `Controlled` oscillator for a value of the
        parameter.
    values : array_like
        Values of the parameter.
    periods, transient : int
        Numbers of forcing periods, or of returns of a flow, that are evaluated if the orbit does
        not close, and that are discarded before. If the orbit closes during the transient, the rest
        of the transient is skipped.
    initial : optional
        State at the start, as for `simulate`; by default at rest, or the initial state of the flow.
    section : (str or int, float), optional
        For flows: name or number of the coordinate whose extremes are evaluated, and a level that
        it crosses upwards, which defines its returns.
    closed : float
        Tolerance of the return of an orbit, as for `bifurcation_diagram`.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    ResponseSpectrum

    Raises
    ------
    InvalidInput
        If an argument is out of range, or the scene does not return a system.

    See Also
    --------
    bifurcation_diagram, plot.response_spectrum

    Examples
    --------
    >>> from impactsig import response_spectrum, scenes
    >>> found = response_spectrum(lambda gamma: scenes.begley_virgin(gamma, 50.0, 0.15), [0.5, 1.0])
    >>> found.values, bool(found.greatest[1] > found.greatest[0])
    (array([0.5, 1. ]), True)
    """
    chosen = parameter_values("values", values)
    periods, transient = whole("periods", periods, 1), whole("transient", transient, 1)
    closed = number("closed", closed, above=0, most=1e-2)
    function("scene", scene, f"a function of the parameter that makes {SYSTEMS}", 1)
    threads = thread_count(workers)
    cut = checked_section(section)
    at_rest = (0.0, 0.0) if initial is None else initial

    def whole_cell(system: Any) -> tuple[float, float, float, int, str]:
        found = whole_motion(system, periods, transient, initial, 0.0, cut)
        if isinstance(found, str):
            return math.nan, math.nan, math.nan, 0, found
        motion, n = found.motion, found.closed(closed)
        start = max(found.since(n or periods), motion.start)
        if isinstance(system, Flow):
            assert cut is not None  # by checked_whole
            reached = _extremes_of_flow(motion, start, coordinate_of(system, cut[0]), n or periods)
        else:
            reached = _extremes(motion, start)
        return *reached, found.resting(start), n, motion.status

    def cell(motion: Any, n: int) -> tuple[float, float, float, int, str]:
        if motion.status != "complete":
            return math.nan, math.nan, math.nan, 0, motion.status
        assert motion.sticks is not None  # all was kept
        rest = float(np.diff(motion.sticks).sum() / motion.duration)
        return *_extremes(motion), rest, n, motion.status

    systems = [scene(value) for value in chosen.tolist()]

    def some(which: list[int]) -> list[tuple[float, float, float, int, str]]:
        if not settles(systems[which[0]]):
            return [whole_cell(checked_whole(systems[k], cut)) for k in which]
        machines = [systems[k] for k in which]
        settling = Settling(machines, transient, tolerance=closed, initial=at_rest)
        settling.close()
        orbit = [one.closed for one in settling.settled]
        courses, others = settling.on([n or periods for n in orbit])
        cells = {k: cell(motion, orbit[k]) for k, motion in others.items()}
        for which, course in courses:
            own = _extremes_of_course(course, [machines[k] for k in which])
            rest, status = course.sticking().tolist(), course.totals["status"].tolist()
            for k, reached, share, ended in zip(which, own, rest, status, strict=True):
                if reached is None:
                    cells[k] = math.nan, math.nan, math.nan, 0, ended
                else:
                    cells[k] = *reached, share, orbit[k], ended
        return [cells[k] for k in range(len(machines))]

    cells = in_blocks(some, systems, transient, threads)
    greatest, least, rest, n, status = zip(*cells, strict=True)
    return ResponseSpectrum(
        values=chosen,
        greatest=np.array(greatest),
        least=np.array(least),
        sticking=np.array(rest),
        periods=np.array(n),
        status=status,
        parameter=parameter_names(scene, 1)[0],
    )


def _extremes_of_flow(motion: Any, start: float, column: int, returns: int) -> tuple[float, float]:
    """Extremes of a coordinate, by parabolas through its samples near turning points."""
    count = 1 + SAMPLES * returns
    time = np.linspace(start, motion.stop, count)
    y = motion.sample(time)[:, column]
    step = (time[1] - time[0]) / WITHIN
    seen = [y]
    turns = time[1:-1][(y[1:-1] - y[:-2]) * (y[2:] - y[1:-1]) < 0]
    if len(turns):
        beside = step * np.arange(-WITHIN, WITHIN + 1)
        near = np.clip(turns[:, None] + beside, start, motion.stop)
        fine = motion.sample(near.ravel())[:, column].reshape(near.shape)
        a, b, c = fine[:, :-2], fine[:, 1:-1], fine[:, 2:]
        at_turn = (b - a) * (c - b) < 0
        bend = (a - 2 * b + c)[at_turn]
        seen.append(b[at_turn] - (c - a)[at_turn] ** 2 / (8 * bend))
    values = np.concatenate(seen)
    return float(values.max()), float(values.min())


def _extremes(motion: Any, start: float | None = None) -> tuple[float, float]:
    """Extremes of the displacement: at turning points, impacts, or the ends."""
    own = motion.system
    if isinstance(own, Cantilever):
        period = 1 / float(motion.frequencies[-1])
    else:
        period = _first_period(own)
    hits = motion.impacts
    stops = (own.stop,) if isinstance(own, Cantilever) else own.stops
    start = motion.start if start is None else start
    looking = _look(
        start, motion.stop, period, hits.time, _jumps(hits.time, hits.stop_index, stops)
    )
    time = next(looking)
    while True:
        try:
            time = looking.send(motion.sample(time))
        except StopIteration as end:
            return cast("tuple[float, float]", end.value)


def _extremes_of_course(
    course: Course, machines: list[Oscillator]
) -> list[tuple[float, float] | None]:
    """The same of oscillators that have been moved together; None of those that ended early."""
    status, n = course.totals["status"].tolist(), len(machines)
    start = course.totals["start"]
    stop = start + course.totals["duration"]
    found: list[tuple[float, float] | None] = [None] * n
    period = np.array([_first_period(machine) for machine in machines])
    upto = np.cumsum((stop - start) / period) // SAMPLED
    for part in np.unique(upto).tolist():
        looking, times = {}, [np.empty(0)] * n
        for k in np.flatnonzero(upto == part).tolist():
            if status[k] == "complete":
                hits, _, which = course.hits(k)
                jumps = _jumps(hits, which, machines[k].stops)
                own = _look(float(start[k]), float(stop[k]), float(period[k]), hits, jumps)
                looking[k], times[k] = own, next(own)
        while looking:
            states = course.sample(times)
            times = [np.empty(0)] * n
            for k, own in tuple(looking.items()):
                try:
                    times[k] = own.send(states[k])
                except StopIteration as end:
                    found[k] = end.value
                    del looking[k]
    return found


def _first_period(oscillator: Oscillator) -> float:
    return 2 * math.pi / oscillator.angular_frequencies[0] * oscillator.time_unit


def _jumps(time: np.ndarray, which: np.ndarray, stops: Sequence[Any]) -> np.ndarray:
    """Those of some impacts that turn the velocity at once."""
    rigid = [k for k, stop in enumerate(stops) if stop is not None and stop.law.rigid]
    return time[np.isin(which, rigid)]


def _look(
    start: float, stop: float, period: float, hits: np.ndarray, jumps: np.ndarray
) -> Generator[np.ndarray, tuple[np.ndarray, np.ndarray], tuple[float, float]]:
    """Extremes over a span, of what is displacement and velocity at the times that it yields."""
    count = 1 + math.ceil(SAMPLES * (stop - start) / period)
    time = np.linspace(start, stop, count)
    x, v = yield time
    turns = np.flatnonzero(v[:-1] * v[1:] < 0)
    step = time[1] - time[0]
    near = (time[turns, None] + step * np.linspace(0, 1, WITHIN)).ravel()
    place, speed = yield near
    # From a sample to the turn the velocity falls evenly, as nearly as it matters.
    before = np.flatnonzero((speed[:-1] * speed[1:] < 0) & (np.diff(near) > 0))
    # At a rigid stop the velocity does not fall, it jumps.
    passed = np.searchsorted(jumps, near)
    before = before[passed[before] == passed[before + 1]]
    falls = speed[before] - speed[before + 1]
    turned = place[before] + speed[before] ** 2 / falls * (step / (WITHIN - 1)) / 2
    touched, _ = yield hits[hits >= start]
    seen = np.concatenate([x, turned, touched])
    return float(seen.max()), float(seen.min())
