"""Sections of a motion: at impacts, and where it crosses a displacement.

The stroboscopic one is `Motion.stroboscopic`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..._arguments import choice, number, whole
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...oscillators.flows import Flow
from ...simulation import Motion
from ...simulation.basis.events import (
    IMPACT,
    PHASE,
    ROW_APPROACH,
    ROW_KIND,
    ROW_STOP,
    TOUCH,
    TURN,
    TURNS,
)
from ...simulation.basis.frame import swings
from ...simulation.beam.beam_motion import BeamMotion
from ...simulation.exact.exact import ExactEngine

PARTS = 512  # of a period of the first force, in which crossings of a stepped motion are looked for
LOOKS = 64  # in a period of the highest mode of a cantilever
MOST = 1_000_000  # steps on one leg


@dataclass(frozen=True, eq=False, repr=False)
class Section(Shown):
    """Points of a motion on a Poincare section.

    Attributes
    ----------
    kind : {"impacts", "displacement"}
        Kind of section.
    time : ndarray, shape (n,)
        Instants of the points [s].
    phase : ndarray, shape (n,)
        Phase of the forcing [rad], 0 to 2 pi.
    velocity : ndarray, shape (n,)
        For impacts the approach velocity relative to the stop, otherwise the velocity relative to
        the stops, in the units of the oscillator.
    stop : ndarray of int, shape (n,)
        Index of the stop in `Oscillator.stops`; -1 for a displacement.

    See Also
    --------
    impact_map, displacement_section, plot.section

    Examples
    --------
    >>> from impactsig import impact_map, scenes, simulate
    >>> found = impact_map(simulate(scenes.karpodinis(22.1), periods=20, transient=500))
    >>> found.kind, len(found.phase)
    ('impacts', 20)
    """

    kind: Literal["impacts", "displacement"]
    time: np.ndarray
    phase: np.ndarray
    velocity: np.ndarray
    stop: np.ndarray

    def __len__(self) -> int:
        return len(self.time)

    plot = drawn_by("section", "velocity over phase")

    def __repr__(self) -> str:
        return f"Section({self.kind}: {len(self)} points)"


def impact_map(motion: Motion | BeamMotion | Any, stop: int | None = None) -> Section:
    """Impact map: phase and velocity at every impact.

    Parameters
    ----------
    motion : Motion, BeamMotion or NoisyMotion
        From `simulate`, with its events kept.
    stop : int, optional
        Index of a stop in `Oscillator.stops`; by default impacts at all stops are included.

    Returns
    -------
    Section
        The impacts in order of time: `time` [s], `phase` [rad], approach `velocity` and index of
        the `stop`, shape (n,).

    Raises
    ------
    InvalidInput
        If only counts were kept, or there is no such stop.

    See Also
    --------
    displacement_section, return_map, plot.section

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import impact_map, scenes, simulate
    >>> motion = simulate(scenes.karpodinis(22.1), periods=20, transient=1000)
    >>> float(np.ptp(impact_map(motion).phase).round(6))  # one impact, at one phase
    0.0
    """
    if not isinstance(motion, Motion) and hasattr(motion, "impacts") and hasattr(motion, "sample"):
        return _of_impacts(motion, stop)
    motion = _motion(motion)
    _check_stop(stop, len(motion.system.stops))
    rows = _rows(motion)
    which = (rows[:, ROW_KIND] == IMPACT) | (rows[:, ROW_KIND] == TOUCH)
    if stop is not None:
        which &= rows[:, ROW_STOP] == stop
    rows = rows[which]
    velocity = rows[:, ROW_APPROACH] * motion._engine.omega
    return Section(
        "impacts", _seconds(motion, rows[:, TURNS], rows[:, PHASE]), rows[:, PHASE], velocity,
        rows[:, ROW_STOP].astype(int),
    )  # fmt: skip


def _of_impacts(motion: Any, stop: int | None) -> Section:
    """The impact map of a motion from its list of impacts."""
    period = _period(motion)
    known = getattr(motion.system, "stops", (getattr(motion.system, "stop", None),))
    _check_stop(stop, len(known))
    hits = motion.impacts
    which = np.full(len(hits), True) if stop is None else hits.stop_index == stop
    phase = (motion._phase + hits.time * (TURN / period)) % TURN
    return Section(
        "impacts", hits.time[which], phase[which], hits.approach_velocity[which],
        hits.stop_index[which].astype(int),
    )  # fmt: skip


def _check_stop(stop: int | None, count: int) -> None:
    """Refuse the index of a stop that is not there."""
    if stop is not None and whole("stop", stop, 0) >= count:
        raise InvalidInput("stop", stop, f"a stop of the {count} there are")


def _period(motion: Any) -> float:
    """Forcing period [s]."""
    period: float | None = motion.system.forcing_period
    if period is None:
        raise InvalidInput("motion", repr(motion), "a forced motion, to tell phases of the forcing")
    return period


def displacement_section(
    motion: Motion | BeamMotion,
    displacement: float = 0.0,
    direction: Literal["up", "down", "both"] = "up",
) -> Section:
    """Phase and velocity at which the motion crosses a displacement.

    No crossing of a motion that is linear between events is missed. Stepped motions are sampled 512
    times per period of the first force, the tip of a cantilever 64 times per period of its highest
    mode, and two crossings between two samples are missed. A turning point or an impact at the
    displacement is not a crossing.

    Parameters
    ----------
    motion : Motion or BeamMotion
        From `simulate`, with its events kept.
    displacement : float
        Displacement of the section, relative to the base if the stops move with it.
    direction : {"up", "down", "both"}
        Direction of the crossings.

    Returns
    -------
    Section
        The crossings in order of time: `time` [s], `phase` [rad] and `velocity`, shape (n,); `stop`
        is -1.

    Raises
    ------
    InvalidInput
        If only counts were kept, a cantilever has no forcing, or an argument is out of its range.

    See Also
    --------
    impact_map, plot.section

    Examples
    --------
    >>> from impactsig import Force, Oscillator, displacement_section, simulate
    >>> free = Oscillator(damping=0.2, forces=(Force(1.0, 0.9),))
    >>> found = displacement_section(simulate(free, periods=20, transient=50), 0.0, "up")
    >>> len(found.velocity), bool((found.velocity > 0).all())
    (20, True)
    """
    level = number("displacement", displacement)
    choice("direction", direction, ("up", "down", "both"))
    if isinstance(motion, BeamMotion):
        return _of_tip(motion, level, direction)
    motion = _motion(motion)
    find = _exact if isinstance(motion._engine, ExactEngine) else _looked
    rigid = [s.position for s in motion.system.stops if s.law.rigid]
    _rows(motion)
    # Rounding may put a hit beyond the stop.
    turns, phase, velocity = np.empty((3, 0)) if level in rigid else find(motion, level)
    return _towards(direction, _seconds(motion, turns, phase), phase, velocity)


def _towards(direction: str, *crossings: np.ndarray) -> Section:
    """Select the crossings in a direction."""
    velocity = crossings[-1]
    wanted = {"up": velocity > 0, "down": velocity < 0, "both": np.full(len(velocity), True)}
    time, phase, velocity = (part[wanted[direction]] for part in crossings)
    return Section("displacement", time, phase, velocity, np.full(len(time), -1))


def _of_tip(motion: BeamMotion, level: float, direction: str) -> Section:
    """Crossings of a displacement by the tip of a cantilever."""
    period, stop = _period(motion), motion.system.stop
    if stop is not None and stop.law.rigid and level == stop.position:
        return _towards(direction, *np.empty((3, 0)))  # rounding may put a hit beyond the stop
    looks = 2 + math.ceil(LOOKS * motion.duration * motion.frequencies.max(initial=1 / period))
    events = (motion._begins - motion._phase) / motion._omega
    times = np.concatenate([np.linspace(motion.start, motion.stop, looks), events])
    times = np.unique(times[(times >= motion.start) & (times <= motion.stop)])
    time, side, velocity = _bisected(motion.sample, times, level)
    phase = (motion._phase + time * motion._omega) % TURN
    return _towards(direction, time, phase, side * np.abs(velocity))


def _exact(motion: Motion, level: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    from ._section import AFTER, FROM, SINCE, SPEED, crossings

    engine: Any = motion._engine
    rows = _rows(motion)
    room = 2 * len(rows) + 256
    while True:
        found = np.empty((room, 4))
        count = crossings(engine.problem, engine.scratch, rows, *motion._last, level, found, MOST)
        if count <= room:
            break
        room = count
    found = found[:count]
    begin = rows[found[:, AFTER].astype(int)]
    angle = begin[:, PHASE] + found[:, SINCE]
    whole_turns = np.floor(angle / TURN)
    velocity = found[:, FROM] * np.abs(found[:, SPEED]) * engine.omega
    return begin[:, TURNS] + whole_turns, angle - TURN * whole_turns, velocity


def _looked(motion: Motion, level: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    engine = motion._engine
    rows = _rows(motion)
    begins = motion._begins
    (first, early), (last, late) = motion._first, motion._last
    start, stop = first * TURN + early, last * TURN + late
    parts = PARTS * swings(motion.system)
    looks = np.linspace(start, stop, max(2, math.ceil((stop - start) / TURN * parts)))
    # An impact within a look would hide what is before it: rows are looks too.
    looks = np.unique(np.concatenate([looks, begins[(begins >= start) & (begins <= stop)]]))

    def state(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        where = np.maximum(np.searchsorted(begins, angle, side="right") - 1, 0)
        turns = np.floor(angle / TURN)
        return engine.sample(rows, where, turns, angle - TURN * turns)

    angle, side, v = _bisected(state, looks, level)
    turns = np.floor(angle / TURN)
    return turns, angle - TURN * turns, side * np.abs(v) * engine.omega


def _bisected(
    state: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], looks: np.ndarray, level: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crossings of a level: instants, direction (1 up, -1 down), velocities."""
    q, _ = state(looks)
    cross = np.flatnonzero((q[:-1] < level) != (q[1:] < level))
    low, high = looks[cross], looks[cross + 1]
    side = np.where(q[cross] < level, 1.0, -1.0)
    for _ in range(60):
        middle = (low + high) / 2
        q, _ = state(middle)
        before = (q < level) == (side > 0)
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    _, v = state(high)
    return high, side, v


def _motion(given: Any) -> Motion:
    if not isinstance(given, Motion):
        moves = getattr(given, "system", None)
        why = ""
        if isinstance(getattr(moves, "system", moves), Flow):
            why = "A flow has no stops and no displacement; threshold_crossings cuts it at a level"
        elif getattr(moves, "noise", None) is not None:
            why = "Between the instants of a path under noise no state is known"
        raise InvalidInput("motion", given, "a Motion or a BeamMotion, as simulate makes", why)
    return given


def _rows(motion: Motion) -> np.ndarray:
    if not len(motion._segments):
        raise InvalidInput("keep", "counts", 'simulate(..., keep="all")')
    return motion._segments


def _seconds(motion: Motion, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
    unit = motion.system.time_unit / motion._engine.omega
    return (turns * TURN + (phase - motion._phase)) * unit
