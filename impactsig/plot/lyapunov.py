"""How Lyapunov exponents converge."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._axes import CHANNEL_COLOURS, GREY, axes, explain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..dynamics.lyapunov import LyapunovSpectrum


def lyapunov_convergence(result: LyapunovSpectrum, ax: Axes | None = None) -> Axes:
    """Draw how far the running estimates of all exponents were from the final ones.

    So that exponents of all sizes share an axis. A band is two standard errors wide on either
    side. Where neighbours became one, the estimates are those between these collapses, and the
    title says so.

    Parameters
    ----------
    result : LyapunovSpectrum
        Of `lyapunov_spectrum`.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Axes
    """
    ax = axes(ax, width=6.4, height=3.8)
    if not len(result.time):
        return explain(ax, f"no exponents: {result.status}")
    off = result.curve - result.between_collapses
    for k, (value, error) in enumerate(zip(result.between_collapses, result.error, strict=True)):
        colour = CHANNEL_COLOURS[k % len(CHANNEL_COLOURS)]
        label = rf"$\lambda_{{{k + 1}}}$ = {value:.5g} ± {error:.1g}"
        ax.plot(result.time, off[:, k], color=colour, linewidth=1.2, label=label)
        if np.isfinite(error):
            ax.axhspan(-2 * error, 2 * error, color=colour, alpha=0.12, linewidth=0)
    ax.axhline(0.0, color=GREY, linewidth=0.8, linestyle=":")
    late = np.abs(off[len(off) // 8 :]).max()
    if np.isfinite(late):  # the first estimates may be far off
        room = 1.1 * max(late, 2 * np.nanmax(result.error, initial=0.0), 1e-12)
        ax.set_ylim(-room, room)
    if result.collapses:
        count = f"{result.collapses} collapse{'s' * (result.collapses > 1)}"
        ax.set_title(f"between {count} of the neighbours", loc="left", fontsize="medium")
    ax.set_xlim(0.0, result.time[-1])
    ax.set_xlabel("time, in the system's unit")
    ax.set_ylabel("estimate less final value")
    ax.legend(frameon=False, loc="upper right", fontsize="small")
    return ax
