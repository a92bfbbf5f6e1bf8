"""Diagrams of experiments: the impacts over the parameter."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.markers import TICKLEFT, TICKRIGHT

from ..errors import InvalidInput
from ._kinds import checked, refuse_others
from .axes import (
    BLUE,
    CHANNEL_COLOURS,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RASTER_ABOVE,
    SKY,
    VERMILLION,
    axes,
    frame,
    legend,
    seconds,
    with_unit,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..dynamics.diagrams.diagrams import BifurcationDiagram
    from ..experiment.experiment import Experiment
    from ..experiment.points import Point

LABELS = {
    "interval": "interval",
    "peak": "peak",
    "contact_time": "contact time",
    "impulse": "impulse",
    "phase": "phase of impact [forcing periods]",
    "impacts_per_period": "impacts per forcing period",
    "time_in_contact": "share of the time in contact",
    "dimension": "correlation dimension",
    "period": "",
}
OF_IMPACTS = ("interval", "peak", "contact_time", "impulse", "phase")
SIMULATED = ("peak", "impacts_per_period", "period")
"""What a bifurcation diagram has a counterpart of."""
BRANCH_COLOURS = {"up": BLUE, "down": VERMILLION}
OTHER_COLOURS = (GREEN, PURPLE, ORANGE, SKY)  # of branches in turn that have no direction
BRANCH_MARKS = {"up": TICKLEFT, "down": TICKRIGHT}
"""Of every impact a stroke to one side of its value, so that no branch hides another."""
STROKE = 0.4
"""Length of such a stroke, of the distance between neighbouring values."""
SHORTEST, LONGEST = 1.5, 6.0  # [pt]
APERIODIC, SILENT, UNKNOWN = "#303030", "#E4E4E4", "#FFFFFF"
MOST_NAMED = 10
"""Motions with an entry in the legend."""
MANY_COLUMNS = 3.2
"""Width of the axes from which on four columns of motions stand above them [in]."""

Observed = Literal[
    "interval", "peak", "contact_time", "impulse", "phase", "impacts_per_period",
    "time_in_contact", "dimension", "period",
]  # fmt: skip


@checked
def experiment(
    result: Experiment,
    observe: Observed = "interval",
    ax: Axes | None = None,
    *,
    simulated: BifurcationDiagram | Sequence[BifurcationDiagram] = (),
) -> Axes:
    """Draw a quantity over the parameter of an experiment, each branch in its colour.

    Parameters
    ----------
    result : Experiment
        From `impactsig.Experiment.read`.
    observe : str
        For every impact: "interval" (to the next impact), "peak", "contact_time", "impulse" or
        "phase", drawn as a dash to the left of the parameter value on the branch "up" and to the
        right on the branch "down". For every run: "impacts_per_period", "time_in_contact",
        "dimension" with its confidence interval, or "period", a bar whose colour is the period(m,
        n).
    simulated : BifurcationDiagram or sequence of it
        Drawn in grey behind the measurement where `observe` is "impacts_per_period" or "peak" (its
        approach velocities, scaled to have the same median), as bars of their own for "period".

    Raises
    ------
    InvalidInput
        If the quantity is unknown, was not measured, or is not part of a bifurcation diagram.

    See Also
    --------
    impactsig.Experiment, impactsig.plot.bifurcation_diagram

    Examples
    --------
    >>> import tempfile
    >>> from impactsig import Experiment, plot
    >>> kept = tempfile.mkdtemp()
    >>> runs = Experiment.read("data_samples/experiment", directory=kept, workers=1, progress=False)
    >>> plot.experiment(runs, "period").get_xlabel()
    'frequency [Hz]'
    """
    if observe not in LABELS:
        raise InvalidInput("observe", observe, f"one of {', '.join(LABELS)}")
    diagrams: list[Any] = list(simulated) if isinstance(simulated, Sequence) else [simulated]
    for one in diagrams:
        refuse_others("simulated", one, ["BifurcationDiagram"])
    if diagrams and observe not in SIMULATED:
        raise InvalidInput(
            "simulated", simulated, "nothing",
            f"A bifurcation diagram has a counterpart of {', '.join(SIMULATED)} only",
        )  # fmt: skip
    ax = axes(ax)
    if observe == "period":
        return _bars(result, ax, diagrams)
    if observe in OF_IMPACTS:
        _clouds(result, ax, observe, diagrams)
    else:
        _lines(result, ax, observe, diagrams)
    known = np.unique(result.values[np.isfinite(result.values)])
    if len(known) > 1:  # all runs, those without impacts too, as the bars of the periods have them
        ax.set_xlim(1.5 * known[0] - 0.5 * known[1], 1.5 * known[-1] - 0.5 * known[-2])
    return frame(ax, with_unit(result.parameter, result.unit), None)


def _clouds(
    result: Experiment, ax: Axes, observe: str, diagrams: Sequence[BifurcationDiagram]
) -> None:
    clouds = list(result.clouds(observe))
    total = sum(len(cloud) for _, cloud in clouds)
    if not total:
        raise InvalidInput("observe", observe, "a quantity that was measured")
    if diagrams:
        _scaled_velocities(ax, clouds, diagrams)
    stroke = _stroke(ax, len({point.value for point, _ in clouds}))
    for branch, colour in _colours(point.branch for point, _ in clouds).items():
        own = [(point, cloud) for point, cloud in clouds if point.branch == branch]
        x = np.concatenate([np.full(len(cloud), point.value) for point, cloud in own])
        y = np.concatenate([cloud for _, cloud in own])
        marks: dict[str, Any] = {"marker": "o", "markersize": 2.2, "markeredgewidth": 0}
        if branch in BRANCH_MARKS:
            marks = {"marker": BRANCH_MARKS[branch], "markersize": stroke, "markeredgewidth": 0.9}
        ax.plot(
            x, y, linestyle="none", color=colour, alpha=0.5, label=branch or None,
            rasterized=len(x) > RASTER_ABOVE, **marks,
        )  # fmt: skip
    _branches(ax, 2)
    if observe in ("interval", "contact_time"):
        seconds(ax.yaxis, LABELS[observe], np.concatenate([cloud for _, cloud in clouds]))
        return
    unit = next((one for one in result.to_frame()["unit"] if one), "")
    units = {"peak": unit, "impulse": f"{unit} s" if unit else ""}
    ax.set_ylabel(
        with_unit(LABELS[observe], units[observe]) if observe in units else LABELS["phase"]
    )


def _stroke(ax: Axes, values: int) -> float:
    """Length of the stroke of an impact [pt], where there are so many values."""
    return float(np.clip(STROKE * 72 * _inches(ax) / max(values, 1), SHORTEST, LONGEST))


def _inches(ax: Axes) -> float:
    """Width of the axes."""
    return float(ax.bbox.transformed(ax.figure.dpi_scale_trans.inverted()).width)


def _scaled_velocities(
    ax: Axes,
    clouds: list[tuple[Point, np.ndarray]],
    diagrams: Sequence[BifurcationDiagram],
) -> None:
    """Approach velocities in the unit of the peaks, by the median ratio at values of both."""
    values, medians = np.array([(p.value, np.median(y)) for p, y in clouds if len(y)]).T
    order = np.argsort(values)
    ratios = [
        np.interp(value, values[order], medians[order]) / np.median(velocity)
        for one in diagrams
        for value, velocity in zip(one.values, one.velocity, strict=True)
        if values.min() <= value <= values.max() and len(velocity)
    ]
    if not ratios:
        raise InvalidInput("simulated", diagrams, "impacts at the values that were measured")
    gain = float(np.median(ratios))
    for one in diagrams:
        x = np.repeat(one.values, [len(velocity) for velocity in one.velocity])
        y = gain * np.concatenate([*one.velocity, np.empty(0)])
        ax.plot(
            x, y, linestyle="none", marker="o", markersize=3.4, markeredgewidth=0, color=GREY,
            alpha=0.25, label="simulated" if one is diagrams[0] else None, zorder=1,
            rasterized=len(x) > RASTER_ABOVE,
        )  # fmt: skip


def _lines(
    result: Experiment, ax: Axes, observe: str, diagrams: Sequence[BifurcationDiagram]
) -> None:
    table = result.to_frame()
    values = table[observe].to_numpy(float)
    if not np.isfinite(values).any():
        remedy = "report = {dimension = true} in the rig" if observe == "dimension" else ""
        raise InvalidInput("observe", observe, "a quantity that was measured", remedy)
    for one in diagrams:
        ax.plot(
            one.values, one.impacts_per_period, color=GREY, linewidth=2.5, alpha=0.5,
            label="simulated" if one is diagrams[0] else None,
        )  # fmt: skip
    branches = np.array(result.branches, object)
    for k, (branch, colour) in enumerate(_colours(result.branches).items()):
        own = branches == branch
        ax.plot(
            result.values[own], values[own], color=colour, marker="o",
            markersize=2.5 if k else 5.5, linewidth=0.8 if k else 2.4, label=branch or None,
        )  # fmt: skip
        if observe == "dimension":
            low, high = (table[f"dimension_{end}"].to_numpy(float)[own] for end in ("low", "high"))
            ax.vlines(result.values[own], low, high, color=colour, linewidth=0.8)
    _branches(ax, 1)
    ax.set_ylabel(LABELS[observe])


def _branches(ax: Axes, scale: float) -> None:
    if ax.get_legend_handles_labels()[1]:
        found = legend(ax, "above", ncols=3, markerscale=scale)
        for handle in found.legend_handles:
            if handle is not None:
                handle.set_alpha(1)


def _bars(result: Experiment, ax: Axes, diagrams: Sequence[BifurcationDiagram]) -> Axes:
    """Horizontal bars for each branch, coloured by the motion."""
    from matplotlib.patches import Patch

    points = result.points()
    bars = [
        (branch or "measured", [(one.value, one.motion) for one in points if one.branch == branch])
        for branch in dict.fromkeys(one.branch for one in points)
    ]
    bars += [
        (_called(one, diagrams), [(float(x), _motion(one, k)) for k, x in enumerate(one.values)])
        for one in diagrams
    ]
    motions = [motion for _, bar in bars for _, motion in bar]
    often = sorted(dict.fromkeys(motions), key=lambda one: -motions.count(one))
    periods = [one for one in often if one.startswith("period(")]
    colours = dict(zip(periods, CHANNEL_COLOURS * len(periods), strict=False))
    colours |= {"aperiodic": APERIODIC, "no impacts": SILENT, "unknown": UNKNOWN}
    for row, (_, bar) in enumerate(bars):
        known = sorted(one for one in bar if np.isfinite(one[0]))
        if not known:
            continue
        x = np.array([value for value, _ in known])
        inner = 0.5 * (x[1:] + x[:-1])
        step = float(np.median(np.diff(x))) if len(x) > 1 else 1.0
        edges = np.concatenate(([x[0] - step / 2], inner, [x[-1] + step / 2]))
        # One bar for neighbours of one motion: no gaps show between them.
        first = [k for k in range(len(x)) if k == 0 or known[k][1] != known[k - 1][1]]
        ends = edges[[*first[1:], len(x)]]
        ax.barh(
            np.full(len(first), row), ends - edges[first], left=edges[first], height=0.7,
            color=[colours[known[k][1]] for k in first],
        )  # fmt: skip
    handles = [
        Patch(facecolor=colours[one], edgecolor=GREY, linewidth=0.4, label=one)
        for one in [*often[:MOST_NAMED]]
    ]
    ax.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(0, 1), frameon=False,
        ncols=4 if _inches(ax) > MANY_COLUMNS else 3, borderaxespad=0.2, fontsize="small",
        handlelength=1.2, columnspacing=1.2,
    )  # fmt: skip
    ax.set(yticks=range(len(bars)), yticklabels=[name for name, _ in bars])
    ax.invert_yaxis()
    ax.margins(x=0)
    return frame(ax, with_unit(result.parameter, result.unit), None)


def _called(diagram: BifurcationDiagram, diagrams: Sequence[BifurcationDiagram]) -> str:
    """Labels of several diagrams by their direction."""
    if len(diagrams) == 1:
        return "simulated"
    return f"simulated {'up' if diagram.values[-1] >= diagram.values[0] else 'down'}"


def _motion(diagram: BifurcationDiagram, k: int) -> str:
    """The motion of a simulation, named as in an experiment."""
    if not diagram.periods[k]:
        return "aperiodic"
    if not diagram.impacts[k]:
        return "no impacts"
    return f"period({diagram.impacts[k]},{diagram.periods[k]})"


def _colours(branches: Iterable[str]) -> dict[str, str]:
    """Of each branch its colour."""
    names = dict.fromkeys(branches)
    others = [one for one in names if one and one not in BRANCH_COLOURS]
    own = dict(zip(others, OTHER_COLOURS * len(others), strict=False))
    return {one: BRANCH_COLOURS.get(one) or own.get(one, BLUE) for one in names}
