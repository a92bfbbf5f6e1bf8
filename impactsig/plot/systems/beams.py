"""Beams: the shapes of their modes, and the restitution coefficient they appear to have."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..._arguments import number, whole
from ...errors import InvalidInput
from .._kinds import checked, refuse_others
from ..axes import (
    BLUE,
    CHANNEL_COLOURS,
    GREY,
    VERMILLION,
    axes,
    colour,
    frame,
    level,
    points,
    seconds,
)
from ._motion_path import mark_events

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...oscillators import Cantilever
    from ...simulation.beam.beam_motion import BeamMotion
    from ...simulation.beam.restitution import ApparentRestitution


@checked
def mode_shapes(beam: Cantilever, ax: Axes | None = None, *, modes: int = 4) -> Axes:
    """Draw the first mode shapes of a cantilever, 1 at the tip, with their frequencies.

    Parameters
    ----------
    beam : Cantilever
        The beam.
    modes : int
        How many.

    See Also
    --------
    impactsig.Cantilever, impactsig.plot.tip_history

    Examples
    --------
    >>> from impactsig import Cantilever, plot
    >>> ax = plot.mode_shapes(Cantilever(0.2, 0.025, 0.001, 210e9, 7850), modes=3)
    >>> len(ax.get_lines()) >= 3
    True
    """
    modes = whole("modes", modes, 1)
    ax = axes(ax, width=6.4, height=3.2)
    x = np.linspace(0.0, beam.length, 50 * modes + 101)
    for k, frequency in enumerate(beam.frequencies(modes)):
        style = "-" if k < len(CHANNEL_COLOURS) else "--"
        label = f"{k + 1}: {frequency:.4g} Hz"
        ax.plot(x, beam.mode_shape(k + 1, x), style, color=colour(k), linewidth=1.2, label=label)
    level(ax, 0.0)
    ax.set_xlim(0.0, beam.length)
    away = {"bbox_to_anchor": (1.0, 0.5)}
    return frame(ax, "distance from the clamp [m]", "mode shape", "center left", **away)


@checked
def tip_history(
    motion: BeamMotion,
    ax: Axes | None = None,
    *,
    start: float | None = None,
    stop: float | None = None,
) -> Axes:
    """Draw the displacement of the tip and the first mode's part of it over time, with impacts.

    The stop is drawn as a line; spans in which it holds the tip are shaded.

    Parameters
    ----------
    motion : BeamMotion
        The simulated system.
    start, stop : float, optional
        Span to draw [s]; by default the last five periods of the first mode.

    Raises
    ------
    InvalidInput
        If the span is not in the motion.

    See Also
    --------
    impactsig.Cantilever, impactsig.plot.time_history

    Examples
    --------
    >>> from impactsig import BaseMotion, Cantilever, Rigid, Stop, plot, simulate
    >>> stop, base = Stop(1e-3, Rigid(0.6)), BaseMotion(2e-4, 130.0)
    >>> ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, stop=stop, forcing=base, modes=3)
    >>> ax = plot.tip_history(simulate(ruler, periods=20))
    """
    end = motion.start + motion.duration
    last = end if stop is None else number("stop", stop, most=end)
    first = max(motion.start, last - 5 / motion.frequencies[0])
    first = first if start is None else number("start", start, least=motion.start)
    if not first < last:
        raise InvalidInput("start, stop", f"{start}, {stop}", "a span inside the motion")
    fine = max(1000, min(20_000, int(20 * (last - first) * motion.frequencies[-1])))
    hits = motion.impacts.time[(motion.impacts.time >= first) & (motion.impacts.time <= last)]
    time = np.union1d(np.linspace(first, last, fine), hits)
    ax = axes(ax, width=8.0)
    ax.plot(time, motion.sample(time)[0], color=BLUE, linewidth=1.0, label="tip")
    slow = motion.modal(time)[0][:, 0]
    ax.plot(time, slow, color=GREY, linewidth=1.0, linestyle="--", label="first mode")
    mark_events(ax, motion, hits, np.clip(motion.sticks, first, last), "held")
    if motion.system.stop is not None:
        ax.axhline(motion.system.stop.position, color=GREY, linewidth=0.8)
    ax.margins(x=0)
    seconds(ax.xaxis, "time", [last])
    return frame(ax, None, "deflection [m]", "above", ncols=4)


@checked
def apparent_restitution(result: ApparentRestitution, ax: Axes | None = None) -> Axes:
    """Draw the first mode's velocity after each contact over that before it.

    Parameters
    ----------
    result : ApparentRestitution
        From `apparent_restitution`.

    See Also
    --------
    impactsig.apparent_restitution, impactsig.plot.restitution_over_modes

    Examples
    --------
    >>> from impactsig import (
    ...     BaseMotion, Cantilever, Rigid, Stop, apparent_restitution, plot,
    ...     simulate,
    ... )
    >>> stop, base = Stop(1e-3, Rigid(0.6)), BaseMotion(2e-4, 130.0)
    >>> ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, stop=stop, forcing=base, modes=3)
    >>> ax = plot.apparent_restitution(apparent_restitution(simulate(ruler, periods=40)))
    """
    ax = axes(ax, width=4.8, height=3.6)
    label = f"{len(result.each)} contact{'s' * (len(result.each) > 1)}"
    points(ax, result.approach, -result.departure, label=label)
    fastest = 1.05 * float(result.approach.max())
    ax.plot([0, fastest], [0, result.value * fastest], color=VERMILLION, linewidth=1.2,
            label=f"r = {result.value:.3g}")  # fmt: skip
    level(ax, 0.0)
    ax.set_xlim(0.0, fastest)
    before, after = "first mode before the contact [m/s]", "and after, away from the stop [m/s]"
    return frame(ax, before, after, "best")


def restitution_over_modes(
    results: Sequence[ApparentRestitution], ax: Axes | None = None, *, label: str = ""
) -> Axes:
    """Draw apparent restitution coefficients over the number of modes, with their spread.

    The bars reach from the 5th to the 95th percentile of the contacts.

    Parameters
    ----------
    results : sequence of ApparentRestitution
        Of motions in different numbers of modes.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default. Another call with the same axes adds a curve.
    label : str
        What the legend calls them.

    Raises
    ------
    InvalidInput
        If there are none.

    See Also
    --------
    impactsig.apparent_restitution, impactsig.plot.apparent_restitution

    Examples
    --------
    >>> from dataclasses import replace
    >>> from impactsig import (
    ...     BaseMotion, Cantilever, Rigid, Stop, apparent_restitution, plot,
    ...     simulate,
    ... )
    >>> stop, base = Stop(1e-3, Rigid(0.6)), BaseMotion(2e-4, 130.0)
    >>> ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, stop=stop, forcing=base)
    >>> beams = [replace(ruler, modes=modes) for modes in (1, 2)]
    >>> found = [apparent_restitution(simulate(beam, periods=20)) for beam in beams]
    >>> ax = plot.restitution_over_modes(found)
    """
    if not isinstance(results, Iterable) or isinstance(results, str) or not len(results):
        raise InvalidInput("results", results, "one result or more, in a sequence")
    for one in results:
        refuse_others("results", one, ["ApparentRestitution"])
    results = sorted(results, key=lambda result: result.modes)
    ax = axes(ax, width=6.0, height=3.6)
    modes = np.array([result.modes for result in results])
    value = np.array([result.value for result in results])
    ends = np.array([np.percentile(result.each, [5, 95]) for result in results])
    reach = np.maximum([value - ends[:, 0], ends[:, 1] - value], 0.0)
    ax.errorbar(
        modes, value, reach, color=colour(len(ax.containers)), marker="o", markersize=4,
        linewidth=1.2, elinewidth=0.8, capsize=2, label=label or None,
    )  # fmt: skip
    if len(ax.containers) == 1:
        level(ax, 0.0)
        ax.set_xscale("log", base=2)
        ax.xaxis.set_major_formatter(lambda x, _position: f"{x:g}")
    return frame(ax, "modes", "apparent restitution coefficient", "best" if label else "")
