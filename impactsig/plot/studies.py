"""A parameter study: a curve over one parameter, a map over two."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import ListedColormap

from ..errors import InvalidInput
from ._kinds import checked
from .axes import (
    BLUE,
    CHANNEL_COLOURS,
    RASTER_ABOVE,
    axes,
    cell_edges,
    explain,
    plain,
    span_of,
    title,
    with_unit,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..studies.study import Study


@checked
def parameter_study(
    study: Study,
    observable: str | None = None,
    ax: Axes | None = None,
    *,
    at: Mapping[str, float] | None = None,
) -> Axes:
    """Draw an observable over the parameters of a study: one as a curve, two as a map.

    Where there is no result, nothing is drawn. A parameter of one value is no axis. An observable
    of several values a cell, such as stroboscopic points, is drawn as points over one parameter.

    Parameters
    ----------
    study : Study
        From `impactsig.sweep` or `impactsig.open_study`.
    observable : str, optional
        Name of the observable; optional if there is only one.
    at : mapping of str to float, optional
        Parameters that are held, each at the value on its axis next to this.

    Raises
    ------
    InvalidInput
        If there is no such observable or parameter, or more than two parameters are left.

    See Also
    --------
    impactsig.sweep, impactsig.open_study

    Examples
    --------
    >>> from impactsig import plot, sweep
    >>> study = sweep(lambda a, b: a * b, {"a": [1, 2], "b": [3, 4, 5]})
    >>> ax = plot.parameter_study(study)
    """
    if not study.observables:
        return explain(axes(ax), "nothing has been computed yet")
    if observable is None:
        if len(study.observables) > 1:
            raise InvalidInput("observable", None, f"one of {', '.join(study.observables)}")
        observable = study.observables[0]
    values = study[observable]
    if values.dtype.kind == "c":
        raise InvalidInput("observable", observable, "real numbers, to be drawn")
    values = np.where(_known(values), values, np.nan)
    place, left, held = _section(study, at or {})
    values = values[place]
    if values.ndim > len(left) == 2:
        raise InvalidInput("observable", observable, "one number a cell, to be drawn as a map")
    ax = axes(ax)
    attributes = study.attributes.get(observable, {})
    words = with_unit(
        attributes.get("long_name", observable.replace("_", " ")), attributes.get("units", "")
    )
    if len(left) == 1:
        _curve(study, left[0], values, ax)
        ax.set_ylabel(words)
        _name_flags(ax.yaxis, attributes)
    else:
        bar = _map(study, left, values, ax)
        bar.set_label(words)
        if "flag_values" in attributes:
            flags = list(attributes["flag_values"])
            bar.mappable.set(cmap=ListedColormap(CHANNEL_COLOURS[: len(flags)]))
            bar.mappable.set_clim(min(flags) - 0.5, max(flags) + 0.5)
        _name_flags(bar.ax.yaxis, attributes)
    if held:
        title(ax, plain(", ".join(held)))
    return ax


def _section(study: Study, at: Mapping[str, float]) -> tuple[tuple[Any, ...], list[str], list[str]]:
    """The chosen section: indices, remaining parameters, and the values of the others."""
    place: list[Any] = []
    left, held = [], []
    names = ", ".join(study.parameters)
    for name in at:
        if name not in study.parameters:
            raise InvalidInput("at", name, f"one of {names}")
    for name, points in study.parameters.items():
        if name in at or len(points) == 1 < study.done.size:
            nearest = int(np.abs(points - at.get(name, points[0])).argmin())
            place.append(nearest)
            held.append(f"{name} = {points[nearest]:.6g}")
        else:
            place.append(slice(None))
            left.append(name)
    if len(left) not in (1, 2):
        raise InvalidInput(
            "at", at, "values for all parameters but one or two", f"The parameters are {names}"
        )
    return tuple(place), left, held


def _known(values: np.ndarray) -> Any:
    """Mask of the cells with a result; see `Study` for the others."""
    if values.dtype.kind == "f":
        return np.isfinite(values)
    limits = np.iinfo(values.dtype)
    return values != (limits.max if values.dtype.kind == "u" else limits.min)


def _curve(study: Study, name: str, values: np.ndarray, ax: Axes) -> None:
    x = study.parameters[name]
    several = values.ndim > 1
    points = values.reshape(len(x), -1)
    dense = points.size > RASTER_ABOVE
    ax.plot(
        np.repeat(x, points.shape[1]),
        points.ravel(),
        "." if several or dense else ".-",
        color=BLUE,
        markersize=1.5 if dense else 3,
        linewidth=0.7,
        markeredgewidth=0,
        rasterized=dense,
    )
    ax.set(xlabel=_label(study, name), xlim=span_of(x))
    ax.grid(alpha=0.25, linewidth=0.5)


def _map(study: Study, names: list[str], values: np.ndarray, ax: Axes) -> Any:
    """The first axis to the right."""
    right, up = names
    mesh = ax.pcolormesh(
        cell_edges(study.parameters[right]),
        cell_edges(study.parameters[up]),
        values.T,
        cmap="viridis",
        rasterized=True,
    )
    ax.set(xlabel=_label(study, right), ylabel=_label(study, up))
    ax.spines[["top", "right"]].set_visible(True)
    return ax.figure.colorbar(mesh, ax=ax)


def _label(study: Study, name: str) -> str:
    attributes = study.attributes.get(name, {})
    return with_unit(
        attributes.get("long_name", name.replace("_", " ")), attributes.get("units", "")
    )


def _name_flags(axis: Any, attributes: Mapping[str, Any]) -> None:
    """Label the ticks of a flag observable with the meanings of the flags."""
    if "flag_values" in attributes:
        words = str(attributes["flag_meanings"]).replace("_", "\n").split(" ")
        axis.set_ticks(list(attributes["flag_values"]), labels=words)
