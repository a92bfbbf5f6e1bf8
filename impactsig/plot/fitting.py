"""A fitted oscillator: the measured train beside a simulated one, and how well it is told."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._kinds import checked
from .axes import BLUE, GREY, VERMILLION, delay_plane, explain, frame, panels, points, span_of
from .comparison import densities

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from ..fitting import OscillatorFit

WITHIN = 5.991  # of a chi squared of two degrees of freedom: 95 %


@checked
def oscillator_fit(result: OscillatorFit, figure: Figure | SubFigure | None = None) -> np.ndarray:
    """Draw a fitted oscillator beside what was measured.

    Above, the densities of the intervals, measured up and simulated down, and both return maps in
    one. Below, how often each word of successive intervals comes (mean and two standard deviations
    of simulated trains), and where the first two free parameters are: the 95 % region of both,
    and the interval of each.

    Parameters
    ----------
    result : OscillatorFit
        From `impactsig.fit_oscillator`.

    Returns
    -------
    ndarray of matplotlib Axes, shape (2, 2)

    See Also
    --------
    impactsig.fit_oscillator, impactsig.plot.comparison

    Examples
    --------
    >>> from impactsig import fit_oscillator, measure, plot, scenes, simulate
    >>> beam = scenes.karpodinis(20.1)
    >>> motion = simulate(beam, periods=400, transient=300)
    >>> train = measure(motion.impacts, jitter=2e-4, seed=1).impacts
    >>> fit = fit_oscillator(train, 1 / 20.1, ["amplitude"], scene=beam)
    >>> axes = plot.oscillator_fit(fit)
    """
    grid = panels(figure, 2, 2, (8.4, 7.2))
    trains = (result.measured, result.simulated)
    values = [train.intervals() for train in trains]
    densities(grid[0, 0], values, ["measured", "simulated"])
    grid[0, 0].set_xlim(span_of(np.quantile(np.concatenate(values), [0.001, 0.999])))
    _maps(grid[0, 1], values)
    _words(grid[1, 0], result)
    _region(grid[1, 1], result)
    return grid


def _maps(ax: Axes, values: list[np.ndarray]) -> None:
    both = np.concatenate(values)
    delay_plane(ax, both, np.quantile(both, [0.001, 0.999]))
    for one, colour, size in zip(values, (BLUE, VERMILLION), (4, 1.5), strict=True):
        points(ax, one[:-1], one[1:], color=colour, markersize=size)


def _words(ax: Axes, result: OscillatorFit) -> None:
    measured, mean, scatter = result.word_shares
    order = np.argsort(-measured, kind="stable")
    order = order[(measured + mean)[order] > 0]
    place = np.arange(len(order))
    ax.bar(place, measured[order], color=BLUE, alpha=0.6, label="measured")
    ax.errorbar(
        place, mean[order], 2 * scatter[order], fmt="o", markersize=3, color=VERMILLION,
        linewidth=1, label="simulated",
    )  # fmt: skip
    ax.set_xticks([])
    ax.set_ylim(bottom=0)
    words = {"fontsize": "small", "title": f"p = {result.p_value:.2g}"}
    frame(ax, "words of successive intervals, the most frequent first", "share", "best", **words)


def _region(ax: Axes, result: OscillatorFit) -> None:
    names = result.free[:2]
    told = [result.intervals[name] for name in names]
    if not np.isfinite(told).all():
        explain(ax, " ".join(result.warnings) or "These impacts do not tell the parameters.")
        return
    centre = [result.values[name] for name in names]
    labels = [name.replace("_", " ") for name in names]
    if len(names) == 1:
        ax.errorbar(centre, [0], xerr=np.abs(np.array(told).T - centre), fmt="o", color=BLUE)
        ax.set(xlabel=labels[0], yticks=[])
        return
    turn = np.linspace(0, 2 * np.pi, 200)
    factor = np.linalg.cholesky(WITHIN * result.covariance[:2, :2])
    edge = factor @ np.array([np.cos(turn), np.sin(turn)])
    curve = [
        value * np.exp(offset) if logarithmic else value + offset
        for value, offset, logarithmic in zip(centre, edge, result.logarithmic, strict=False)
    ]
    ax.fill(*curve, color=BLUE, alpha=0.2, linewidth=0)
    ax.plot(*curve, color=BLUE, linewidth=1)
    ax.plot(*centre, "o", color=BLUE)
    for (low, high), draw in zip(told, (ax.axvline, ax.axhline), strict=True):
        for value in (low, high):
            draw(value, color=GREY, linewidth=0.8, linestyle=":")
    frame(ax, *labels)
