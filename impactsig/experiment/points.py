"""Points of an experiment: a parameter value, the motion there, and its impacts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._motions import motion_of

if TYPE_CHECKING:
    from ..impacts import Impacts

QUANTITIES = ("interval", "peak", "contact_time", "impulse", "phase")
"""Quantities that an experiment has of every impact."""


class Point(NamedTuple):
    """One parameter value.

    Attributes
    ----------
    run : int
        Number of the run.
    value : float
        Of the parameter.
    branch : str
    motion : str
        "period(m,n)", "aperiodic", "no impacts" or "unknown".
    m, n : int or None
        Of the period.
    confidence : float
        Probability of the motion.
    start, stop : float
        Span of the run that it is read from [s]; infinite for all of it.
    """

    run: int
    value: float
    branch: str
    motion: str
    m: int | None
    n: int | None
    confidence: float
    start: float = -math.inf
    stop: float = math.inf


def points_of(run: int, row: Mapping[str, Any], value: float, branch: str) -> Iterator[Point]:
    """The points of a run: one, or one for each window of a sweep."""
    if "windows" not in row:
        yield Point(run, value, branch, *motion_of(row))
        return
    direction = branch_of(row, branch)
    for window in row["windows"]:
        yield Point(
            run, window["value"], direction, *motion_of(window), window["start"], window["stop"]
        )


def branch_of(row: Mapping[str, Any], branch: str) -> str:
    """Branch of a run; for a sweep without one, the direction of the sweep."""
    if branch or "windows" not in row:
        return branch
    return "up" if row["rate"] >= 0 else "down"


def cloud_of(
    quantity: str, point: Point, row: Mapping[str, Any], impacts: Impacts | None
) -> np.ndarray:
    """Values of a quantity at the impacts of a point; empty if it was not measured."""
    if impacts is None:
        return np.empty(0)
    inside = (impacts.time >= point.start) & (impacts.time < point.stop)
    if quantity == "interval":
        return impacts[inside].intervals()
    if quantity == "phase":
        return _phases(row, impacts)[inside]
    column = getattr(impacts, quantity)
    return np.empty(0) if column is None else column[inside]


def _phases(row: Mapping[str, Any], impacts: Impacts) -> np.ndarray:
    """Phases of the impacts, in forcing periods from 0 to 1."""
    if row.get("cycles") is not None:
        return np.asarray(row["cycles"]) % 1
    frequency = row.get("locked_frequency") or row.get("forcing_frequency")
    if not frequency:
        return np.full(len(impacts), np.nan)
    turns = (impacts.time - impacts.start) * frequency
    centre = np.angle(np.exp(2j * np.pi * turns).sum()) / (2 * np.pi)
    return (turns - centre + 0.5) % 1 - 0.5
