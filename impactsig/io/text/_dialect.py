"""Dialect of a text table: encoding, delimiter, decimal sign, headings, first row of data.

Decided from the first lines of the file, by trying the few ways there are and taking the one under
which most lines are rows of numbers.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from typing import NamedTuple

from .._encoding import encoding_of
from .._units import split_heading, unit_cell
from ..times.time_columns import FACTORS, time_factor

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf(?:inity)?)", re.I)
_MOMENT = re.compile(
    r"(\d{1,4}[-./](\d\d?|[A-Za-z]{3})[-./]\d{2,4})?[T ]*(\d\d?:\d\d(:\d\d([.,:]\d+)?)?.{0,7})?"
)
_COMMENT = re.compile(r"\s*(?:#|%|;|!|//)+\s?")
_WAYS = (
    ("\t", "."),
    ("\t", ","),
    (";", "."),
    (";", ","),
    (",", "."),
    (",", ","),
    (" ", "."),
    (" ", ","),
)
_SAMPLES = (60, 12, 3)  # lines that are looked at, in turn
_LEAST = 0.3  # share of numbers in a table
_BETWEEN = 6  # lines between headings and data


class Dialect(NamedTuple):
    """How a table is written; `delimiter` is " " for any white space and "" for one column.

    `above` are the lines before the data, without marks of comments.
    """

    encoding: str
    delimiter: str
    decimal: str
    comment: str
    skipped: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    columns: int
    above: tuple[str, ...]

    def fields(self, line: str) -> list[str]:
        """Split a line into cells."""
        return split_line(line, self.delimiter)

    def number(self, text: str) -> str:
        """A cell with a decimal point in place of the file's decimal sign."""
        return text.replace(",", ".") if self.decimal == "," else text


def split_line(line: str, delimiter: str) -> list[str]:
    """Split a line into cells, without surrounding blanks and quotes."""
    if delimiter == " ":
        return line.split()
    if delimiter and '"' in line:
        cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    else:
        cells = line.split(delimiter) if delimiter else [line]
    return [cell.strip().strip('"').strip() for cell in cells]


def find_dialect(head: bytes, whole: bool) -> Dialect | None:
    """The dialect of a file that begins with `head`; None if there are no rows of numbers.

    Parameters
    ----------
    head : bytes
        Its first bytes.
    whole : bool
        That is the whole file, so that the last line is complete.
    """
    encoding = encoding_of(head)
    text = codecs.getincrementaldecoder(encoding)("replace").decode(head)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if not whole and len(lines) > 1:
        lines.pop()
    # The first character of a comment may also be what separates empty cells.
    bodies: list[str] = []
    for line in reversed(lines):
        if line.strip() and not re.match(r"\s*[#%!]", line):
            bodies.insert(0, line)
        if len(bodies) == 2 * _SAMPLES[0]:
            break
    if not bodies:
        return None
    # Of a short file the second half, or less: headings may be longer than the data.
    for most in _SAMPLES:
        sample = bodies[-min(most, (len(bodies) + 1) // 2) :]
        score, delimiter, decimal, columns = max(
            (_score(sample, *way) for way in (*_WAYS, ("", "."), ("", ","))), key=lambda s: s[0]
        )
        if score >= _LEAST:
            break
    else:
        return None
    if delimiter == "," and columns == 2 and _decimals_after_comma(sample):
        delimiter, decimal, columns = "", ",", 1
    return _with_headings(lines, encoding, delimiter, decimal, columns)


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal sign."""
    if decimal == ",":
        if "." in cell:
            return False
        cell = cell.replace(",", ".")
    return _NUMBER.fullmatch(cell) is not None


def is_moment(cell: str) -> bool:
    """Whether a cell is a date, a time of day, or both."""
    return _MOMENT.fullmatch(cell) is not None


def _score(sample: list[str], delimiter: str, decimal: str) -> tuple[float, str, str, int]:
    """Share of lines with the usual number of cells, times the share of numbers in them."""
    rows = [split_line(line, delimiter) for line in sample]
    columns, _ = Counter(len(row) for row in rows).most_common(1)[0]
    if (columns == 1) != (delimiter == ""):
        return 0.0, delimiter, decimal, columns
    regular = [row for row in rows if len(row) == columns]
    cells = [cell for row in regular for cell in row if cell]
    numbers = sum(is_number(cell, decimal) for cell in cells)
    share = len(regular) / len(rows) * numbers / max(1, len(cells))
    if decimal == "," and not any("," in cell for cell in cells):
        share = 0.0
    return share, delimiter, decimal, columns


def _decimals_after_comma(sample: list[str]) -> bool:
    """Whether "12,0345" is one number: all cells after the comma are bare digits, and as many.

    Digits that begin with 0 tell it from two columns of whole numbers.
    """
    cells = [line.split(",") for line in sample if line.count(",") == 1]
    if not all(re.fullmatch(r"\s*[-+]?\d+", a) and re.fullmatch(r"\d+\s*", b) for a, b in cells):
        return False
    ends = [b.strip() for _, b in cells]
    return any(len(end) > 1 and end.startswith("0") for end in ends)


def _with_headings(
    lines: list[str], encoding: str, delimiter: str, decimal: str, columns: int
) -> Dialect | None:
    """Add headings and the first row of data to a dialect."""
    comment = "#"
    above: list[tuple[bool, str]] = []
    begin = _first_row(lines, delimiter, decimal, columns)
    for skipped, line in enumerate(lines):
        mark = _COMMENT.match(line)
        if mark and not (delimiter == ";" and mark[0].strip() == ";"):
            comment = mark[0].strip()[:1] if mark[0].strip()[:1] in "#%;!" else comment
            above.append((True, line[mark.end() :]))
            continue
        cells = split_line(line, delimiter)
        if (
            skipped >= begin
            and _is_row(cells, columns, decimal)
            and not _lacks_its_first(cells, lines[skipped + 1 : skipped + 2], delimiter)
        ):
            names, units = _headings(above, delimiter, decimal, columns)
            texts = tuple(text for _, text in above)
            return Dialect(
                encoding, delimiter, decimal, comment, skipped, names, units, len(cells), texts
            )
        if line.strip():
            above.append((False, line))
    return None


def _first_row(lines: list[str], delimiter: str, decimal: str, columns: int) -> int:
    """Index of the first row below the headings; 0 if there are none.

    Some headings, such as "x-axis,1,2", hold as many numbers as a row may.
    """
    begin = 0
    for index, line in enumerate(lines[: _SAMPLES[0]]):
        cells = split_line(line, delimiter)
        if not _is_row(cells, columns, decimal) or cells[0].endswith(("=", ":")):
            begin = index + 1
        elif all(is_number(cell, decimal) or is_moment(cell) for cell in cells if cell):
            if not _is_key(lines[index + 1 : index + 2]):
                return begin
            begin = index + 1
    return 0


def _is_key(below: list[str]) -> bool:
    """Whether the line below a row of numbers goes on with settings, such as "data:"."""
    return bool(below and re.fullmatch(r"[A-Za-z][\w ]*:\s*", below[0]))


def _lacks_its_first(cells: list[str], below: list[str], delimiter: str) -> bool:
    """Whether a heading has no first cell although the rows have, as above sample numbers."""
    return bool(not cells[0] and below and split_line(below[0], delimiter)[0])


def _is_row(cells: list[str], columns: int, decimal: str) -> bool:
    filled = [cell for cell in cells if cell]
    numbers = sum(is_number(cell, decimal) for cell in filled)
    return len(cells) == columns and numbers > 0 and numbers >= (len(filled) + 1) // 2


def _headings(
    above: list[tuple[bool, str]], delimiter: str, decimal: str, columns: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units from the last line or two above the data."""
    rows: list[list[str]] = []
    for commented, line in reversed(_up_to_headings(above, delimiter, columns)[-2:]):
        cells = _heading_cells(line, delimiter, columns, commented)
        if cells and _is_setting(cells, decimal):
            continue
        if cells is None:
            break
        rows.insert(0, cells)
    if not rows:
        return (), ()
    if len(rows) == 2 and len(rows[0]) == len(rows[1]) > columns:
        # "Start,Increment" above two numbers, behind the names of the columns and their units.
        named = [not is_number(cell, decimal) for cell in rows[1]]
        rows = [[cell for cell, kept in zip(row, named, strict=True) if kept] for row in rows]
        rows = [row + [""] * (columns - len(row)) for row in rows]
    units = [unit_cell(cell) for cell in rows[-1]]
    filled = [unit for unit, cell in zip(units, rows[-1], strict=True) if cell]
    if (
        len(rows) == 2
        and len(rows[0]) == len(rows[1])
        and filled
        and sum(unit is not None for unit in filled) * 2 > len(filled)
    ):
        # ",CH1,CH2" above "Time,Volt,Volt": the first is named in the line of units.
        titles = [
            upper or ("" if unit is not None else lower)
            for upper, lower, unit in zip(rows[0], rows[1], units, strict=True)
        ]
        names = [split_heading(cell) for cell in titles]
        paired = zip(names, units, strict=True)
        return tuple(n for n, _ in names), tuple(below or beside for (_, beside), below in paired)
    if len(units) > 1 and units[0] in FACTORS and None not in units:
        return ("",) * len(units), tuple(unit or "" for unit in units)
    split = [split_heading(cell) for cell in rows[-1]]
    return tuple(name for name, _ in split), tuple(unit for _, unit in split)


def _is_setting(cells: list[str], decimal: str) -> bool:
    """Whether a line that could be headings is a setting, such as "Sample interval:,2E-5"."""
    if len(cells) == 1:
        return re.search(r"\w: +\d", cells[0]) is not None
    keys = (index for index, cell in enumerate(cells) if cell.endswith((":", "=")))
    values = cells[next(keys, len(cells)) + 1 :]
    return bool(values) and is_number(values[0], decimal)


def _up_to_headings(
    above: list[tuple[bool, str]], delimiter: str, columns: int
) -> list[tuple[bool, str]]:
    """The lines up to the one that names a column of times, and one of units below it.

    Some programs write rates and dates of the channels between the headings and the data.
    """
    for index in range(len(above) - 1, max(-1, len(above) - 1 - _BETWEEN), -1):
        cells = split_line(above[index][1], delimiter)
        if columns > 2 and len(cells) >= columns and time_factor(*split_heading(cells[0])):
            below = split_line(above[index + 1][1], delimiter) if index + 1 < len(above) else []
            return above[: index + 1 + any(unit_cell(cell) for cell in below)]
    return above


def _heading_cells(line: str, delimiter: str, columns: int, commented: bool) -> list[str] | None:
    """The cells of a heading, at least one for each column; None if it is not a heading.

    A commented one may be delimited otherwise than the data. One that is not may name columns
    that were not written; the first names are those of the columns there are.
    """
    if not commented:
        cells = split_line(line, delimiter)
        while len(cells) > columns and not cells[-1]:
            cells.pop()
        if re.search(r"\b[Uu]nits?\W*$", cells[0]):  # a setting, such as "Y Unit,V"
            return None
        return cells if len(cells) == columns or len(cells) > columns > 1 else None
    ways = dict.fromkeys((delimiter.strip(), "\t", ";", ",", " "))
    for cells in (split_line(line, way) for way in ways):
        while len(cells) > columns and not cells[-1]:
            cells.pop()
        if len(cells) == columns and (
            columns > 1 or len(line.split()) == 1 or split_heading(line)[1]
        ):
            return cells
    return None
