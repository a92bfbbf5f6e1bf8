"""Shared parts of figures: axes, colours, legends, and times with SI prefixes."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.ticker import Formatter

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.legend import Legend

# Okabe and Ito's palette: its colours stay apart in every common form of colour blindness.
BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#E69F00",
    "#CC79A7",
    "#56B4E9",
)
CHANNEL_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)
GREY = "#6B6B6B"

GREEK = {
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda",
    "mu", "nu", "xi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega",
}  # fmt: skip

RASTER_ABOVE = 3000
"""Points above which a scatter is drawn as pixels inside a vector figure, to keep it small."""


def axes(ax: Axes | None, width: float = 7.0, height: float = 3.2) -> Axes:
    """The given axes, or those of a new figure."""
    if ax is None:
        # Only here: a figure handed in needs no window system, and so no pyplot.
        from matplotlib import pyplot

        _, ax = pyplot.subplots(figsize=(width, height), layout="constrained")
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def panels(
    figure: Figure | SubFigure | None,
    rows: int,
    columns: int,
    size: tuple[float, float],
    layout: Literal["constrained", "compressed"] = "constrained",
    **options: Any,
) -> np.ndarray:
    """Several axes in the given figure, or in a new one of that size."""
    if figure is None:
        # Only here: a figure handed in needs no window system, and so no pyplot.
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=size, layout=layout)
    grid: np.ndarray = figure.subplots(rows, columns, **options)
    for ax in grid.flat:
        axes(ax)
    return grid


def colour(number: int) -> str:
    """The colour of a curve by its number, from 0 to 5."""
    return CHANNEL_COLOURS[number % len(CHANNEL_COLOURS)]


def shades(count: int) -> np.ndarray:
    """Colours for an ordered family of curves, such as embedding dimensions."""
    from matplotlib import colormaps

    # The lightest end of the map would be lost on white paper.
    return colormaps["viridis"](np.linspace(0, 0.88, count))


def curve(ax: Axes, x: Any, y: Any, label: str = "", **options: Any) -> None:
    """A curve through few values, with markers."""
    look = {"color": BLUE, "marker": "o", "markersize": 4, "linewidth": 1.2}
    ax.plot(x, y, **{**look, "label": label or None, **options})


def level(ax: Axes, value: float, label: str = "") -> None:
    """A horizontal reference line."""
    ax.axhline(value, color=GREY, linewidth=0.8, linestyle=":", label=label or None)


def chosen(ax: Axes, what: str, value: float | None) -> None:
    """Mark the chosen value on the horizontal axis, or say that there is none."""
    if value is None:
        unanswered(ax, f"no {what}")
    else:
        ax.axvline(value, color=VERMILLION, linewidth=1, label=f"{what} {value}", zorder=1)


def title(ax: Axes, words: str, **options: Any) -> None:
    """Write a title above the axes."""
    ax.set_title(words, **{"loc": "left", "fontsize": "medium", **options})


def unanswered(ax: Axes, words: str) -> None:
    """Write above the axes that the result has no answer."""
    title(ax, words, color=VERMILLION)


def legend(ax: Axes, place: str = "best", **options: Any) -> Legend:
    """Add a legend: at a place in the axes, "above" or "beside" them."""
    around: dict[str, dict[str, Any]] = {
        "above": {"loc": "lower left", "bbox_to_anchor": (0, 1), "ncols": 2, "borderaxespad": 0.2},
        "beside": {"loc": "upper left", "bbox_to_anchor": (1.01, 1), "borderaxespad": 0},
    }
    return ax.legend(**{"frameon": False, **around.get(place, {"loc": place}), **options})


def frame(ax: Axes, x: str | None, y: str | None, place: str = "", **options: Any) -> Axes:
    """Label the axes (None leaves a label as it is), with a legend if its place is given."""
    if x is not None:
        ax.set_xlabel(x)
    if y is not None:
        ax.set_ylabel(y)
    if place:
        legend(ax, place, **options)
    return ax


class _TwoAndFive(Formatter):
    """Labels of minor ticks on a short logarithmic axis: 2 and 5 times powers of ten only."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Label of a tick; empty for other multiples, and over two decades and more."""
        low, high = sorted(self.axis.get_view_interval()) if self.axis else (x, x)
        exponent = math.floor(math.log10(x))
        multiple = round(x / 10.0**exponent, 6)
        if multiple not in {2.0, 5.0} or high >= 100 * low:
            return ""
        return rf"${multiple:.0f}\times10^{{{exponent}}}$"


def logarithmic(ax: Axes) -> None:
    """Make the x axis logarithmic, with tick labels that do not overlap over a short range."""
    ax.set_xscale("log")
    ax.xaxis.set_minor_formatter(_TwoAndFive())


def explain(ax: Axes, text: str) -> Axes:
    """Write into empty axes why there is nothing to draw."""
    ax.set(xticks=[], yticks=[])
    ax.spines[:].set_visible(False)
    ax.text(
        0.5,
        0.5,
        textwrap.fill(plain(text, longest=400), 44),
        ha="center",
        va="center",
        transform=ax.transAxes,
        color=GREY,
    )
    return ax


def points(ax: Axes, x: Any, y: Any, **options: Any) -> None:
    """A scatter that shows dense regions."""
    size = len(x)
    alpha = 0.85 if size < 200 else 0.5 if size < RASTER_ABOVE else 0.25
    ax.plot(
        x,
        y,
        **{
            "linestyle": "none",
            "marker": "o",
            "markersize": 4 if size < RASTER_ABOVE else 2.5,
            "markeredgewidth": 0,
            "color": BLUE,
            "alpha": alpha,
            "rasterized": size > RASTER_ABOVE,
            **options,
        },
    )


def cell_edges(values: np.ndarray) -> np.ndarray:
    """Edges of the cells around the values of an axis.

    A single value is given a width too, or its cells would not be seen.
    """
    middle = np.asarray(values, dtype=float)
    if len(middle) == 1:
        half = 0.05 * abs(middle[0]) or 0.5
        return np.array([middle[0] - half, middle[0] + half])
    half = np.diff(middle) / 2
    return np.concatenate(([middle[0] - half[0]], middle[:-1] + half, [middle[-1] + half[-1]]))


def bins(ax: Axes, height: np.ndarray, edges: np.ndarray, **options: Any) -> None:
    """A filled histogram."""
    look = {"color": BLUE, **options}
    ax.stairs(height, edges, fill=True, alpha=0.6, **look)
    # The outline keeps bins in sight that are narrower than a pixel.
    ax.stairs(height, edges, color=look["color"], linewidth=0.8)


def delay_plane(ax: Axes, both: np.ndarray, shown: Any = None, lag: int = 1) -> None:
    """Axes of intervals against earlier ones with the diagonal, over all values or `shown`."""
    span = span_of(both if shown is None else shown)
    ax.plot(span, span, color=GREY, linewidth=0.8, linestyle=":", zorder=1)
    ax.set(xlim=span, ylim=span, aspect="equal")
    seconds(ax.xaxis, "interval $I_k$", both)
    seconds(ax.yaxis, f"interval $I_{{k+{lag}}}$", both)


def span_of(values: np.ndarray) -> tuple[float, float]:
    """Limits that hold all values, at least 4 % apart.

    A perfect period would otherwise be drawn at the scale of its rounding errors.
    """
    low, high = float(values.min()), float(values.max())
    room = max(0.08 * (high - low), 0.02 * abs(high))
    return low - room, high + room


def plain(text: str, longest: int = 48) -> str:
    """Text from a file made fit for a label: short, one line, no mathtext."""
    words = " ".join(text.split())
    shown = words if len(words) <= longest else words[: longest - 3] + "..."
    return shown.replace("$", r"\$")


def called(name: str) -> str:
    """Label of a function's parameter: a Greek letter as a symbol, others in words."""
    words = plain(name.replace("_", " "))
    return rf"$\{name}$" if name in GREEK else words


def with_unit(quantity: str, unit: str) -> str:
    """``quantity [unit]``, or the quantity alone if there is no unit."""
    return plain(f"{quantity} [{unit}]" if unit else quantity)


class PrefixFormatter(Formatter):
    """Format ticks in seconds with a prefixed unit and as many digits as they need."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """Labels of one axis, with equal numbers of decimals."""
        shown = np.asarray(values, float) * self.factor
        size = max(float(np.abs(shown).max(initial=0.0)), 1e-12)
        decimals = next((d for d in range(9) if _is_exact(shown, d, size)), 9)
        return [f"{value:.{decimals}f}".replace("-", "\N{MINUS SIGN}") for value in shown]

    def __call__(self, value: float, position: int | None = None) -> str:
        """One label, for the cursor's read-out."""
        return f"{value * self.factor:.6g}"


def _is_exact(shown: np.ndarray, decimals: int, size: float) -> bool:
    return bool(np.all(np.abs(shown - np.round(shown, decimals)) < 1e-9 * size + 1e-12))


def seconds(axis: Axis, quantity: str, values: Any, in_seconds: bool = True) -> None:
    """Label an axis of times; ticks in s, ms or µs, whichever suits `values`.

    The data stay in seconds, so that limits are set and further curves added in SI units. Where no
    seconds are known, as of a dimensionless oscillator, the label is the quantity alone.
    """
    if not in_seconds:
        axis.set_label_text(quantity)
        return
    finite = np.abs(np.asarray(values, float))
    largest = float(finite.max(initial=0.0))
    factor, unit = 1.0, "s"
    if 0 < largest < 1:
        factor, unit = (1e3, "ms") if largest >= 1e-4 else (1e6, "µs")
    axis.set_major_formatter(PrefixFormatter(factor))
    axis.set_label_text(f"{quantity} [{unit}]")
