"""How Lyapunov exponents converge."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import axes, colour, explain, frame, level, title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...dynamics.tangents.lyapunov import LyapunovSpectrum


@checked
def lyapunov_convergence(result: LyapunovSpectrum, ax: Axes | None = None) -> Axes:
    """Draw the deviation of the running estimates of all exponents from the final values.

    Deviations are drawn so that exponents of different sizes share an axis. The bands are two
    standard errors on either side. If deviations collapsed, the estimates are those between
    collapses, as the title states.

    Parameters
    ----------
    result : LyapunovSpectrum
        From `lyapunov_spectrum`.

    See Also
    --------
    impactsig.lyapunov_spectrum

    Examples
    --------
    >>> from impactsig import lyapunov_spectrum, plot, scenes
    >>> ax = plot.lyapunov_convergence(lyapunov_spectrum(scenes.karpodinis(20.1), periods=200))
    """
    ax = axes(ax, width=6.4, height=3.8)
    if not len(result.time):
        return explain(ax, f"no exponents: {result.status}")
    off = result.curve - result.between_collapses
    for k, (value, error) in enumerate(zip(result.between_collapses, result.error, strict=True)):
        label = rf"$\lambda_{{{k + 1}}}$ = {value:.5g} ± {error:.1g}"
        ax.plot(result.time, off[:, k], color=colour(k), linewidth=1.2, label=label)
        if np.isfinite(error):
            ax.axhspan(-2 * error, 2 * error, color=colour(k), alpha=0.12, linewidth=0)
    level(ax, 0.0)
    late = np.abs(off[len(off) // 8 :]).max()
    if np.isfinite(late):  # the first estimates may be far off
        room = 1.1 * max(late, 2 * np.nanmax(result.error, initial=0.0), 1e-12)
        ax.set_ylim(-room, room)
    if result.collapses:
        count = f"{result.collapses} collapse{'s' * (result.collapses > 1)}"
        title(ax, f"between {count} of the neighbours")
    ax.set_xlim(0.0, result.time[-1])
    along = "time, in the system's unit"
    return frame(ax, along, "estimate less final value", "upper right", fontsize="small")
