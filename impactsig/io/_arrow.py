"""Parquet and Feather: each column of numbers a channel, read by groups of rows."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import UnreadableFile
from ._arrays import Array, Facts, fact, source_of
from ._limits import Limits
from ._source import Source

IMPACTS = b"impactsig"
"""Key of the metadata by which a table of impacts is told from a recording."""

_NO_RATE = "The file has no column of times, and no rate or fs among its metadata"


class _Groups(NamedTuple):
    """Groups of rows: group k holds rows ``starts[k]`` to ``starts[k + 1]``.

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
    groups = _parquet(path, limits) if magic == b"PAR1" else _feather(path, limits)
    try:
        return _source(path, groups, limits)
    except BaseException:
        groups.close()
        raise


def _source(path: Path, groups: _Groups, limits: Limits) -> Source:
    told = groups.schema.metadata or {}
    if IMPACTS in told:
        raise UnreadableFile(
            path,
            "is a table of impacts, not a recording",
            "Read it with impactsig.Impacts.read_parquet",
        )
    facts, notes, arrays = Facts(path), [], []
    for name, value in told.items():
        facts.add((), name.decode("utf-8", "replace"), _value(name, value))
    names = groups.schema.names
    length = int(groups.starts[-1])
    for field in groups.schema:
        dtype = _dtype(field.type)
        if dtype is None or names.count(field.name) > 1:
            what = f"it holds {field.type}" if dtype is None else "others have its name"
            notes.append(f"column {field.name!r} is left out: {what}")
            continue
        for key, value in (field.metadata or {}).items():
            facts.add((field.name,), key.decode("utf-8", "replace"), _value(key, value))
        place = (field.name,)
        arrays.append(Array(place, (length,), dtype, _reader(path, groups, field, limits)))
    return source_of(
        path, groups.format, arrays, facts, notes, no_rate=_NO_RATE, close=groups.close
    )


def _parquet(path: Path, limits: Limits) -> _Groups:
    from pyarrow import parquet

    file = parquet.ParquetFile(path)
    counts = [file.metadata.row_group(i).num_rows for i in range(file.num_row_groups)]

    def load(group: int, name: str) -> np.ndarray:
        column = file.read_row_group(group, columns=[name]).column(name)
        return (column.cast("uint8") if column.type == "bool" else column).to_numpy()

    return _Groups("Parquet", file.schema_arrow, _starts(path, counts), load, file.close)


def _feather(path: Path, limits: Limits) -> _Groups:
    import pyarrow

    held = pyarrow.memory_map(str(path))
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
        column = readers[name].get_batch(group).column(0)
        if column.type == "bool":
            column = column.cast("uint8")
        return column.to_numpy(zero_copy_only=False)

    return _Groups("Feather", schema, _starts(path, counts), load, held.close)


def _rows(message: Any) -> int:
    """Number of rows that a record batch announces, read before any of its buffers is unpacked.

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
    return None


def _value(name: bytes, value: bytes) -> Any:
    """A number where one is looked for, a text elsewhere."""
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
    """Reads rows of one column; the group read last is held, for the block that goes on in it."""
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
