"""Oscillator and feedback -> motion under control."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .._arguments import number
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..simulate import RungeKutta
from ..simulate.motion import TURN
from ._delayed import run_delayed
from .controlled import ControlledMotion, under_control
from .feedback import DelayedFeedback, Phase, schedule


def control(
    oscillator: Oscillator,
    feedback: DelayedFeedback | Sequence[Phase],
    *,
    periods: float,
    start: float | None = None,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
    method: RungeKutta | None = None,
    chatter: float = 1e-6,
) -> ControlledMotion:
    """The motion of an oscillator under control.
    """
    if not isinstance(oscillator, Oscillator):
        raise InvalidInput("oscillator", oscillator, "an Oscillator, as impactsig.scenes makes")
    if oscillator.forcing_frequency is None:
        raise InvalidInput(
            "oscillator", oscillator, "an oscillator with forcing",
            "Delays are counted in its forcing periods",
        )  # fmt: skip
    length = number("periods", periods, positive=True)
    phases = schedule(feedback, start, length)
    if method is None:
        method = RungeKutta(1e-12)
    if not isinstance(method, RungeKutta):
        raise InvalidInput("method", method, "RungeKutta(...) or None")
    motion, line = run_delayed(
        oscillator, phases, length, initial=initial,
        phase=math.fmod(number("phase", phase), TURN) % TURN, method=method, chatter=chatter,
    )  # fmt: skip
    return under_control(motion, phases, line)
