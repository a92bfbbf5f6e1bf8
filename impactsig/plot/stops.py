"""Impacts of several stops, each in its colour."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from .axes import BLUE, GREY, colour, legend, points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..impacts import Impacts


def several_stops(impacts: Impacts) -> bool:
    """Whether the impacts are of more than one stop, those of no known stop being one more."""
    return impacts.stop_index is not None and len(np.unique(impacts.stop_index)) > 1


def by_stop(
    impacts: Impacts, chosen: np.ndarray, only: str = BLUE
) -> Iterator[tuple[str, str, np.ndarray]]:
    """Label, colour and mask of the impacts of each stop, among those chosen.

    Parameters
    ----------
    impacts : Impacts
    chosen : ndarray of bool or int
        Which of them.
    only : str
        Colour of all, without a label, where there are not several stops.
    """
    if impacts.stop_index is None or not several_stops(impacts):
        yield "", only, np.ones(len(impacts.time[chosen]), bool)
        return
    stop = impacts.stop_index[chosen]
    for number in np.unique(stop):
        yield stop_name(number), stop_colour(number), stop == number


def stop_name(stop: int) -> str:
    """What a stop is called in a legend."""
    return f"stop {stop}" if stop >= 0 else "stop not known"


def stop_colour(stop: int) -> str:
    """The colour of a stop, in every figure."""
    return colour(int(stop)) if stop >= 0 else GREY


def name_stops(ax: Axes) -> None:
    """Add a legend above the axes if there are several stops."""
    if ax.get_legend_handles_labels()[0]:
        legend(ax, "above", ncols=4)


def scatter_by_stop(
    ax: Axes, impacts: Impacts, chosen: np.ndarray, x: np.ndarray, y: np.ndarray
) -> None:
    """Scatter y over x, one value for each chosen impact, every stop in its colour."""
    for label, shade, of_stop in by_stop(impacts, chosen):
        points(ax, x[of_stop], y[of_stop], color=shade, label=label)
    name_stops(ax)
