"""A simulated motion: phase portrait, time history, power spectrum."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import InvalidInput, finite_number
from ._axes import BLUE, GREY, ORANGE, VERMILLION, axes, explain, points, seconds

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..impacts import Impacts
    from ..simulate.motion import Motion
    from ..simulate.spectrum import PowerSpectrum

EDGE = "#A6A6A6"
"""A stop's colour: light, for what hits it is drawn along it."""

PER_PERIOD = 300
"""Points of a line in a forcing period, and a twelfth of that, at least, between two events."""

MOST_IMPACTS = 5000
"""Impacts drawn unless a span is chosen; more than that a page cannot show."""

DECADES = 12
"""Powers of ten that a spectrum is drawn over: below are the roundings of a periodic motion."""


def phase_portrait(
    motion: Motion,
    ax: Axes | None = None,
    *,
    start: float | None = None,
    stop: float | None = None,
    phase: float | None = 0.0,
) -> Axes:
    """Draw velocity over displacement, with the stops and stroboscopic points.

    On a rigid stop, drawn by a full line with a shade behind, a dashed line spans what the velocity
    jumps over; a soft stop is itself drawn by a dashed line. Where the stops move, displacement and
    velocity are taken relative to them.

    Parameters
    ----------
    motion : Motion
        What moved, with all kept.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.
    start, stop : float, optional
        Span to draw [s]; by default the last 50 forcing periods of the motion, or its last
        5000 impacts where these are fewer.
    phase : float or None
        Phase of the reference forcing at which the points are taken, over the whole motion [rad];
        None for no points.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    InvalidInput
        If the span is not in the motion, or only counts were kept.
    """
    path = _path(motion, *_span(motion, start, stop, periods=50), relative=True)
    ax = axes(ax, width=4.8, height=4.4)
    ax.plot(path.x, path.v, color=BLUE, linewidth=0.7)
    ax.vlines(*_spans_jumped(path), color=BLUE, linewidth=1.4, linestyle=(0, (3, 2)), zorder=2.5)
    if phase is not None and motion.oscillator.forcing_frequency is not None:
        time = _strobe(motion, finite_number("phase", phase, "a finite angle [rad]"))
        x, v = _from_stops(motion, time)
        label = "once a period" if phase == 0 else f"once a period, at phase {phase:.3g}"
        points(ax, x, v, color=VERMILLION, label=label, zorder=3)
        _legend_above(ax)
    near = _in_sight(motion, path.x)
    ax.margins(0.06)
    ax.locator_params(axis="x", nbins=6)
    ax.autoscale_view()
    for one in near:
        _stop_line(ax, one)
    moving = _stops_move(motion)
    ax.set_xlabel("displacement from the base $x - b$" if moving else "displacement $x$")
    ax.set_ylabel("velocity $x' - b'$" if moving else "velocity $x'$")
    return ax


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
        What moved, with all kept.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.
    start, stop : float, optional
        Span to draw [s]; by default the last 10 forcing periods of the motion, or its last
        5000 impacts where these are fewer.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    InvalidInput
        If the span is not in the motion, or only counts were kept.
    """
    first, last = _span(motion, start, stop, periods=10)
    path = _path(motion, first, last, relative=False)
    ax = axes(ax, width=8.0)
    ax.plot(path.time, path.x, color=BLUE, linewidth=1.0)
    impacts, sticks = _events(motion)
    hits = impacts.time[(impacts.time >= first) & (impacts.time <= last)]
    if len(hits):
        label = f"{len(hits)} impact{'s' * (len(hits) > 1)}"
        points(ax, hits, motion.sample(hits)[0], color=VERMILLION, label=label, zorder=3)
    for begin, end in np.clip(sticks, first, last):
        if begin < end:
            ax.axvspan(begin, end, color=ORANGE, alpha=0.25, linewidth=0, label="stuck")
    near = _in_sight(motion, path.x - _base(motion, path.time)[0])
    ax.margins(x=0, y=0.1)
    time = np.linspace(first, last, 2 + int(PER_PERIOD * (last - first) / _period(motion)))
    base = _base(motion, time)[0]
    for one in near:
        ax.plot(time, one.position + base, **_stop_style(one))
    ax.autoscale_view()
    low, high = ax.get_ylim()
    for one in near:
        behind = high if one.side == "upper" else low
        ax.fill_between(time, one.position + base, behind, color=GREY, alpha=0.12, linewidth=0)
    ax.set_ylim(low, high)
    if ax.get_legend_handles_labels()[0]:
        _legend_above(ax)
    seconds(ax.xaxis, "time", [last])
    ax.set_ylabel("displacement $x$")
    return ax


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
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.
    highest : float, optional
        Highest frequency drawn [Hz]; a little over 10 times that of the forcing by default.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    InvalidInput
        If there is no spectrum of the motion, or `highest` is not positive.
    """
    from ..simulate.spectrum import PowerSpectrum

    spectrum = result if isinstance(result, PowerSpectrum) else result.power_spectrum()
    forcing, top = spectrum.forcing_frequency, float(spectrum.frequency[-1])
    if highest is None:
        highest = min(10.5 * forcing, top) if forcing else top
    elif not finite_number("highest", highest, "a positive frequency [Hz]") > 0:
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
        label = f"forcing, {forcing:.4g} Hz"
        ax.axvline(forcing, color=GREY, linewidth=0.8, linestyle=":", label=label, zorder=1)
        ax.legend(loc="upper right", frameon=False, borderaxespad=0)
    ax.set_xlim(0, highest)
    ax.set_xlabel("frequency [Hz]")
    symbol = "$x$" if spectrum.quantity == "displacement" else "$x'$"
    ax.set_ylabel(f"power density of {symbol} [unit$^2$/Hz]")
    return ax


def _legend_above(ax: Axes) -> None:
    """What the marks mean, above the axes and each once."""
    found = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    legend = ax.legend(
        found.values(), found.keys(), loc="lower left", bbox_to_anchor=(0, 1), ncols=4,
        frameon=False, borderaxespad=0.2, borderpad=0, handletextpad=0.4, handlelength=1.2,
    )  # fmt: skip
    for handle in legend.legend_handles:
        if handle is not None and handle.get_label() != "stuck":
            handle.set_alpha(1)


# -- the line ------------------------------------------------------------------------------------


class _Path(NamedTuple):
    """A line, broken by NaN at the jumps; and those: displacement, velocity before and after."""

    time: np.ndarray
    x: np.ndarray
    v: np.ndarray
    jumps: np.ndarray


def _path(motion: Motion, start: float, stop: float, relative: bool) -> _Path:
    """States at enough times between any two events to draw a smooth line."""
    impacts, sticks = _events(motion)
    period = _period(motion)
    lasts = 0.0 if impacts.contact_time is None else impacts.contact_time
    edges = np.concatenate(([start, stop], impacts.time, impacts.time + lasts, sticks.ravel()))
    edges = np.unique(edges[(edges >= start) & (edges <= stop)])
    # Sampling at an event gives one of its sides; a little off it, for certain the one meant.
    aside = max(1e-9 * period, 8 * np.spacing(abs(stop)))
    legs = [(a + aside, b - aside) for a, b in pairwise(edges)]
    legs = [(a, b) for a, b in legs if b > a]
    size = [PER_PERIOD // 12 + int(PER_PERIOD * (b - a) / period) for a, b in legs]
    time = np.concatenate([np.linspace(*leg, n) for leg, n in zip(legs, size, strict=True)])
    x, v = _from_stops(motion, time) if relative else motion.sample(time)
    after = np.cumsum(size)[:-1]
    jumps = np.stack([x[after], v[after - 1], v[after]])
    where = np.abs(jumps[2] - jumps[1]) > 1e-6 * np.ptp(v)
    time, x, v = (np.insert(one, after[where], np.nan) for one in (time, x, v))
    return _Path(time, x, v, jumps[:, where])


def _spans_jumped(path: _Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the velocity jumps, and from where to where of all jumps there.

    Dashes on dashes would look like a line.
    """
    x, before, after = path.jumps
    apart = np.diff(np.sort(x), prepend=-np.inf) > 1e-6 * np.nanmax(np.abs(path.x))
    first = np.flatnonzero(apart)
    if not len(first):
        return x, before, after
    order = np.argsort(x)
    low = np.minimum.reduceat(np.minimum(before, after)[order], first)
    high = np.maximum.reduceat(np.maximum(before, after)[order], first)
    return x[order][first], low, high


def _events(motion: Motion) -> tuple[Impacts, np.ndarray]:
    """The impacts and the sticks, where they were kept."""
    if motion.impacts is None or motion.sticks is None:
        raise InvalidInput("keep", "counts", 'simulate(..., keep="all")')
    return motion.impacts, motion.sticks


def _span(
    motion: Motion, start: float | None, stop: float | None, periods: int
) -> tuple[float, float]:
    last = motion.stop if stop is None else min(finite_number("stop", stop, "a time"), motion.stop)
    first = last - periods * _period(motion) if start is None else start
    hits = _events(motion)[0].time
    hits = hits[hits <= last]
    if start is None and len(hits) > MOST_IMPACTS:
        first = max(first, hits[-MOST_IMPACTS])
    first = max(finite_number("start", first, "a time [s]"), motion.start)
    if not first < last:
        raise InvalidInput(
            "start, stop",
            f"{start}, {stop}",
            f"a span in the motion's, {motion.start:.6g} to {motion.stop:.6g} s",
        )
    return first, last


def _period(motion: Motion) -> float:
    """Time that the motion takes for about one swing [s]."""
    own = motion.oscillator.natural_frequency
    natural = 2 * math.pi / own * motion.oscillator.time_unit if own else motion.duration / 10
    return motion.oscillator.forcing_period or natural


# -- the stops -----------------------------------------------------------------------------------


def _stops_move(motion: Motion) -> bool:
    return bool(motion.oscillator.base and motion.oscillator.base.stops)


def _from_stops(motion: Motion, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity relative to what carries the stops."""
    at, moving = _base(motion, time)
    x, v = motion.sample(time)
    return x - at, v - moving


def _base(motion: Motion, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity of what carries the stops."""
    base = motion.oscillator.base
    if base is None or not base.stops:
        return 0 * time, 0 * time
    omega = motion.oscillator.forcing_frequency or base.frequency
    turned = base.frequency * (time / motion.oscillator.time_unit + _begun(motion) / omega)
    angle = turned + base.phase
    velocity = -base.frequency * base.amplitude * np.sin(angle)
    return base.amplitude * np.cos(angle), velocity


def _begun(motion: Motion) -> float:
    """Phase of the reference forcing at t = 0, from 0 to 2 pi."""
    omega = motion.oscillator.forcing_frequency or 0.0
    phase = motion.final[2] - math.fmod(omega * motion.stop / motion.oscillator.time_unit, math.tau)
    # Rounding may put a start at 0 a turn later.
    return (phase + 1e-6) % math.tau - 1e-6


def _strobe(motion: Motion, phase: float) -> np.ndarray:
    """Times of the motion at which the reference forcing has that phase."""
    period = motion.oscillator.forcing_period
    assert period is not None
    first = (phase - _begun(motion)) / math.tau * period
    count = np.arange(
        math.ceil((motion.start - first) / period), math.floor((motion.stop - first) / period) + 1
    )
    return np.clip(first + count * period, motion.start, motion.stop)


def _in_sight(motion: Motion, x: np.ndarray) -> list[Any]:
    """The stops that the motion comes to, or near to."""
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    room = 0.5 * (high - low)
    stops = motion.oscillator.stops
    return [stop for stop in stops if low - room <= stop.position <= high + room]


def _stop_style(stop: Any) -> dict[str, Any]:
    from ..oscillators import Rigid

    rigid = isinstance(stop.law, Rigid)
    style = "-" if rigid else (0, (5, 3))
    return {"color": EDGE, "linewidth": 1.0, "linestyle": style, "zorder": 1.5}


def _stop_line(ax: Axes, stop: Any) -> None:
    """A vertical line where a stop stands, with a shade behind it, in view."""
    low, high = ax.get_xlim()
    low, high = min(low, stop.position), max(high, stop.position)
    room = 0.04 * (high - low)
    low = stop.position - room if low > stop.position - room else low
    high = stop.position + room if high < stop.position + room else high
    ax.axvline(stop.position, **_stop_style(stop))
    behind = (stop.position, high) if stop.side == "upper" else (low, stop.position)
    ax.axvspan(*behind, color=GREY, alpha=0.12, linewidth=0)
    ax.set_xlim(low, high)
