"""Waveforms: a whole recording with its impacts, and one pulse in detail."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...errors import InvalidInput
from .._kinds import checked, refuse_others
from ..axes import (
    BLUE,
    GREEN,
    GREY,
    VERMILLION,
    axes,
    colour,
    explain,
    frame,
    legend,
    plain,
    points,
    seconds,
    title,
    with_unit,
)
from ..stops import by_stop, several_stops

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...impacts import Impacts
    from ...recording import Recording

ATTACK = 4e-3
"""Time after a touch in which its peak is looked for where no contact was measured [s]."""

BINS = 2000
"""Spans a waveform is reduced to; a figure has fewer pixels than that."""


@checked
def waveform(
    recording: Recording,
    impacts: Impacts | None = None,
    ax: Axes | None = None,
    *,
    start: float | None = None,
    stop: float | None = None,
) -> Axes:
    """Draw a recording against time, with a mark on every impact.

    Long recordings are drawn by the least and the greatest sample of each of 2000 spans, so no
    spike is lost however short it is. For more detail, choose a span by `start` and `stop`.

    Parameters
    ----------
    recording : Recording
        One or several channels.
    impacts : Impacts, optional
        The impacts to mark, on the first channel; of several stops in several colours.
    start, stop : float, optional
        Span to draw [s].

    Raises
    ------
    InvalidInput
        If the span holds no sample.

    See Also
    --------
    impactsig.read, impactsig.detect_impacts, impactsig.plot.pulse

    Examples
    --------
    >>> from impactsig import detect_impacts, plot, read
    >>> recording = read("data_samples/loadcell_periodic_22.1Hz_short.csv")
    >>> ax = plot.waveform(recording, detect_impacts(recording))
    """
    ax = axes(ax)
    shown = recording.between(start, stop)
    if not len(shown):
        return explain(ax, "The recording has no samples.")
    time, low, high = polyline(shown)
    one_channel = shown.samples.ndim == 1
    stops = impacts is not None and several_stops(impacts)
    for index, name in enumerate(shown.channels):
        column = (slice(None),) if one_channel else (slice(None), index)
        line = np.column_stack((low[column], high[column])).ravel() if len(low) else low
        ax.plot(
            np.repeat(time, 2),
            line,
            color=GREY if one_channel and stops else colour(index),
            linewidth=0.7,
            label=None if one_channel else plain(name or f"channel {index}"),
        )
    if impacts is not None and len(impacts):
        inside = (impacts.time >= shown.start) & (impacts.time <= shown.stop)
        seen = impacts[inside]
        column = (slice(None),) if one_channel else (slice(None), 0)
        heights = marker_heights(seen, time, low[column], high[column])
        marks = by_stop(impacts, inside, VERMILLION)
        if not one_channel:  # colours tell channels apart
            marks = iter([("", VERMILLION, np.ones(len(seen), bool))])
        for name, mark, of_stop in marks:
            count = int(of_stop.sum())
            label = f"{count} impacts" if count != 1 else "1 impact"
            label += f", {name}" if name else ""
            points(ax, seen.time[of_stop], heights[of_stop], color=mark, label=label, zorder=3)
    if ax.get_legend_handles_labels()[0]:
        legend(ax, "upper right", ncols=4, borderaxespad=0)
        ax.margins(y=0.2)  # the legend lies clear of the highest
    ax.margins(x=0.01)
    seconds(ax.xaxis, "time", [shown.duration] if shown.start == 0 else [shown.stop])
    names = [name for name in shown.channels if name]
    name = names[0] if len(shown.channels) == 1 and names else "signal"
    return frame(ax, None, with_unit(name, shown.unit))


def polyline(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, least and greatest sample of each span, or the samples if there are few."""
    if len(recording) <= 2 * BINS:
        return recording.time, recording.samples, recording.samples
    return recording.envelope(BINS)


def marker_heights(
    impacts: Impacts, time: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Height at which each impact is marked: the extreme of the spans that its contact touches.

    The extreme is that on the side of the pulses where the run tells it, and otherwise that on the
    side where the signal goes farther from its median.

    Parameters
    ----------
    impacts : Impacts
        The impacts to mark.
    time : ndarray, shape (m,)
        Start of each span [s].
    low, high : ndarray, shape (m,)
        Least and greatest sample of each span.

    Returns
    -------
    ndarray, shape (n,)
    """
    middle = float(np.nanmedian(np.concatenate((low, high))))
    rise = {"positive": high - middle, "negative": middle - low}.get(
        impacts.settings.get("polarity", ""), np.fmax(high - middle, middle - low)
    )
    height = np.nan_to_num(np.where(rise == high - middle, high, low), nan=middle)
    rise = np.nan_to_num(rise, nan=-np.inf)
    contact = impacts.contact_time if impacts.contact_time is not None else ATTACK
    # One span more on each side: the peak may lie just over the edge.
    first = np.maximum(np.searchsorted(time, impacts.time, side="right") - 2, 0)
    last = np.searchsorted(time, impacts.time + contact, side="right") + 1
    return height[[a + np.argmax(rise[a:b]) for a, b in zip(first, last, strict=True)]]


@checked
def pulse(
    recording: Recording,
    impacts: Impacts,
    index: int,
    ax: Axes | None = None,
    *,
    margin: float | None = None,
) -> Axes:
    """Draw one impact in detail, with its levels and its contact time.

    Levels are drawn above the baseline, the median of the samples outside the contact. Threshold
    and release apply to the filtered signal, which is not drawn.

    Parameters
    ----------
    recording : Recording
        One channel, holding the impact.
    impacts : Impacts
        The impacts found in it.
    index : int
        Which of them; negative counts from the end.
    margin : float, optional
        Time shown before the contact, and three times that after it [s]; by default one contact
        time and at least 12 samples, or 5 ms where contact times were not measured.

    Raises
    ------
    InvalidInput
        If there is no such impact, the recording has several channels or does not hold it.

    See Also
    --------
    impactsig.detect_impacts, impactsig.plot.waveform

    Examples
    --------
    >>> from impactsig import detect_impacts, plot, read
    >>> recording = read("data_samples/loadcell_periodic_22.1Hz_short.csv")
    >>> ax = plot.pulse(recording, detect_impacts(recording), 3)
    """
    refuse_others("impacts", impacts, ["Impacts"])
    if recording.samples.ndim != 1:
        raise InvalidInput(
            "recording",
            f"{len(recording.channels)} channels",
            "one channel",
            "Choose it by recording.channel(name)",
        )
    ax = axes(ax)
    if not len(impacts):
        return explain(ax, impacts.reason or "No impacts.")
    if not -len(impacts) <= index < len(impacts):
        raise InvalidInput("index", index, f"from {-len(impacts)} to {len(impacts) - 1}")
    index %= len(impacts)
    touch = float(impacts.time[index])
    contact = 0.0 if impacts.contact_time is None else float(impacts.contact_time[index])
    if margin is None:
        margin = max(contact, 12 / recording.rate) if contact else 5e-3
    shown = recording.between(touch - margin, touch + contact + 3 * margin)
    few = len(shown) < 120
    ax.plot(
        shown.time - touch,
        shown.samples,
        color=BLUE,
        linewidth=1.2,
        marker="o" if few else "",
        markersize=3,
        zorder=3,
    )
    outside = (shown.time < touch) | (shown.time > touch + contact)
    rest = float(np.nanmedian(shown.samples[outside])) if contact and outside.any() else 0.0
    side = -1.0 if _negative(shown.samples - rest) else 1.0
    if contact:
        ax.axvspan(0, contact, color=BLUE, alpha=0.12, linewidth=0)
        _write_contact(ax, contact, 0.02 if side > 0 else 0.98)
    level = impacts.contact_level
    levels = (
        ("threshold", impacts.threshold, VERMILLION, "--"),
        # Level 0 stands for the touch itself: there is nothing to draw.
        ("contact level", level if isinstance(level, float) and level else None, GREEN, ":"),
    )
    if impacts.sensor != "sound":
        for name, value, colour, style in levels:
            if value is not None:
                height = rest + side * abs(value)
                label = plain(f"{name} {value:.3g} {impacts.unit}")
                ax.axhline(height, color=colour, linestyle=style, linewidth=1, label=label)
        if ax.get_legend_handles_labels()[0]:
            place = "upper right" if side > 0 else "lower right"
            legend(ax, place, fontsize="small", borderaxespad=0)
    ax.axvline(0, color=GREY, linewidth=0.8)
    ax.margins(x=0, y=0.15)
    seconds(ax.xaxis, f"time since {touch:.6f} s", shown.time - touch)
    title(ax, f"impact {index + 1} of {len(impacts)}")
    return frame(ax, None, with_unit(recording.channels[0] or "signal", recording.unit))


def _negative(samples: np.ndarray) -> bool:
    return bool(-np.nanmin(samples) > np.nanmax(samples))


def _write_contact(ax: Axes, contact: float, height: float) -> None:
    """Write the contact time in the shaded span, on the side where the pulse is not."""
    text = f"{contact * 1e3:.3f} ms" if contact >= 1e-4 else f"{contact * 1e6:.1f} µs"
    ax.text(
        contact / 2,
        height,
        f"contact {text}",
        transform=ax.get_xaxis_transform(),
        ha="center",
        va="bottom" if height < 0.5 else "top",
        fontsize="small",
    )
