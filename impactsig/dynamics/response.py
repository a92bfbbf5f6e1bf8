"""How far a system swings over one parameter, once it has settled."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import function, number, thread_count, whole
from .._showing import Shown
from ..oscillators import Cantilever, Oscillator, Rigid
from ._arguments import parameter_names, parameter_values
from ._settling import settle
from ._whole_motions import SYSTEMS, checked_whole, whole_motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SAMPLES = 256  # of a period of the first force, between which a turn is looked for
WITHIN = 64  # of the interval that has one


@dataclass(frozen=True)
class ResponseSpectrum(Shown):
    """How far an oscillator swings over one parameter, once it has settled.

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
        """Half of what lies between the extremes."""
        return (self.greatest - self.least) / 2

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw both extremes; see `impactsig.plot.response_spectrum`."""
        from ..plot import response_spectrum

        return response_spectrum(self, ax=ax)


def response_spectrum(
    scene: Callable[[float], Any],
    values: Any,
    *,
    periods: int = 20,
    transient: int = 400,
    initial: tuple[float, float] = (0.0, 0.0),
    closed: float = 1e-9,
    workers: int | None = None,
) -> ResponseSpectrum:
    """How far an oscillator, or the tip of a cantilever, swings over one parameter, once settled.

    Parameters
    ----------
    scene : callable
        The `Oscillator`, `Cantilever` or `Controlled` oscillator for a value of the parameter.
    values : array_like
        Values of the parameter.
    periods, transient : int
        Forcing periods that are looked at where the orbit does not close, and that are left out
        before. Of an orbit that closes, the rest of the transient is left out.
    initial : (float, float)
        Displacement and velocity at the start.
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

    def whole_cell(system: Any) -> tuple[float, float, float, int, str]:
        found = whole_motion(system, periods, transient, initial, 0.0)
        if isinstance(found, str):
            return math.nan, math.nan, math.nan, 0, found
        motion, n = found.motion, found.closed(closed)
        start = motion.stop - (n or periods) * system.forcing_period
        rest = float(np.diff(np.maximum(motion.sticks, start)).sum() / (motion.stop - start))
        return *_extremes(motion, max(start, motion.start)), rest, n, motion.status

    def cell(value: float) -> tuple[float, float, float, int, str]:
        oscillator = scene(value)
        if not isinstance(oscillator, Oscillator):
            return whole_cell(checked_whole(oscillator))
        settled = settle(oscillator, transient, tolerance=closed, initial=initial).closing()
        motion = settled.motion(settled.closed or periods)
        if motion.status != "complete":
            return math.nan, math.nan, math.nan, 0, motion.status
        assert motion.sticks is not None  # all was kept
        rest = float(np.diff(motion.sticks).sum() / motion.duration)
        return *_extremes(motion), rest, settled.closed, motion.status

    with ThreadPoolExecutor(threads) as pool:
        cells = list(pool.map(cell, chosen.tolist()))
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


def _extremes(motion: Any, start: float | None = None) -> tuple[float, float]:
    """Greatest and least displacement: at turns, impacts, or the ends."""
    own = motion.system
    if isinstance(own, Cantilever):
        period = 1 / float(motion.frequencies[-1])
    else:
        period = 2 * math.pi / own.frequencies[0] * own.time_unit
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
