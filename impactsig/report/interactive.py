"""Data of the interactive figures: waveform, intervals, return map and table, in JSON."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np

from ..impacts import flag_names
from ..plot.axes import VERMILLION
from ..plot.records.waveforms import marker_heights
from ..plot.stops import by_stop
from .analysing.samples import Span, by_interest
from .contents import printable
from .tables import columns_shown, intervals_before

if TYPE_CHECKING:
    from ..impacts import Impacts
    from ..recording import Recording
    from .analysing.analysis import Analysis

MARKED = 10_000
"""Impacts marked and listed at most; beyond that they would make the page slow and large."""
LEVELS = 65_534
"""Steps into which the range of some samples is divided; one code more says: not valid."""


def scripts() -> list[str]:
    """The scripts of the page: the drawing library, then ours."""
    parts = resources.files("impactsig.report")
    names = ("charts.js", "table.js", "linked.js")
    ours = "\n".join((parts / name).read_text(encoding="utf-8") for name in names)
    # The policy and a reader's browser see a script as it is here, so its ends of line are fixed.
    library = (parts / "uplot" / "uPlot.iife.min.js").read_text(encoding="utf-8")
    return [library, f'"use strict";\n(() => {{\n{ours}}})();\n']


def style() -> str:
    """The style sheet of the drawing library."""
    return (resources.files("impactsig.report") / "uplot" / "uPlot.min.css").read_text("utf-8")


def marked(impacts: Impacts) -> np.ndarray:
    """Indices of the impacts that are marked: all, or every k-th of very many."""
    count = len(impacts)
    return np.arange(0, count, max(1, -(-count // MARKED)))


def colours(impacts: Impacts) -> list[tuple[str, str, np.ndarray]]:
    """Label and colour of each stop, and which of the impacts marked are of it."""
    return list(by_stop(impacts, marked(impacts), VERMILLION))


def numbers(analysis: Analysis, room: int) -> tuple[str, int]:
    """The JSON, safe inside a script element, and the number of impacts shown by samples.

    Parameters
    ----------
    analysis : Analysis
    room : int
        Bytes it may take. What exceeds them is left out by the samples around impacts, those of
        least interest first.
    """
    without = script_safe(json.dumps(_content(analysis, [()] * len(analysis.overviews))))
    kept = _fitting(analysis, room - len(without))
    held = {span.impact for spans in kept for span in spans}
    return script_safe(json.dumps(_content(analysis, kept))), len(held)


SPAN_BYTES, SAMPLE_BYTES = 44, 2.7
"""What a span takes in base64, of two whole numbers and three others; and each of its samples."""


def _fitting(analysis: Analysis, room: int) -> list[Sequence[Span]]:
    """The spans of each channel that fit, in the order of interest."""
    cost = np.zeros(len(analysis.impacts))
    for spans in analysis.spans:
        for span in spans:
            cost[span.impact] += SPAN_BYTES + SAMPLE_BYTES * len(span.samples)
    order = by_interest(analysis.impacts)
    fits = np.zeros(len(cost), bool)
    fits[order] = np.cumsum(cost[order]) <= room
    return [[span for span in spans if fits[span.impact]] for spans in analysis.spans]


def _content(analysis: Analysis, spans: Sequence[Sequence[Span]]) -> dict[str, Any]:
    chosen = marked(analysis.impacts)
    return {
        "panels": [
            _panel(analysis.impacts, overview, rate, own, chosen)
            for overview, rate, own in zip(analysis.overviews, analysis.rates, spans, strict=True)
        ],
        "impacts": _impacts(analysis.impacts, chosen),
    }


def _panel(
    impacts: Impacts, overview: Recording, rate: float, spans: Sequence[Span], chosen: np.ndarray
) -> dict[str, Any]:
    """One channel: overview, samples around impacts, and heights of the marks."""
    every = overview.samples
    heights = np.zeros(len(chosen))
    if len(chosen) and len(every):
        heights = marker_heights(impacts[chosen], overview.time, every, every)
    codes = [_codes(span.samples) for span in spans]
    return {
        "name": printable(overview.channels[0] or "signal"),
        "unit": printable(overview.unit),
        "rate": rate,
        "start": overview.start,
        "step": 1 / overview.rate,
        "reduced": overview.rate != rate,
        "overview": [*_codes(every)[:2], _packed(_codes(every)[2], "<u2")],
        "heights": _packed(heights, "<f4"),
        "spans": {
            "impact": _packed([span.impact for span in spans], "<u4"),
            "start": _packed([span.start for span in spans], "<f8"),
            "count": _packed([len(span.samples) for span in spans], "<u4"),
            "low": _packed([low for low, _, _ in codes], "<f8"),
            "step": _packed([step for _, step, _ in codes], "<f8"),
            "codes": _packed(np.concatenate([c for *_, c in codes]) if codes else [], "<u2"),
        },
    }


def _impacts(impacts: Impacts, chosen: np.ndarray) -> dict[str, Any]:
    """All marked impacts: table row, intervals and colour of each."""
    before = intervals_before(impacts)
    flags = impacts.flags[chosen]
    stops = colours(impacts)
    colour = np.zeros(len(chosen), np.uint8)
    for k, (_, _, own) in enumerate(stops):
        colour[own] = k
    return {
        "number": _packed(chosen + 1, "<u4"),
        "time": _packed(impacts.time[chosen], "<f8"),
        "contact": _packed(
            np.zeros(len(chosen)) if impacts.contact_time is None else impacts.contact_time[chosen],
            "<f4",
        ),
        "before": _packed(1e3 * before[chosen], "<f4"),
        "after": _packed(1e3 * np.append(before[1:], np.nan)[chosen], "<f4"),
        "columns": [
            {
                "head": column.head,
                "form": column.form,
                "values": _packed(
                    column.values[chosen], "<f8" if column.head == "time [s]" else "<f4"
                ),
            }
            for column in columns_shown(impacts)
        ],
        "flags": _packed(flags, "<u2"),
        "flagNames": {str(one): flag_names(int(one)) for one in np.unique(flags)},
        "colour": _packed(colour, "u1"),
        "colours": [[printable(name), shade] for name, shade, _ in stops],
    }


def _codes(samples: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Least value, step, and samples as steps above it; `LEVELS` + 1 is not valid."""
    valid = np.isfinite(samples)
    if not valid.any():
        return 0.0, 1.0, np.full(len(samples), LEVELS + 1, np.uint16)
    low, high = float(samples[valid].min()), float(samples[valid].max())
    step = (high - low) / LEVELS or 1.0
    steps = np.round((samples.astype(float) - low) / step)
    return low, step, np.where(valid, steps, LEVELS + 1).astype(np.uint16)


def _packed(values: Any, kind: str) -> str:
    """Numbers as little-endian bytes in base64."""
    with np.errstate(over="ignore"):  # what no drawing could show is infinite
        return base64.b64encode(np.asarray(values).astype(kind).tobytes()).decode()


def script_safe(text: str) -> str:
    """JSON without characters that could end a script element or start a comment."""
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text
