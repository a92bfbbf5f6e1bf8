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

    ``F = gain * (w(t) - y(t))`` with the delayed signal
    ``w(t) = (1 - memory) y(t - delay) + memory w(t - delay)``; ``abs(F)`` is at most `limit`
    [Pyragas1992]_. With a memory, all earlier delays contribute,
    ``w = (1 - memory) sum of memory^(n - 1) y(t - n delay)`` (ETDAS, [Socolar1994]_), which can
    stabilise orbits that a single delay cannot.

    Parameters
    ----------
    gain : float
        Gain K: force per unit of the signal, in the units of the oscillator; for a flow, rate of
        change per unit of the signal.
    delay : float
        Delay in forcing periods of an oscillator, 1 for orbits that close after one period; in the
        unit of time of a flow.
    limit : float, optional
        F0, the greatest force; by default the force is not limited.
    signal : str or int
        y: "velocity" or "displacement" of an oscillator, relative to the stops; for a flow, the
        name or number of a coordinate, to whose rate of change the feedback is added. `Controlled`
        and `orbit_stability` raise an error for a signal that the system does not have.
    memory : float
        R, 0 <= R < 1. The memory is empty when the feedback begins: in the first delay, w is the
        delayed signal itself.

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
