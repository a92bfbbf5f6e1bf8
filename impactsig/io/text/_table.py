"""The columns of a text table, as numbers or as text: held where they are small, else in pieces.

A table larger than `LARGE` is gone through once, when it is opened: what there is to know of each
column, and where the rows of each piece stand. Its samples are read anew from the pieces asked for.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...errors import UnreadableFile
from ._columns import columns_of, filled, numbers_in
from ._dialect import Dialect

LARGE = 256 << 20
"""Bytes from which a file is not held."""

PIECE = 16 << 20
"""Bytes of text that are read at a time from such a file."""

HEAD = 1 << 17
"""Bytes that hold the headings of a file and enough of its rows to tell how it is written."""

_TAIL = 1 << 16
_ENDING = re.compile(rb"\r\n|\n|\r")
_LAST = 50  # lines that show the printed digits


class Column:
    """What is known of all cells of a column.

    Attributes
    ----------
    filled : int
        Rows up to the last that holds a number.
    strays : int
        Cells that hold text.
    stray : tuple of (str, int)
        The first of them, and its row.
    ended : int
        Rows up to the last that holds anything.
    counts : bool
        It counts its rows, from any whole number.
    begin : float
        The first of its cells, if that is a number.
    """

    def __init__(self) -> None:
        self.filled = self.strays = self.ended = self._rows = 0
        self.stray = ("", -1)
        self.counts = True
        self.begin = np.nan

    @property
    def text(self) -> bool:
        """Whether it holds text."""
        return self.strays > 0

    def add(self, cells: np.ndarray, dialect: Dialect) -> None:
        """Look at the cells that follow those seen so far."""
        numbers = cells
        if cells.dtype == object:
            numbers, strays = numbers_in(cells, dialect)
            if len(strays) and not self.strays:
                self.stray = (cells[strays[0]], self._rows + int(strays[0]))
            self.strays += len(strays)
            if len(strays):
                self.ended = self._rows + int(strays[-1]) + 1
        if last := filled(numbers):
            self.filled = self._rows + last
        self.ended = max(self.ended, self.filled)
        if self.counts and len(numbers):
            if not self._rows:
                self.begin = float(numbers[0])
            begin = self.begin + self._rows
            # The first few tell nearly every column that does not count.
            self.counts = self.begin.is_integer() and all(
                np.array_equal(part, begin + np.arange(len(part)))
                for part in (numbers[:3], numbers)
            )
        self._rows += len(cells)


class Table:
    """A text table, and its last lines as they stand.

    Attributes
    ----------
    columns : list of Column
    rows : int
    last_lines : list of str
    truncated : str
        What is missing at its end.
    in_memory : bool
        Its numbers are held.
    """

    def __init__(self, path: Path, dialect: Dialect) -> None:
        self._path, self._dialect = path, dialect
        self.last_lines, cut = _last_lines(path, dialect)
        self.truncated = ""
        if cut:
            last = self.last_lines.pop()
            self.truncated = f"its last line, {last[:40]!r}, is not complete"
        spans = list(_spans(path, dialect)) if path.stat().st_size > LARGE else []
        self.in_memory = not spans
        self._spans: list[tuple[int, int]] = spans
        self._held: tuple[int, list[np.ndarray]] = (-1, [])
        self.columns: list[Column] = []
        counts = []
        for number in range(max(1, len(spans))):
            cells = self._piece(number, cut and number >= len(spans) - 1)
            self.columns = self.columns or [Column() for _ in cells]
            for column, part in zip(self.columns, cells, strict=True):
                column.add(part, dialect)
            counts.append(len(cells[0]) if cells else 0)
        self._starts = np.concatenate(([0], np.cumsum(counts)))
        self.rows = int(self._starts[-1])

    def cells(self, chosen: list[int], first: int, last: int) -> list[np.ndarray]:
        """Rows [first, last) of some columns: numbers, or text as objects."""
        low = max(0, int(np.searchsorted(self._starts, first, side="right")) - 1)
        high = max(low + 1, int(np.searchsorted(self._starts, last, side="left")))
        high = min(high, len(self._starts) - 1)
        found: list[np.ndarray] = []
        for number in range(low, high):
            start = int(self._starts[number])
            cells = self._piece(number, False)
            rows = slice(max(0, first - start), min(last, int(self._starts[number + 1])) - start)
            parts = [self._as_numbers(cells[index][rows], index) for index in chosen]
            if high - low == 1:
                return parts
            # Filled piece by piece: of a long column there is but one copy.
            kinds = [object if self.columns[index].text else np.float64 for index in chosen]
            found = found or [np.empty(last - first, kind) for kind in kinds]
            for whole, part in zip(found, parts, strict=True):
                at = start + rows.start - first
                whole[at : at + len(part)] = part
        return found

    def _as_numbers(self, cells: np.ndarray, index: int) -> np.ndarray:
        if cells.dtype == object and not self.columns[index].text:
            return numbers_in(cells, self._dialect)[0]
        return cells

    def _piece(self, number: int, cut: bool) -> list[np.ndarray]:
        """The columns of one piece, or of the whole table; the one used last is held."""
        if self._held[0] == number:
            return self._held[1]
        if self.in_memory:
            columns = columns_of(self._path, self._dialect)
        else:
            begin, end = self._spans[number]
            with self._path.open("rb") as file:
                file.seek(begin)
                text = io.BytesIO(file.read(end - begin))
            columns = columns_of(text, self._dialect._replace(skipped=0))
            if not columns:  # blank lines, or comments
                columns = [np.empty(0) for _ in range(self._dialect.columns)]
            if len(columns) != self._dialect.columns:
                raise UnreadableFile(
                    self._path,
                    f"has rows of {len(columns)} cells, not {self._dialect.columns}, after byte "
                    f"{begin}",
                )
        if cut:  # the row that was being written
            columns = [column[:-1] for column in columns]
        self._held = (number, columns)
        return columns


def _spans(path: Path, dialect: Dialect) -> Iterator[tuple[int, int]]:
    """Where the pieces of a file begin and end, at the ends of lines; none if it has no such."""
    if dialect.encoding.startswith("utf-16"):
        return
    size = path.stat().st_size
    with path.open("rb") as file:
        begin = _after_headings(file.read(HEAD), dialect.skipped)
        while begin < size:
            file.seek(min(begin + PIECE, size))
            file.readline()
            end = file.tell()
            yield begin, end
            begin = end


def _after_headings(head: bytes, skipped: int) -> int:
    """Where the first row of data begins, after so many lines."""
    ends = [match.end() for _, match in zip(range(skipped), _ENDING.finditer(head), strict=False)]
    return ends[-1] if ends else 0


def _last_lines(path: Path, dialect: Dialect) -> tuple[list[str], bool]:
    """The last lines of a file, and whether the very last one is cut off before its last cell."""
    with path.open("rb") as file:
        order = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}.get(file.read(2), "latin-1")
        size = file.seek(0, 2)
        # From an even byte, so that no UTF-16 character is cut.
        file.seek(max(0, size - _TAIL) // 2 * 2)
        wide = dialect.encoding.startswith("utf-16")
        order = order if dialect.encoding == "utf-16" else dialect.encoding
        text = file.read().decode(order if wide else "latin-1", "replace")
    lines = text.splitlines()
    if size > _TAIL:
        lines = lines[1:]
    lines = [line for line in lines if line.strip()][-_LAST:]
    ended = not lines or text.endswith(("\n", "\r"))
    if lines and dialect.comment and lines[-1].lstrip().startswith(dialect.comment):
        ended = True
    return lines, not ended and len(dialect.fields(lines[-1])) < dialect.columns
