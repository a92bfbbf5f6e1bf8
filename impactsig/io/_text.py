"""Text tables: CSV, TSV and whatever else writes rows of numbers."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import UnreadableFile
from ._dialect import Dialect, find_dialect
from ._source import Signal, Source, memory_reader
from ._timebase import TimeBase, printed_resolution, time_base, time_factor

_HEAD = 1 << 17
_TAIL = 1 << 16
_COUNTERS = frozenset(("index", "sample", "samples", "n", "no", "nr", "i", "k", "row", ""))
_NO_TIME = "The file has no column of times"


class Table(NamedTuple):
    """Columns of a text table: numbers, or None where a column holds text."""

    columns: list[np.ndarray | None]
    rows: int
    last_lines: list[str]
    truncated: str


def open_source(path: Path) -> Source:
    """Open a table of numbers; see `impactsig.io.formats`.

    The column of times is the one named as such, or the first of several if none has a name and
    it rises uniformly. A column that only counts its rows gives no rate.
    """
    with path.open("rb") as file:
        head = file.read(_HEAD)
        whole = not file.read(1)
    dialect = find_dialect(head, whole)
    if dialect is None:
        raise UnreadableFile(
            path,
            "holds no rows of numbers",
            "Expected columns of numbers, with or without headings above them",
        )
    table = read_table(path, dialect)
    names = list(dialect.names) or [""] * len(table.columns)
    units = list(dialect.units) or [""] * len(table.columns)
    named = bool(dialect.names)
    kept, notes = [], []
    if len(names) > len(table.columns):
        notes.append(
            f"its headings name {len(names)} columns, its rows have {len(table.columns)}: "
            f"the first {len(table.columns)} names are taken"
        )
    for index, column in enumerate(table.columns):
        if column is not None and np.isnan(column).all():
            continue  # what stands after a trailing delimiter, or an empty column
        if column is None and time_factor(names[index], units[index]) is None:
            notes.append(f"column {names[index] or index} holds text and is left out")
        else:
            kept.append(index)
    base, times = _time(dialect, table, kept, names, units)
    kept = [
        index
        for index in kept
        if index != times and not (_counts(table.columns[index]) and _is_counter(names, index))
    ]
    signals, columns = [], []
    for position, index in enumerate(kept):
        column = table.columns[index]
        if column is None:
            continue
        length = filled(column)
        name = names[index] if named else ("" if len(kept) == 1 else f"channel {position}")
        signals.append(
            Signal(name, units[index], base.rate, length, base.start, no_rate=base.problem)
        )
        columns.append(column)
    if not signals:
        raise UnreadableFile(path, "; ".join(notes) or "holds no column of samples")
    longest = max(signal.length for signal in signals)
    if longest < table.rows:
        notes.append(f"its samples end after {longest} of {table.rows} rows")
    if base.doubt:
        notes.append(base.doubt)
    return Source(
        format="text",
        signals=tuple(signals),
        read=memory_reader(columns),
        in_memory=True,
        truncated=table.truncated,
        notes=tuple(notes),
    )


def read_table(path: Path, dialect: Dialect) -> Table:
    """All columns of a table, from the first row of data on."""
    import pandas as pd

    separator: dict[str, Any] = {"sep": r"\s+"} if dialect.delimiter == " " else {}
    if not separator:
        # A character that no text has: the whole line is one cell.
        separator = {"sep": dialect.delimiter or "\x1f", "skipinitialspace": True}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pd.errors.DtypeWarning)
        frame = pd.read_csv(
            path,
            header=None,
            skiprows=dialect.skipped,
            decimal=dialect.decimal,
            comment=dialect.comment or None,
            encoding=dialect.encoding,
            encoding_errors="replace",
            engine="c",
            low_memory=False,
            skip_blank_lines=True,
            **separator,
        )
    columns: list[np.ndarray | None] = []
    for name in frame:
        column = frame[name]
        number = column.dtype.kind in "biuf"
        columns.append(column.to_numpy(dtype=np.float64) if number else None)
    last_lines, ended = _last_lines(path, dialect.encoding)
    truncated = ""
    if not ended and last_lines and len(dialect.fields(last_lines[-1])) < len(columns):
        # The row that was being written when the file was cut is not complete.
        columns = [None if column is None else column[:-1] for column in columns]
        truncated = f"its last line, {last_lines[-1][:40]!r}, is not complete"
        last_lines.pop()
    rows = len(frame) - bool(truncated)
    return Table(columns, rows, last_lines, truncated)


def _last_lines(path: Path, encoding: str) -> tuple[list[str], bool]:
    """The last lines of a file, and whether the very last one is ended."""
    with path.open("rb") as file:
        size = file.seek(0, 2)
        # From an even byte, so that no UTF-16 character is cut.
        file.seek(max(0, size - _TAIL) // 2 * 2)
        tail = file.read()
    if encoding == "utf-16":
        with path.open("rb") as file:
            order = "utf-16-le" if file.read(2) == b"\xff\xfe" else "utf-16-be"
        text = tail.decode(order, "replace")
    else:
        text = tail.decode("latin-1")
    lines = text.splitlines()
    if size > _TAIL:
        lines = lines[1:]
    return [line for line in lines if line.strip()][-50:], text.endswith(("\n", "\r"))


def _time(
    dialect: Dialect, table: Table, kept: list[int], names: list[str], units: list[str]
) -> tuple[TimeBase, int]:
    """Time base, and index of the column it comes from or -1."""
    for index in kept:
        factor = time_factor(names[index], units[index]) if names[index] else None
        if factor is not None:
            return _column_base(dialect, table, index, factor), index
    if dialect.names:
        listed = ", ".join(repr(name) for name in names if name)
        return TimeBase(None, 0.0, f"{_NO_TIME}: its columns are {listed}"), -1
    if len(kept) < 2:
        return TimeBase(None, 0.0, f"{_NO_TIME}: it has one column of numbers"), -1
    first = table.columns[kept[0]]
    if first is None:
        return TimeBase(None, 0.0, _NO_TIME), -1
    if _counts(first):
        return TimeBase(None, 0.0, f"{_NO_TIME}: its first column only counts the rows"), kept[0]
    base = _column_base(dialect, table, kept[0], 1.0)
    if base.rate is None:
        return TimeBase(None, 0.0, f"{_NO_TIME}, and its first column is none: {base.problem}"), -1
    return base, kept[0]


def _column_base(dialect: Dialect, table: Table, index: int, factor: float) -> TimeBase:
    times = table.columns[index]
    if times is None:
        return TimeBase(None, 0.0, "The time column holds text")
    cells = [dialect.fields(line) for line in table.last_lines]
    texts = [dialect.number(row[index]) for row in cells if len(row) > index]
    return time_base(times * factor, printed_resolution(texts) * factor)


def _counts(column: np.ndarray | None) -> bool:
    """Whether a column is 0, 1, 2, ... or 1, 2, 3, ..."""
    if column is None or column[0] not in (0.0, 1.0):
        return False
    return bool(np.array_equal(column, column[0] + np.arange(len(column))))


def _is_counter(names: list[str], index: int) -> bool:
    return names[index].strip().lower().strip("#. ") in _COUNTERS and index == 0 and len(names) > 1


def filled(column: np.ndarray) -> int:
    """Number of samples up to the last that is a number."""
    if len(column) and not np.isnan(column[-1]):
        return len(column)
    filled = np.flatnonzero(~np.isnan(column))
    return int(filled[-1]) + 1 if len(filled) else 0
