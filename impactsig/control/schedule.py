"""Schedules of control."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

from .._arguments import entries, number, pair
from ..errors import InvalidInput
from .feedback import DelayedFeedback
from .intervals import IntervalFeedback
from .ogy import OGY

Controller: TypeAlias = "DelayedFeedback | IntervalFeedback | OGY"
Phase: TypeAlias = "tuple[float, DelayedFeedback | IntervalFeedback | OGY | None]"
KINDS = (DelayedFeedback, IntervalFeedback, OGY)


def schedule(
    controller: Controller | Sequence[Phase], start: float | None, length: float
) -> tuple[Phase, ...]:
    """Validate a schedule: pairs of a start and a controller, None to switch off.

    Raises
    ------
    InvalidInput
        If phases are not in the order of time, of two kinds, or one begins before its delay has
        passed.
    """
    if isinstance(controller, KINDS):
        since = controller.delay if isinstance(controller, DelayedFeedback) else 0.0
        since = since if start is None else number("start", start, least=0.0)
        phases: tuple[Phase, ...] = ((since, controller),)
        name = "start"
    else:
        if start is not None:
            raise InvalidInput("start", start, "None, where each phase has its own start")
        phases, name = _pairs(controller), "controller"
    before = -1.0
    for since, own in phases:
        if since <= before:
            raise InvalidInput(
                name, f"a start at {since:g} after one at {before:g}",
                "phases in the order of time, no two at once", "Each lasts until the next begins",
            )  # fmt: skip
        before = since
        if isinstance(own, DelayedFeedback) and since < own.delay * (1 - 1e-12):
            raise InvalidInput(
                name, since, f"a start at {own.delay:g} or later",
                "Before one delay has passed there is nothing to feed back",
            )  # fmt: skip
        if since >= length:
            raise InvalidInput(name, since, f"a start before the end, {length:g}")
    kinds = {type(own) for _, own in phases if own is not None}
    if len(kinds) > 1:
        raise InvalidInput(
            name, controller, "phases of one kind", "Go on with the other from motion.final"
        )
    return phases


def _pairs(given: Any) -> tuple[Phase, ...]:
    required = "a DelayedFeedback, IntervalFeedback or OGY, or pairs (start, one of them or None)"
    pairs = [pair("controller", one, required) for one in entries("controller", given, required)]
    right = all(own is None or isinstance(own, KINDS) for _, own in pairs)
    if not pairs or not right:
        raise InvalidInput("controller", given, required)
    return tuple((number("controller", since, least=0.0), own) for since, own in pairs)
