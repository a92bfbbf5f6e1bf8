"""What the reconstructions share of checking arguments: numbers, dimensions, Theiler's window."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np

from .._arguments import whole
from ..errors import InvalidInput, finite_number


def positive(argument: str, value: Any, required: str = "a positive number") -> float:
    """`value` as a float greater than 0."""
    number = finite_number(argument, value, required)
    if number <= 0:
        raise InvalidInput(argument, value, required)
    return number


def dimensions_of(value: int | Iterable[int]) -> np.ndarray:
    """Dimensions as ascending whole numbers; of a single one, all from 1 up to it."""
    if isinstance(value, (int, np.integer)):
        value = range(1, whole("dimensions", value, 1) + 1)
    try:
        found = [whole("dimensions", one, 1) for one in value]
    except TypeError:
        raise InvalidInput("dimensions", value, "whole numbers, or the greatest of them") from None
    if not found or any(b <= a for a, b in pairwise(found)):
        raise InvalidInput("dimensions", found, "one or more dimensions, ascending")
    return np.array(found)


def varying(x: np.ndarray, argument: str = "x") -> np.ndarray:
    """`x`, if it is not constant."""
    if x.min() == x.max():
        raise InvalidInput(argument, f"{len(x)} times {x[0]:.6g}", "values that are not all equal")
    return x


def theiler_window(theiler: int | None, x: np.ndarray) -> int:
    """The window given, or else the mean period: the reciprocal of the mean frequency.

    The mean is weighted with the power spectrum of `x` about its mean [Rosenstein1993]_.
    """
    if theiler is not None:
        return whole("theiler", theiler, 0)
    power = np.abs(np.fft.rfft(x - x.mean())) ** 2
    return int(np.ceil(power.sum() / (np.fft.rfftfreq(len(x)) @ power)))


def long_enough(x: np.ndarray, span: int, theiler: int, least: int, argument: str = "x") -> None:
    """Refuse a series too short for `least` references and their neighbours outside the window."""
    needed = span + max(least, 2 * theiler + 2)
    if len(x) < needed:
        raise InvalidInput(
            argument,
            f"{len(x)} values",
            f"at least {needed} for this dimension, delay and Theiler window of {theiler}",
            "Use a longer series, a smaller dimension or delay, or give a smaller theiler",
        )
