"""Named arrays as signals: shared by npz, HDF5, MATLAB and Arrow files.

They hold arrays under names, in folders or not, and whoever wrote them put the rate beside them: a
number named fs or dt, an attribute, or an array of times.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import UnreadableFile
from ._source import Signal, Source, sample_type
from ._units import split_heading
from .times.time_columns import time_factor
from .times.timebase import TimeBase, rate_of_step, time_base

_FACTS = {
    "rate": "rate fs sr samplingrate samplerate samplingfrequency samplefrequency",
    "step": "dt deltat timestep samplinginterval sampleinterval samplingperiod sampleperiod "
    "tinterval wfincrement",
    "start": "tstart wfstartoffset",
    "unit": "unit units unitstring",
    "names": "channels channelnames columns columnnames labels",
}
_KINDS = {name: kind for kind, names in _FACTS.items() for name in names.split()}

Place = tuple[str, ...]
"""Names of the folders on the way to an array, and its own."""


@dataclass(frozen=True)
class Array:
    """One array of a file, of shape (n,), (n, columns) or (columns, n).

    Parameters
    ----------
    place : tuple of str
        Its folders and its name.
    shape, dtype
        As the file says.
    read : callable
        ``read(columns, first, last)``: samples [first, last) of those columns, of shape
        (n, len(columns)), in any real type.
    digit : float, optional
        Of times that are counted, one count [s].
    """

    place: Place
    shape: tuple[int, ...]
    dtype: np.dtype
    read: Callable[[list[int], int, int], np.ndarray]
    digit: float = 0.0

    @property
    def length(self) -> int:
        """Number of samples: time runs along the longer axis."""
        return max(self.shape)

    @property
    def columns(self) -> int:
        """Number of channels."""
        return 1 if len(self.shape) == 1 else min(self.shape)


class Facts:
    """What a file says of its arrays and folders: rate, step, start, unit, names."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._facts: dict[tuple[Place, str], tuple[str, Any]] = {}

    def add(self, place: Place, name: str, value: Any) -> None:
        """Record an attribute of `place`, or a number or text in that folder, if it is a fact."""
        kind = fact(name)
        if kind is None:
            return
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        if kind == "names":
            value = [v.decode("utf-8", "replace") if isinstance(v, bytes) else v for v in value]
            fits = all(isinstance(v, str) for v in value)
        elif kind == "unit":
            fits = isinstance(value, str)
        else:
            fits = isinstance(value, (int, float, np.number))
        if fits:
            self._facts.setdefault((place, kind), (name, value))

    def rate(self, place: Place) -> float | None:
        """Rate [Hz] given for an array or a folder that it is in; the nearest counts."""
        for here in _ways_up(place):
            for kind in ("rate", "step"):
                if (here, kind) in self._facts:
                    name, value = self._facts[here, kind]
                    value = float(value)
                    if not (np.isfinite(value) and value > 0):
                        required = "a positive number " + ("[Hz]" if kind == "rate" else "[s]")
                        raise UnreadableFile(self._path, f"its {name} is {value:g}, not {required}")
                    return value if kind == "rate" else rate_of_step(value)
        return None

    def start(self, place: Place) -> float:
        """Time of the first sample [s]."""
        for here in _ways_up(place):
            if (here, "start") in self._facts:
                value = float(self._facts[here, "start"][1])
                return value if np.isfinite(value) else 0.0
        return 0.0

    def unit(self, place: Place) -> str:
        """Unit of an array: given for it, in its name, or in its folder."""
        unit = self._facts.get((place, "unit"), ("", ""))[1] or split_heading(place[-1])[1]
        return unit or self._facts.get((place[:-1], "unit"), ("", ""))[1]

    def names(self, place: Place, count: int) -> list[str]:
        """Names of the columns of an array, given for it or in its folder; [] if none fit."""
        for here in (place, place[:-1]):
            names = self._facts.get((here, "names"), ("", []))[1]
            if len(names) == count:
                return list(names)
        return []


def fact(name: str) -> str | None:
    """The kind of fact that a number or a text of this name gives; None if none."""
    return _KINDS.get(re.sub(r"[\s_.-]", "", name.lower()))


def unusable(shape: tuple[int, ...], dtype: np.dtype) -> str:
    """Why an array cannot be a recording; "" if it can."""
    if dtype.hasobject:
        return "holds Python objects, which are never unpickled"
    if dtype.kind not in "biuf":
        return f"holds {dtype}, not real numbers"
    if len(shape) not in (1, 2):
        return f"has {len(shape)} dimensions, not 1 or 2"
    return ""


def along_time(samples: np.ndarray) -> np.ndarray:
    """The array as (n, channels): time runs along its longer axis."""
    if samples.ndim == 1:
        return samples[:, np.newaxis]
    return samples if samples.shape[0] >= samples.shape[1] else samples.T


def bytes_of(shape: Iterable[int], dtype: np.dtype) -> int:
    """Size of an array in memory; Python integers, so that no hostile shape overflows."""
    size = dtype.itemsize
    for extent in shape:
        size *= int(extent)
    return size


def source_of(
    path: Path,
    format: str,
    arrays: list[Array],
    facts: Facts,
    notes: list[str],
    *,
    separator: str = "/",
    no_rate: str = "",
    in_memory: bool = False,
    truncated: str = "",
    close: Callable[[], None] = lambda: None,
) -> Source:
    """A `Source` whose signals are the columns of the arrays.

    An array named as times (time, t, ...) gives the rate of the arrays that are as long, in its
    folder and below, unless a number or an attribute tells it.

    Raises
    ------
    UnreadableFile
        If no array is left.
    """
    arrays = [array for array in arrays if 0 not in array.shape]
    bases = _time_bases(arrays, facts)
    signals: list[Signal] = []
    columns: list[tuple[Array, int]] = []
    doubts: dict[str, None] = {}
    for array in arrays:
        if array.place in bases:
            continue
        above = _ways_up(array.place[:-1])
        beside = [b for f in above for p, b in bases.items() if p[:-1] == f]
        base = next(
            (b for b, length in beside if length == array.length),
            TimeBase(None, facts.start(array.place), no_rate),
        )
        rate = facts.rate(array.place)
        if rate is None and base.doubt:
            doubts[base.doubt] = None
        names = facts.names(array.place, array.columns)
        whole = separator.join(array.place)
        for column in range(array.columns):
            columns.append((array, column))
            name = f"{whole} {column}" if array.columns > 1 else whole
            signals.append(
                Signal(
                    f"{whole}{separator}{names[column]}" if array.columns > 1 and names else name,
                    facts.unit(array.place),
                    base.rate if rate is None else rate,
                    array.length,
                    base.start,
                    alias=names[column] if names else _short(array),
                    no_rate=base.problem,
                )
            )
    if not signals:
        raise UnreadableFile(
            path,
            "; ".join(notes[:3]) or "contains no array of samples",
            "Save arrays of shape (n,) or (n, channels) of numbers",
        )

    def read(channels: list[int], first: int, last: int) -> np.ndarray:
        parts = []
        position = 0
        while position < len(channels):
            array = columns[channels[position]][0]
            chosen = []
            while position < len(channels) and columns[channels[position]][0] is array:
                chosen.append(columns[channels[position]][1])
                position += 1
            part = array.read(chosen, first, last)
            parts.append(part.astype(sample_type(array.dtype), copy=False))
        return parts[0] if len(parts) == 1 else np.column_stack(parts)

    return Source(
        format,
        tuple(signals),
        read,
        close,
        in_memory=in_memory,
        truncated=truncated,
        notes=(*notes, *doubts),
    )


class _Times:
    """An array of times [s], read in parts on demand."""

    def __init__(self, array: Array, factor: float) -> None:
        self._array, self._factor = array, factor

    def __len__(self) -> int:
        return self._array.length

    def __getitem__(self, part: slice) -> np.ndarray:
        first, last, _ = part.indices(len(self))
        times = self._array.read([0], first, last)[:, 0].astype(np.float64, copy=False)
        return times * self._factor if self._factor != 1 else times


def _short(array: Array) -> str:
    """Name of a channel without its folders and its unit."""
    return split_heading(array.place[-1])[0] if array.columns == 1 else ""


def _time_bases(arrays: list[Array], facts: Facts) -> dict[Place, tuple[TimeBase, int]]:
    """Time base and length of every array that is named as times."""
    bases = {}
    for array in arrays:
        unit = facts.unit(array.place)
        name = split_heading(array.place[-1])[0]
        factor = time_factor(name, unit)
        if factor is None and split_heading(array.place[-1])[1] == "":
            factor = time_factor(name, "")  # the unit of its folder is that of the others
        if factor is not None and array.columns == 1 and array.length > 1:
            times = _Times(array, factor)
            coarse = np.finfo(array.dtype).eps if array.dtype.kind == "f" else 0.0
            ends = np.abs([times[:1][0], times[array.length - 1 :][0]])
            digit = max(array.digit, float(coarse * np.max(ends)))
            bases[array.place] = time_base(times, digit), array.length
    return bases


def _ways_up(place: Place) -> list[Place]:
    """A place and its parent folders, the nearest first."""
    return [place[:depth] for depth in range(len(place), -1, -1)]
