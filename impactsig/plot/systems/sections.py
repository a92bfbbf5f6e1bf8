"""Points of a motion on a section."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import axes, explain, frame, legend, points
from ..stops import stop_colour, stop_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...dynamics.sections.sections import Section


@checked
def section(result: Section, ax: Axes | None = None) -> Axes:
    """Draw velocity over the phase of the forcing; impacts of several stops in several colours.

    Parameters
    ----------
    result : Section
        From `impact_map` or `displacement_section`.

    See Also
    --------
    impactsig.impact_map, impactsig.displacement_section

    Examples
    --------
    >>> from impactsig import impact_map, plot, scenes, simulate
    >>> ax = plot.section(impact_map(simulate(scenes.karpodinis(20.1), periods=100, transient=200)))
    """
    ax = axes(ax, width=5.2, height=4.0)
    if not len(result):
        nothing = "no impacts" if result.kind == "impacts" else "the displacement is not crossed"
        return explain(ax, nothing)
    # A cloud about phase 0 is not torn in two.
    low = 0.0
    if np.abs(result.phase - math.pi).min() > 1.0:
        low = -math.pi
    phase = (result.phase - low) % (2 * math.pi) + low
    stops = np.unique(result.stop)
    for stop in stops:
        own = result.stop == stop
        look = {"color": stop_colour(stop), "label": stop_name(stop)}
        points(ax, phase[own], result.velocity[own], **look)
    if len(stops) > 1:
        legend(ax, fontsize="small")
    names = ["0", "π/2", "π", "3π/2", "2π"] if low == 0 else ["−π", "−π/2", "0", "π/2", "π"]
    ax.set_xlim(low, low + 2 * math.pi)
    ax.set_xticks(np.linspace(low, low + 2 * math.pi, 5), names)
    impacts = result.kind == "impacts"
    if impacts:
        ax.set_ylim(bottom=0)
    return frame(ax, "phase of the forcing [rad]", "approach velocity" if impacts else "velocity")
