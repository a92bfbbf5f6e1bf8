"""Validators shared by the reconstructions: series, dimensions, lengths."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from .._arguments import entries, whole
from ..errors import InvalidInput
from ._series import known, unbroken

GREATEST, LEAST_SPAN = 1e140, 1e-140
"""Of values and of their range: sums of as many squares as there may be are numbers still."""


def dimensions_of(value: int | Iterable[int]) -> tuple[int, ...]:
    """Embedding dimensions, ascending; a single number stands for all from 1 up to it.

    Everywhere: what is asked is how something changes as the dimension grows. ``[m]`` is m alone.
    """
    if isinstance(value, (int, np.integer)):
        value = range(1, whole("dimensions", value, 1, 10_000) + 1)
    several = entries("dimensions", value, "whole numbers, or the greatest of them")
    found = tuple(whole("dimensions", one, 1) for one in several)
    if not found or any(b <= a for a, b in pairwise(found)):
        raise InvalidInput("dimensions", found, "one or more dimensions, ascending")
    return found


def varying(x: np.ndarray, argument: str = "x") -> np.ndarray:
    """Require a series that is not constant and whose differences can be squared."""
    values = known(x)
    if values.min() == values.max():
        raise InvalidInput(
            argument, f"{len(values)} times {values[0]:.6g}", "values that are not all equal"
        )
    low, high = float(values.min()), float(values.max())
    if high - low < LEAST_SPAN or max(-low, high) > GREATEST:
        raise InvalidInput(
            argument,
            f"values from {low:g} to {high:g}",
            f"no value beyond {GREATEST:g}, and a range of {LEAST_SPAN:g} or more",
            "Give them in another unit",
        )
    return x


def finite_range(x: np.ndarray) -> np.ndarray:
    """Require a series with a finite range."""
    values = known(x)
    with np.errstate(over="ignore"):
        if not np.isfinite(np.ptp(values)):
            raise InvalidInput(
                "x",
                f"values from {values.min():g} to {values.max():g}",
                "a range that is not beyond float64",
                "Give them in another unit",
            )
    return x


def long_enough(x: np.ndarray, span: int, theiler: int, least: int) -> None:
    """Refuse a series too short for `least` references and their neighbours outside the window.

    A reference takes `span` values and one more, all of them between the same gaps.
    """
    needed = span + max(least, 2 * theiler + 2)
    references = int(np.count_nonzero(unbroken(x, span + 1)))
    if references + span >= needed:
        return
    given = f"{len(known(x))} values"
    if references < len(x) - span:
        given += f", {references} stretches of {span + 1} that no gap breaks"
    raise InvalidInput(
        "x",
        given,
        f"at least {needed} for this dimension, delay and Theiler window of {theiler}",
        "Use a longer series, a smaller dimension or delay, or give a smaller theiler",
    )
