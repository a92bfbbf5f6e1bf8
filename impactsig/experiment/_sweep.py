"""A recording in which the forcing frequency was swept: the motion over the frequency."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import InvalidInput
from ..impacts import Impacts
from ..intervals.forcing import forcing_cycles
from ..intervals.track import track
from ._delays import continues, transient_of
from ._motions import NO_IMPACTS, motion_of
from .parameter import Place
from .rig import Rig

if TYPE_CHECKING:
    from ..intervals import Periodicity

WINDOW = 60
"""Impacts in a window, unless the rig says how many."""
SILENT = 20.0
"""Forcing periods without an impact, at the beginning or the end, from which on there are none."""


class Course(NamedTuple):
    """Phase and frequency of the forcing through a recording."""

    cycles: Callable[[np.ndarray], np.ndarray]
    """Forcing periods since the beginning, at some times [s]."""
    frequency: Callable[[float], float]
    """[Hz], at a time [s]."""


def law_of(rig: Rig, place: Place) -> Rig:
    """The rig with the law of the sweep of one run, where that depends on its parameter or branch.

    Raises
    ------
    InvalidInput
        If it is to begin at the parameter, and that is no frequency.
    """
    sweep = dict(rig.sweep)
    if sweep.get("start") == "parameter":
        sweep["start"] = place.value
    if "rate" in sweep and place.branch == "down":
        sweep["rate"] = -abs(sweep["rate"])
    return rig if sweep == rig.sweep else replace(rig, sweep=sweep)


def swept(impacts: Impacts, rig: Rig, instants: np.ndarray | None) -> dict[str, Any]:
    """Identify the motion in windows of a sweep, and the changes between them.

    The times of the impacts are counted in forcing periods, so that the period of a steady motion
    does not change with the frequency; `track_period` follows the motion. Frequencies are those at
    the time: what the motion lags behind is taken off when the branches are put together
    (`_transitions.jumps_in_sweeps`), of whose transients each change holds what is seen.

    Raises
    ------
    InvalidInput
        If the impacts are fewer than a window, or the stated frequency reaches 0.
    """
    course = _course(impacts, rig, instants)
    begin, end = impacts.start, impacts.stop
    ends = course.frequency(begin), course.frequency(end)
    if min(ends) <= 0:
        raise InvalidInput("sweep", dict(rig.sweep), "a frequency above 0 through the recording")
    cycles = course.cycles(impacts.time)
    mean = float(np.ptp(cycles) / np.ptp(impacts.time)) if len(impacts) > 1 else ends[0]
    # Seconds at the mean frequency, in which the forcing is steady.
    steady = cycles / mean
    gaps = course.cycles(impacts.gaps.ravel()).reshape(-1, 2) / mean
    found = track(
        Impacts(steady, gaps=gaps),
        1 / mean,
        window=rig.sweep.get("window", WINDOW),
        steady=False,
    )

    def real(at: float) -> float:
        return float(np.interp(at, steady, impacts.time))

    def place(at: float, period: Periodicity | None) -> float:
        stated = course.frequency(at)
        if rig.sweep["from"] != "impacts" or period is None or not period.forcing_period:
            return stated
        # The motion that is locked to the forcing tells by how much the stated law is off.
        return stated / (period.forcing_period * mean)

    first, last = float(impacts.time[0]), float(impacts.time[-1])
    windows, changes = [], []
    edges = [first, *(real(float(one)) for one in found.changes), last]
    centres = [real(float(one)) for one in found.time]
    for k, (centre, period) in enumerate(zip(centres, found.windows, strict=True)):
        low = edges[0] if k == 0 else 0.5 * (centres[k - 1] + centre)
        high = edges[-1] if k == len(centres) - 1 else 0.5 * (centre + centres[k + 1])
        windows.append(_window(place(0.5 * (low + high), period), period, low, high))
    if (first - begin) * ends[0] > SILENT:
        windows.insert(0, _silence(course, begin, first))
        changes.append((first, first - 1 / course.frequency(first), first))
    for one in found.changes:
        after = _first_after(steady, one)
        changes.append(
            (real(float(one)), float(impacts.time[after - 1]), float(impacts.time[after]))
        )
    if (end - last) * ends[1] > SILENT:
        windows.append(_silence(course, last, end))
        changes.append((last, last, last + 1 / course.frequency(last)))
    motions = [_usual(windows, low, high) for low, high in pairwise(_borders(windows, changes))]
    spans = [[course.frequency(one) for one in change] for change in changes]
    pace = np.array([course.frequency(float(one)) for one in impacts.time])

    def at_cycles(count: np.ndarray) -> np.ndarray:
        return np.interp(count, cycles, pace)

    return {
        "rate": ends[1] - ends[0],
        "windows": windows,
        "changes": [
            {
                "value": value,
                "error": abs(high - low) / math.sqrt(12),
                "low": low,
                "high": high,
                "before": before,
                "after": after,
                "rate": _rate(course, change[0]),
                **_transients(cycles, at_cycles, impacts.time, change[0], before, after),
            }
            for change, (value, low, high), (before, after) in zip(
                changes, spans, pairwise(motions), strict=True
            )
            if _motion(before) != _motion(after)
        ],
    }


def _first_after(times: np.ndarray, change: float) -> int:
    """The first impact after a change."""
    return min(max(int(np.searchsorted(times, change)), 1), len(times) - 1)


def _rate(course: Course, at: float) -> float:
    """Rate of change of the frequency around a change of the motion [Hz/s]."""
    beside = 30 / course.frequency(at)
    return (course.frequency(at + beside) - course.frequency(at - beside)) / (2 * beside)


def _transients(
    cycles: np.ndarray,
    frequency: Callable[[np.ndarray], np.ndarray],
    time: np.ndarray,
    change: float,
    before: Mapping[str, Any],
    after: Mapping[str, Any],
) -> dict[str, Any]:
    """Transients before a motion is lost and after it sets in; see `_delays.py`."""
    seen: dict[str, Any] = {"growth": [], "decay": [], "through": False}
    if before["kind"] == NO_IMPACTS or after["kind"] == NO_IMPACTS:
        return seen
    first = _first_after(time, change)
    if before["n"]:
        seen["growth"] = transient_of(cycles, frequency, first - 1, before["n"], -1)
    if after["n"]:
        seen["decay"] = transient_of(cycles, frequency, first, after["n"], 1)
        born = not before["n"] or before["n"] > after["n"]
        seen["through"] = born and continues(cycles, first, after["n"], -1)
    return seen


def _course(impacts: Impacts, rig: Rig, instants: np.ndarray | None) -> Course:
    if rig.sweep["from"] == "channel":
        assert instants is not None  # the rig has such a channel
        at = instants
        count = forcing_cycles(at, at)[0]
        middle, pace = 0.5 * (at[1:] + at[:-1]), np.diff(count) / np.diff(at)
        return Course(
            lambda time: forcing_cycles(at, time)[0] if np.size(time) else np.empty(0),
            lambda time: float(np.interp(time, middle, pace)),
        )
    start, rate, begin = rig.sweep["start"], rig.sweep["rate"], impacts.start
    return Course(
        lambda time: (start + 0.5 * rate * (time - begin)) * (time - begin),
        lambda time: float(start + rate * (time - begin)),
    )


def _borders(
    windows: list[dict[str, Any]], changes: Sequence[tuple[float, float, float]]
) -> list[float]:
    return [windows[0]["start"], *(change[0] for change in changes), windows[-1]["stop"]]


def _usual(windows: list[dict[str, Any]], low: float, high: float) -> dict[str, Any]:
    """The window whose motion is the most frequent between two times."""
    inside = [
        window for window in windows if low <= 0.5 * (window["start"] + window["stop"]) <= high
    ]
    if not inside:  # a stretch shorter than a window: the one that it lies in
        inside = [
            min(windows, key=lambda window: abs(window["start"] + window["stop"] - low - high))
        ]
    motions = [_motion(window) for window in inside]
    usual = max(dict.fromkeys(motions), key=motions.count)
    return inside[motions.index(usual)]


def _motion(window: dict[str, Any]) -> str:
    return motion_of(window)[0]


def _window(value: float, period: Periodicity, start: float, stop: float) -> dict[str, Any]:
    return {
        "value": value,
        "kind": period.kind,
        "m": period.impacts,
        "n": period.periods,
        "confidence": period.confidence,
        "start": start,
        "stop": stop,
    }


def _silence(course: Course, start: float, stop: float) -> dict[str, Any]:
    value = course.frequency(0.5 * (start + stop))
    silent = {"kind": NO_IMPACTS, "m": 0, "n": 1, "confidence": 1.0}
    return {"value": value, "start": start, "stop": stop, **silent}
