"""Series of numbers, or of the intervals of impacts, as input of every reconstruction.

Here, and nowhere else, is decided what a gap in a run means: an interval across it was not
measured, and in its place stands nan. A vector that holds nan is none, nor is one that steps over
it (`unbroken`); what is counted or averaged is what is left.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arguments import reals
from ..errors import InvalidInput
from ..impacts import Impacts


def series(x: Any, argument: str = "x", least: int = 2, gap: int = 0) -> np.ndarray:
    """The series as float64 numbers in the order of time; of impacts, their interspike intervals.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        Only impacts can have gaps; nan in an array is refused.
    argument : str
        What the caller calls it.
    least : int
        Fewest numbers that will do.
    gap : int
        How many nan stand for an interval across a gap of the run. With as many as the delay, none
        of the delay vectors can step over it. 0 leaves the interval out, and joins what is on
        either side: for what does not ask which value follows which.

    Raises
    ------
    InvalidInput
        If it is not one-dimensional, holds what is no finite real number, or is too short.
    """
    if isinstance(x, Impacts):
        values, crossing = np.diff(x.time), x.interval_spans_gap()
    else:
        required = "a series of real numbers"
        values, crossing = reals(argument, x, required), None
        if np.asarray(x).dtype.kind == "b":
            raise InvalidInput(argument, x, required)
    if values.ndim != 1:
        raise InvalidInput(
            argument, f"shape {values.shape}", "one dimension, shape (n,)",
            "Give one channel or coordinate at a time",
        )  # fmt: skip
    values = np.ascontiguousarray(values, dtype=np.float64)
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong):
        raise InvalidInput(
            argument,
            f"{len(wrong)} of {len(values)} not finite, the first at index {wrong[0]}",
            "finite numbers",
            "Leave them out, or give the parts between them one by one",
        )
    known = len(values) if crossing is None else int(np.count_nonzero(~crossing))
    if known < least:
        raise InvalidInput(argument, f"{known} values", f"at least {least}")
    if crossing is None or not crossing.any():
        return values
    values[crossing] = np.nan
    return np.repeat(values, np.where(crossing, gap, 1))


def known(values: np.ndarray) -> np.ndarray:
    """The values without the NaN of gaps."""
    missing = np.isnan(values)
    return values[~missing] if missing.any() else values


def unbroken(values: np.ndarray, length: int) -> np.ndarray:
    """Whether values[i : i + length] has no NaN, shape (n - length + 1,)."""
    missing = np.concatenate(([0], np.cumsum(np.isnan(values))))
    return missing[length:] == missing[: max(len(missing) - length, 0)]


def pairs_apart(vectors: np.ndarray, window: int) -> int:
    """Number of pairs of `vectors`, shape (n,) of bool, more than `window` steps apart."""
    if vectors.all():
        last = max(len(vectors) - window - 1, 0)
        return last * (last + 1) // 2
    before = np.cumsum(vectors, dtype=np.int64)
    return int(before[: max(len(vectors) - window - 1, 0)] @ vectors[window + 1 :].astype(np.int64))


def stretches(values: np.ndarray) -> list[np.ndarray]:
    """The parts between gaps, as views."""
    edges = np.flatnonzero(np.diff(np.concatenate(([True], np.isnan(values), [True])))).tolist()
    return [values[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True)]
