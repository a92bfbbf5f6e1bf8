"""The curve of a motion for drawing, its events, and the motion of the base."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._arguments import number
from ...errors import InvalidInput
from ..axes import ORANGE, VERMILLION, points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...impacts import Impacts
    from ...simulation.motion import Motion

PER_PERIOD = 300
"""Points of a line in a forcing period, and a twelfth of that, at least, between two events."""

MOST_IMPACTS = 5000
"""Impacts drawn unless a span is chosen; more than that a page cannot show."""


class Path(NamedTuple):
    """A curve, NaN at velocity jumps, and the jumps: displacement, velocity before and after."""

    time: np.ndarray
    x: np.ndarray
    v: np.ndarray
    jumps: np.ndarray


def path_of(motion: Motion, start: float, stop: float, relative: bool) -> Path:
    """Sample a motion densely enough between events for a smooth curve."""
    impacts, sticks = events_of(motion)
    period = swing(motion)
    lasts = 0.0 if impacts.contact_time is None else impacts.contact_time
    edges = np.concatenate(([start, stop], impacts.time, impacts.time + lasts, sticks.ravel()))
    edges = np.unique(edges[(edges >= start) & (edges <= stop)])
    # Sampling at an event gives one of its sides; a little off it, for certain the one meant.
    aside = max(1e-9 * period, 8 * np.spacing(abs(stop)))
    legs = [(a + aside, b - aside) for a, b in pairwise(edges)]
    legs = [(a, b) for a, b in legs if b > a]
    size = [PER_PERIOD // 12 + int(PER_PERIOD * (b - a) / period) for a, b in legs]
    time = np.concatenate([np.linspace(*leg, n) for leg, n in zip(legs, size, strict=True)])
    x, v = motion._from_stops(time) if relative else motion.sample(time)
    after = np.cumsum(size)[:-1]
    jumps = np.stack([x[after], v[after - 1], v[after]])
    where = np.abs(jumps[2] - jumps[1]) > 1e-6 * np.ptp(v)
    time, x, v = (np.insert(one, after[where], np.nan) for one in (time, x, v))
    return Path(time, x, v, jumps[:, where])


def spans_jumped(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times at which the velocity jumps, with the range of all jumps there.

    Dashes on dashes would look like a line.
    """
    x, before, after = path.jumps
    apart = np.diff(np.sort(x), prepend=-np.inf) > 1e-6 * np.nanmax(np.abs(path.x))
    first = np.flatnonzero(apart)
    if not len(first):
        return x, before, after
    order = np.argsort(x)
    low = np.minimum.reduceat(np.minimum(before, after)[order], first)
    high = np.maximum.reduceat(np.maximum(before, after)[order], first)
    return x[order][first], low, high


def events_of(motion: Motion) -> tuple[Impacts, np.ndarray]:
    """Impacts and sticks, if they were kept."""
    if motion.impacts is None or motion.sticks is None:
        raise InvalidInput("keep", "counts", 'simulate(..., keep="all")')
    return motion.impacts, motion.sticks


def mark_events(ax: Axes, motion: Any, hits: np.ndarray, sticks: np.ndarray, held: str) -> None:
    """Mark impacts with points and sticks with shades, each once in the legend."""
    if len(hits):
        label = f"{len(hits)} impact{'s' * (len(hits) > 1)}"
        points(ax, hits, motion.sample(hits)[0], color=VERMILLION, label=label, zorder=3)
    for begin, end in sticks[sticks[:, 0] < sticks[:, 1]]:
        ax.axvspan(begin, end, color=ORANGE, alpha=0.25, linewidth=0, label=held)
        held = ""


def span_drawn(
    motion: Motion, start: float | None, stop: float | None, periods: int
) -> tuple[float, float]:
    """The given span, or the last so many periods, in the motion's unit of time."""
    last = motion.stop if stop is None else min(number("stop", stop, "a time"), motion.stop)
    first = last - periods * swing(motion) if start is None else start
    hits = events_of(motion)[0].time
    hits = hits[hits <= last]
    if start is None and len(hits) > MOST_IMPACTS:
        first = max(first, hits[-MOST_IMPACTS])
    first = max(number("start", first, "a time [s]"), motion.start)
    if not first < last:
        raise InvalidInput(
            "start, stop",
            f"{start}, {stop}",
            f"a span in the motion's, {motion.start:.6g} to {motion.stop:.6g} s",
        )
    return first, last


def swing(motion: Motion) -> float:
    """Approximate period of the motion's oscillation [s]."""
    omega = motion.system.angular_natural_frequency
    natural = 2 * math.pi / omega * motion.system.time_unit if omega else motion.duration / 10
    forced = motion.system.angular_frequencies
    return 2 * math.pi / forced[0] * motion.system.time_unit if forced else natural


def stops_move(motion: Motion) -> bool:
    """Whether the base carries the stops."""
    return bool(motion.system.base and motion.system.base.stops)


def base_at(motion: Motion, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity of the base of the stops."""
    return motion._stops_at(*motion._instants(time))


def strobe_times(motion: Motion, phase: float) -> np.ndarray:
    """Times within the motion at which the forcing has a phase."""
    period = motion.system.forcing_period
    assert period is not None
    first = (phase - motion._phase) / math.tau * period
    count = np.arange(
        math.ceil((motion.start - first) / period), math.floor((motion.stop - first) / period) + 1
    )
    return np.clip(first + count * period, motion.start, motion.stop)
