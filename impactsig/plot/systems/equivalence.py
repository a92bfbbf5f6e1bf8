"""Where in a plane of parameters two families of oscillators do the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import TwoSlopeNorm

from .._kinds import checked
from ..axes import axes, called, cell_edges, frame, title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...dynamics.contacts.matching import MatchRate

DECADES = 4  # shown on either side of the limit


@checked
def match_rate(result: MatchRate, ax: Axes | None = None) -> Axes:
    """Draw the distance of every cell of a plane, blue where it matches and red where not.

    Parameters
    ----------
    result : MatchRate
        From `impactsig.match_rate`. Cells without a distance stay white.

    See Also
    --------
    impactsig.match_rate

    Examples
    --------
    >>> from impactsig import match_rate, plot, scenes
    >>> def hard(omega, amplitude):
    ...     return scenes.tian(omega, amplitude, "hard")
    >>> ax = plot.match_rate(match_rate(hard, hard, [1.5, 1.6], [0.5, 1.0], workers=1))
    """
    ax = axes(ax, width=5.6, height=4.2)
    limit = np.log10(result.below)
    with np.errstate(divide="ignore"):
        level = np.clip(np.log10(result.distance), limit - DECADES, None)
    top = max(np.nanmax(level, initial=limit), limit) + 1e-9
    mesh = ax.pcolormesh(
        cell_edges(result.x), cell_edges(result.y), level, cmap="RdBu_r", rasterized=True,
        norm=TwoSlopeNorm(limit, limit - DECADES, top),
    )  # fmt: skip
    bar = ax.figure.colorbar(mesh, ax=ax, label="$\\log_{10}$ of the distance $e_c$")
    bar.ax.axhline(limit, color="black", linewidth=1)
    title(ax, f"match in {result.rate:.1%} of the cells")
    return frame(ax, *map(called, result.names))
