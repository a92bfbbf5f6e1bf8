"""A system and what controls it -> its motion under control."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, overload

from .._arguments import number
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..oscillators.flows import Flow
from ..simulate import RungeKutta
from ..simulate._events import TURN
from ..simulate._run import LONGEST
from ._delayed import run_delayed
from ._nudged import run_nudged
from .controlled import ControlledMotion, under_control
from .flow import ControlledTrajectory, control_flow
from .ogy import OGY
from .schedule import Controller, Phase, schedule

TOLERANCE = 1e-12  # of delayed feedback, unless told otherwise


@overload
def control(
    system: Oscillator,
    controller: Controller | Sequence[Phase],
    *,
    periods: float,
    start: float | None = None,
    initial: Sequence[float] | None = None,
    phase: float | None = None,
    method: RungeKutta | None = None,
    chatter: float = 1e-6,
) -> ControlledMotion: ...


@overload
def control(
    system: Flow,
    controller: Controller | Sequence[Phase],
    *,
    duration: float,
    start: float | None = None,
    initial: Sequence[float] | None = None,
) -> ControlledTrajectory: ...


def control(
    system: Oscillator | Flow,
    controller: Controller | Sequence[Phase],
    *,
    periods: float | None = None,
    duration: float | None = None,
    start: float | None = None,
    initial: Sequence[float] | None = None,
    phase: float | None = None,
    method: RungeKutta | None = None,
    chatter: float = 1e-6,
) -> ControlledMotion | ControlledTrajectory:
    """The motion of an oscillator, or the course of a flow, under control.

    Delayed feedback makes the motion one with a delay and with impacts. It is stepped by Dormand
    and Prince's method of order 8, what is fed back coming from its interpolant; steps end on the
    impacts, where the force reaches its limit or comes back from it, and one delay after each of
    these, again and again, so that the order holds throughout. Under `OGY` it is simulated period
    by period, exactly where the oscillator is piecewise linear.

    Parameters
    ----------
    system : Oscillator or Flow
        What moves. An oscillator must be forced, as delays and sections are counted in its forcing
        periods. A flow is controlled by delayed feedback only.
    controller : DelayedFeedback or OGY, or a sequence of (float, one of them or None)
        What controls it from `start` on; or several, each from its own start to that of the next,
        such as ``[(100, DelayedFeedback(0.15, 1, 0.1)), (300, DelayedFeedback(0.15, 2, 0.1)),
        (500, None)]`` to go from one orbit to another and let go.
    periods : float
        How long to look at an oscillator, from t = 0 [forcing periods].
    duration : float
        How long to look at a flow, in its unit of time.
    start : float, optional
        When control is switched on, in forcing periods or the flow's unit of time; by default as
        soon as there is something to feed back, one delay after t = 0.
    initial : sequence of float, optional
        State at t = 0: displacement and velocity, in the oscillator's units and against the ground,
        (0, 0) unless given; or the coordinates of a flow.
    phase : float, optional
        Phase of the forcing at t = 0 [rad]; 0, or under OGY that of the orbit's section.
    method : RungeKutta, optional
        How to step; ``RungeKutta(1e-12)`` under delayed feedback, and as in `simulate` under OGY.
    chatter : float
        As in `simulate`.

    Returns
    -------
    ControlledMotion or ControlledTrajectory
        A `Motion` (or the states of the flow) with the control force, kept whole: about 10 kB a
        forcing period under delayed feedback. The status is "diverged" where a gain has blown up:
        what there was until then is kept.

    Raises
    ------
    InvalidInput
        If an argument is out of its range, the oscillator is not forced, phases overlap, or the
        orbit of an OGY is none of this oscillator.

    Examples
    --------
    >>> beam = scenes.karpodinis(20.3355)
    >>> locked = control(beam, DelayedFeedback(0.15, 1, limit=0.1), periods=600, start=300)
    >>> time, rms = locked.effort()
    >>> control(flows.rossler(), DelayedFeedback(0.2, 5.881, signal="y"), duration=300, start=100)
    """
    if isinstance(system, Flow):
        return _flow(system, controller, periods, duration, start, initial, phase, method)
    if not isinstance(system, Oscillator):
        raise InvalidInput("system", system, "an Oscillator, as impactsig.scenes makes, or a Flow")
    if system.forcing_frequency is None:
        raise InvalidInput(
            "system", system, "an oscillator with forcing", "Control is counted in its periods"
        )
    if duration is not None:
        raise InvalidInput("duration", duration, "periods= for an oscillator")
    chatter = number("chatter", chatter, above=0, most=1e-2)
    length = number("periods", periods, above=0, most=LONGEST)
    phases = schedule(controller, start, length)
    if not isinstance(method, (RungeKutta, type(None))):
        raise InvalidInput("method", method, "RungeKutta(...) or None")
    begin = 0.0 if phase is None else number("phase", phase)
    initial = (0.0, 0.0) if initial is None else initial
    options: dict[str, Any] = {"initial": initial, "method": method, "chatter": chatter}
    nudging = [own for _, own in phases if isinstance(own, OGY)]
    if nudging:
        options["phase"] = _section(system, nudging, phase)
        motion, engines = run_nudged(system, phases, length, **options)
        return under_control(motion, phases, engines)
    options["method"] = method or RungeKutta(TOLERANCE)
    options["phase"] = math.fmod(begin, TURN) % TURN
    motion, line = run_delayed(system, phases, length, **options)
    return under_control(motion, phases, line)


def _section(system: Oscillator, nudging: list[OGY], phase: float | None) -> float:
    """The phase at which all of them nudge.

    Raises
    ------
    InvalidInput
        If they differ, the run is to begin at another, or an orbit is none of the oscillator.
    """
    section = math.fmod(nudging[0].orbit.phase, TURN) % TURN
    for own in nudging:
        own.check(system)
        if abs(math.remainder(own.orbit.phase - section, TURN)) > 1e-12:
            raise InvalidInput(
                "controller", f"an orbit at phase {own.orbit.phase:g}",
                f"all orbits at the phase of the first, {section:g}",
            )  # fmt: skip
    if phase is not None and abs(math.remainder(phase - section, TURN)) > 1e-12:
        raise InvalidInput("phase", phase, f"that of the orbit's section, {section:.9g}, or None")
    return section


def _flow(
    flow: Flow, controller: Any, periods: Any, duration: Any, start: Any, initial: Any,
    phase: Any, method: Any,
) -> ControlledTrajectory:  # fmt: skip
    given = {"periods": periods, "phase": phase, "method": method}
    for name, value in given.items():
        if value is not None:
            raise InvalidInput(name, value, f"no {name} for a flow: it is told duration= alone")
    length = number("duration", duration, above=0)
    phases = schedule(controller, start, length)
    if any(isinstance(own, OGY) for _, own in phases):
        raise InvalidInput("controller", controller, "a DelayedFeedback for a flow")
    return control_flow(flow, phases, length, initial)
