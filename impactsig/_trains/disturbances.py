"""Disturbances of a record: glitches, dropouts and the like, which are no impacts."""

from __future__ import annotations

from typing import Any, NamedTuple

from .._arguments import entries, number
from ..errors import InvalidInput

KINDS = {
    "glitch": "single samples that stand alone",
    "wide": "pulses longer than a contact",
    "baseline": "moves of the baseline",
    "dropout": "dropouts of the signal",
    "burst": "bursts of noise",
    "code": "error codes",
}
"""Kinds of disturbances, in words."""


class Disturbance(NamedTuple):
    """Something in a record that is not an impact, such as a glitch or a dropout."""

    kind: str
    """"glitch", "wide", "baseline", "dropout", "burst" or "code", see `KINDS`."""
    start: float
    """Where it begins [s]."""
    duration: float
    """How long it is [s]."""
    height: float
    """How high [unit]; 0 where that was not measured."""


def disturbances(given: Any) -> tuple[Disturbance, ...]:
    """Validate disturbances, each a `Disturbance` or a tuple with its fields."""
    required = "disturbances, each a kind, a start and a duration [s]"
    try:
        found = tuple(Disturbance(*one) for one in entries("disturbances", given, required))
    except Exception:  # other fields, or an item that raises
        raise InvalidInput("disturbances", given, required) from None
    for one in found:
        if not isinstance(one.kind, str):
            raise InvalidInput("disturbances", given, required)
        number("disturbances", one.start), number("disturbances", one.duration, least=0)
    return found
