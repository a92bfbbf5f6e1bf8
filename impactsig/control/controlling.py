"""Oscillator and controller -> motion under control."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .._arguments import number
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..simulate import FixedStep, RungeKutta
from ..simulate.motion import TURN
from ._delayed import run_delayed
from ._nudged import run_nudged
from .controlled import ControlledMotion, under_control
from .ogy import OGY
from .schedule import Controller, Phase, schedule

TOLERANCE = 1e-12  # of delayed feedback, unless told otherwise


def control(
    oscillator: Oscillator,
    controller: Controller | Sequence[Phase],
    *,
    periods: float,
    start: float | None = None,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float | None = None,
    method: RungeKutta | None = None,
    chatter: float = 1e-6,
) -> ControlledMotion:
    """The motion of an oscillator under control.

    Delayed feedback makes the motion one with a delay and with impacts. It is stepped by Dormand
    and Prince's method of order 8, what is fed back coming from its interpolant; steps end on the
    impacts, where the force reaches its limit or comes back from it, and one delay after each of
    these, again and again, so that the order holds throughout. Under `OGY` it is simulated period
    by period, exactly where the oscillator is piecewise linear.

    Parameters
    ----------
    oscillator : Oscillator
        What moves; it must be forced, as delays and sections are counted in its forcing periods.
    controller : DelayedFeedback or OGY, or a sequence of (float, one of them or None)
        What controls it from `start` on; or several, each from its own start [forcing periods] to
        that of the next, such as ``[(100, DelayedFeedback(0.15, 1, 0.1)), (300,
        DelayedFeedback(0.15, 2, 0.1)), (500, None)]`` to go from one orbit to another and let go.
    periods : float
        How long to look, from t = 0 [forcing periods].
    start : float, optional
        When control is switched on [forcing periods]; by default as soon as there is something to
        feed back, one delay after t = 0.
    initial : (float, float)
        Displacement and velocity at t = 0, in the oscillator's units, against the ground.
    phase : float, optional
        Phase of the reference forcing at t = 0 [rad]; 0, or under OGY that of the orbit's section.
    method : RungeKutta, optional
        How to step; ``RungeKutta(1e-12)`` under delayed feedback, and as in `simulate` under OGY.
    chatter : float
        As in `simulate`.

    Returns
    -------
    ControlledMotion
        A `Motion` with its control force, kept whole: about 10 kB a forcing period under delayed
        feedback. Its status is "diverged" where a gain has blown up: what there was until then is
        kept.

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
    """
    if not isinstance(oscillator, Oscillator):
        raise InvalidInput("oscillator", oscillator, "an Oscillator, as impactsig.scenes makes")
    if oscillator.forcing_frequency is None:
        raise InvalidInput(
            "oscillator", oscillator, "an oscillator with forcing",
            "Control is counted in its forcing periods",
        )  # fmt: skip
    if not 0 < chatter <= 1e-2:
        raise InvalidInput("chatter", chatter, "0 < chatter <= 0.01")
    length = number("periods", periods, positive=True)
    phases = schedule(controller, start, length)
    if isinstance(method, FixedStep) or not isinstance(method, (RungeKutta, type(None))):
        raise InvalidInput("method", method, "RungeKutta(...) or None")
    begin = 0.0 if phase is None else number("phase", phase)
    options: dict[str, Any] = {"initial": initial, "method": method, "chatter": chatter}
    nudging = [own for _, own in phases if isinstance(own, OGY)]
    if not nudging:
        options["method"] = method or RungeKutta(TOLERANCE)
        motion, line = run_delayed(
            oscillator, phases, length, phase=math.fmod(begin, TURN) % TURN, **options
        )
        return under_control(motion, phases, line)
    section = math.fmod(nudging[0].orbit.phase, TURN) % TURN
    for own in nudging:
        own.check(oscillator)
        if abs(math.remainder(own.orbit.phase - section, TURN)) > 1e-12:
            raise InvalidInput(
                "controller", own.orbit.phase, f"an orbit at the phase of the first, {section:g}"
            )
    if phase is not None and abs(math.remainder(begin - section, TURN)) > 1e-12:
        raise InvalidInput("phase", phase, f"that of the orbit's section, {section:.9g}, or None")
    motion, engines = run_nudged(oscillator, phases, length, phase=section, **options)  # type: ignore[arg-type]
    return under_control(motion, phases, engines)
