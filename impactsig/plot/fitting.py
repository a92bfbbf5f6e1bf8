"""A fitted oscillator: the measured train beside a simulated one, and the confidence region."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._kinds import checked
from .axes import (
    BLUE,
    GREY,
    SKY,
    VERMILLION,
    delay_plane,
    explain,
    frame,
    legend,
    panels,
    points,
    span_of,
)
from .comparison import densities

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure, SubFigure

    from ..fitting import Band, MachineFit, OscillatorFit, Prediction

WITHIN = 5.991  # of a chi squared of two degrees of freedom: 95 %


@checked
def oscillator_fit(result: OscillatorFit, figure: Figure | SubFigure | None = None) -> np.ndarray:
    """Draw a fitted oscillator together with the measured train.

    The upper panels show the densities of the intervals, measured upwards and simulated downwards,
    and both return maps. The lower panels show the frequency of each word of successive intervals
    (mean and two standard deviations of simulated trains), and the 95 % region and intervals of the
    first two free parameters.

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


def _region(ax: Axes, result: OscillatorFit | MachineFit) -> None:
    names = result.free[:2]
    if not names:
        explain(ax, "Nothing that the trains share was free.")
        return
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


@checked
def machine_fit(result: MachineFit, figure: Figure | SubFigure | None = None) -> np.ndarray:
    """Draw the parameters of an oscillator fitted to many trains.

    The left panel shows the region of the first two common parameters, as in `oscillator_fit`; the
    right panel the amplitude of the forcing of each train, with its 95 % interval, against the
    frequency.

    Parameters
    ----------
    result : MachineFit
        From `impactsig.fit_oscillator` of many trains.

    Returns
    -------
    ndarray of matplotlib Axes, shape (2,)

    See Also
    --------
    impactsig.fit_oscillator, impactsig.plot.oscillator_fit

    Examples
    --------
    >>> from impactsig import fit_oscillator, measure, plot, scenes, simulate
    >>> beams = [scenes.karpodinis(frequency) for frequency in (20.1, 20.3355)]
    >>> trains = [simulate(beam, periods=400, transient=300).impacts for beam in beams]
    >>> trains = [measure(train, jitter=2e-4, seed=1).impacts for train in trains]
    >>> fit = fit_oscillator(trains, [1 / 20.1, 1 / 20.3355], ["amplitude"], scene=beams[0], seed=1)
    >>> axes = plot.machine_fit(fit)
    """
    grid = panels(figure, 1, 2, (8.4, 3.8)).ravel()
    _region(grid[0], result)
    frequency = [1 / run.forcing_period for run in result.runs]
    amplitude = np.array([run.values["amplitude"] for run in result.runs])
    told = [run.intervals.get("amplitude", (np.nan, np.nan)) for run in result.runs]
    reach = np.abs(np.array(told).T - amplitude)
    reach = np.where(np.isfinite(reach), reach, 0.0)
    grid[1].errorbar(frequency, amplitude, reach, fmt="o", color=BLUE, markersize=4, linewidth=1)
    frame(grid[1], "forcing frequency [Hz]", "amplitude of the forcing [gaps]")
    return grid


@checked
def prediction(result: Prediction, figure: Figure | SubFigure | None = None) -> np.ndarray:
    """Draw measured intervals together with those of trains simulated from a fit.

    The left panel shows the fraction of measured intervals in each bin, with the band of 95 % of
    the simulated trains. The right panel shows the return map in cells, darker for more measured
    pairs, with a mark where there are more, or fewer, than in 95 % of the simulated trains. Each
    bin contains an equal fraction of all trains, so that clusters of intervals appear wide and the
    gaps between them narrow.

    Parameters
    ----------
    result : Prediction
        From `results.OscillatorFit.predict`.

    Returns
    -------
    ndarray of matplotlib Axes, shape (2,)

    See Also
    --------
    impactsig.plot.oscillator_fit, impactsig.fit_oscillator

    Examples
    --------
    >>> from impactsig import fit_oscillator, measure, plot, scenes, simulate
    >>> beam = scenes.karpodinis(20.1)
    >>> motion = simulate(beam, periods=400, transient=300)
    >>> train = measure(motion.impacts, jitter=2e-4, seed=1).impacts
    >>> fit = fit_oscillator(train, 1 / 20.1, ["amplitude"], scene=beam)
    >>> axes = plot.prediction(fit.predict(60, seed=2))
    """
    grid = panels(figure, 1, 2, (8.4, 3.6))
    _shares_in_band(grid[0], result.interval)
    _cells_in_band(grid[1], result.return_map)
    return grid


def _shares_in_band(ax: Axes, band: Band) -> None:
    place = np.arange(len(band.edges))
    low, high, measured = (100 * one for one in (band.low, band.high, band.measured))
    ax.stairs(
        high, place, baseline=low, fill=True, color=VERMILLION, alpha=0.3, label="simulated, 95 %"
    )
    ax.stairs(measured, place, baseline=None, color=BLUE, label="measured")
    ax.set_ylim(bottom=0)
    _edges(ax.xaxis, band.edges, max((len(place) - 1) // 6, 1))
    title = f"p = {band.p_value:.2g}"
    frame(ax, "interval [ms], in bins of equal share", "share [%]")
    legend(ax, "above", fontsize="small", title=title)


def _cells_in_band(ax: Axes, band: Band) -> None:
    place = np.arange(len(band.edges))
    ax.pcolormesh(place, place, 100 * band.measured.T, cmap="Greys", vmin=0)
    outside = band.outside
    for sign, mark, colour in ((1, "^", VERMILLION), (-1, "v", SKY)):
        where = np.argwhere(sign * outside > 0) + 0.5
        ax.plot(
            *where.T, linestyle="none", marker=mark, color=colour, markeredgecolor="white",
            label="more than simulated" if sign > 0 else "less",
        )  # fmt: skip
    for axis in (ax.xaxis, ax.yaxis):
        _edges(axis, band.edges, 2)
    ax.set(aspect="equal")
    frame(ax, "interval $I_k$ [ms]", "interval $I_{k+1}$ [ms]")
    legend(ax, "above", fontsize="small", title=f"p = {band.p_value:.2g}")


def _edges(axis: Axis, edges: np.ndarray, every: int) -> None:
    """Places in equal steps, named by their intervals."""
    place = np.arange(0, len(edges), every)
    axis.set_ticks(place, [f"{1e3 * edges[k]:.4g}" for k in place], fontsize="small")
