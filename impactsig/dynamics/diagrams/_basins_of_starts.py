"""Basins by following starts one by one: stepped oscillators, cantilevers and flows."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from ..._running.threads import in_threads
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation.basis.events import STROBE_IMPACTS
from ._flow_sections import Section
from ._whole_motions import checked_whole, whole_motion
from .settling.settling import ground, settle

LOOK = 64  # periods, or returns of a flow, between two looks whether a motion has closed
ALIKE = 1e3  # orbits whose points are closer than so many tolerances are one


class End(NamedTuple):
    """Outcome of one start."""

    status: str
    points: np.ndarray  # (n, d), of the orbit; none where it has not closed
    impacts: int = 0


NOTHING = np.empty((0, 2))
SYSTEMS = "an Oscillator, also under OGY on for good, a Cantilever with forcing or a Flow"
NO_PLANE = (
    "Under feedback a motion depends on all that was within the delay, or on the last intervals, "
    "besides displacement and velocity: its starts are no plane"
)


def ends(
    system: Any, starts: np.ndarray, section: Section | None, phase: float, periods: int,
    closed: float, threads: int,
) -> tuple[np.ndarray, list[End], int]:  # fmt: skip
    """Index of the attractor of each start (-1: none), the attractors, and failures."""
    follow = _follower(system, section, phase, periods, closed)
    found = in_threads(follow, starts.tolist(), threads, " starts")
    attractors: list[End] = []
    labels = [_label(end, attractors, ALIKE * closed) for end in found]
    return np.array(labels), attractors, sum(end.status != "complete" for end in found)


def _follower(
    system: Any, section: Section | None, phase: float, periods: int, closed: float
) -> Callable[[list[float]], End]:
    if isinstance(system, Oscillator) and system.noise is None:
        origin, unit = ground(system, phase)

        def settled(start: list[float]) -> End:
            own = settle(
                system, periods, tolerance=closed, initial=(start[0], start[1]), phase=phase
            )
            last = own.strobes[len(own.strobes) - own.closed :]
            return End(own.status, origin + unit * last[:, :2], int(last[:, STROBE_IMPACTS].sum()))

        return settled
    checked_whole(system, section, name="system")
    if not isinstance(system, (Cantilever, Flow)) and not _nudged_for_good(system):
        why = NO_PLANE if system.dimension is None else ""
        raise InvalidInput("system", system, SYSTEMS, why)
    if isinstance(system, Flow) and system.dimension < 2:
        raise InvalidInput("system", system, "a flow of two coordinates or more")

    def chunked(start: list[float]) -> End:
        initial: Any = tuple(start)
        if isinstance(system, Cantilever):
            initial = (start[:1], start[1:])
        elif isinstance(system, Flow):
            initial = (*start, *system.initial[2:])
        for _ in range(-(-periods // LOOK)):
            own = whole_motion(system, LOOK, 0, initial, phase, section)
            if isinstance(own, str):
                return End(own, NOTHING)
            n = own.closed(closed)
            if n:
                points = own.strobe[-n:]
                if isinstance(system, Cantilever):  # of the first mode, as the starts are
                    q, v = own.motion.modal(own.motion.stop - system.forcing_period * _back(n))
                    points = np.stack([q[:, 0], v[:, 0]], axis=1)
                return End("complete", points, len(own.speeds_since(own.since(n))))
            initial = own.motion.final if isinstance(system, Flow) else own.motion.final[:2]
        return End("complete", NOTHING)

    return chunked


def _nudged_for_good(controlled: Any) -> bool:
    """Whether a controlled oscillator moves on from a strobe as it does from a start."""
    always = not isinstance(controlled.controller, tuple) and not controlled.start
    return always and controlled.dimension == 2


def _back(n: int) -> np.ndarray:
    return np.arange(n - 1, -1, -1)


def _label(end: End, attractors: list[End], tolerance: float) -> int:
    """Index of the attractor that an outcome belongs to, added if new."""
    if not len(end.points):
        return -1
    near = tolerance * float(np.abs(end.points).max())
    for k, other in enumerate(attractors):
        if other.points.shape == end.points.shape and other.impacts == end.impacts:
            shifts: Iterable[int] = range(len(end.points))
            if any(np.abs(np.roll(end.points, s, 0) - other.points).max() <= near for s in shifts):
                return k
    attractors.append(end)
    return len(attractors) - 1
