"""Response of a system over one parameter: extremes of the displacement once settled."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..._arguments import function, number, thread_count, whole
from ..._showing import Shown, drawn_by
from ...oscillators import Cantilever, Rigid
from ...oscillators.flows import Flow
from ...simulate.flows.course import coordinate_of
from ..arguments import parameter_names, parameter_values
from ._flow_sections import checked_section
from ._settling_together import Settling, in_blocks, settles
from ._whole_motions import SYSTEMS, checked_whole, whole_motion

SAMPLES = 256  # of a period of the first force, between which a turn is looked for
WITHIN = 64  # of the interval that has one


@dataclass(frozen=True)
class ResponseSpectrum(Shown):
    """Response of a system over one parameter: extremes of the displacement, once settled.

    Attributes
    ----------
    values : numpy.ndarray, shape (n,)
        Values of the parameter.
    greatest, least : numpy.ndarray, shape (n,)
        Displacement; NaN where a motion ended early.
    sticking : numpy.ndarray, shape (n,)
        Share of the time at rest against a stop or held by friction, likewise.
    periods : numpy.ndarray of int, shape (n,)
        Forcing periods of the orbit; 0 where it has not closed, and the extremes are those of the
        periods that were looked at.
    status : tuple of str
        As of `Motion`, for each value.
    parameter : str
        What the parameter is called: what the scene calls it.

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
        """Half of the difference of the extremes."""
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

    Of a cantilever it is the tip that swings, of a flow the coordinate of the section.

    Parameters
    ----------
    scene : callable
        The `Oscillator`, `Cantilever`, `Flow` or `Controlled` oscillator for a value of the
        parameter.
    values : array_like
        Values of the parameter.
    periods, transient : int
        Forcing periods, or returns of a flow, that are looked at where the orbit does not close,
        and that are left out before. Of an orbit that closes, the rest of the transient is left
        out.
    initial : optional
        State at the start, as for `simulate`; at rest, or that of the flow, unless given.
    section : (str or int, float), optional
        Of flows: name or number of the coordinate whose extremes are wanted, and a level that it
        crosses upwards, by which its returns are counted.
    closed : float
        Tolerance within which an orbit closes, as for `bifurcation_diagram`.
    workers : int, optional
        Threads; as many as there are cores unless given. The result does not depend on it.

    Returns
    -------
    ResponseSpectrum

    Raises
    ------
    InvalidInput
        If an argument is out of range, or the scene makes no oscillator.

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
    function("scene", scene, f"a function of the parameter that makes {SYSTEMS}")
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
        found = [one.closed for one in settling.settled]
        motions = settling.motions([n or periods for n in found])
        return [cell(*own) for own in zip(motions, found, strict=True)]

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
        period = 2 * math.pi / own.angular_frequencies[0] * own.time_unit
    start = motion.start if start is None else start
    count = 1 + math.ceil(SAMPLES * (motion.stop - start) / period)
    time = np.linspace(start, motion.stop, count)
    x, v = motion.sample(time)
    turns = np.flatnonzero(v[:-1] * v[1:] < 0)
    step = time[1] - time[0]
    near = (time[turns, None] + step * np.linspace(0, 1, WITHIN)).ravel()
    place, speed = motion.sample(near)
    # From a sample to the turn the velocity falls evenly, as nearly as it matters.
    before = np.flatnonzero((speed[:-1] * speed[1:] < 0) & (np.diff(near) > 0))
    hits = motion.impacts
    stops = (own.stop,) if isinstance(own, Cantilever) else own.stops
    rigid = [k for k, stop in enumerate(stops) if stop is not None and isinstance(stop.law, Rigid)]
    jumps = hits.time[np.isin(hits.stop_index, rigid)]
    # At a rigid stop the velocity does not fall, it jumps.
    passed = np.searchsorted(jumps, near)
    before = before[passed[before] == passed[before + 1]]
    falls = speed[before] - speed[before + 1]
    turned = place[before] + speed[before] ** 2 / falls * (step / (WITHIN - 1)) / 2
    touched, _ = motion.sample(hits.time[hits.time >= start])
    seen = np.concatenate([x, turned, touched])
    return float(seen.max()), float(seen.min())
