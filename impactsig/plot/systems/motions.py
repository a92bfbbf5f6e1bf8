"""A simulated motion: phase portrait, time history, power spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._arguments import number
from ...errors import InvalidInput
from ...recording import sample_span
from .._kinds import checked
from ..axes import BLUE, GREY, VERMILLION, axes, called, explain, frame, legend, points, seconds
from ._flow_portrait import flow_portrait
from ._motion_path import (
    PER_PERIOD,
    base_at,
    events_of,
    mark_events,
    path_of,
    span_drawn,
    spans_jumped,
    stops_move,
    strobe_times,
    swing,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...control.running.flow import ControlledFlowMotion
    from ...recorded import RecordedMotion
    from ...simulation.beam.beam_motion import BeamMotion
    from ...simulation.flows.flow_motion import FlowMotion
    from ...simulation.motion import Motion
    from ...simulation.spectrum import PowerSpectrum
    from ...stochastic.noisy_motion import NoisyMotion

EDGE = "#A6A6A6"
"""A stop's colour: light, for what hits it is drawn along it."""

DECADES = 12
"""Powers of ten that a spectrum is drawn over: below are the roundings of a periodic motion."""


@checked
def phase_portrait(
    motion: Motion | BeamMotion | NoisyMotion | RecordedMotion | FlowMotion | ControlledFlowMotion,
    ax: Axes | None = None,
    *,
    start: float | None = None,
    stop: float | None = None,
    phase: float | None = 0.0,
    coordinates: tuple[str | int, str | int] | None = None,
) -> Axes:
    """Draw velocity over displacement, with the stops and stroboscopic points.

    For a flow, draw one coordinate over another.

    A rigid stop is a solid line, shaded behind it, with a dashed line over each jump of the
    velocity; a soft stop is a dashed line. If the stops move, displacement and velocity are
    relative to them.

    Parameters
    ----------
    motion : Motion, BeamMotion, NoisyMotion, RecordedMotion, FlowMotion, ControlledFlowMotion
        The motion, with all events kept; of a cantilever its tip.
    start, stop : float, optional
        Span to draw [s]; by default the last 50 forcing periods of the motion, or its last
        5000 impacts where these are fewer; all of it of a flow.
    phase : float or None
        Phase of the forcing at which the points are taken, over the whole motion [rad];
        None for no points. A flow has none.
    coordinates : (str or int, str or int), optional
        Names or numbers of the coordinates of a flow, across and up; by default the first two.

    Raises
    ------
    InvalidInput
        If the span is not in the motion, only counts were kept, or there are no such coordinates.

    See Also
    --------
    impactsig.simulate, impactsig.plot.time_history

    Examples
    --------
    >>> from impactsig import plot, scenes, simulate
    >>> ax = plot.phase_portrait(simulate(scenes.karpodinis(22.1), periods=20, transient=200))
    """
    from ...control.running.flow import ControlledFlowMotion
    from ...recorded import RecordedMotion
    from ...simulation.beam.beam_motion import BeamMotion
    from ...simulation.flows.flow_motion import FlowMotion
    from ...stochastic.noisy_motion import NoisyMotion

    if isinstance(motion, (FlowMotion, ControlledFlowMotion)):
        return flow_portrait(motion, ax, start, stop, coordinates)
    if coordinates is not None:
        raise InvalidInput("coordinates", coordinates, "None for the motion of an oscillator")
    if isinstance(motion, RecordedMotion):
        return _recorded_portrait(motion, axes(ax, width=4.8, height=4.4), start, stop, phase)
    if isinstance(motion, (BeamMotion, NoisyMotion)):
        return _sampled_portrait(motion, axes(ax, width=4.8, height=4.4), start, stop)
    path = path_of(motion, *span_drawn(motion, start, stop, periods=50), relative=True)
    ax = axes(ax, width=4.8, height=4.4)
    ax.plot(path.x, path.v, color=BLUE, linewidth=0.7)
    ax.vlines(*spans_jumped(path), color=BLUE, linewidth=1.4, linestyle=(0, (3, 2)), zorder=2.5)
    if phase is not None and motion.system.angular_forcing_frequency is not None:
        time = strobe_times(motion, number("phase", phase, "a finite angle [rad]"))
        x, v = motion._from_stops(time)
        label = "once a period" if phase == 0 else f"once a period, at phase {phase:.3g}"
        points(ax, x, v, color=VERMILLION, label=label, zorder=3)
        _legend_above(ax)
    near = _in_sight(motion, path.x)
    ax.margins(0.06)
    ax.locator_params(axis="x", nbins=6)
    ax.autoscale_view()
    for wall in near:
        _stop_line(ax, wall)
    moving = stops_move(motion)
    if moving:
        return frame(ax, "displacement from the base $x - b$", "velocity $x' - b'$")
    return frame(ax, "displacement $x$", "velocity $x'$")


@checked
def time_history(
    motion: Motion,
    ax: Axes | None = None,
    *,
    start: float | None = None,
    stop: float | None = None,
) -> Axes:
    """Draw displacement over time, with the stops, a mark on every impact, and sticks shaded.

    Parameters
    ----------
    motion : Motion
        The motion, with all events kept.
    start, stop : float, optional
        Span to draw [s]; by default the last 10 forcing periods of the motion, or its last
        5000 impacts where these are fewer.

    Raises
    ------
    InvalidInput
        If the span is not in the motion, or only counts were kept.

    See Also
    --------
    impactsig.simulate, impactsig.plot.phase_portrait

    Examples
    --------
    >>> from impactsig import plot, scenes, simulate
    >>> ax = plot.time_history(simulate(scenes.karpodinis(22.1), periods=10, transient=200))
    """
    first, last = span_drawn(motion, start, stop, periods=10)
    path = path_of(motion, first, last, relative=False)
    ax = axes(ax, width=8.0)
    ax.plot(path.time, path.x, color=BLUE, linewidth=1.0)
    impacts, sticks = events_of(motion)
    hits = impacts.time[(impacts.time >= first) & (impacts.time <= last)]
    mark_events(ax, motion, hits, np.clip(sticks, first, last), "stuck")
    near = _in_sight(motion, path.x - base_at(motion, path.time)[0])
    ax.margins(x=0, y=0.1)
    time = np.linspace(first, last, 2 + int(PER_PERIOD * (last - first) / swing(motion)))
    base = base_at(motion, time)[0]
    for wall in near:
        ax.plot(time, wall.position + base, **_stop_style(wall))
    ax.autoscale_view()
    low, high = ax.get_ylim()
    for wall in near:
        behind = high if wall.side == "upper" else low
        ax.fill_between(time, wall.position + base, behind, color=GREY, alpha=0.12, linewidth=0)
    ax.set_ylim(low, high)
    if ax.get_legend_handles_labels()[0]:
        _legend_above(ax)
    seconds(ax.xaxis, "time", [last], motion.system.in_seconds)
    return frame(ax, None, "displacement $x$")


@checked
def power_spectrum(
    result: PowerSpectrum | Motion,
    ax: Axes | None = None,
    *,
    highest: float | None = None,
) -> Axes:
    """Draw a power spectral density, with a mark at the frequency of the forcing.

    Parameters
    ----------
    result : PowerSpectrum or Motion
        Of a motion, the spectrum of its displacement as `Motion.power_spectrum` makes it.
    highest : float, optional
        Highest frequency drawn [Hz]; a little over 10 times that of the forcing by default.

    Raises
    ------
    InvalidInput
        If there is no spectrum of the motion, or `highest` is not positive.

    See Also
    --------
    impactsig.results.Motion.power_spectrum, impactsig.plot.time_history

    Examples
    --------
    >>> from impactsig import plot, scenes, simulate
    >>> ax = plot.power_spectrum(simulate(scenes.karpodinis(22.1), periods=200, transient=200))
    """
    from ...simulation.spectrum import PowerSpectrum

    spectrum = result if isinstance(result, PowerSpectrum) else result.power_spectrum()
    top = float(spectrum.frequency[-1])
    forcing = 1 / spectrum.forcing_period if spectrum.forcing_period else None
    if highest is None:
        highest = min(10.5 * forcing, top) if forcing else top
    elif not number("highest", highest, "a positive frequency [Hz]") > 0:
        raise InvalidInput("highest", highest, "a positive frequency [Hz]")
    ax = axes(ax)
    shown = (spectrum.frequency <= highest) & (spectrum.frequency > 0)
    density = spectrum.density[shown]
    if not density.any():
        return explain(ax, "Nothing moves: there is no power.")
    floor = max(density.max() * 10.0**-DECADES, np.finfo(float).tiny)
    # Below the floor, but drawn, so that the flanks of a line go down to it.
    density = np.maximum(density, floor / 10)
    ax.semilogy(spectrum.frequency[shown], density, color=BLUE, linewidth=0.9)
    ax.set_ylim(max(floor, density.min()), 3 * density.max())
    if forcing is not None and forcing <= highest:
        label = f"forcing, {forcing:.4g}{' Hz' if spectrum.in_seconds else ''}"
        ax.axvline(forcing, color=GREY, linewidth=0.8, linestyle=":", label=label, zorder=1)
        legend(ax, "upper right", borderaxespad=0)
    ax.set_xlim(0, highest)
    symbols = {"displacement": "$x$", "velocity": "$x'$"}
    symbol = symbols.get(spectrum.quantity) or called(spectrum.quantity)
    if spectrum.in_seconds:
        return frame(ax, "frequency [Hz]", f"power density of {symbol} [unit$^2$/Hz]")
    return frame(ax, "frequency", f"power density of {symbol}")


def _sampled_portrait(
    motion: BeamMotion | NoisyMotion, ax: Axes, start: float | None, stop: float | None
) -> Axes:
    """Portrait of a cantilever's tip over the last 50 forcing periods, or of a sampled path."""
    from ...oscillators import Cantilever
    from ...stochastic.noisy_motion import NoisyMotion

    period = motion.system.forcing_period or motion.duration / 50
    last = motion.stop if stop is None else number("stop", stop, "a time", most=motion.stop)
    first = max(motion.start, last - 50 * period)
    first = first if start is None else number("start", start, "a time", least=motion.start)
    if not first < last:
        raise InvalidInput("start, stop", f"{start}, {stop}", "a span inside the motion")
    stops: tuple[Any, ...]
    if isinstance(motion.system, Cantilever):
        hits = motion.impacts.time
        fine = np.linspace(first, last, 40_000)
        time = np.union1d(fine, hits[(hits >= first) & (hits <= last)])
        x, v = motion.sample(time)
        stops = () if motion.system.stop is None else (motion.system.stop,)
    else:
        assert isinstance(motion, NoisyMotion)
        within = (motion.time >= first) & (motion.time <= last)
        x, v, stops = motion.x[within], motion.v[within], motion.system.stops
    ax.plot(x, v, color=BLUE, linewidth=0.7)
    ax.margins(0.06)
    ax.autoscale_view()
    for wall in stops:
        if x.min() - np.ptp(x) <= wall.position <= x.max() + np.ptp(x):
            _stop_line(ax, wall)
    return frame(ax, "displacement $x$", "velocity $x'$")


def _recorded_portrait(
    motion: RecordedMotion, ax: Axes, start: float | None, stop: float | None, phase: float | None
) -> Axes:
    first, last = sample_span(start, stop, motion.rate, len(motion.x), float(motion.time[0]))
    ax.plot(motion.x[first:last], motion.v[first:last], color=BLUE, linewidth=0.7)
    if phase is not None and motion.phase is not None:
        label = "once a period" if phase == 0 else f"once a period, at phase {phase:.3g}"
        points(ax, *motion.stroboscopic(phase), color=VERMILLION, label=label, zorder=3)
        _legend_above(ax)
    unit = motion.unit
    ax.margins(0.06)
    return frame(
        ax,
        f"displacement $x$ [{unit}]" if unit else "displacement $x$",
        f"velocity $x'$ [{unit}/s]" if unit else "velocity $x'$",
    )


def _legend_above(ax: Axes) -> None:
    """A legend with opaque marks, since many overlap in the figure."""
    marks = legend(ax, "above", ncols=4, borderpad=0, handletextpad=0.4, handlelength=1.2)
    for handle in marks.legend_handles:
        if handle is not None and handle.get_label() != "stuck":
            handle.set_alpha(1)


# -- the stops -----------------------------------------------------------------------------------


def _in_sight(motion: Motion, x: np.ndarray) -> list[Any]:
    """The stops that the motion reaches or comes near to."""
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    room = 0.5 * (high - low)
    stops = motion.system.stops
    return [stop for stop in stops if low - room <= stop.position <= high + room]


def _stop_style(stop: Any) -> dict[str, Any]:
    style = "-" if stop.law.rigid else (0, (5, 3))
    return {"color": EDGE, "linewidth": 1.0, "linestyle": style, "zorder": 1.5}


def _stop_line(ax: Axes, stop: Any) -> None:
    """A vertical line at a stop, shaded behind it."""
    low, high = ax.get_xlim()
    low, high = min(low, stop.position), max(high, stop.position)
    room = 0.04 * (high - low)
    low = stop.position - room if low > stop.position - room else low
    high = stop.position + room if high < stop.position + room else high
    ax.axvline(stop.position, **_stop_style(stop))
    behind = (stop.position, high) if stop.side == "upper" else (low, stop.position)
    ax.axvspan(*behind, color=GREY, alpha=0.12, linewidth=0)
    ax.set_xlim(low, high)
