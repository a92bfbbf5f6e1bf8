"""Parquet and Feather: each numeric column is a channel, read by groups of rows."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ...errors import UnreadableFile
from .._arrays import Array, Facts, fact, source_of
from .._limits import Limits
from .._source import Source, in_utf8
from ..times.time_columns import time_factor

IMPACTS = b"impactsig"
"""Key of the metadata that marks a table of impacts; recordings have none."""

_Read: TypeAlias = Callable[[list[int], int, int], np.ndarray]

_NO_RATE = "The file has no column of times, and no rate or fs among its metadata"


class _Groups(NamedTuple):
    """Row groups: group k holds rows ``starts[k]`` to ``starts[k + 1]``.

    ``load(group, name)`` reads one column of one of them.
    """

    format: str
    schema: Any
    starts: np.ndarray
    load: Callable[[int, str], np.ndarray]
    close: Callable[[], None]


def open_source(path: Path, limits: Limits) -> Source:
    """Open a table of columns; see `impactsig.io.formats`."""
    with path.open("rb") as file:
        magic = file.read(4)
    if magic == b"FEA1":
        raise UnreadableFile(path, "is of the first version of Feather", "Write it as version 2")
    groups = _parquet(path) if magic == b"PAR1" else _feather(path)
    try:
        return _source(path, groups, limits)
    except BaseException:
        groups.close()
        raise


def _source(path: Path, groups: _Groups, limits: Limits) -> Source:
    metadata = groups.schema.metadata or {}
    if IMPACTS in metadata:
        raise UnreadableFile(
            path,
            "is a table of impacts, not a recording",
            "Read it with impactsig.Impacts.read_parquet",
        )
    facts, notes, arrays = Facts(path), [], []
    for name, value in metadata.items():
        facts.add((), name.decode("utf-8", "replace"), _value(name, value))
    names = groups.schema.names
    length = int(groups.starts[-1])
    moment = None
    for field in groups.schema:
        dtype = _dtype(field.type)
        if dtype is None or names.count(field.name) > 1:
            what = f"it holds {field.type}" if dtype is None else "others have its name"
            notes.append(f"column {field.name!r} is left out: {what}")
            continue
        for key, value in (field.metadata or {}).items():
            facts.add((field.name,), key.decode("utf-8", "replace"), _value(key, value))
        place, count = (field.name,), _count(field.type)
        reader = _reader(path, groups, field, limits)
        if count:  # of what it counts, from the first: as a time, or as seconds among others
            if timed := _is_moment(field.type) or time_factor(field.name, "s") is not None:
                place = ("time",) if "time" not in names else place
            facts.add(place, "unit", "s")
            reader, first = _seconds(reader, count, length > 0 and _is_moment(field.type))
            if timed and moment is None and first is not None:
                moment = np.datetime64(first, field.type.unit).astype("datetime64[us]").item()
                moment = moment.replace(tzinfo=UTC) if field.type.tz else moment
        arrays.append(Array(place, (length,), dtype, reader, count))
    source = source_of(
        path, groups.format, arrays, facts, notes, no_rate=_NO_RATE, close=groups.close
    )
    return replace(
        source, signals=tuple(replace(signal, recorded_at=moment) for signal in source.signals)
    )


def _seconds(read: _Read, count: float, from_first: bool) -> tuple[_Read, int | None]:
    """A reader of seconds from counts, and the first count if times begin there."""
    first = None
    if from_first:
        (value,) = read([0], 0, 1)[0]
        first = int(value) if np.isfinite(value) else 0

    def seconds(columns: list[int], begin: int, end: int) -> np.ndarray:
        return (read(columns, begin, end) - (first or 0)) * count

    return seconds, first


def _parquet(path: Path) -> _Groups:
    from pyarrow import parquet

    file = parquet.ParquetFile(path if in_utf8(path) else path.open("rb"))
    counts = [file.metadata.row_group(i).num_rows for i in range(file.num_row_groups)]

    def load(group: int, name: str) -> np.ndarray:
        column = file.read_row_group(group, columns=[name]).column(name)
        return _numbers(column).to_numpy()

    return _Groups("Parquet", file.schema_arrow, _starts(path, counts), load, file.close)


def _feather(path: Path) -> _Groups:
    import pyarrow

    held = pyarrow.memory_map(str(path)) if in_utf8(path) else pyarrow.PythonFile(path.open("rb"))
    counts = []
    held.seek(8)
    for message in pyarrow.ipc.MessageReader.open_stream(held):
        if message.type == "record batch":
            counts.append(_rows(message.metadata))
    schema = pyarrow.ipc.open_file(held).schema
    readers: dict[str, Any] = {}  # of one column each

    def load(group: int, name: str) -> np.ndarray:
        if name not in readers:
            chosen = pyarrow.ipc.IpcReadOptions(included_fields=[schema.names.index(name)])
            readers[name] = pyarrow.ipc.open_file(held, options=chosen)
        return _numbers(readers[name].get_batch(group).column(0)).to_numpy(zero_copy_only=False)

    return _Groups("Feather", schema, _starts(path, counts), load, held.close)


def _rows(message: Any) -> int:
    """Number of rows that a record batch announces, read before its buffers are unpacked.

    The message is a FlatBuffer: each table begins with the distance back to a list of where its
    fields stand. The header is the third field of a message, the length the first of a batch.
    """
    raw = memoryview(message)

    def field(table: int, index: int) -> int:
        (back,) = struct.unpack_from("<i", raw, table)
        (size,) = struct.unpack_from("<H", raw, table - back)
        if 4 + 2 * index >= size:
            return 0
        (offset,) = struct.unpack_from("<H", raw, table - back + 4 + 2 * index)
        return table + offset if offset else 0

    (root,) = struct.unpack_from("<I", raw, 0)
    header = field(root, 2)
    (distance,) = struct.unpack_from("<I", raw, header)
    length = field(header + distance, 0)
    return int(struct.unpack_from("<q", raw, length)[0]) if length else 0


def _starts(path: Path, counts: list[int]) -> np.ndarray:
    # Python integers, so that no hostile count overflows.
    if any(count < 0 for count in counts) or sum(counts) >= 1 << 48:
        raise UnreadableFile(path, f"announces {sum(counts)} rows")
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))


def _dtype(kind: Any) -> np.dtype | None:
    """Type of the numbers of a column; None if it holds none."""
    from pyarrow import types

    if types.is_boolean(kind):
        return np.dtype(bool)
    if types.is_integer(kind) or types.is_floating(kind):
        return np.dtype(kind.to_pandas_dtype())
    if types.is_decimal(kind) or _count(kind):
        return np.dtype(np.float64)
    return None


def _is_moment(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_timestamp(kind))


def _count(kind: Any) -> float:
    """Seconds in one count of a timestamp or duration; 0 for any other type."""
    from pyarrow import types

    counted = types.is_timestamp(kind) or types.is_duration(kind)
    return {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[kind.unit] if counted else 0.0


def _numbers(column: Any) -> Any:
    """A column as plain numbers: counts of timestamps, decimals as binary fractions."""
    from pyarrow import types

    if column.type == "bool":
        return column.cast("uint8")
    if types.is_decimal(column.type):
        return column.cast("float64")
    return column.cast("int64") if _count(column.type) else column


def _value(name: bytes, value: bytes) -> Any:
    """Metadata as a number if it is one, else as text."""
    text = value.decode("utf-8", "replace")
    if fact(name.decode("utf-8", "replace")) in ("rate", "step", "start"):
        try:
            return float(text)
        except ValueError:
            return None
    return None if fact(name.decode("utf-8", "replace")) == "names" else text


def _reader(
    path: Path, groups: _Groups, field: Any, limits: Limits
) -> Callable[[list[int], int, int], np.ndarray]:
    """A reader of one column, which caches the last group for the next block."""
    held: dict[int, np.ndarray] = {}
    starts, dtype = groups.starts, _dtype(field.type)

    def group_of(index: int) -> np.ndarray:
        if index not in held:
            held.clear()
            count = int(starts[index + 1] - starts[index])
            limits.check(path, count * 8, at_once=True)
            column = groups.load(index, field.name)
            if len(column) != count:
                raise UnreadableFile(
                    path, f"group {index} announces {count} rows and has {len(column)}"
                )
            held[index] = column
        return held[index]

    def read(columns: list[int], first: int, last: int) -> np.ndarray:
        limits.check(path, (last - first) * 8)
        low = int(np.searchsorted(starts, first, side="right")) - 1
        high = int(np.searchsorted(starts, last, side="left"))
        parts = [
            group_of(i)[max(0, first - int(starts[i])) : last - int(starts[i])]
            for i in range(low, high)
        ]
        # A copy: the group may be mapped, or far larger than the part that is kept of it.
        return np.concatenate(parts or [np.empty(0, dtype)])[:, np.newaxis]

    return read
