"""How Lyapunov exponents converge."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._axes import CHANNEL_COLOURS, GREY, axes, explain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..dynamics.lyapunov import LyapunovSpectrum


def lyapunov_convergence(result: LyapunovSpectrum, ax: Axes | None = None) -> Axes:
    """Draw the running estimates of all exponents over time, with their final error.

    The bands are two standard errors wide on either side of the final value. Where neighbours
    became one, the estimates are those between these collapses, and the title says so.

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
    for k, (value, error) in enumerate(zip(result.between_collapses, result.error, strict=True)):
        colour = CHANNEL_COLOURS[k % len(CHANNEL_COLOURS)]
        label = rf"$\lambda_{{{k + 1}}}$ = {value:.5g} ± {error:.1g}"
        ax.plot(result.time, result.curve[:, k], color=colour, linewidth=1.2, label=label)
        if np.isfinite(error):
            band = (value - 2 * error, value + 2 * error)
            ax.axhspan(*band, color=colour, alpha=0.15, linewidth=0)
    ax.axhline(0.0, color=GREY, linewidth=0.8, linestyle=":")
    if result.collapses:
        count = f"{result.collapses} collapse{'s' * (result.collapses > 1)}"
        ax.set_title(f"between {count} of the neighbours", loc="left", fontsize="medium")
    ax.set_xlim(0.0, result.time[-1])
    ax.set_xlabel("time, in the system's unit")
    ax.set_ylabel("exponent")
    ax.legend(frameon=False, loc="center right", fontsize="small")
    return ax
