"""The phase portrait of a flow: one coordinate of its trajectory over another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._arguments import number
from ..errors import InvalidInput
from ._axes import BLUE, axes, called, frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..oscillators.flows import Flow
    from ..simulate.trajectories import Trajectory


def flow_portrait(
    trajectory: Trajectory,
    ax: Axes | None,
    start: float | None,
    stop: float | None,
    coordinates: tuple[str | int, str | int] | None,
) -> Axes:
    """Draw the line through the states of a trajectory, in two of its coordinates."""
    across, up = _two(trajectory.flow, coordinates)
    time = trajectory.time
    first = -np.inf if start is None else number("start", start, "a time")
    last = np.inf if stop is None else number("stop", stop, "a time")
    shown = (time >= first) & (time <= last)
    if shown.sum() < 2:
        held = f"{time[0]:.6g} to {time[-1]:.6g}" if len(time) else "none, as it has no states"
        raise InvalidInput("start, stop", f"{start}, {stop}", f"a span of two states of {held}")
    ax = axes(ax, width=4.8, height=4.4)
    ax.plot(trajectory[across][shown], trajectory[up][shown], color=BLUE, linewidth=0.7)
    ax.margins(0.06)
    names = trajectory.flow.coordinates
    return frame(ax, called(names[across]), called(names[up]))


def _two(flow: Flow, coordinates: tuple[str | int, str | int] | None) -> tuple[int, int]:
    """Numbers of the coordinates, across and up."""
    from ..simulate._course import coordinate_of

    try:
        across, up = (0, 1) if coordinates is None else coordinates
        return coordinate_of(flow, across), coordinate_of(flow, up)
    except (InvalidInput, TypeError, ValueError):
        names = ", ".join(flow.coordinates)
        raise InvalidInput("coordinates", coordinates, f"two of {names}") from None
