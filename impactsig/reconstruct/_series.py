"""What every reconstruction is given: a series of numbers, or the intervals of impacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..impacts import Impacts


def series(x: Any, argument: str = "x", least: int = 2) -> np.ndarray:
    """The series as float64 numbers in the order of time; of impacts, their interspike intervals.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        Intervals across a gap of the run are not taken.
    argument : str
        What the caller calls it.
    least : int
        Fewest numbers that will do.

    Raises
    ------
    InvalidInput
        If it is not one-dimensional, holds what is no finite real number, or is too short.
    """
    if isinstance(x, Impacts):
        values = x.intervals()
    else:
        try:
            values = np.asarray(x)
            if values.dtype.kind == "O":
                values = values.astype(float)
            if values.dtype.kind not in "iuf":
                raise TypeError
        except (TypeError, ValueError):
            raise InvalidInput(argument, x, "a series of real numbers") from None
    values = np.ascontiguousarray(values, dtype=np.float64)
    if values.ndim != 1:
        raise InvalidInput(
            argument, f"shape {values.shape}", "one dimension, shape (n,)",
            "Give one channel or coordinate at a time",
        )  # fmt: skip
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong):
        raise InvalidInput(
            argument,
            f"{len(wrong)} of {len(values)} not finite, the first at index {wrong[0]}",
            "finite numbers",
            "Leave them out, or give the parts between them one by one",
        )
    if len(values) < least:
        raise InvalidInput(argument, f"{len(values)} values", f"at least {least}")
    return values
