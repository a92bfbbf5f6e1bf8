"""The waveform to zoom into: a Bokeh drawing as JSON, and the script that shows it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..plot._axes import BLUE, GREY, VERMILLION
from ..plot._stops import by_stop, several_stops
from ..plot.waveforms import marker_heights

if TYPE_CHECKING:
    from ..recording import Recording
    from .analysis import Analysis

MARKED = 5000
"""Impacts marked at most; beyond that they would hide the waveform and slow the page down."""


def bokeh_script() -> str:
    """Bokeh itself, from the installed package: the page must work without a network."""
    import bokeh

    script = Path(bokeh.__file__).parent / "server" / "static" / "js" / "bokeh.min.js"
    return script.read_text(encoding="utf-8")


def marked(analysis: Analysis) -> np.ndarray:
    """Indices of the impacts that are marked: all, or every second, third, ... of very many."""
    count = len(analysis.impacts)
    return np.arange(0, count, max(1, -(-count // MARKED)))


def waveform_json(analysis: Analysis) -> str:
    """The drawing as JSON that is safe inside a script element: a panel a channel, in one time.

    Text from the file reaches Bokeh only as plain text, never as markup or a formula.
    """
    from bokeh.embed import json_item
    from bokeh.layouts import column

    panels: list[Any] = []
    for overview in analysis.overviews:
        panels.append(_panel(analysis, overview))
        panels[-1].x_range = panels[0].x_range
    for one in panels[:-1]:
        one.xaxis.axis_label = None
    drawn = panels[0] if len(panels) == 1 else column(panels, sizing_mode="stretch_width")
    return script_safe(json.dumps(json_item(drawn)))


def _panel(analysis: Analysis, overview: Recording) -> Any:
    """One channel and the impacts, those of each stop in its colour."""
    from bokeh.models import ColumnDataSource, HoverTool, PlainText
    from bokeh.plotting import figure

    impacts = analysis.impacts
    drawing = figure(
        height=340 if len(analysis.overviews) == 1 else 240,
        sizing_mode="stretch_width",
        tools="xpan,xwheel_zoom,box_zoom,reset,save",
        active_scroll="xwheel_zoom",
        active_drag="box_zoom",
        background_fill_color=None,
        border_fill_color=None,
        outline_line_color=None,
    )
    drawing.toolbar.logo = None
    line = GREY if several_stops(impacts) else BLUE
    drawing.line(overview.time, overview.samples.astype(np.float32), color=line, line_width=0.8)
    chosen = marked(analysis)
    if len(chosen) and len(overview):
        every = overview.samples
        heights = marker_heights(impacts[chosen], overview.time, every, every).astype(np.float32)
        for label, colour, own in by_stop(impacts, chosen, VERMILLION):
            data, tips = _columns(analysis, chosen[own])
            data["height"] = heights[own]
            named = {"legend_label": label} if label else {}
            markers = drawing.scatter(
                "time", "height", source=ColumnDataSource(data), color=colour, size=6, alpha=0.8,
                **named,
            )  # fmt: skip
            drawing.add_tools(HoverTool(renderers=[markers], tooltips=tips))
    if drawing.legend:
        drawing.legend.orientation = "horizontal"
        drawing.legend.click_policy = "hide"
        drawing.add_layout(drawing.legend[0], "above")
    drawing.xaxis.axis_label = "time [s]"
    name = overview.channels[0] or "signal"
    drawing.yaxis.axis_label = PlainText(
        text=f"{name} [{overview.unit}]" if overview.unit else name
    )
    drawing.axis.axis_label_text_font_style = "normal"
    drawing.axis.minor_tick_line_color = None
    drawing.grid.grid_line_alpha = 0.4
    return drawing


def script_safe(text: str) -> str:
    """JSON without the characters that could end a script element or start a comment."""
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _columns(analysis: Analysis, chosen: np.ndarray) -> tuple[dict[str, Any], list[Any]]:
    impacts = analysis.impacts
    data: dict[str, Any] = {"number": chosen + 1, "time": impacts.time[chosen]}
    tips = [("impact", "@number"), ("time", "@time{0.000000} s")]
    if len(impacts) > 1:
        before = np.concatenate(([np.nan], np.diff(impacts.time)))
        before[1:][impacts.interval_spans_gap()] = np.nan
        data["interval"] = (before[chosen] * 1e3).astype(np.float32)
        tips.append(("interval before", "@interval{0.000} ms"))
    if impacts.contact_time is not None:
        data["contact"] = (impacts.contact_time[chosen] * 1e3).astype(np.float32)
        tips.append(("contact time", "@contact{0.0000} ms"))
    if impacts.peak is not None:
        data["peak"] = impacts.peak[chosen].astype(np.float32)
        # Only the number: a unit comes from the file, and tooltips are markup.
        tips.append(("peak", "@peak{0.0000}"))
    if impacts.time_error is not None:
        data["error"] = (impacts.time_error[chosen] * 1e6).astype(np.float32)
        tips.append(("standard error of time", "@error{0.00} µs"))
    if impacts.probability is not None:
        data["probability"] = impacts.probability[chosen].astype(np.float32)
        tips.append(("probability", "@probability{0.000}"))
    if impacts.stop_index is not None:
        data["stop"] = impacts.stop_index[chosen]
        tips.append(("stop", "@stop"))
    if impacts.stop_probability is not None:
        data["sure"] = impacts.stop_probability[chosen].astype(np.float32)
        tips.append(("probability of the stop", "@sure{0.000}"))
    return data, tips
