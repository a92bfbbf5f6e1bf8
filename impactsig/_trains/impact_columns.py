"""Columns of a train of impacts, and the validation of their values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import number, reals
from ..errors import InvalidInput

if TYPE_CHECKING:
    from ..impacts import Impacts

ERRORS = ("time_error", "contact_time_error", "peak_error", "impulse_error")
SHARED, SHARED_PEAK = "shared_time_error", "shared_peak_error"
SHARED_ERRORS = {SHARED: "time_error", SHARED_PEAK: "peak_error"}
"""The parts of errors that impacts within a second share, and what they are parts of."""
PROBABILITIES = ("probability", "stop_probability")
COUNTS = {"pulses": 1, "stop_index": -1}
"""Whole numbers, and the least that each may be."""
MEASURED = (
    "contact_time",
    "peak",
    "impulse",
    "rise_time",
    "approach_velocity",
    *ERRORS,
    *SHARED_ERRORS,
    "probability",
    *COUNTS,
    "stop_probability",
)
COLUMNS = ("time", *MEASURED, "flags")


def columns(impacts: Impacts) -> dict[str, np.ndarray]:
    """The columns that a train has, by name."""
    known = {name: getattr(impacts, name) for name in COLUMNS}
    return {name: values for name, values in known.items() if values is not None}


def filled(name: str, values: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Values of a column at inserted impacts, from the neighbours `left` and `right`."""
    if name in ERRORS:
        return np.full(len(left), np.inf)
    if name in (*PROBABILITIES, *SHARED_ERRORS):
        return np.zeros(len(left))
    if name in COUNTS:
        return np.full(len(left), COUNTS[name])
    return 0.5 * (values[left] + values[right])


def vector(
    name: str, value: Iterable[float], length: int | None = None, *, finite: bool = True
) -> np.ndarray:
    """One-dimensional real numbers, as a copy.

    Raises
    ------
    InvalidInput
        If they are none, not finite, or of another length.
    """
    array = np.array(reals(name, value, "an array of real numbers"))
    if array.ndim != 1 or (length is not None and len(array) != length):
        wanted = "(n,)" if length is None else f"({length},)"
        raise InvalidInput(name, f"shape {array.shape}", f"shape {wanted}")
    if finite and len(array):
        _require(name, array, np.isfinite(array), "finite numbers")
    return array


def instants(time: Any) -> np.ndarray:
    """Ascending instants, as a copy.

    Raises
    ------
    InvalidInput
        If they are none.
    """
    array = vector("time", time)
    if np.count_nonzero(array[1:] < array[:-1]):
        where = int(np.argmax(np.diff(array) < 0)) + 1
        raise InvalidInput(
            "time",
            f"time[{where}] = {array[where]:.9g} s after {array[where - 1]:.9g} s",
            "ascending instants",
            "Sort them first",
        )
    return array


def flag_column(value: Any, length: int) -> np.ndarray:
    """Validate the flags, one for each impact; none are set by default.

    Raises
    ------
    InvalidInput
        If they are not so many, or not whole numbers from 0 to 255.
    """
    if type(value) is np.ndarray and value.dtype == np.uint8 and value.shape == (length,):
        return value.copy()
    required = f"whole numbers from 0 to 255, shape ({length},)"
    given = reals("flags", value, required)
    if given.shape == (0,):
        return np.zeros(length, np.uint8)
    flags = np.where((given >= 0) & (given <= 255), given, 0).astype(np.uint8)
    if given.ndim != 1 or (flags != given).any():
        raise InvalidInput("flags", value, required)
    if len(given) != length:
        raise InvalidInput("flags", f"shape {given.shape}", f"shape ({length},)")
    return flags


def run_span(time: np.ndarray, start: Any, duration: Any) -> tuple[float, float]:
    """Start and duration of a run [s], by default from its first impact to its last.

    Raises
    ------
    InvalidInput
        If they are no finite times, or an impact lies outside the run.
    """
    begin = first = float(time[0]) if len(time) else 0.0
    if start is not None:
        begin = number("start", start, "a finite time [s]")
    last = float(time[-1]) if len(time) else begin
    span = last - begin
    if duration is not None:
        span = number("duration", duration, "a finite time, 0 or greater [s]", least=0)
    slack = 1e-9 * max(1.0, abs(last))
    if len(time) and (first < begin - slack or last > begin + span + slack):
        raise InvalidInput(
            "time",
            f"{first:.9g} ... {last:.9g} s",
            f"instants inside the run, {begin:.9g} to {begin + span:.9g} s",
        )
    return begin, span


def column(name: str, value: Any, length: int) -> np.ndarray:
    """Validate one column.

    Raises
    ------
    InvalidInput
        If a value is not one that this column may hold.
    """
    if name in ERRORS:
        array = vector(name, value, length, finite=False)
        _require(name, array, array >= 0, "standard errors, 0 or greater")
        return array
    array = vector(name, value, length)
    if name in PROBABILITIES:
        _require(name, array, (array >= 0) & (array <= 1), "probabilities, 0 to 1")
    elif name in SHARED_ERRORS:
        _require(name, array, array >= 0, "standard errors, 0 or greater")
    elif name in COUNTS:
        least = COUNTS[name]
        right = (array >= least) & (array == np.floor(array))
        _require(name, array, right, f"whole numbers, {least} or greater")
        return array.astype(np.intp)
    return array


def require_part(name: str, shared: np.ndarray | None, error: np.ndarray | None) -> None:
    """Raise InvalidInput where more of an error is shared, in the column `name`, than there is."""
    if shared is None:
        return
    whole = np.zeros(len(shared)) if error is None else error
    if np.any(shared > whole):
        where = int(np.argmax(shared > whole))
        raise InvalidInput(
            name,
            f"{shared[where]:.9g} at index {where}",
            f"at most {SHARED_ERRORS[name]}, {whole[where]:.9g}",
            "It is a part of it: give both, or None for errors that are independent",
        )


def _require(name: str, array: np.ndarray, right: np.ndarray, wanted: str) -> None:
    if np.count_nonzero(right) < right.size:  # a tenth of the time of `all`
        where = int(np.argmin(right))
        raise InvalidInput(name, f"{array[where]} at index {where}", wanted)


def spans(gaps: Any) -> np.ndarray:
    """Pairs of start and stop, shape (g, 2).

    Raises
    ------
    InvalidInput
        If they are none, or a span ends before it starts.
    """
    required = "pairs of start and stop [s], start <= stop"
    pairs = np.array(reals("gaps", gaps, required))
    if not pairs.size:
        return np.empty((0, 2))
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not np.all(pairs[:, 0] <= pairs[:, 1]):
        raise InvalidInput("gaps", gaps, required)
    return pairs
