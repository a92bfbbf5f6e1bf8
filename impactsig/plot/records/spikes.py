"""Impacts along the run: the spike train and the strength of each impact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...errors import InvalidInput
from .._kinds import checked
from ..axes import GREY, RASTER_ABOVE, axes, explain, seconds, span_of, with_unit
from ..stops import by_stop, name_stops, scatter_by_stop

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...impacts import Impacts


@checked
def spike_train(impacts: Impacts, ax: Axes | None = None) -> Axes:
    """Draw a line at every instant of impact; spans without valid samples are shaded.

    Parameters
    ----------
    impacts : Impacts
        Measured or simulated.

    See Also
    --------
    impactsig.Impacts, impactsig.plot.interval_sequence

    Examples
    --------
    >>> from impactsig import Impacts, plot
    >>> ax = plot.spike_train(Impacts.from_times([0.0, 0.1, 0.3, 0.4]))
    """
    ax = axes(ax, height=1.4)
    if not len(impacts):
        return explain(ax, impacts.reason or "No impacts.")
    for label, colour, of_stop in by_stop(impacts, np.ones(len(impacts), bool)):
        ax.vlines(
            impacts.time[of_stop],
            0,
            1,
            color=colour,
            label=label,
            linewidth=0.8,
            alpha=1.0 if len(impacts) < 500 else 0.5,
            rasterized=len(impacts) > RASTER_ABOVE,
        )
    name_stops(ax)
    for first, last in impacts.gaps:
        ax.axvspan(first, last, color=GREY, alpha=0.2, linewidth=0)
    ax.set_yticks([])
    ax.set_ylim(0, 1.05)
    ax.spines["left"].set_visible(False)
    if impacts.duration > 0:
        ax.set_xlim(impacts.start, impacts.stop)
    seconds(ax.xaxis, "time", [impacts.stop])
    return ax


@checked
def peak_against_time(impacts: Impacts, ax: Axes | None = None) -> Axes:
    """Draw the peak of every impact against time; drift and wear show here first.

    Parameters
    ----------
    impacts : Impacts
        With peaks.

    Raises
    ------
    InvalidInput
        If peaks were not measured.

    See Also
    --------
    impactsig.detect_impacts, impactsig.plot.contact_against_interval

    Examples
    --------
    >>> from impactsig import Impacts, plot
    >>> ax = plot.peak_against_time(Impacts([0.0, 0.1, 0.3], peak=[1.0, 1.2, 0.9], unit="N"))
    """
    if impacts.peak is None:
        raise InvalidInput("impacts", "no peaks", "impacts with measured peaks")
    ax = axes(ax)
    if not len(impacts):
        return explain(ax, impacts.reason or "No impacts.")
    scatter_by_stop(ax, impacts, np.ones(len(impacts), bool), impacts.time, impacts.peak)
    seconds(ax.xaxis, "time", [impacts.stop])
    ax.set_ylabel(with_unit("peak", impacts.unit))
    ax.set_ylim(
        min(0.0, 1.08 * float(impacts.peak.min())), 1.08 * float(impacts.peak.max()) or None
    )
    return ax


@checked
def contact_against_interval(impacts: Impacts, ax: Axes | None = None) -> Axes:
    """Draw the contact time of every impact against the interval before it.

    Impacts after a gap in the samples have no such interval and are left out.

    Parameters
    ----------
    impacts : Impacts
        With contact times.

    Raises
    ------
    InvalidInput
        If contact times were not measured (sound, hard stops).

    See Also
    --------
    impactsig.detect_impacts, impactsig.plot.peak_against_time

    Examples
    --------
    >>> from impactsig import detect_impacts, plot
    >>> impacts = detect_impacts("data_samples/loadcell_periodic_22.1Hz_short.csv")
    >>> ax = plot.contact_against_interval(impacts)
    """
    if impacts.contact_time is None:
        raise InvalidInput(
            "impacts", "no contact times", "impacts with contact times", "Sound has none"
        )
    ax = axes(ax, width=4.2, height=3.6)
    intervals = impacts.intervals()
    if not len(intervals):
        return explain(ax, f"{_count(impacts)}: an interval needs two.")
    after = np.append(False, ~impacts.interval_spans_gap())
    contact = impacts.contact_time[after]
    scatter_by_stop(ax, impacts, after, intervals, contact)
    seconds(ax.xaxis, "interspike interval before it", intervals)
    seconds(ax.yaxis, "contact time", contact)
    ax.set_xlim(span_of(intervals))
    ax.set_ylim(0, 1.08 * float(contact.max()) or None)
    return ax


@checked
def interval_sequence(impacts: Impacts, ax: Axes | None = None) -> Axes:
    """Draw every interspike interval against the time of its end.

    Parameters
    ----------
    impacts : Impacts
        Measured or simulated.

    See Also
    --------
    impactsig.Impacts.intervals, impactsig.plot.spike_train

    Examples
    --------
    >>> from impactsig import Impacts, plot
    >>> ax = plot.interval_sequence(Impacts.from_times([0.0, 0.1, 0.3, 0.4]))
    """
    ax = axes(ax)
    intervals = impacts.intervals()
    if not len(intervals):
        return explain(ax, f"{_count(impacts)}: an interval needs two.")
    after = np.append(False, ~impacts.interval_spans_gap())
    scatter_by_stop(ax, impacts, after, impacts.time[after], intervals)
    seconds(ax.xaxis, "time", [impacts.stop])
    seconds(ax.yaxis, "interspike interval", np.append(intervals, 0.0))
    ax.set_ylim(0, 1.08 * float(intervals.max()) or None)
    return ax


def _count(impacts: Impacts) -> str:
    return {0: "No impacts", 1: "One impact"}.get(len(impacts), f"{len(impacts)} impacts")
