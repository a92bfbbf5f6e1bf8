"""Figures of a report: matplotlib drawings as data URIs."""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .. import plot

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..impacts import Impacts
    from ..recording import Recording
    from .analysing.analysis import Analysis

SPIKES_SHOWN = 60
_NARROW = "screen and (max-width: 720px)"  # as in page.css

MANY = 400
"""Points of one artist beyond which it is drawn as an image: as many paths make a page slow."""


@dataclass(frozen=True)
class Picture:
    """One figure: `source` is a data URI, `alt` describes it in words.

    `narrow` is drawn anew for narrow screens, where a wide one would have to be pushed along. A
    `still` one is for paper and for readers without scripts: the page draws it itself else.
    """

    source: str
    alt: str
    caption: str
    size: Literal["third", "half", "wide"] = "half"
    still: bool = False
    narrow: str = ""

    @property
    def image(self) -> Markup:
        """The HTML of the figure."""
        from markupsafe import Markup

        image = Markup('<img src="{}" alt="{}">').format(self.source, self.alt)
        if not self.narrow:
            return image
        source = Markup('<source media="{}" srcset="{}">').format(_NARROW, self.narrow)
        return Markup("<picture>{}{}</picture>").format(source, image)


def draw(paint: Callable[[Axes], object], width: float, height: float) -> str:
    """Draw axes to an SVG data URI, without a display or pyplot."""
    return draw_figure(lambda figure: paint(figure.subplots()), width, height)


def draw_figure(paint: Callable[[Figure], object], width: float, height: float) -> str:
    """The same for a whole figure."""
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    settings: Any = {"svg.hashsalt": "impactsig", "svg.fonttype": "path", "font.size": 9.5}
    with matplotlib.rc_context(settings), warnings.catch_warnings():
        # A channel named in a script the font does not have is drawn with boxes; that is enough.
        warnings.filterwarnings("ignore", "Glyph .* missing")
        figure = Figure(figsize=(width, height), dpi=200, layout="constrained")
        paint(figure)
        for ax in figure.axes:
            for line in ax.lines:
                line.set_rasterized(np.size(line.get_xdata()) > MANY)
            for points in ax.collections:
                drawn = max(np.shape(points.get_offsets())[0], len(points.get_paths()))
                points.set_rasterized(drawn > MANY)
        for patch in (figure.patch, *(ax.patch for ax in figure.axes)):
            patch.set_visible(False)  # the page shows through
        held = io.BytesIO()
        # Not by savefig, which lays a figure out in a drawing of its own first.
        FigureCanvasSVG(figure).print_svg(held, metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(held.getvalue()).decode()


def waveform(analysis: Analysis) -> Picture:
    """The static waveform for paper and for readers without scripts; one panel per channel."""
    impacts, count = analysis.impacts, len(analysis.overviews)

    def paint(figure: Figure) -> None:
        panels = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
        for ax, overview in zip(panels, analysis.overviews, strict=True):
            plot.waveform(overview, impacts, ax)
        for ax in panels[:-1]:
            ax.set_xlabel("")

    return Picture(
        draw_figure(paint, 9.2, 2.9 if count == 1 else 0.5 + 2.1 * count),
        waveform_in_words(analysis),
        "The recording and the impacts found in it.",
        size="wide",
    )


def waveform_in_words(analysis: Analysis, overview: Recording | None = None) -> str:
    """Caption of the waveform; of one channel of several, with its name."""
    impacts, name = analysis.impacts, ""
    if overview is not None and len(analysis.overviews) > 1 and overview.channels[0]:
        name = f" of {overview.channels[0]}"
    return f"Waveform{name}, {impacts.duration:.4g} s with {len(impacts)} impacts marked"


def pictures(analysis: Analysis) -> Iterator[Picture]:
    """All figures of the impacts that have data."""
    impacts = analysis.impacts
    count = len(impacts.intervals())
    for index, excerpt in analysis.excerpts:
        yield Picture(
            draw(partial(_pulse, excerpt, impacts, index), 3.4, 2.9),
            f"Close-up of impact {index + 1} at {impacts.time[index]:.6f} s",
            f"Impact {index + 1} in detail, {_standing(analysis, index)}.",
            size="third",
        )
    if len(impacts) > 1:
        shown = impacts[:SPIKES_SHOWN]
        if len(impacts) > SPIKES_SHOWN:
            shown = impacts.between(None, float(impacts.time[SPIKES_SHOWN]))
        yield Picture(
            draw(lambda ax: plot.spike_train(shown, ax), 9.2, 1.3),
            f"Spike train of the first {len(shown)} impacts",
            f"Spike train: the first {len(shown)} impacts."
            if len(shown) < len(impacts)
            else "Spike train.",
            size="wide",
            narrow=draw(lambda ax: plot.spike_train(shown, ax), 4.4, 1.3),
        )
    if count:
        yield Picture(
            draw(lambda ax: plot.interval_sequence(impacts, ax), 9.2, 2.7),
            f"{count} interspike intervals against time",
            "Interspike intervals in the order of time.",
            size="wide",
            still=True,
        )
    if len(impacts) and impacts.peak is not None:
        yield Picture(
            draw(lambda ax: plot.peak_against_time(impacts, ax), 9.2, 2.7),
            "Peak of each impact against time",
            "Peak of each impact; a drift here may mean wear, loosening or a changed gain.",
            size="wide",
            narrow=draw(lambda ax: plot.peak_against_time(impacts, ax), 4.4, 2.7),
        )
    if count < 2:
        return
    yield Picture(
        draw(lambda ax: plot.histogram(impacts, ax), 4.4, 3.3),
        f"Density of {count} interspike intervals",
        "Density of the interspike intervals.",
    )
    if impacts.contact_time is not None:
        yield Picture(
            draw(lambda ax: plot.contact_against_interval(impacts, ax), 4.4, 3.3),
            "Contact time of each impact against the interval before it",
            "Contact time against the interval that led up to the impact.",
        )


def _pulse(excerpt: Recording, impacts: Impacts, index: int, ax: Axes) -> None:
    plot.pulse(excerpt, impacts, index, ax)


def _standing(analysis: Analysis, index: int) -> str:
    """Why this impact was selected; see `channels.typical`."""
    measured = analysis.impacts.peak is not None
    places = ("the weakest", "one of middle strength", "the strongest")
    if not measured:
        places = ("the first", "in the middle of the run", "the last")
    order = [i for i, _ in analysis.excerpts]
    return places[order.index(index)] if len(order) == 3 else "in full detail"
