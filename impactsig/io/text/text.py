"""Text tables: CSV, TSV and whatever else writes rows of numbers."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import UnreadableFile
from .._limits import Limits
from .._source import Signal, Source
from ..companions import lines_above, samples_of, settings_of
from ..times.time_columns import FACTORS, epoch_factor, time_factor
from ..times.timebase import (
    DOUBTFUL,
    TimeBase,
    printed_digits,
    time_base,
)
from ._dialect import Dialect, find_dialect
from ._moments import read_moments
from ._preamble import Preamble, read_preamble
from ._table import HEAD, Column, Table

_COUNTERS = frozenset(
    (
        *("index", "sample", "samples", "n", "no", "nr", "i", "k", "row", "", "number", "point"),
        *("scan", "scan number", "sample number", "record", "id"),
    )
)
_DATES = frozenset(("date", "datetime", "date time", "date/time", "datum"))
_NUMBERED = frozenset(("sequence", "sample", "samples", "points"))  # as a unit
_SHORT = 4  # settings beside the samples fill less than one row in so many
_ROUNDED = 0.01  # share by which a rate from rounded times may differ from the header's
_NO_TIME = "The file has no column of times"


class _Clock(NamedTuple):
    """Time base, the column it comes from or -1, and the wall-clock time of its time 0."""

    base: TimeBase
    column: int
    recorded_at: datetime | None = None
    uneven: Callable[[], np.ndarray] | None = None
    steps: int = 0  # times that differ from the one before


def open_source(path: Path, limits: Limits) -> Source:
    """Open a table of numbers; see `impactsig.io.formats`.

    The column of times is the one named as such, or the first of several if none has a name and
    it rises uniformly; ISO dates and times of day count from their first. A column that only
    counts its rows gives no rate: that may stand in the header (see `_preamble`).
    """
    head, whole = _first(path)
    if (samples := samples_of(path, head)) != path:
        path = samples
        head, whole = _first(path)
    stated, missing = settings_of(path)
    dialect = find_dialect(head, whole)
    if dialect is None:
        remedy = "Expected columns of numbers, with or without headings above them"
        if b" -> " in head:
            remedy = (
                "Its lines begin with the time stamps of a serial monitor, which says when a line "
                "came: switch these off, and print micros() before each sample"
            )
        raise UnreadableFile(path, "contains no rows of numbers", remedy)
    table = Table(path, dialect)
    if stated:
        dialect = dialect._replace(above=lines_above(path, stated, table.rows))
    settings = _settings_beside(table)
    preamble = read_preamble(dialect, _rows(table, settings))
    # What a header calls the channels goes before the line above the data, which belongs to it.
    if preamble.names:
        dialect = dialect._replace(names=(), units=())
    width = len(table.columns)
    notes = []
    if len(dialect.names) > width and not preamble.key:
        notes.append(
            f"its headings name {len(dialect.names)} columns, its rows have {width}: "
            f"the first {width} names are taken"
        )
    names = [*dialect.names[:width]] or [""] * width
    units = [*dialect.units[:width]] or [""] * width
    _refuse_stray_text(path, table, names, settings)
    clock = _clock(dialect, table, names, units, settings, preamble.base and preamble.base.rate)
    counter = -1
    kept = []
    for index, column in enumerate(table.columns):
        if index == clock.column or index in settings:
            continue
        if _is_counter(column, index, names[index], units[index], width):
            counter = index
        elif column.text:
            notes.append(f"column {names[index] or index} holds text and is left out")
        elif clock.column >= 0 and dialect.names and _is_times(names[index], units[index]):
            continue  # the same times again, beside each channel or in another unit
        elif column.filled:  # unlike what stands after a trailing delimiter
            kept.append(index)
    if not kept:
        raise UnreadableFile(path, "; ".join(notes) or "contains no column of samples")
    _name(preamble, kept, names, units)
    if not preamble.names and not any(dialect.names) and len(kept) > 1:
        names = [f"channel {kept.index(i)}" if i in kept else "" for i in range(width)]
    base, doubt = _agreed(clock, preamble, table.columns[counter].begin if counter >= 0 else 0.0)
    signals = tuple(
        Signal(
            names[index],
            units[index],
            base.rate,
            table.columns[index].filled,
            base.start,
            recorded_at=clock.recorded_at,
            no_rate=missing or base.problem,
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
        notes=(*notes, doubt) if doubt else tuple(notes),
        times=clock.uneven,
        path=path,
    )


def _first(path: Path) -> tuple[bytes, bool]:
    """The first bytes of a file, and whether they are all of it."""
    with path.open("rb") as file:
        return file.read(HEAD), not file.read(1)


def _settings_beside(table: Table) -> range:
    """The columns of text, and of what they set, that end long before those of the samples."""
    short = [0 < column.ended < table.rows // _SHORT for column in table.columns]
    for index, column in enumerate(table.columns):
        if short[index] and column.text and column.strays > column.ended // 2:
            after = index + 1
            while after < len(short) and (short[after] or not table.columns[after].ended):
                after += 1
            return range(index, after)
    return range(0)


def _rows(table: Table, columns: range) -> list[list[str]]:
    """The cells of some columns as they stand, as far as these go."""
    if not columns:
        return []
    last = max(table.columns[index].ended for index in columns)
    cells = table.cells(list(columns), 0, last)
    texts = [
        ["" if cell != cell else str(cell) for cell in row] for row in zip(*cells, strict=True)
    ]
    return texts


def _name(preamble: Preamble, kept: list[int], names: list[str], units: list[str]) -> None:
    """Give the channels the names and units of the header, if it has one for each."""
    if len(preamble.names) == len(kept):
        for index, name in zip(kept, preamble.names, strict=True):
            names[index] = name
    if len(preamble.units) == len(kept) and (preamble.names or not any(units)):
        for index, unit in zip(kept, preamble.units, strict=True):
            units[index] = unit


def _agreed(clock: _Clock, preamble: Preamble, begin: float) -> tuple[TimeBase, str]:
    """Time base from the times and from the header, and what is to be doubted of it.

    Where both are there, the header may say more than rounded times do, and must not differ from
    them by more than those leave open. `begin` is the first row's number, of one that counts from
    0 or 1.
    """
    timed, headed = clock.base, preamble.base
    if headed is None:
        return timed, timed.doubt
    if clock.column < 0 or timed.problem.startswith(_NO_TIME):
        if headed.rate is None or begin == 1:
            return headed, headed.doubt
        return headed._replace(start=headed.start + begin / headed.rate), headed.doubt
    if timed.rate is None or headed.rate is None:
        return timed, timed.doubt
    if abs(headed.rate / timed.rate - 1) <= (_ROUNDED if timed.doubt else DOUBTFUL):
        return timed._replace(rate=headed.rate), ""
    return timed, (
        f"its header says {preamble.key!r}, which is {headed.rate:.6g} Hz, and its times say "
        f"{timed.rate:.6g} Hz, which is taken; give rate= (--rate) if the header is right"
    )


def _refuse_stray_text(path: Path, table: Table, names: list[str], settings: range) -> None:
    """Raise if a column is numbers but for a few cells: leaving it out would lose a channel."""
    for index, column in enumerate(table.columns):
        if index not in settings and column.text and column.strays * 2 < table.rows:
            cell, row = column.stray
            raise UnreadableFile(
                path,
                f"column {names[index] or index} holds text in {column.strays} of {table.rows} "
                f"rows, first {cell!r} in row {row} of the data",
                "Remove those lines, or mark them as comments with #",
            )


def _clock(
    dialect: Dialect,
    table: Table,
    names: list[str],
    units: list[str],
    settings: range,
    stated: float | None,
) -> _Clock:
    """Find the column of times, and what follows from it; `stated` is the rate of the header."""
    columns = table.columns
    numeric = [i for i, c in enumerate(columns) if c.filled and not c.text and i not in settings]
    found: list[_Clock] = []
    for index, column in enumerate(columns):
        if index in settings:
            continue
        factor = time_factor(names[index], units[index]) if dialect.names else None
        dated = names[index].lower() in _DATES or (not dialect.names and index == 0)
        if column.text and (factor is not None or dated):
            last = _last_cells(dialect, table, index)
            (cells,) = table.cells([index], 0, table.rows)
            base, seconds, begin = read_moments(cells, last)
            found.append(
                _timed(base, index, seconds, begin) if len(seconds) else _Clock(base, index)
            )
        elif factor is not None and not column.text:
            found.append(_column_clock(dialect, table, index, factor))
        if found and found[-1].base.rate is not None and not found[-1].base.doubt:
            return found[-1]
    if found:  # the finest of several
        finest = max(found, key=lambda clock: clock.steps)
        dates = [clock.recorded_at for clock in found if clock.recorded_at is not None]
        return finest._replace(recorded_at=dates[0] if dates else None)
    if dialect.names:
        first = numeric[0] if numeric else -1
        if numeric and units[first] and (factor := FACTORS.get(units[first].lower())):
            # In any language: what rises evenly, in a unit of time, ahead of the samples.
            clock = _column_clock(dialect, table, first, factor)
            if clock.base.rate is not None:
                return clock
        listed = ", ".join(repr(name) for name in names if name)
        return _Clock(TimeBase(None, 0.0, f"{_NO_TIME}: its columns are {listed}"), -1)
    if len(numeric) < 2:
        return _Clock(TimeBase(None, 0.0, f"{_NO_TIME}: it has one column of numbers"), -1)
    first = numeric[0]
    if columns[first].counts and columns[first].begin in (0.0, 1.0):
        if stated and len(numeric) > 2:
            clock = _column_clock(dialect, table, numeric[1], 1.0)
            if abs((clock.base.rate or 0.0) / stated - 1) <= _ROUNDED:
                return clock
        problem = f"{_NO_TIME}: its first column only counts the rows"
        return _Clock(TimeBase(None, 0.0, problem), first)
    clock = _column_clock(dialect, table, first, 1.0)
    if clock.base.rate is None:
        problem = f"{_NO_TIME}, and its first column is none: {clock.base.problem}"
        return _Clock(TimeBase(None, 0.0, problem), -1)
    return clock


def _column_clock(dialect: Dialect, table: Table, index: int, factor: float) -> _Clock:
    texts = [dialect.number(text) for text in _last_cells(dialect, table, index)]
    (times,) = table.cells([index], 0, table.rows)
    factor = epoch_factor(times[0]) if factor == 1 and len(times) else factor
    printed = printed_digits(texts, times, factor)
    times = times if factor == 1 else times * factor
    return _timed(time_base(times, printed), index, times)


def _timed(
    base: TimeBase, index: int, times: np.ndarray, recorded_at: datetime | None = None
) -> _Clock:
    """A clock that keeps its times where these are uneven."""
    uneven = base.rate is None and len(times) > 1 and bool(np.all(np.isfinite(times)))
    steps = int(np.count_nonzero(np.diff(times)))
    return _Clock(base, index, recorded_at, (lambda: times) if uneven else None, steps)


def _last_cells(dialect: Dialect, table: Table, index: int) -> list[str]:
    rows = [dialect.fields(line) for line in table.last_lines]
    return [row[index] for row in rows if len(row) > index]


def _is_times(name: str, unit: str) -> bool:
    return time_factor(name, unit) is not None


def _is_counter(column: Column, index: int, name: str, unit: str, width: int) -> bool:
    plain = name.strip().lower().strip("#. ")
    named = (plain in _COUNTERS and column.begin in (0.0, 1.0)) or unit.lower() in _NUMBERED
    return index == 0 and width > 1 and column.counts and named
