"""Periodic orbits along a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from .._kinds import checked
from ..axes import BLUE, GREEN, ORANGE, PURPLE, VERMILLION, axes, frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...dynamics.periodic.branches import Branch

MARKS = {
    "fold": ("s", VERMILLION),
    "period doubling": ("^", ORANGE),
    "grazing": ("o", PURPLE),
}


@checked
def branch(
    result: Branch,
    ax: Axes | None = None,
    *,
    observe: Literal["displacement", "approach velocity", "multiplier"] = "displacement",
    parameter: str = "parameter",
) -> Axes:
    """Draw a branch of periodic orbits: stable ones solid, unstable ones dashed, special points.

    Parameters
    ----------
    result : Branch
        From `continue_orbit`.
    observe : {"displacement", "approach velocity", "multiplier"}
        Displacement on the section, the least approach velocity, or the modulus of the greater
        multiplier.
    parameter : str
        What to call the parameter.

    See Also
    --------
    impactsig.continue_orbit, impactsig.plot.bifurcation_diagram

    Examples
    --------
    >>> from impactsig import continue_orbit, plot, scenes
    >>> branch = continue_orbit(scenes.karpodinis, (22.1, 22.0))
    >>> ax = plot.branch(branch, parameter="frequency [Hz]")
    """
    ax = axes(ax, width=6.0, height=4.0)
    values = {
        "displacement": result.state[:, 0],
        "approach velocity": (
            result.approach_velocity.min(axis=1) if result.impacts else np.full(len(result), np.nan)
        ),
        "multiplier": np.abs(result.multipliers).max(axis=1),
    }[observe]
    stable = result.stable
    # A segment is as stable as both of its ends; the section must not have moved between them.
    both = stable[1:] & stable[:-1]
    moved = np.diff(result.phase) != 0
    for wanted, style, colour, label in (
        (True, "-", BLUE, "stable"),
        (False, "--", GREEN, "unstable"),
    ):
        shown = (both == wanted) & ~(moved & (observe == "displacement"))
        if not shown.any():
            continue
        x = np.full((len(shown), 3), np.nan)
        y = x.copy()
        x[shown, 0], x[shown, 1] = result.parameter[:-1][shown], result.parameter[1:][shown]
        y[shown, 0], y[shown, 1] = values[:-1][shown], values[1:][shown]
        joined = np.isnan(x[:-1, 2]) & shown[:-1] & shown[1:]
        keep = np.ones(x.size, bool)
        keep[2:-1:3][joined] = False
        ax.plot(x.ravel()[keep], y.ravel()[keep], style, color=colour, lw=1.4, label=label)
    for kind, (mark, colour) in MARKS.items():
        points = [point for point in result.special if point.kind == kind]
        if points:
            at = [values[point.index] for point in points]
            places = [point.parameter for point in points]
            ax.plot(places, at, mark, color=colour, label=kind, zorder=3)
    names = {"displacement": "displacement on the section", "multiplier": "|multiplier|"}
    label = names.get(observe, "least approach velocity")
    return frame(ax, parameter, label, "best", fontsize="small")
