"""An oscillator under a random force: densities with their bands, joint densities, a path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import BLUE, VERMILLION, axes, frame, legend, seconds

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...stochastic.density import Density, JointDensity
    from ...stochastic.noisy_motion import NoisyMotion

SYMBOLS = {"energy": "H", "displacement": "x", "velocity": "v"}


@checked
def density(result: Density, ax: Axes | None = None, label: str = "simulated") -> Axes:
    """Draw a density cell by cell, with 95 % bands.

    Parameters
    ----------
    result : Density
        Such as `Ensemble.energy`.
    label : str
        What the legend calls it.

    See Also
    --------
    impactsig.simulate_ensemble, impactsig.plot.joint_density

    Examples
    --------
    >>> from impactsig import Noise, Oscillator, plot, simulate_ensemble
    >>> shaken = Oscillator(damping=0.2, noise=Noise(0.1))
    >>> found = simulate_ensemble(shaken, paths=8, duration=100, transient=50, seed=1)
    >>> ax = plot.density(found.energy)
    """
    ax = axes(ax, width=5.2)
    ax.stairs(result.density, result.edges, color=BLUE, linewidth=1.1, label=label)
    ax.fill_between(
        result.edges,
        np.append(result.low, result.low[-1]),
        np.append(result.high, result.high[-1]),
        step="post", color=BLUE, alpha=0.25, linewidth=0, label="95 % of each cell",
    )  # fmt: skip
    symbol = SYMBOLS[result.quantity]
    ax.set_xlim(result.edges[0], result.edges[-1])
    ax.set_ylim(bottom=0)
    return frame(ax, f"{result.quantity} ${symbol}$", f"density $p({symbol})$", "best")


@checked
def joint_density(result: JointDensity, ax: Axes | None = None) -> Axes:
    """Draw a joint density as a map with a colour bar.

    Parameters
    ----------
    result : JointDensity
        Such as `Ensemble.joint`.

    See Also
    --------
    impactsig.simulate_ensemble, impactsig.plot.density

    Examples
    --------
    >>> from impactsig import Noise, Oscillator, plot, simulate_ensemble
    >>> shaken = Oscillator(damping=0.2, noise=Noise(0.1))
    >>> found = simulate_ensemble(shaken, paths=8, duration=100, transient=50, seed=1)
    >>> ax = plot.joint_density(found.joint)
    """
    ax = axes(ax, width=4.8, height=3.8)
    mesh = ax.pcolormesh(
        result.x_edges, result.v_edges, result.density, cmap="viridis", vmin=0, rasterized=True
    )
    ax.figure.colorbar(mesh, ax=ax, label="density $p(x, v)$")
    return frame(ax, "displacement $x$", "velocity $v$")


@checked
def noisy_motion(result: NoisyMotion, ax: Axes | None = None) -> Axes:
    """Draw displacement over time, with a mark where the path hits a stop.

    Parameters
    ----------
    result : NoisyMotion
        The path, as `impactsig.simulate` returns it.

    See Also
    --------
    impactsig.simulate, impactsig.plot.time_history

    Examples
    --------
    >>> from impactsig import plot, scenes, simulate
    >>> ax = plot.noisy_motion(simulate(scenes.van_der_pol_duffing(0.99), duration=50, seed=1))
    """
    ax = axes(ax)
    ax.plot(result.time, result.x, color=BLUE, linewidth=0.8)
    hits = result.impacts.time
    if len(hits) and len(result.time):
        at = np.interp(hits, result.time, result.x)
        base = result.system.base
        if base is None or not base.stops:  # where the stop is, not where the path was seen next
            places = np.array([stop.position for stop in result.system.stops])
            at = places[np.abs(at[:, None] - places).argmin(axis=1)]
        ax.plot(hits, at, "o", color=VERMILLION, markersize=3, label="impacts")
        legend(ax, "lower right", bbox_to_anchor=(1, 1))
    seconds(ax.xaxis, "time", result.time, result.system.in_seconds)
    return frame(ax, None, "displacement $x$")
