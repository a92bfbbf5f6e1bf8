"""Choosing an embedding: dependence over lags, false neighbours over dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._axes import BLUE, GREY, ORANGE, SKY, VERMILLION, axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..reconstruct import AveragedFalseNeighbors, DelayChoice, FalseNeighbors


def delay_choice(result: DelayChoice, ax: Axes | None = None) -> Axes:
    """Draw the autocorrelation or mutual information over the lag, with the delay chosen.

    Parameters
    ----------
    result : DelayChoice
        Of `autocorrelation_delay` or `mutual_information_delay`.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Axes
    """
    ax = axes(ax, width=5.2, height=3.4)
    # Far beyond the choice there is nothing to see.
    last = len(result.curve) if result.delay is None else max(6 * result.delay, 30) + 1
    # An information at lag 0 is that of the bins alone.
    first = 1 if result.method == "mutual information" else 0
    lags = np.arange(first, min(len(result.curve), last))
    ax.plot(lags, result.curve[lags], color=BLUE, marker="o", markersize=3, linewidth=1)
    if result.level is not None:
        label = f"{result.level:.2g}"
        ax.axhline(result.level, color=GREY, linewidth=0.8, linestyle=":", label=label)
    if result.delay is not None:
        label = f"delay {result.delay}"
        ax.axvline(result.delay, color=VERMILLION, linewidth=1, label=label, zorder=1)
    else:
        ax.set_title("no delay", loc="left", color=VERMILLION, fontsize="medium")
    ax.set_xlabel("lag")
    if result.method == "autocorrelation":
        ax.set_ylabel("autocorrelation")
    else:
        ax.set_ylabel("mutual information [nat]")
        ax.set_ylim(min(0, float(result.curve[lags].min())), None)
    ax.legend(loc="upper right", frameon=False)
    return ax


def false_neighbors(result: FalseNeighbors, ax: Axes | None = None) -> Axes:
    """Draw the shares of false nearest neighbours over the dimension, with the one chosen.

    Parameters
    ----------
    result : FalseNeighbors
        Of `false_nearest_neighbors`.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Axes
    """
    ax = axes(ax, width=5.2, height=3.4)
    for share, label, colour, style in (
        (result.by_growth, "by growth", SKY, "--"),
        (result.by_size, "by size", ORANGE, "--"),
        (result.share, "by either", BLUE, "-"),
    ):
        ax.plot(
            result.dimensions,
            100 * share,
            style,
            color=colour,
            marker="o",
            markersize=4,
            label=label,
        )
    label = f"{result.tolerance:.0%}"
    ax.axhline(100 * result.tolerance, color=GREY, linewidth=0.8, linestyle=":", label=label)
    _chosen(ax, result.dimension, result.dimensions)
    ax.set_ylabel("false nearest neighbours [%]")
    ax.set_ylim(-2, 102)
    ax.legend(loc="upper right", frameon=False)
    return ax


def averaged_false_neighbors(result: AveragedFalseNeighbors, ax: Axes | None = None) -> Axes:
    """Draw Cao's E1 and E2 over the dimension, with the one chosen.

    Parameters
    ----------
    result : AveragedFalseNeighbors
        Of `averaged_false_neighbors`.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Axes
    """
    ax = axes(ax, width=5.2, height=3.4)
    ax.axhline(1, color=GREY, linewidth=0.8, linestyle=":")
    for curve, label, colour in ((result.e1, "$E_1$", BLUE), (result.e2, "$E_2$", ORANGE)):
        ax.plot(result.dimensions, curve, color=colour, marker="o", markersize=4, label=label)
    _chosen(ax, result.dimension, result.dimensions)
    ax.set_ylabel("$E_1$, $E_2$")
    ax.set_ylim(0, 1.08 * max(1, float(result.e1.max()), float(result.e2.max())))
    ax.legend(loc="lower right", frameon=False)
    return ax


def _chosen(ax: Axes, dimension: int | None, dimensions: np.ndarray) -> None:
    if dimension is None:
        ax.set_title("no dimension", loc="left", color=VERMILLION, fontsize="medium")
    else:
        label = f"dimension {dimension}"
        ax.axvline(dimension, color=VERMILLION, linewidth=1, label=label, zorder=1)
    ax.set_xticks(dimensions)
    ax.set_xlabel("dimension $m$")
