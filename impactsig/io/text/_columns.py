"""The columns of a text table, as pyarrow or pandas reads them."""

from __future__ import annotations

import io
import re
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .._source import in_utf8
from ._dialect import Dialect

# What pandas takes for missing; pyarrow gets the same list.
_MISSING = (
    *("", "#N/A", "#N/A N/A", "#NA", "-1.#IND", "-1.#QNAN", "-NaN", "-nan", "1.#IND", "1.#QNAN"),
    *("<NA>", "N/A", "NA", "NULL", "NaN", "None", "n/a", "nan", "null"),
)


def columns_of(source: Path | io.BytesIO, dialect: Dialect) -> list[np.ndarray]:
    """The columns: numbers, or text as objects; [] if there are no rows."""
    columns = _columns_by_arrow(source, dialect)
    if columns is None:
        if isinstance(source, io.BytesIO):
            source.seek(0)
        columns = _columns_by_pandas(source, dialect)
    return columns


def _columns_by_arrow(source: Path | io.BytesIO, dialect: Dialect) -> list[np.ndarray] | None:
    """The columns as pyarrow reads them; None if it is not there, or they are not all numbers.

    What it refuses (comments, text, rows that are too short) is left to pandas, which says more of
    it. What both read, they read alike.
    """
    if dialect.delimiter == " " or dialect.encoding.startswith("utf-16"):
        return None
    try:
        from pyarrow import ArrowException, csv, float64
    except ImportError:
        return None
    names = [str(index) for index in range(dialect.columns)]
    if isinstance(source, Path) and not in_utf8(source):
        source = io.BytesIO(source.read_bytes())
    try:
        table = csv.read_csv(
            source,
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


def _columns_by_pandas(source: Path | io.BytesIO, dialect: Dialect) -> list[np.ndarray]:
    """The columns as pandas reads them."""
    import pandas as pd

    options: dict[str, Any] = {"sep": r"\s+"}
    if dialect.delimiter != " ":
        # For one column a character that no text has: the whole line is one cell.
        options = {"sep": dialect.delimiter or "\x1f", "skipinitialspace": True}
    if tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1):
        options["float_precision"] = "round_trip"  # later ones are right to the last digit
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pd.errors.DtypeWarning)
        read: Any = partial(
            pd.read_csv,
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
        try:
            frame = read(source)
        except pd.errors.EmptyDataError:
            return []
        except pd.errors.ParserError:
            bare = _without_comments(source, dialect)
            if bare is None:
                raise
            frame = read(bare)
    return [
        frame[name].to_numpy(dtype=np.float64 if frame[name].dtype.kind in "biuf" else object)
        for name in frame
    ]


def _without_comments(source: Path | io.BytesIO, dialect: Dialect) -> io.BytesIO | None:
    """The text without the comments that stand in a cell of their own, if there are any.

    What separates them from the row would make one more cell of it than the others have.
    """
    if not dialect.comment or not dialect.delimiter.strip(" ") or "utf-16" in dialect.encoding:
        return None
    content = source.read_bytes() if isinstance(source, Path) else source.getvalue()
    mark, cell = re.escape(dialect.comment.encode()), re.escape(dialect.delimiter.encode())
    bare, count = re.subn(rb"%s[ ]*%s[^\r\n]*" % (cell, mark), b"", content)
    return io.BytesIO(bare) if count else None


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
