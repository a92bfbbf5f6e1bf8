"""Delayed feedback as data, and when which is on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from .._arguments import number
from ..errors import InvalidInput


@dataclass(frozen=True)
class DelayedFeedback:
    """A force that vanishes on orbits of one period, and pushes others towards them.

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
        or number of a coordinate of a flow, whose rate the feedback is added to.
    memory : float
        R, from 0 up to but without 1. The memory begins empty with the feedback: the first delay
        is fed back as it was.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    Examples
    --------
    >>> control(scenes.karpodinis(20.3355), DelayedFeedback(0.15, 1, limit=0.1), periods=600)
    """

    gain: float
    delay: float = 1.0
    limit: float | None = None
    signal: str | int = "velocity"
    memory: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", number("gain", self.gain))
        object.__setattr__(self, "delay", number("delay", self.delay, positive=True))
        if self.limit is not None:
            object.__setattr__(self, "limit", number("limit", self.limit, positive=True))
        memory = number("memory", self.memory, least=0.0, most=1.0)
        if memory == 1.0:
            raise InvalidInput("memory", self.memory, "0 <= memory < 1")
        object.__setattr__(self, "memory", memory)


Phase: TypeAlias = tuple[float, "DelayedFeedback | None"]


def schedule(
    feedback: DelayedFeedback | Sequence[Phase], start: float | None, length: float
) -> tuple[Phase, ...]:
    """When which feedback begins: pairs of a start and a feedback, None where it is switched off.

    Raises
    ------
    InvalidInput
        If phases are not in the order of time, or one begins before its delay has passed.
    """
    if isinstance(feedback, DelayedFeedback):
        since = feedback.delay if start is None else number("start", start, least=0.0)
        phases: tuple[Phase, ...] = ((since, feedback),)
        name = "start"
    else:
        if start is not None:
            raise InvalidInput("start", start, "None, where each feedback has its own start")
        phases, name = _pairs(feedback), "feedback"
    before = -1.0
    for since, own in phases:
        if since <= before:
            raise InvalidInput(
                name, f"a start at {since:g} after one at {before:g}",
                "phases in the order of time, no two at once", "Each lasts until the next begins",
            )  # fmt: skip
        before = since
        if own is not None and since < own.delay * (1 - 1e-12):
            raise InvalidInput(
                name, since, f"a start at {own.delay:g} or later",
                "Before one delay has passed there is nothing to feed back",
            )  # fmt: skip
        if since >= length:
            raise InvalidInput(name, since, f"a start before the end, {length:g}")
    return phases


def _pairs(given: Any) -> tuple[Phase, ...]:
    required = "a DelayedFeedback, or pairs (start, DelayedFeedback or None)"
    try:
        pairs = [(since, own) for since, own in given]
    except (TypeError, ValueError):
        raise InvalidInput("feedback", given, required) from None
    if not pairs or not all(own is None or isinstance(own, DelayedFeedback) for _, own in pairs):
        raise InvalidInput("feedback", given, required)
    return tuple((number("feedback", since, least=0.0), own) for since, own in pairs)
