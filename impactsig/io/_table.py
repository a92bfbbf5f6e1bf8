"""The columns of a text table, as numbers or as text."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ._dialect import Dialect

_TAIL = 1 << 16
# What pandas takes for no number; pyarrow is told to do so too.
_MISSING = (
    *("", "#N/A", "#N/A N/A", "#NA", "-1.#IND", "-1.#QNAN", "-NaN", "-nan", "1.#IND", "1.#QNAN"),
    *("<NA>", "N/A", "NA", "NULL", "NaN", "None", "n/a", "nan", "null"),
)
_LAST = 50  # lines that show the printed digits


class Table(NamedTuple):
    """Columns of a text table: float64, or text as objects; and its last lines as they stand."""

    columns: list[np.ndarray]
    rows: int
    last_lines: list[str]
    truncated: str


def read_table(path: Path, dialect: Dialect) -> Table:
    """All columns of a table, from the first row of data on."""
    columns = _columns_by_arrow(path, dialect)
    if columns is None:
        columns = _columns_by_pandas(path, dialect)
    rows = len(columns[0]) if columns else 0
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
    return Table(columns, rows - bool(truncated), lines, truncated)


def _columns_by_arrow(path: Path, dialect: Dialect) -> list[np.ndarray] | None:
    """The columns as pyarrow reads them; None if it is not there, or they are not all numbers.

    What it refuses (comments, text, rows that are too short) is left to pandas, which says more of
    it. What both read, they read alike.
    """
    if dialect.delimiter == " " or dialect.encoding == "utf-16":
        return None
    try:
        from pyarrow import ArrowException, csv, float64
    except ImportError:
        return None
    names = [str(index) for index in range(dialect.columns)]
    try:
        table = csv.read_csv(
            path,
            csv.ReadOptions(column_names=names, skip_rows=dialect.skipped),
            csv.ParseOptions(delimiter=dialect.delimiter or "\x1f"),
            csv.ConvertOptions(
                column_types=dict.fromkeys(names, float64()),
                decimal_point=dialect.decimal,
                null_values=list(_MISSING),
            ),
        )
    except ArrowException:
        return None
    return [column.to_numpy() for column in table.columns]


def _columns_by_pandas(path: Path, dialect: Dialect) -> list[np.ndarray]:
    """The columns as pandas reads them: numbers, or text as objects."""
    import pandas as pd

    options: dict[str, Any] = {"sep": r"\s+"}
    if dialect.delimiter != " ":
        # For one column a character that no text has: the whole line is one cell.
        options = {"sep": dialect.delimiter or "\x1f", "skipinitialspace": True}
    if tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1):
        options["float_precision"] = "round_trip"  # later ones are right to the last digit
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
            **options,
        )
    return [
        frame[name].to_numpy(dtype=np.float64 if frame[name].dtype.kind in "biuf" else object)
        for name in frame
    ]


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
