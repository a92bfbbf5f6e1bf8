"""Averaged densities: of the energy, of displacement and velocity, and their shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._kinds import checked
from ..axes import BLUE, GREY, VERMILLION, axes, called, frame, panels, title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from ...stochastic.averaging.averaging import AveragedDensity
    from ...stochastic.averaging.bifurcation import PBifurcation

EXTREMA: tuple[tuple[bool, dict[str, Any]], ...] = (
    (True, {"color": BLUE, "markerfacecolor": BLUE, "label": "maximum"}),
    (False, {"color": VERMILLION, "markerfacecolor": "white", "label": "minimum"}),
)
ALL_BUT = 1e-3  # probability that is left outside the figure
FINENESS = 241


@checked
def averaged_density(
    result: AveragedDensity, figure: Figure | SubFigure | None = None
) -> np.ndarray:
    """Draw the density of the energy, the joint density, and its cut along the velocity.

    The ridges of the joint density, orbits on which it has a maximum, are white. Extrema are marked
    on the cut, which passes through the bottom of the well. With several wells the cut passes
    through the lowest one, and no extrema are marked.

    Parameters
    ----------
    result : AveragedDensity
        From `impactsig.averaged_density`.

    Returns
    -------
    ndarray of matplotlib Axes, shape (3,)
        Energy; plane; cut.

    See Also
    --------
    impactsig.averaged_density, impactsig.plot.density

    Examples
    --------
    >>> from impactsig import averaged_density, plot, scenes
    >>> axes = plot.averaged_density(averaged_density(scenes.van_der_pol_duffing(0.99)))
    >>> len(axes)
    3
    """
    grid = panels(figure, 1, 3, (11.0, 3.6))
    energies, plane, cut = grid
    shape = result.shape if len(result.wells) == 1 else None
    fine = np.linspace(0, result.greatest, 4000)
    most = float(fine[np.searchsorted(result.cumulative(fine), 1 - ALL_BUT)])

    energy = most * np.linspace(0, 1, 2 * FINENESS)[1:] ** 2
    density = result.energy_density(energy)
    energies.plot(energy, density, color=BLUE)
    energies.axvline(result.mean, color=VERMILLION, linewidth=1, label=f"mean {result.mean:.4g}")
    low, high = max(result.mean - result.sd, 0.0), result.mean + result.sd
    energies.axvspan(low, high, color=VERMILLION, alpha=0.12, linewidth=0, label="1 sd")
    # p(H) may have a pole at the bottom, which would press all else down.
    tall = density[energy > 0.01 * most].max()
    energies.set(xlim=(0, most), ylim=(0, 1.15 * tall))
    frame(energies, "energy $H$", "$p(H)$", "upper right")

    fastest = np.sqrt(2 * most / result.oscillator.mass)
    v = np.linspace(-fastest, fastest, FINENESS)
    x = np.linspace(*result.reach(most), FINENESS)
    joint = result.joint_density(x, v[:, None])
    shown = plane.pcolormesh(x, v, joint, shading="gouraud", cmap="viridis", rasterized=True)
    plane.figure.colorbar(shown, ax=plane)
    title(plane, "$p(x, v)$")
    ridges = () if shape is None else shape.energy[shape.maximum & (shape.energy > 0)]
    for ridge in ridges:
        place = np.linspace(*result.reach(ridge), 4 * FINENESS)
        speed = np.sqrt(
            np.maximum(2 * (ridge - result.potential(place)), 0) / result.oscillator.mass
        )
        plane.plot(place, speed, color="white", linewidth=0.8, linestyle="--")
        plane.plot(place, -speed, color="white", linewidth=0.8, linestyle="--")
    for stop in result.oscillator.stops:
        plane.axvline(stop.position, color=VERMILLION, linewidth=2, clip_on=False)
    plane.set(xlabel="displacement $x$", ylabel="velocity $v$", ylim=(v[0], v[-1]))

    fine_v = fastest * np.linspace(-1, 1, 8 * FINENESS)
    cut.plot(fine_v, result.joint_density(result.bottom, fine_v), color=BLUE)
    height = float(result.joint_density(result.bottom, fine_v).max())
    if shape is not None:
        speeds = np.sqrt(2 * shape.energy / result.oscillator.mass)
        height = float(shape.height.max())
        for kind, look in EXTREMA:
            marked = shape.maximum == kind
            at = np.concatenate([-speeds[marked], speeds[marked]])
            cut.plot(at, np.tile(shape.height[marked], 2), "o", markersize=5, **look)
    cut.set(xlim=(v[0], v[-1]), ylim=(0, 1.2 * height))
    title(cut, f"{len(result.wells)} wells" if shape is None else shape.name)
    words = "velocity $v$", f"$p(x = {result.bottom:.3g}, v)$"
    if shape is None:
        frame(cut, *words)
    else:
        frame(cut, *words, "upper right", ncols=2)
    return grid


@checked
def p_bifurcation(result: PBifurcation, ax: Axes | None = None) -> Axes:
    """Draw the energies of the extrema of a joint density over a parameter, and where they change.

    Parameters
    ----------
    result : PBifurcation
        From `impactsig.p_bifurcation`.

    See Also
    --------
    impactsig.p_bifurcation, impactsig.plot.averaged_density

    Examples
    --------
    >>> from impactsig import p_bifurcation, plot, scenes
    >>> ax = plot.p_bifurcation(p_bifurcation(scenes.van_der_pol_duffing, [0.9, 0.99]))
    """
    ax = axes(ax, width=7.0, height=3.8)
    for kind, look in EXTREMA:
        energy = [shape.energy[shape.maximum == kind] for shape in result.shapes]
        value = np.repeat(result.values, [len(some) for some in energy])
        ax.plot(value, np.concatenate(energy), "o", markersize=4, clip_on=False, **look)
    low, high = float(result.values[0]), float(result.values[-1])
    at = [low, *(transition.value for transition in result.transitions), high]
    names = [transition.before for transition in result.transitions] + [result.classes[-1]]
    for edge in at[1:-1]:
        ax.axvline(edge, color=GREY, linewidth=0.8, linestyle=":")
    for start, end, name in zip(at[:-1], at[1:], names, strict=True):
        if end - start > 0.02 * (high - low):
            words = name.replace(" with", "\nwith")
            ax.text(
                (start + end) / 2, 1.01, words, transform=ax.get_xaxis_transform(), color=GREY,
                ha="center", va="bottom", fontsize="small",
            )  # fmt: skip
    ax.set_ylim(bottom=0)
    return frame(ax, called(result.parameter), "energy of the extremum", "best")
