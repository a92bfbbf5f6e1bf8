"""Split a universal file into its datasets.

A dataset stands between two lines of "    -1"; the second follows binary numbers with or without a
line end between.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from ...errors import UnreadableFile
from ._uff_header import binary_sizes, header_lines, line_end, parsed_header, value_layouts

_LINE = re.compile(rb"^    -1[ \r]*$", re.M)
_ANYWHERE = re.compile(rb"    -1[ \r]*$", re.M)
_AFTER_BLANKS = re.compile(rb"[ \r\n]*    -1[ \r]*$", re.M)
_BLANKS = re.compile(rb"[ \r\n]*")


class Dataset(NamedTuple):
    """A dataset: its number, the rest of its first line if it is binary, and its other lines."""

    number: int
    binary: bytes | None
    start: int
    end: int


def datasets(path: Path, content: memoryview, notes: list[str]) -> Iterator[Dataset]:
    """The datasets in order; anything outside or malformed is added to `notes`."""
    at = 0
    while opening := _LINE.search(content, at):
        if _blank_end(content, at) < opening.start():
            notes.append(f"bytes {at} to {opening.start()} stand in no data set")
        first = line_end(content, opening.end())
        while (again := _LINE.match(content, first)) or first == len(content):
            # One of two lines around nothing, or what is left of a dataset that was lost.
            notes.append(f"the line of -1 at byte {opening.start()} opens no data set")
            if again is None:
                return
            opening, first = again, line_end(content, again.end())
        start = line_end(content, first)
        line = bytes(content[first:start])
        numbered = re.match(rb" *(\d+)(b?)", line)
        if numbered is None:
            raise UnreadableFile(path, f"has no number of a dataset at byte {first}")
        number, binary = int(numbered[1]), line[numbered.end() :] if numbered[2] else None
        if binary is not None and number == 58:
            closing = _closing_behind_numbers(path, content, start, binary)
        else:
            closing = (_LINE if binary is None else _ANYWHERE).search(content, start)
        yield Dataset(number, binary, start, closing.start() if closing else len(content))
        if closing is None:
            return
        at = closing.end()


def _closing_behind_numbers(
    path: Path, content: memoryview, start: int, line: bytes
) -> re.Match[bytes] | None:
    """Offset of the line of -1 after a binary dataset 58b; None if the file ends before it."""
    lines, at = header_lines(path, content, start)
    header, (*_, announced) = parsed_header(path, lines, 0), binary_sizes(path, line)
    # Some writers count the values alone, without their times or their imaginary parts.
    sizes = [announced, *(header.length * row.itemsize for row in value_layouts(header, "="))]
    # No search: the bytes of the numbers may look like a line of -1.
    ends = [min(at + size, len(content)) for size in sizes]
    for end in ends:
        if closing := _AFTER_BLANKS.match(content, end):
            return closing
    rests = (_blank_end(content, end) for end in ends)
    if not any(bytes(content[rest : rest + 3]) in (b"", b"-") for rest in rests):
        raise UnreadableFile(
            path,
            f"announces {announced} bytes of numbers at byte {at}, and no line of -1 follows them",
            "Either the number of bytes or the numbers are wrong",
        )
    return None


def _blank_end(content: memoryview, at: int) -> int:
    """End of the blanks and line ends from a place on."""
    blank = _BLANKS.match(content, at)
    return blank.end() if blank else at
