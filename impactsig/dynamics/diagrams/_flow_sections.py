"""Returns of a flow to a Poincare section: upward crossings of a level by a coordinate."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._arguments import number, pair
from ...errors import InvalidInput
from ...oscillators.flows import Flow
from ...simulation import simulate
from ...simulation.basis.events import DIVERGED, ENDLESS
from ...simulation.flows.course import Running, coordinate_of
from ...simulation.flows.flow_motion import FlowMotion
from ..periodic.flow_shooting import jacobian, rate_at

Section = tuple[str | int, float]

NEWTON = 3
NEAR = 1e-3  # of the size: how far an equilibrium may be from what comes to it
STEPS = 64  # between two looks whether a flow that does not return has come to rest
PATIENCE = 4000  # looks without a return after which none is waited for
AT_REST = 1e-6  # way that a flow about to rest would go in as long again, as a share of its size
REST = 1e-3  # share of the time that it took to come to rest, in which it is looked at there


def checked_section(section: Any) -> Section | None:
    """Validate a coordinate and a level, or None.

    Raises
    ------
    InvalidInput
        If it is neither. Whether a flow has the coordinate is seen later.
    """
    if section is None:
        return None
    required = "the name or number of a coordinate, and a level"
    signal, level = pair("section", section, required)
    if not isinstance(signal, (str, int)) or isinstance(signal, bool):
        raise InvalidInput("section", section, required)
    return signal, number("section", level, required)


def cut(
    flow: Flow, section: Section, count: int, transient: int, initial: Any
) -> tuple[FlowMotion, np.ndarray, np.ndarray, np.ndarray] | str:
    """A motion of so many returns, with instants, states and rates on the section.

    The first of ``count + 1`` instants ends the transient. A flow that comes to rest has as many
    states, all alike, but no rates. Of one that does neither, what it does instead.
    """
    from ...simulation.flows.flow_spikes import Task, spikes

    signal, level = section
    column = coordinate_of(flow, signal)
    running = Running(flow, signal, initial)
    wanted, found, size = transient + count + 1, list[float](), 0.0
    task = Task(level, True, False, np.inf, wanted)
    silent, rest = 0, None
    while len(found) < wanted and silent < PATIENCE and rest is None:
        status, times = spikes(
            running.tableau, running.field, task._replace(wanted=wanted - len(found)),
            running.scratch, running.course, STEPS,
        )  # fmt: skip
        found.extend(times.tolist())
        if status in (DIVERGED, ENDLESS):
            return "diverged" if status == DIVERGED else "no return"
        y = running.course.state[: flow.dimension]
        size = max(size, float(np.abs(y).max()))
        silent = 0 if len(times) else silent + 1
        speed = float(np.abs(rate_at(flow, running.time, y)).max())
        if not len(times) and speed * running.time <= AT_REST * size:
            rest = _rest(flow, running.time, y, size)
    if len(found) == wanted:
        returns = np.array(found[transient:])
        motion = simulate(
            flow, duration=returns[-1] - returns[0], transient=returns[0], initial=initial
        )
        points = motion.sample(np.clip(returns, motion.start, motion.stop))
        rates = np.array([
            rate_at(flow, t, y)[column] for t, y in zip(returns[1:], points[1:], strict=True)
        ])  # fmt: skip
        return motion, returns, points, rates
    if rest is None:
        return "no return"
    motion = simulate(flow, duration=REST * running.time, initial=rest)
    points = np.repeat(rest[None, :], count + 1, axis=0)
    return motion, np.linspace(motion.start, motion.stop, count + 1), points, np.empty(0)


def _rest(flow: Flow, t: float, y: np.ndarray, size: float) -> np.ndarray | None:
    """The stable equilibrium near a state, by Newton's method; None if there is none."""
    place, sizes = y.copy(), np.full(flow.dimension, size)
    for _ in range(NEWTON):
        slopes = jacobian(flow, t, place, sizes)
        if not np.isfinite(slopes).all() or np.linalg.eigvals(slopes).real.max() >= 0:
            return None
        place = place - np.linalg.solve(slopes, rate_at(flow, t, place))
    return place if np.abs(place - y).max() <= NEAR * size else None
