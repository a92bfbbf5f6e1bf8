"""Spikes from flows: integrate and fire, and threshold crossings."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from ..._arguments import GREATEST, choice, instance, number, one_of_them, whole
from ...errors import InvalidInput
from ...impacts import Impacts, exact
from ...oscillators.flows import Flow
from ...recording import Recording
from ..basis.events import TIME
from .course import WITH_STOPS, Running

Signal = Callable[[Any], float] | str | int


def integrate_and_fire(
    flow: Flow,
    threshold: float,
    *,
    signal: Signal | None = None,
    count: int | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: Sequence[float] | None = None,
) -> Impacts:
    """Spikes of a neuron that integrates a signal up to a threshold [Sauer1994]_.

    ``integral of S(y(t)) dt from one spike to the next = threshold``; the integral starts from 0 at
    the end of the transient and again at each spike, so that every interval, including the one
    before the first spike, is complete. With a signal of either sign, a spike occurs when the
    integral first reaches the threshold from below.

    The flow is integrated by Dormand and Prince's method of order 8 at a tolerance of 1e-13, and a
    spike is the root of the integral on its interpolant, corrected by a step that ends there. Every
    spike is found, even if there are several within a step. Instants are accurate to 1e-10 or
    better as long as errors have not grown. In a chaotic flow errors grow as exp(lambda t): in the
    Lorenz system to 1e-10 within 10 units of time and to the size of the attractor within 35. The
    spikes are then those of another trajectory nearby, and each interval is still accurate for the
    state at its start.

    Parameters
    ----------
    flow : Flow
        See `impactsig.flows`.
    threshold : float
        Integral at which a spike occurs, in units of the signal times time; positive. It determines
        the number of spikes per orbit of the flow.
    signal : callable, str or int, optional
        ``signal(y)`` as a function of the state, which numba must be able to compile; it need not
        be positive. Or the name or number of a coordinate. By default the signal of the flow. A
        function is compiled once: define it outside of loops.
    count, duration : int, float
        Number of spikes, or duration after the transient. Give one of them.
    transient : float
        Duration of the transient, in which no spikes are counted.
    initial : sequence of float, optional
        State at t = 0, if not that of the flow.

    Returns
    -------
    Impacts
        Instants counted from t = 0, the transient included. Where there are fewer than asked for,
        because the flow diverges or fires no more, `reason` says so.

    Raises
    ------
    InvalidInput
        If an argument is out of range, or numba cannot compile a function.

    See Also
    --------
    threshold_crossings, measure

    Examples
    --------
    >>> from impactsig import flows, integrate_and_fire
    >>> train = integrate_and_fire(flows.rossler(), 20.0, count=101, transient=200)
    >>> len(train.intervals())
    100
    """
    threshold = number("threshold", threshold, above=0)
    if isinstance(flow, Flow) and signal is None:
        signal = flow.signal
        if signal is None:
            raise InvalidInput("signal", None, "a signal, since the flow has none")
    return _spikes(
        flow, signal, initial, count, duration, transient, threshold, True, "up", "integral"
    )


def threshold_crossings(
    flow: Flow,
    level: float,
    *,
    signal: Signal = 0,
    direction: Literal["up", "down", "both"] = "up",
    count: int | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: Sequence[float] | None = None,
) -> Impacts:
    """Spikes at the crossings of a level by a signal [CastroSauer1997]_.

    The accuracy is that of `integrate_and_fire`. Over a step the signal is represented by a
    polynomial of degree 11, of which no crossing is missed, and the instants are then corrected;
    for a coordinate this is exact. A signal that touches the level does not cross it; one that
    starts on it crosses when it returns.

    Parameters
    ----------
    flow : Flow
        See `impactsig.flows`.
    level : float
        Level, in units of the signal.
    signal : callable, str or int
        The name or number of a coordinate; or ``signal(y)``, a smooth function of the state, which
        numba must be able to compile.
    direction : {"up", "down", "both"}
        Which crossings count.
    count, duration : int, float
        Number of spikes, or duration after the transient. Give one of them.
    transient : float
        Duration of the transient, in which no spikes are counted.
    initial : sequence of float, optional
        State at t = 0, if not that of the flow.

    Returns
    -------
    Impacts
        Instants counted from t = 0, the transient included. Where there are fewer than asked for,
        because the flow diverges or crosses no more, `reason` says so.

    Raises
    ------
    InvalidInput
        If an argument is out of range, or numba cannot compile a function.

    See Also
    --------
    integrate_and_fire, displacement_section, recorded_motion

    Notes
    -----
    The intervals have the dimension of a section, one less than the attractor's.

    Examples
    --------
    >>> from impactsig import flows, threshold_crossings
    >>> returns = threshold_crossings(flows.rossler(), 0.0, signal="x", count=101, transient=200)
    >>> len(returns.intervals())
    100
    """
    remedy = WITH_STOPS
    if hasattr(flow, "crossings"):
        remedy = "A RecordedMotion has a method crossings()"
    elif isinstance(flow, Recording):
        remedy = "recorded_motion(recording).crossings(level) finds those of a recording"
    instance("flow", flow, Flow, "a Flow", remedy)
    level = number("level", level)
    choice("direction", direction, ("up", "down", "both"))
    return _spikes(
        flow, signal, initial, count, duration, transient, level, False, direction, "crossing"
    )


def _spikes(
    flow: Flow,
    signal: Signal | None,
    initial: Sequence[float] | None,
    count: int | None,
    duration: float | None,
    transient: float,
    level: float,
    fires: bool,
    direction: str,
    kind: str,
) -> Impacts:
    given, value = one_of_them(count=count, duration=duration)
    wanted, end = GREATEST, math.inf
    transient = number("transient", transient, least=0)
    if given == "count":
        wanted = whole("count", value, 1)
    else:
        end = transient + number("duration", value, above=0)
    running = Running(flow, signal, initial, fires)

    from .flow_spikes import Task

    settled, reason = Running(flow, None, initial).sample(np.array([transient]))
    times = np.empty(0)
    if not reason:
        running.course.state[: flow.dimension] = settled[0]
        running.course.clock[TIME] = transient
        task = Task(level, direction != "down", direction != "up", end, wanted)
        times, reason = running.spikes(task)
    stop = end
    if reason:
        stop = running.time
    elif count is not None:
        stop = times[-1]
    elif not len(times):
        reason = f"no spike came to t = {end:g}"
    stop = max(transient, stop, *times[-1:])
    return Impacts(
        times,
        **exact(len(times)),
        start=transient,
        duration=stop - transient,
        threshold=level,
        source=flow.name,
        settings={
            "spikes": kind,
            "parameters": list(flow.parameters),
            "signal": getattr(signal, "__name__", signal),
            "direction": direction,
            "transient": transient,
        },
        reason=reason,
    )
