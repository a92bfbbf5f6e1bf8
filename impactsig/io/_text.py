"""Text tables: CSV, TSV and whatever else writes rows of numbers."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import UnreadableFile
from ._dialect import Dialect, find_dialect
from ._limits import Limits
from ._source import Signal, Source
from ._table import HEAD, Column, Table
from ._timebase import TimeBase, printed_resolution, time_base, time_factor

_COUNTERS = frozenset(("index", "sample", "samples", "n", "no", "nr", "i", "k", "row", ""))
_DATES = frozenset(("date", "datetime", "date time", "date/time", "datum"))
_NO_TIME = "The file has no column of times"


class _Clock(NamedTuple):
    """Time base, the column it comes from or -1, and the wall-clock time of its time 0."""

    base: TimeBase
    column: int
    recorded_at: datetime | None = None


def open_source(path: Path, limits: Limits) -> Source:
    """Open a table of numbers; see `impactsig.io.formats`.

    The column of times is the one named as such, or the first of several if none has a name and
    it rises uniformly; ISO dates and times of day count from their first. A column that only
    counts its rows gives no rate.
    """
    with path.open("rb") as file:
        head = file.read(HEAD)
        whole = not file.read(1)
    dialect = find_dialect(head, whole)
    if dialect is None:
        raise UnreadableFile(
            path,
            "holds no rows of numbers",
            "Expected columns of numbers, with or without headings above them",
        )
    table = Table(path, dialect)
    width = len(table.columns)
    notes = []
    if len(dialect.names) > width:
        notes.append(
            f"its headings name {len(dialect.names)} columns, its rows have {width}: "
            f"the first {width} names are taken"
        )
    names = list(dialect.names) or [""] * width
    units = list(dialect.units) or [""] * width
    _refuse_stray_text(path, table, names)
    clock = _clock(dialect, table, names, units)
    kept = []
    for index, column in enumerate(table.columns):
        if index == clock.column or _is_counter(column, index, names[index], width):
            continue
        if column.text:
            notes.append(f"column {names[index] or index} holds text and is left out")
        elif column.filled:  # unlike what stands after a trailing delimiter
            kept.append(index)
    if not kept:
        raise UnreadableFile(path, "; ".join(notes) or "holds no column of samples")
    if not dialect.names and len(kept) > 1:
        names = [f"channel {kept.index(i)}" if i in kept else "" for i in range(width)]
    base = clock.base
    signals = tuple(
        Signal(
            names[index],
            units[index],
            base.rate,
            table.columns[index].filled,
            base.start,
            recorded_at=clock.recorded_at,
            no_rate=base.problem,
        )
        for index in kept
    )
    longest = max(signal.length for signal in signals)
    if longest < table.rows:
        notes.append(f"its samples end after {longest} of {table.rows} rows")

    def read(channels: list[int], first: int, last: int) -> np.ndarray:
        cells = table.cells([kept[channel] for channel in channels], first, last)
        return cells[0][:, np.newaxis] if len(cells) == 1 else np.column_stack(cells)

    return Source(
        format="text",
        signals=signals,
        read=read,
        in_memory=table.in_memory,
        truncated=table.truncated,
        notes=(*notes, base.doubt) if base.doubt else tuple(notes),
    )


def _refuse_stray_text(path: Path, table: Table, names: list[str]) -> None:
    """Raise if a column is numbers but for a few cells: leaving it out would lose a channel."""
    for index, column in enumerate(table.columns):
        if column.text and column.strays * 2 < table.rows:
            cell, row = column.stray
            raise UnreadableFile(
                path,
                f"column {names[index] or index} holds text in {column.strays} of {table.rows} "
                f"rows, first {cell!r} in row {row} of the data",
                "Remove those lines, or mark them as comments with #",
            )


def _clock(dialect: Dialect, table: Table, names: list[str], units: list[str]) -> _Clock:
    """Find the column of times, and what follows from it."""
    numeric = [i for i, column in enumerate(table.columns) if not column.text]
    for index, column in enumerate(table.columns):
        factor = time_factor(names[index], units[index]) if names[index] else None
        dated = names[index].lower() in _DATES or (not dialect.names and index == 0)
        if column.text and (factor is not None or dated):
            return _stamps(dialect, table, index)
        if factor is not None:
            return _Clock(_column_base(dialect, table, index, factor), index)
    if dialect.names:
        listed = ", ".join(repr(name) for name in names if name)
        return _Clock(TimeBase(None, 0.0, f"{_NO_TIME}: its columns are {listed}"), -1)
    if len(numeric) < 2:
        return _Clock(TimeBase(None, 0.0, f"{_NO_TIME}: it has one column of numbers"), -1)
    first = numeric[0]
    if table.columns[first].counts:
        problem = f"{_NO_TIME}: its first column only counts the rows"
        return _Clock(TimeBase(None, 0.0, problem), first)
    base = _column_base(dialect, table, first, 1.0)
    if base.rate is None:
        problem = f"{_NO_TIME}, and its first column is none: {base.problem}"
        return _Clock(TimeBase(None, 0.0, problem), -1)
    return _Clock(base, first)


def _column_base(dialect: Dialect, table: Table, index: int, factor: float) -> TimeBase:
    texts = [dialect.number(text) for text in _last_cells(dialect, table, index)]
    (times,) = table.cells([index], 0, table.rows)
    return time_base(times if factor == 1 else times * factor, printed_resolution(texts) * factor)


def _stamps(dialect: Dialect, table: Table, index: int) -> _Clock:
    """Time base of ISO dates or times of day."""
    import pandas as pd

    (cells,) = table.cells([index], 0, table.rows)
    texts = pd.Series(cells).str.replace(",", ".", regex=False)
    moments: Any
    try:
        moments = pd.to_datetime(texts, format="ISO8601")
        begin = moments.iloc[0].to_pydatetime(warn=False)
    except (ValueError, TypeError):
        try:
            moments, begin = pd.to_timedelta(texts), None
        except (ValueError, TypeError):
            shown = cells[0]
            problem = f"The time column holds text that is no ISO date or time, such as {shown!r}"
            return _Clock(TimeBase(None, 0.0, problem), index)
    seconds = (moments - moments.iloc[0]).dt.total_seconds().to_numpy(dtype=np.float64)
    last = [
        re.sub(r".*?(\d+(?:[.,]\d+)?)\D*$", r"\1", t) for t in _last_cells(dialect, table, index)
    ]
    return _Clock(
        time_base(seconds, printed_resolution(t.replace(",", ".") for t in last)), index, begin
    )


def _last_cells(dialect: Dialect, table: Table, index: int) -> list[str]:
    rows = [dialect.fields(line) for line in table.last_lines]
    return [row[index] for row in rows if len(row) > index]


def _is_counter(column: Column, index: int, name: str, width: int) -> bool:
    plain = name.strip().lower().strip("#. ")
    return index == 0 and width > 1 and plain in _COUNTERS and column.counts
