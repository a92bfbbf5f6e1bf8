"""The phase portrait of a flow: one of its coordinates over another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._arguments import number
from ...errors import InvalidInput
from ..axes import BLUE, axes, called, frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...control.running.flow import ControlledFlowMotion
    from ...oscillators.flows import Flow
    from ...simulation.flows.flow_motion import FlowMotion

MOST = 20_000  # states that are drawn


def flow_portrait(
    motion: FlowMotion | ControlledFlowMotion,
    ax: Axes | None,
    start: float | None,
    stop: float | None,
    coordinates: tuple[str | int, str | int] | None,
) -> Axes:
    """Draw the trajectory of a flow in the plane of two coordinates."""
    across, up = _two(motion.system, coordinates)
    first = motion.start if start is None else number("start", start, "a time")
    last = motion.stop if stop is None else number("stop", stop, "a time")
    first, last = max(first, motion.start), min(last, motion.stop)
    if not first < last:
        held = f"{motion.start:.6g} to {motion.stop:.6g}"
        raise InvalidInput("start, stop", f"{start}, {stop}", f"a span within {held}")
    states = motion.sample(np.linspace(first, last, MOST))
    ax = axes(ax, width=4.8, height=4.4)
    ax.plot(states[:, across], states[:, up], color=BLUE, linewidth=0.7)
    ax.margins(0.06)
    names = motion.system.coordinates
    return frame(ax, called(names[across]), called(names[up]))


def _two(flow: Flow, coordinates: tuple[str | int, str | int] | None) -> tuple[int, int]:
    """Numbers of the coordinates, across and up."""
    from ...simulation.flows.course import coordinate_of

    try:
        across, up = (0, 1) if coordinates is None else coordinates
        return coordinate_of(flow, across), coordinate_of(flow, up)
    except (InvalidInput, TypeError, ValueError):
        names = ", ".join(flow.coordinates)
        raise InvalidInput("coordinates", coordinates, f"two of {names}") from None
