"""The waveform to zoom into: a Bokeh drawing as JSON, and the script that shows it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..plot.waveforms import marker_heights

if TYPE_CHECKING:
    from .analysis import Analysis

MARKED = 5000
"""Impacts marked at most; beyond that they would hide the waveform and slow the page down."""

LINE, MARK = "#0072B2", "#D55E00"


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
    """The drawing as JSON that is safe inside a script element.

    Text from the file reaches Bokeh only as plain text, never as markup or a formula.
    """
    from bokeh.embed import json_item
    from bokeh.models import ColumnDataSource, HoverTool, PlainText
    from bokeh.plotting import figure

    overview, impacts = analysis.overview, analysis.impacts
    drawing = figure(
        height=340,
        sizing_mode="stretch_width",
        tools="xpan,xwheel_zoom,box_zoom,reset,save",
        active_scroll="xwheel_zoom",
        active_drag="box_zoom",
        background_fill_color=None,
        border_fill_color=None,
        outline_line_color=None,
    )
    drawing.toolbar.logo = None
    drawing.line(overview.time, overview.samples.astype(np.float32), color=LINE, line_width=0.8)
    chosen = marked(analysis)
    if len(chosen):
        shown = impacts[chosen]
        every = overview.samples
        data, tips = _columns(analysis, chosen)
        data["height"] = marker_heights(shown, overview.time, every, every).astype(np.float32)
        markers = drawing.scatter(
            "time", "height", source=ColumnDataSource(data), color=MARK, size=6, alpha=0.8
        )
        drawing.add_tools(HoverTool(renderers=[markers], tooltips=tips))
    drawing.xaxis.axis_label = "time [s]"
    name = overview.channels[0] or "signal"
    drawing.yaxis.axis_label = PlainText(
        text=f"{name} [{overview.unit}]" if overview.unit else name
    )
    drawing.axis.axis_label_text_font_style = "normal"
    drawing.axis.minor_tick_line_color = None
    drawing.grid.grid_line_alpha = 0.4
    return script_safe(json.dumps(json_item(drawing)))


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
    return data, tips
