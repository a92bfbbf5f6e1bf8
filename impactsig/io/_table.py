"""The columns of a text table, as numbers or as text."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ._dialect import Dialect

_TAIL = 1 << 16
_LAST = 50  # lines that show the printed digits


class Table(NamedTuple):
    """Columns of a text table: float64, or text as objects; and its last lines as they stand."""

    columns: list[np.ndarray]
    rows: int
    last_lines: list[str]
    truncated: str


def read_table(path: Path, dialect: Dialect) -> Table:
    """All columns of a table, from the first row of data on."""
    import pandas as pd

    separator: dict[str, Any] = {"sep": r"\s+"} if dialect.delimiter == " " else {}
    if not separator:
        # For one column a character that no text has: the whole line is one cell.
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
    columns = [
        frame[name].to_numpy(dtype=np.float64 if frame[name].dtype.kind in "biuf" else object)
        for name in frame
    ]
    lines, ended = _last_lines(path, dialect.encoding)
    truncated = ""
    if lines and dialect.comment and lines[-1].lstrip().startswith(dialect.comment):
        ended = True
    if not ended and lines and len(dialect.fields(lines[-1])) < len(columns):
        # The row that was being written when the file was cut is not complete.
        columns = [column[:-1] for column in columns]
        for index, column in enumerate(columns):
            if column.dtype == object:
                numbers, stray = numbers_in(column, dialect)
                columns[index] = column if len(stray) else numbers
        truncated = f"its last line, {lines[-1][:40]!r}, is not complete"
        lines.pop()
    return Table(columns, len(frame) - bool(truncated), lines, truncated)


def numbers_in(column: np.ndarray, dialect: Dialect) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of a column of text, NaN where there are none, and the rows that hold others."""
    import pandas as pd

    pointed = [dialect.number(cell) if isinstance(cell, str) else cell for cell in column]
    numbers = pd.to_numeric(pd.Series(pointed, dtype=object), errors="coerce").to_numpy(np.float64)
    stray = np.flatnonzero(np.isnan(numbers) & pd.notna(column))
    return numbers, stray


def filled(column: np.ndarray) -> int:
    """Number of samples up to the last that is a number."""
    if len(column) and not np.isnan(column[-1]):
        return len(column)
    numbers = np.flatnonzero(~np.isnan(column))
    return int(numbers[-1]) + 1 if len(numbers) else 0


def _last_lines(path: Path, encoding: str) -> tuple[list[str], bool]:
    """The last lines of a file, and whether the very last one is ended."""
    with path.open("rb") as file:
        order = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}.get(file.read(2), "latin-1")
        size = file.seek(0, 2)
        # From an even byte, so that no UTF-16 character is cut.
        file.seek(max(0, size - _TAIL) // 2 * 2)
        text = file.read().decode(order if encoding == "utf-16" else "latin-1", "replace")
    lines = text.splitlines()
    if size > _TAIL:
        lines = lines[1:]
    return [line for line in lines if line.strip()][-_LAST:], text.endswith(("\n", "\r"))
