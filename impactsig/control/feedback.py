"""Delayed feedback as data, and its schedule."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Any

from .._arguments import choice
from ..errors import InvalidInput
from ..oscillators.parts import numbers

OF_OSCILLATOR = '"velocity" or "displacement" of an oscillator'
OF_FLOW = "the name or number of a coordinate"


@dataclass(frozen=True)
class DelayedFeedback:
    """Delayed feedback: a force that vanishes on orbits of one period and stabilises them.

    ``F = gain * (w(t) - y(t))``, with what was seen before, ``w = (1 - memory) y(t - delay) +
    memory w(t - delay)``, and no more than ``limit`` either way [Pyragas1992]_. With a memory it is
    extended to all earlier delays, ``w = (1 - memory) sum of memory^(n - 1) y(t - n delay)``
    (ETDAS, [Socolar1994]_), which stabilises what one delay cannot.

    Parameters
    ----------
    gain : float
        K, force by signal, in the oscillator's units; of a flow, rate by signal.
    delay : float
        Forcing periods of an oscillator: 1 for orbits that close after one. Units of time of a
        flow.
    limit : float, optional
        F0, the greatest force; none unless given.
    signal : str or int
        y: "velocity" or "displacement" of an oscillator, against what carries the stops; the name
        or number of a coordinate of a flow, whose rate the feedback is added to. Which of them
        there are depends on the system: `Controlled` and `orbit_stability` refuse others.
    memory : float
        R, from 0 up to but without 1. The memory begins empty with the feedback: the first delay
        is fed back as it was.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    See Also
    --------
    Controlled, orbit_stability, stability_chart, OGY

    Examples
    --------
    >>> from impactsig import Controlled, DelayedFeedback, scenes, simulate
    >>> feedback = DelayedFeedback(0.15, 1, limit=0.1)
    >>> motion = simulate(Controlled(scenes.karpodinis(20.3355), feedback), periods=100)
    >>> motion.status
    'complete'
    """

    gain: float
    delay: float = 1.0
    limit: float | None = None
    signal: str | int = "velocity"
    memory: float = 0.0

    def __post_init__(self) -> None:
        numbers(self, "gain")
        numbers(self, "delay", *(["limit"] if self.limit is not None else []), above=0)
        numbers(self, "memory", least=0.0, most=1.0)
        if self.memory == 1.0:
            raise InvalidInput("memory", self.memory, "0 <= memory < 1")
        signal: Any = self.signal
        whole = isinstance(signal, Integral) and not isinstance(signal, bool)
        if not (signal >= 0 if whole else isinstance(signal, str) and signal):
            raise InvalidInput("signal", self.signal, f"{OF_OSCILLATOR}, or {OF_FLOW}")


def check_signal(feedback: DelayedFeedback) -> None:
    """Refuse to feed back a signal that an oscillator does not have.

    Raises
    ------
    InvalidInput
        If the signal is neither the velocity nor the displacement.
    """
    choice("signal", feedback.signal, ("velocity", "displacement"))
