"""Control of chaos: motion, impacts and force over time, and where control is stable."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InvalidInput
from .._kinds import checked
from ..axes import BLUE, GREY, VERMILLION, axes, colour, explain, frame, level, points, seconds

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...control.controlled import ControlledMotion
    from ...control.running.flow import ControlledFlowMotion
    from ...dynamics.periodic.flow_orbits import FlowOrbit
    from ...studies.study import Study

FLOOR = 1e-18  # below which a force is drawn as none


@checked
def control_strobe(motion: ControlledMotion, ax: Axes | None = None, *, phase: float = 0.0) -> Axes:
    """Draw the displacement once every forcing period over time, with changes of control.

    Parameters
    ----------
    motion : ControlledMotion
        Motion of a `Controlled` system.
    phase : float
        Phase of the strobe [rad].

    See Also
    --------
    impactsig.Controlled, impactsig.plot.control_intervals

    Examples
    --------
    >>> from impactsig import Controlled, DelayedFeedback, plot, scenes, simulate
    >>> feedback = DelayedFeedback(0.15, 1, limit=0.1)
    >>> motion = simulate(Controlled(scenes.karpodinis(20.3355), feedback, start=20), periods=60)
    >>> ax = plot.control_strobe(motion)
    """
    ax = axes(ax)
    x, _ = motion.stroboscopic(phase)
    period = motion.system.forcing_period
    if not len(x) or period is None:
        return explain(ax, "no forcing period has passed")
    points(ax, motion.start + np.arange(len(x)) * period, x, markersize=2.5)
    _phases(ax, motion)
    seconds(ax.xaxis, "time", [motion.stop], motion.system.in_seconds)
    return frame(ax, None, "displacement, strobed")


@checked
def control_intervals(
    motion: ControlledMotion | ControlledFlowMotion, ax: Axes | None = None
) -> Axes:
    """Draw each interspike interval against the time of its end, with changes of control.

    Parameters
    ----------
    motion : ControlledMotion or ControlledFlowMotion
        Motion of a `Controlled` system; of a flow under `IntervalFeedback`.

    See Also
    --------
    impactsig.Controlled, impactsig.plot.interval_sequence

    Examples
    --------
    >>> from impactsig import Controlled, DelayedFeedback, plot, scenes, simulate
    >>> feedback = DelayedFeedback(0.15, 1, limit=0.1)
    >>> motion = simulate(Controlled(scenes.karpodinis(20.3355), feedback, start=20), periods=60)
    >>> ax = plot.control_intervals(motion)
    """
    from ...control.running.flow import ControlledFlowMotion

    ax = axes(ax)
    impacts = motion.spikes if isinstance(motion, ControlledFlowMotion) else motion.impacts
    if impacts is None or len(impacts) < 2:
        return explain(ax, "fewer than two impacts: no interval")
    points(ax, impacts.time[1:], np.diff(impacts.time), markersize=2.5)
    _phases(ax, motion)
    seconds(ax.xaxis, "time", [motion.stop], motion.system.in_seconds)
    in_seconds = motion.system.in_seconds
    seconds(ax.yaxis, "interspike interval", np.diff(impacts.time), in_seconds)
    return ax


@checked
def control_effort(
    motion: ControlledMotion, ax: Axes | None = None, *, periods: float | None = None
) -> Axes:
    """Draw the root mean square of the control force over time, on a logarithmic scale.

    Parameters
    ----------
    motion : ControlledMotion
        Motion of a `Controlled` system.
    periods : float, optional
        Length of the windows in which it is taken [forcing periods]; by default the longest period
        of what is controlled, over which the force need not alternate.

    See Also
    --------
    impactsig.Controlled, impactsig.plot.control_force

    Examples
    --------
    >>> from impactsig import Controlled, DelayedFeedback, plot, scenes, simulate
    >>> feedback = DelayedFeedback(0.15, 1, limit=0.1)
    >>> motion = simulate(Controlled(scenes.karpodinis(20.3355), feedback, start=20), periods=60)
    >>> ax = plot.control_effort(motion)
    """
    ax = axes(ax)
    if periods is None:
        periods = max([1.0, *(_period_of(own) for _, own in motion.schedule)])
        periods = min(periods, motion.duration / (motion.system.forcing_period or math.inf))
    time, rms = motion.effort(periods)
    if not (rms > FLOOR).any():
        return explain(ax, "no control force")
    ax.plot(time, np.where(rms > FLOOR, rms, np.nan), color=BLUE, linewidth=0.9)
    ax.set_yscale("log")
    _phases(ax, motion)
    seconds(ax.xaxis, "time", [motion.stop], motion.system.in_seconds)
    return frame(ax, None, "RMS control force")


@checked
def control_force(
    motion: ControlledMotion | ControlledFlowMotion,
    ax: Axes | None = None,
    *,
    span: tuple[float, float] | None = None,
) -> Axes:
    """Draw the control force over time.

    Parameters
    ----------
    motion : ControlledMotion or ControlledFlowMotion
        Motion of a `Controlled` system.
    span : (float, float), optional
        From when to when [s, or the flow's unit of time]; all of it by default.

    See Also
    --------
    impactsig.Controlled, impactsig.plot.control_effort

    Examples
    --------
    >>> from impactsig import Controlled, DelayedFeedback, plot, scenes, simulate
    >>> feedback = DelayedFeedback(0.15, 1, limit=0.1)
    >>> motion = simulate(Controlled(scenes.karpodinis(20.3355), feedback, start=20), periods=60)
    >>> ax = plot.control_force(motion, span=(0.0, 1.0))
    """
    from ...control.running.flow import ControlledFlowMotion

    ax = axes(ax)
    if isinstance(motion, ControlledFlowMotion):
        start, stop = 0.0, motion.duration
    else:
        start, stop = motion.start, motion.stop
    begin, end = (start, stop) if span is None else span
    time = np.linspace(max(begin, start), min(end, stop), 20_000)
    ax.plot(time, motion.force(time), color=BLUE, linewidth=0.7)
    _phases(ax, motion, (begin, end))
    if isinstance(motion, ControlledFlowMotion):
        return frame(ax, "time", "control force")
    seconds(ax.xaxis, "time", [end], motion.system.in_seconds)
    return frame(ax, None, "control force")


@checked
def controlled_flow(
    course: ControlledFlowMotion, ax: Axes | None = None, *, coordinate: str | int = 0
) -> Axes:
    """Draw a coordinate of a controlled flow over time, with changes of control.

    Parameters
    ----------
    course : ControlledFlowMotion
        Motion of a `Controlled` system.
    coordinate : str or int
        Which; by default the first.

    See Also
    --------
    impactsig.Controlled, impactsig.plot.control_force

    Examples
    --------
    >>> from impactsig import Controlled, DelayedFeedback, flows, plot, simulate
    >>> feedback = DelayedFeedback(0.2, 5.881, signal="y")
    >>> course = simulate(Controlled(flows.rossler(), feedback, start=50), duration=100)
    >>> ax = plot.controlled_flow(course, coordinate="x")
    """
    from ...simulation.flows.course import coordinate_of

    k = coordinate_of(course.system, coordinate)
    ax = axes(ax)
    time = np.linspace(0.0, course.duration, 8000)
    ax.plot(time, course.sample(time)[:, k], color=BLUE, linewidth=0.7)
    _phases(ax, course, (0.0, course.duration))
    return frame(ax, "time", course.system.coordinates[k])


@checked
def flow_orbit(
    orbit: FlowOrbit, ax: Axes | None = None, *, x: str | int = 0, y: str | int = 1
) -> Axes:
    """Draw a periodic orbit of a flow in the plane of two coordinates.

    Parameters
    ----------
    orbit : FlowOrbit
        From `find_periodic_orbit`.
    x, y : str or int
        Which coordinates; by default the first two.

    See Also
    --------
    impactsig.find_periodic_orbit, impactsig.plot.phase_portrait

    Examples
    --------
    >>> from impactsig import find_periodic_orbit, flows, plot
    >>> ax = plot.flow_orbit(find_periodic_orbit(flows.rossler(), period=5.88))
    """
    from ...simulation.flows.course import coordinate_of

    i, j = coordinate_of(orbit.system, x), coordinate_of(orbit.system, y)
    ax = axes(ax, width=4.2, height=3.8)
    states = orbit.sample(np.linspace(0.0, orbit.period, 2000, endpoint=False))
    states = np.concatenate([states, states[:1]])
    ax.plot(states[:, i], states[:, j], color=BLUE, linewidth=1.1)
    return frame(ax, orbit.system.coordinates[i], orbit.system.coordinates[j])


@checked
def stability_chart(chart: Study, ax: Axes | None = None) -> Axes:
    """Draw the growth of deviations from an orbit over the gain, a curve for each delay.

    Parameters
    ----------
    chart : Study
        From `impactsig.stability_chart`.

    See Also
    --------
    impactsig.stability_chart

    Examples
    --------
    >>> from impactsig import find_periodic_orbit, flows, plot, stability_chart
    >>> orbit = find_periodic_orbit(flows.rossler(), period=5.88)
    >>> chart = stability_chart(orbit, [0.1, 0.2], [1], signal="y", laps=50)
    >>> ax = plot.stability_chart(chart)
    """
    if not {"gain", "delay"} <= set(chart.parameters) or "growth" not in chart.observables:
        raise InvalidInput(
            "chart", chart, "a study of impactsig.stability_chart", "parameter_study draws others"
        )
    ax = axes(ax, width=6.4, height=3.8)
    gain, growth = chart.parameters["gain"], chart["growth"]
    for k, delay in enumerate(chart.parameters["delay"]):
        ax.plot(gain, growth[:, k], color=colour(k), linewidth=1.2, label=f"{delay:.6g}")
    level(ax, 1.0)
    ax.fill_between(gain, 0.0, 1.0, color=GREY, alpha=0.08, linewidth=0)
    ax.set_xlim(gain[0], gain[-1])
    ax.set_ylim(0.0, min(1.05 * np.nanmax(growth), 2.5))
    words = {"fontsize": "small", "title": "delay"}
    return frame(ax, "gain K", "growth in one period of the orbit", "best", **words)


def _phases(ax: Axes, motion: Any, span: tuple[float, float] | None = None) -> None:
    """Mark the times at which control was changed."""
    unit = motion.system.forcing_period or 1.0
    low, high = span or (motion.start, motion.stop)
    for start, own in motion.schedule:
        at = start * unit
        if low <= at <= high:
            ax.axvline(at, color=VERMILLION, linewidth=0.9)
            _label(ax, at, _feedback_in_words(own))
    ax.set_xlim(low, high)


def _feedback_in_words(own: Any) -> str:
    if own is None:
        return "off"
    if hasattr(own, "orbit"):
        return f"OGY ({own.orbit.impacts}, {own.orbit.periods})"
    return f"K {own.gain:g}, delay {own.delay:g}"


def _period_of(own: Any) -> float:
    """Period, in forcing periods, of the orbit that is controlled."""
    if own is None:
        return 1.0
    return float(own.orbit.periods) if hasattr(own, "orbit") else float(math.ceil(own.delay))


def _label(ax: Axes, at: float, text: str) -> None:
    """Write a label above the axes at a time."""
    ax.annotate(
        text, (at, 1.0), xycoords=("data", "axes fraction"), xytext=(2, 2),
        textcoords="offset points", color=VERMILLION, fontsize="small", annotation_clip=False,
    )  # fmt: skip
