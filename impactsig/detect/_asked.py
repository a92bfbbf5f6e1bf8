"""Validation of the options of detection."""

from __future__ import annotations

import math
import re
from typing import Any

from .._arguments import limits, number, real
from ..errors import InvalidInput
from .search.judging import Level

_PERCENT = re.compile(r"\s*([0-9.eE+-]+)\s*%\s*")
_SIGMAS = re.compile(r"\s*([0-9.eE+-]+)\s*(?:σ|sigmas?)\s*")


def _amount(match: re.Match[str] | None, given: Any) -> float:
    """The number of a matched text, else the value itself; NaN for what is no number."""
    if match is None:
        return real(given)
    try:
        return float(match[1])
    except ValueError:
        return math.nan


def parse_threshold(threshold: float | str | None) -> Level:
    """The threshold, in the unit of the record or in standard deviations.

    Raises
    ------
    InvalidInput
        If it is neither a positive number nor one followed by "sigma".
    """
    if threshold is None:
        return Level()
    match = _SIGMAS.fullmatch(threshold) if isinstance(threshold, str) else None
    value = _amount(match, threshold)
    if not (math.isfinite(value) and value > 0):
        raise InvalidInput(
            "threshold", threshold, 'a positive level, or a multiple of the noise such as "6 sigma"'
        )
    return Level(sigma=value) if match else Level(unit=value)


def parse_probability(least: float) -> float:
    """The least probability of an impact.

    Raises
    ------
    InvalidInput
        If it is not between 0 and 1, or one of them.
    """
    required = "a number above 0 and below 1"
    if not 0.0 < number("least_probability", least, required) < 1.0:
        raise InvalidInput("least_probability", least, required)
    return float(least)


def parse_contact_level(level: float | str) -> tuple[float, bool]:
    """The contact level, and whether it is a share of the peak.

    Raises
    ------
    InvalidInput
        If it is neither a level of 0 or more nor a percentage below 100.
    """
    match = _PERCENT.fullmatch(level) if isinstance(level, str) else None
    value = _amount(match, level) / (100 if match else 1)
    if not (math.isfinite(value) and value >= 0 and (not match or 0 < value < 1)):
        raise InvalidInput(
            "contact_level",
            level,
            'a level of 0 or more in the unit, or a share of the peak such as "10 %"',
        )
    return value, match is not None


def parse_contact_time(span: Any) -> tuple[float, float | None]:
    """Shortest and longest contact [s]; None if the record decides.

    Raises
    ------
    InvalidInput
        If they are no two times, the longest greater than the shortest.
    """
    if span is None:
        return 0.0, None
    required = "the shortest and the longest contact [s], such as (0, 0.1)"
    return limits("contact_time", span, required, least=0.0)


def refuse_other_than_default(kind: str, *asked: tuple[str, Any, Any]) -> None:
    """Refuse options that do not apply to a kind of record.

    Raises
    ------
    InvalidInput
        For the first that is not its default.
    """
    for name, value, default in asked:
        if value != default:
            other = "force" if kind == "sound" else "sound"
            raise InvalidInput(
                name, value, f"its default for {kind}", f"It applies to {other} records only"
            )
