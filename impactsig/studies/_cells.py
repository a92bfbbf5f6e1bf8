"""Evaluate the cells of a task in a worker, one by one or in one call."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidInput
from ._grid import Task

LONGEST = 500
"""Characters kept of an error's message."""

Signature = tuple[tuple[str, str, tuple[int, ...]], ...]
"""Name, type and shape of every observable of a cell."""


class Job(NamedTuple):
    """The function of every cell, and the key that their seeds derive from, if any."""

    function: Callable[..., Any]
    vectorized: bool
    key: int | None


class Outcome(NamedTuple):
    """Results and errors of a task.

    Cells whose results have the same names, types and shapes are together, `positions` in the task
    first; usually there is one such group. Errors are listed by cell number.
    """

    groups: list[tuple[np.ndarray, dict[str, np.ndarray]]]
    errors: dict[int, str]
    seconds: float


def run_cells(job: Job, task: Task) -> Outcome:
    """Evaluate the cells of a task; exceptions of a cell are returned, not raised.

    Raises
    ------
    KeyboardInterrupt
        If the function raises it: it stops the sweep, whether from the keyboard or not.
    InvalidInput
        If a vectorized function returns something else than arrays with a value for each cell.
    """
    task = seeded(job, task)
    begin = time.perf_counter()
    groups: list[tuple[np.ndarray, dict[str, np.ndarray]]] = []
    errors: dict[int, str] = {}
    (_run_whole if job.vectorized else _run_each)(job.function, task, groups, errors)
    return Outcome(groups, errors, time.perf_counter() - begin)


def _run_each(function: Callable[..., Any], task: Task, groups: Any, errors: Any) -> None:
    alike: dict[Signature, tuple[list[int], list[dict[str, np.ndarray]]]] = {}
    columns = {
        # Of Python's whole numbers numba takes none that does not fit an int64; seeds do not.
        name: column if is_compiled(function) and column.dtype == np.uint64 else column.tolist()
        for name, column in task.columns.items()
    }
    for position, cell in enumerate(task.cells.tolist()):
        try:
            found = observables(function(**{n: column[position] for n, column in columns.items()}))
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # SystemExit too: a cell cannot end the program
            errors[cell] = brief(error)
            continue
        positions, values = alike.setdefault(signature(found), ([], []))
        positions.append(position)
        values.append(found)
    for positions, values in alike.values():
        groups.append(
            (np.array(positions), {n: np.stack([one[n] for one in values]) for n in values[0]})
        )


def _run_whole(
    function: Callable[..., Any], task: Task, groups: Any, errors: Any, start: int = 0
) -> None:
    """Call the function on all cells; if that raises, on halves, down to the failing cell."""
    count = len(task.cells)
    try:
        result = function(**task.columns)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        if count == 1:
            errors[int(task.cells[0])] = brief(error)
            return
        half = count // 2
        _run_whole(function, task.part(0, half), groups, errors, start)
        _run_whole(function, task.part(half, count), groups, errors, start + half)
        return
    try:
        found = observables(result)
    except TypeError as error:
        raise InvalidInput("function", name_of(function), str(error)) from None
    for name, array in found.items():
        if array.shape[:1] != (count,):
            raise InvalidInput(
                "function",
                f"{name_of(function)} returned {name!r} of shape {array.shape} for {count} cells",
                f"shape ({count}, ...), a value for each cell",
                "Leave vectorized=False for a function of one cell",
            )
    groups.append((np.arange(start, start + count), found))


def observables(result: Any) -> dict[str, np.ndarray]:
    """What a function returned, as arrays by name; what has no name is called "value".

    Python's numbers become float64 or complex128, because one cell's 0 is another's 0.5.

    Raises
    ------
    TypeError
        If it is no number, array of numbers, or mapping or NamedTuple of such.
    """
    if hasattr(result, "_asdict"):
        result = result._asdict()
    named = result if isinstance(result, Mapping) else {"value": result}
    found = {}
    for name, value in named.items():
        if not isinstance(name, str) or not name.isidentifier():
            raise TypeError(f"names of observables that are identifiers, not {name!r}")
        array = np.asarray(value)
        if not isinstance(value, (np.ndarray, np.generic)) and array.dtype.kind in "biu":
            array = array.astype(np.float64)
        if array.dtype.kind not in "biufc" or array.size == 0:
            raise TypeError(f"numbers for {name!r}, not {type(value).__name__} {value!r:.60}")
        if array.dtype.kind == "b":
            array = array.astype(np.int8)
        elif array.dtype.itemsize > (16 if array.dtype.kind == "c" else 8):
            array = array.astype(np.complex128 if array.dtype.kind == "c" else np.float64)
        found[name] = array
    if not found:
        raise TypeError("one observable or more, not an empty mapping")
    return found


def signature(found: dict[str, np.ndarray]) -> Signature:
    """Names, types and shapes that the results of all cells must share."""
    return tuple((name, array.dtype.str, array.shape) for name, array in found.items())


def is_compiled(function: Any) -> bool:
    """Whether numba has compiled a function."""
    inner = function.func if isinstance(function, functools.partial) else function
    return hasattr(inner, "py_func")


def brief(error: BaseException) -> str:
    """An exception as one line."""
    try:
        text = " ".join(str(error).split())
    except Exception:
        text = ""
    return f"{type(error).__name__}: {text}"[:LONGEST] if text else type(error).__name__


def name_of(function: Any) -> str:
    """Name of a function for messages."""
    return getattr(function, "__qualname__", None) or type(function).__name__


def seeded(job: Job, task: Task) -> Task:
    """Add the seeds of the cells to the parameters, if the job has a key."""
    if job.key is None:
        return task
    return Task(task.cells, {**task.columns, "seed": seeds(job.key, task.cells)})


def seeds(key: int, cells: np.ndarray) -> np.ndarray:
    """A distinct 64-bit seed for every cell, by SplitMix64 [Steele2014]_.

    The n-th output of that generator can be had at once, so a cell's seed depends on nothing but
    the key and the cell.
    """
    with np.errstate(over="ignore"):
        z = np.uint64(key) + (cells.astype(np.uint64) + np.uint64(1)) * np.uint64(
            0x9E3779B97F4A7C15
        )
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return z ^ (z >> np.uint64(31))
