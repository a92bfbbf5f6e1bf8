"""Figures over parameters and starts: bifurcation diagrams, periodicity charts, basins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgb
from matplotlib.patches import Patch

from ...errors import InvalidInput
from .._kinds import checked
from ..axes import (
    BLUE,
    CHANNEL_COLOURS,
    GREY,
    RASTER_ABOVE,
    VERMILLION,
    axes,
    called,
    cell_edges,
    frame,
    legend,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...dynamics.diagrams.basins import Basins
    from ...dynamics.diagrams.charts import PeriodicityChart
    from ...dynamics.diagrams.diagrams import BifurcationDiagram
    from ...dynamics.diagrams.response import ResponseSpectrum

LABELS = {
    "displacement": "displacement once a period",
    "velocity": "approach velocity",
    "impacts": "impacts per period",
    "energy": "energy lost per period",
    "kinetic energy": "kinetic energy gained per period",
    "sticking": "share of the time at rest",
    "exponents": "Lyapunov exponents",
}
CLASSES = ("period-1 without impact", "period-1 with impacts", "higher or not closed")
CLASS_COLOURS = ("#F0E6C8", "#56B4E9", "#B8402A")
FEW = 600  # values up to which a single point would hardly be seen
MOST_ORBITS = 12  # kinds of orbit with a colour of their own
NOT_CLOSED, ENDED_EARLY = "#303030", "#FFFFFF"


@checked
def bifurcation_diagram(
    result: BifurcationDiagram,
    ax: Axes | None = None,
    *,
    observe: Literal[
        "displacement", "velocity", "impacts", "energy", "kinetic energy", "sticking", "exponents"
    ] = "displacement",
) -> Axes:
    """Draw a bifurcation diagram: one quantity over the parameter.

    Parameters
    ----------
    result : BifurcationDiagram
        From `impactsig.bifurcation_diagram`.
    observe : str
        "displacement" once a forcing period; approach "velocity"; "impacts" and "energy" lost per
        period, and "kinetic energy" that the body gains; "sticking" share; "exponents".

    Raises
    ------
    InvalidInput
        If the quantity is not known, or exponents were not asked for.

    See Also
    --------
    impactsig.bifurcation_diagram, impactsig.plot.branch

    Examples
    --------
    >>> from impactsig import bifurcation_diagram, plot, scenes
    >>> found = bifurcation_diagram(scenes.karpodinis, [22.0, 22.1])
    >>> ax = plot.bifurcation_diagram(found, observe="velocity")
    """
    if observe not in LABELS:
        raise InvalidInput("observe", observe, f"one of {', '.join(LABELS)}")
    if observe == "exponents" and result.exponents is None:
        raise InvalidInput(
            "observe", observe, "a diagram with exponents", "bifurcation_diagram(exponents=True)"
        )
    ax = axes(ax)
    clouds = {
        "displacement": [strobe[:, 0] for strobe in result.strobe],
        "velocity": list(result.velocity),
    }
    if observe in clouds:
        cloud = clouds[observe]
        x = np.repeat(result.values, [len(some) for some in cloud])
        y = np.concatenate([*cloud, []])
        # The many points of chaos are drawn lighter than the few of an orbit that has closed.
        chaotic = np.repeat(result.periods == 0, [len(some) for some in cloud])
        for some, alpha in ((chaotic, 0.4), (~chaotic, 1.0)):
            ax.plot(
                x[some], y[some], linestyle="none", color=BLUE, alpha=alpha,
                marker="," if len(result.values) > FEW else "o", markersize=1.5,
                markeredgewidth=0, rasterized=len(x) > RASTER_ABOVE,
            )  # fmt: skip
    elif observe == "exponents" and result.exponents is not None:
        shown = np.where(np.isfinite(result.exponents), result.exponents, np.nan)
        ax.axhline(0, color=GREY, linewidth=0.6)
        for k, (colour, name) in enumerate(((BLUE, "greater"), (VERMILLION, "lesser"))):
            ax.plot(result.values, shown[:, k], color=colour, linewidth=0.8, label=name)
        legend(ax, "above")
    else:
        line = {
            "impacts": result.impacts_per_period,
            "energy": result.energy_per_period,
            "kinetic energy": result.kinetic_energy_per_period,
            "sticking": result.sticking,
        }[observe]
        ax.plot(result.values, line, color=BLUE, linewidth=0.8)
    ax.margins(x=0)
    return frame(ax, called(result.parameter), LABELS[observe])


@checked
def response_spectrum(result: ResponseSpectrum, ax: Axes | None = None) -> Axes:
    """Draw greatest and least displacement over the parameter.

    Parameters
    ----------
    result : ResponseSpectrum
        From `impactsig.response_spectrum`.

    See Also
    --------
    impactsig.response_spectrum, impactsig.plot.bifurcation_diagram

    Examples
    --------
    >>> from impactsig import plot, response_spectrum, scenes
    >>> ax = plot.response_spectrum(response_spectrum(scenes.karpodinis, [22.0, 22.1]))
    """
    ax = axes(ax)
    for extreme, colour, name in (
        (result.greatest, BLUE, "greatest"),
        (result.least, VERMILLION, "least"),
    ):
        ax.plot(result.values, extreme, color=colour, linewidth=1.0, label=name)
    ax.margins(x=0)
    return frame(ax, called(result.parameter), "displacement", "above")


@checked
def periodicity_chart(
    result: PeriodicityChart,
    ax: Axes | None = None,
    *,
    colours: Literal["orbits", "classes"] = "orbits",
) -> Axes:
    """Draw period(m, n), or the classes, over both parameters.

    Parameters
    ----------
    result : PeriodicityChart
        From `impactsig.periodicity_chart`.
    colours : {"orbits", "classes"}
        A colour for each of the twelve commonest (m, n), others grey, what has not closed black;
        or the three classes of [BegleyVirgin1998]_.

    Raises
    ------
    InvalidInput
        If `colours` is neither.

    See Also
    --------
    impactsig.periodicity_chart, impactsig.plot.basins

    Examples
    --------
    >>> from impactsig import periodicity_chart, plot, scenes
    >>> def beam(frequency, amplitude):
    ...     return scenes.karpodinis(frequency, amplitude=amplitude)
    >>> chart = periodicity_chart(beam, [22.0, 22.1], [0.2, 0.25], workers=1)
    >>> ax = plot.periodicity_chart(chart, colours="classes")
    """
    if colours == "classes":
        codes = result.classes
        names = list(CLASSES)
        palette = list(CLASS_COLOURS)
    elif colours == "orbits":
        codes, names, palette = _orbits(result)
    else:
        raise InvalidInput("colours", colours, '"orbits" or "classes"')
    ax = axes(ax, width=6.4, height=4.2)
    shown = np.where(result.failed, len(names), codes)
    if result.failed.any():
        names, palette = [*names, "ended early"], [*palette, ENDED_EARLY]
    _cells(ax, result.x, result.y, shown, palette)
    _key(ax, names, palette, np.unique(shown))
    return frame(ax, *map(called, result.names))


@checked
def basins(result: Basins, ax: Axes | None = None) -> Axes:
    """Draw basins of attraction, with the stroboscopic points of the attractors.

    Parameters
    ----------
    result : Basins
        From `impactsig.basins_of_attraction`.

    See Also
    --------
    impactsig.basins_of_attraction

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import basins_of_attraction, plot, scenes
    >>> walls = scenes.begley_virgin(gamma=1.338, sigma=1.6, friction=0.05)
    >>> found = basins_of_attraction(walls, np.linspace(-1.5, 1.5, 3), np.linspace(-1, 1, 3))
    >>> ax = plot.basins(found)
    """
    ax = axes(ax, width=6.4, height=4.2)
    count = min(len(result.attractors), MOST_ORBITS)
    palette = [*_palette(count), GREY, NOT_CLOSED]
    names = [
        f"({attractor.impacts}, {attractor.periods}): {share:.1%}"
        for attractor, share in zip(result.attractors, result.shares, strict=True)
    ][:count]
    names += [f"{len(result.attractors) - count} others", f"not closed: {result.open_share:.1%}"]
    shown = np.where(result.labels >= count, count, result.labels)
    shown = np.where(result.labels < 0, count + 1, shown)
    _cells(ax, result.x, result.v, shown, palette)
    ax.set(xlim=ax.get_xlim(), ylim=ax.get_ylim())  # those of the starts, whatever is drawn on them
    for attractor in result.attractors:
        ax.plot(
            *attractor.strobe[:, :2].T, "o", color="white", markeredgecolor="black", markersize=4
        )
    _key(ax, names, palette, np.unique(shown))
    return frame(ax, "displacement at the start", "velocity at the start")


def _orbits(result: PeriodicityChart) -> tuple[np.ndarray, list[str], list[str]]:
    """Codes of the most common orbits, with labels and colours."""
    pairs = np.stack([result.impacts, result.periods], axis=-1)
    kinds, code, counts = np.unique(
        pairs.reshape(-1, 2), axis=0, return_inverse=True, return_counts=True
    )
    closed = kinds[:, 1] > 0
    common = np.argsort(-np.where(closed, counts, 0), kind="stable")[:MOST_ORBITS]
    common = common[closed[common]]
    common = common[np.lexsort((kinds[common, 0], kinds[common, 1]))]
    rank = np.full(len(kinds), len(common))
    rank[common] = np.arange(len(common))
    rank[~closed] = len(common) + 1
    names = [f"({m}, {n})" for m, n in kinds[common]]
    return (
        rank[code.ravel()].reshape(result.periods.shape),
        [*names, "other closed", "not closed"],
        [*_palette(len(common)), GREY, NOT_CLOSED],
    )


def _palette(count: int) -> list[str]:
    """Colours for so many kinds: distinct ones first, then lighter ones."""
    lighter = ["#{:02X}{:02X}{:02X}".format(*(int(255 * (0.55 + 0.45 * c)) for c in to_rgb(own)))
               for own in CHANNEL_COLOURS]  # fmt: skip
    return [*CHANNEL_COLOURS, *lighter][:count]


def _cells(ax: Axes, x: np.ndarray, y: np.ndarray, codes: np.ndarray, palette: list[str]) -> None:
    ax.pcolormesh(
        cell_edges(x), cell_edges(y), codes, rasterized=True, cmap=ListedColormap(palette),
        norm=BoundaryNorm(np.arange(len(palette) + 1) - 0.5, len(palette)),
    )  # fmt: skip


def _key(ax: Axes, names: list[str], palette: list[str], present: np.ndarray) -> None:
    """Legend of the colours, beside the axes."""
    legend(ax, "beside", handles=[Patch(color=palette[k], label=names[k]) for k in present])
