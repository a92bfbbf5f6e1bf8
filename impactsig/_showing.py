"""Representation of results: one line in a console, a small picture in a notebook."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, is_dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any

from .errors import ImpactsigError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

LONGEST = 300  # characters of a line
FIELDS = 6  # that a line has room for
SIZE, DPI = (4.2, 2.6), 80  # of a picture [inches], [1/inch]


class Shown:
    """Base of results: shown as a line in a console, as a line and a picture in a notebook.

    The line is what `describe`, which `str` returns, or another `str` says, else the fields, arrays
    by their shapes. The picture is what `plot` draws; a result that is not drawn shows a table of
    its fields. A class keeps a `__repr__` of its own.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if cls.__repr__ is Shown.__repr__:
            cls.__repr__ = Shown.__repr__  # type: ignore[method-assign]  # before @dataclass does

    def __repr__(self) -> str:
        name = type(self).__name__
        if hasattr(self, "describe"):
            words = self.describe()
        elif type(self).__str__ is not Shown.__str__:
            words = str(self)
        else:
            brief = [f"{field}={value}" for field, value in _brief(self)]
            words = ", ".join(brief[:FIELDS]) + (", ..." if len(brief) > FIELDS else "")
        words = " ".join(words.split())
        return f"{name}({words if len(words) <= LONGEST else words[: LONGEST - 3] + '...'})"

    def __str__(self) -> str:
        return str(self.describe()) if hasattr(self, "describe") else repr(self)

    def _repr_html_(self) -> str:
        line = f"<code>{html.escape(repr(self))}</code>"
        drawn = picture(self) if hasattr(self, "plot") else ""
        return f"<div>{line}<br>{drawn or _table(self)}</div>"


def drawn_by(name: str, what: str) -> Callable[..., Axes]:
    """The method `plot` of results that a function of `impactsig.plot` draws on axes."""

    def plot(self: Any, ax: Axes | None = None, **options: Any) -> Axes:
        axes: Axes = figures(name)(self, ax, **options)
        return axes

    plot.__doc__ = f"Draw {what}; see `impactsig.plot.{name}`."
    return plot


def drawn_on_figure_by(name: str, what: str) -> Callable[..., Any]:
    """As `drawn_by`, where the function takes a figure."""

    def plot(self: Any, figure: Figure | SubFigure | None = None) -> Any:
        return figures(name)(self, figure)

    plot.__doc__ = f"Draw {what}; see `impactsig.plot.{name}`."
    return plot


def figures(name: str) -> Callable[..., Any]:
    """A function of `impactsig.plot`, which is imported when something is drawn, never before."""
    from . import plot

    found: Callable[..., Any] = getattr(plot, name)
    return found


def _brief(result: Any) -> list[tuple[str, str]]:
    """Names and short values of the fields that are set, in order."""
    if not is_dataclass(result):
        return []
    named = [(one.name, getattr(result, one.name)) for one in fields(result)]
    return [(name, _short(value)) for name, value in named if value is not None]


def _short(value: Any) -> str:
    """A number or a short text as it is; type and size of anything longer."""
    shape = getattr(value, "shape", None)
    if shape:
        return f"array of {' x '.join(map(str, shape))}"
    if isinstance(value, bool | str):
        return repr(value) if len(str(value)) <= 40 else repr(str(value)[:37] + "...")
    if isinstance(value, int | float) or shape == ():
        return f"{value:.6g}"
    if isinstance(value, tuple | list | dict):
        small = isinstance(value, tuple) and 0 < len(value) <= 3
        if small and all(isinstance(one, int | float) for one in value):
            return f"({', '.join(_short(one) for one in value)})"
        return f"{type(value).__name__} of {len(value)}"
    return type(value).__name__


def _table(result: Any) -> str:
    if isinstance(result, Sequence) and not is_dataclass(result):
        return html_table((str(k), repr(one)) for k, one in enumerate(result[:FIELDS]))
    return html_table(_brief(result))


def html_table(pairs: Iterable[tuple[str, str]]) -> str:
    """Names and values as an HTML table; empty if there are none."""
    rows = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
        for name, value in pairs
    )
    return f"<table>{rows}</table>" if rows else ""


def picture(result: Any) -> str:
    """The result's plot as a small inline image; empty if it cannot be drawn."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    try:
        if "figure" in signature(result.plot).parameters:
            figure.set_size_inches(1.6 * SIZE[0], 1.6 * SIZE[1])
            result.plot(figure=figure)
        else:
            result.plot(ax=figure.subplots())
    except ImpactsigError:
        return ""
    drawn = io.BytesIO()
    # A legend or a title may be wider than such small axes.
    figure.savefig(drawn, format="png", bbox_inches="tight", pad_inches=0.05)
    data = base64.b64encode(drawn.getvalue()).decode()
    name = html.escape(type(result).__name__)
    return f'<img alt="Figure of this {name}" src="data:image/png;base64,{data}">'
