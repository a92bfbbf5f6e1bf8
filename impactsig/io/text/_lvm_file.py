"""The structure of an NI LVM file: headers, columns, and the place of the numbers.

A file header is followed by one or several segments, each with a header of its own, a line of
column names and rows of numbers; see NI's "Specification for the LabVIEW Measurement File (.lvm)".
"""

from __future__ import annotations

import io
import re
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import UnreadableFile
from ._columns import filled
from ._dialect import is_number

_END = b"***End_of_Header***"


class LvmColumn(NamedTuple):
    """One channel of a segment, as its header describes it.

    `position` is its column and `x_position` that of its X values, or -1. `declared` is the number
    of samples that the header names, or 0. `x0` and `delta_x` stay as text, for their digits.
    """

    name: str
    unit: str
    position: int
    x_position: int
    declared: int
    x0: str
    delta_x: str
    dimension: str
    recorded_at: datetime | None


class LvmSegment(NamedTuple):
    """Columns of a segment, their numbers by position, and the lines they were read from."""

    columns: list[LvmColumn]
    numbers: dict[int, np.ndarray]
    lines: LvmLines


class LvmLines(NamedTuple):
    """The rows of a segment as text."""

    region: bytes
    separator: str
    decimal: str

    def cells(self, position: int, last: int, count: int = 50) -> list[str]:
        """Up to `count` cells of a column, before row `last`, with decimal points."""
        ends = np.flatnonzero(np.frombuffer(self.region, np.uint8) == ord("\n"))
        first = max(0, last - count)
        begin = 0 if first == 0 else int(ends[first - 1]) + 1
        stop = int(ends[last - 1]) if last - 1 < len(ends) else len(self.region)
        rows = self.region[begin:stop].decode("latin-1").splitlines()
        split = [row.split(self.separator) for row in rows]
        cells = [row[position].strip() for row in split if len(row) > position]
        return [cell.replace(",", ".") if self.decimal == "," else cell for cell in cells]


def read_segments(path: Path) -> list[LvmSegment]:
    """All segments of a file that begins with an LVM header."""
    content = path.read_bytes().replace(b"\r\n", b"\n")
    ends = [match.start() for match in re.finditer(rb"^" + re.escape(_END), content, re.M)]
    if not ends:
        raise UnreadableFile(path, "its header does not end", "The file is cut short")
    file_header = _header(_decoded(content[: ends[0]]), "")
    separator = "," if file_header.get("Separator", ["Tab"])[0].lower() == "comma" else "\t"
    if len(ends) == 1:
        raise UnreadableFile(path, "has a file header but no segment of data")
    regions: list[tuple[str, int, int]] = []
    begin = _next_line(content, ends[0])
    for end in ends[1:]:
        start = _header_start(content, begin, end)
        if regions:
            regions[-1] = (regions[-1][0], regions[-1][1], start)
        names = _next_line(content, end)
        begin = _next_line(content, names)
        regions.append((_decoded(content[start:end]), names, len(content)))
    segments = []
    for header, names, stop in regions:
        begin = _next_line(content, names)
        name_line = _decoded(content[names:begin]).strip("\n")
        segments.append(
            _segment(
                path,
                {**file_header, **_header(header, separator)},
                [cell.strip() for cell in name_line.split(separator)],
                content[begin:stop],
                separator,
            )
        )
    return segments


def _header(text: str, separator: str) -> dict[str, list[str]]:
    """Values of a header by key; those of a segment stand in the columns they belong to.

    Without a separator, as in the file header that has yet to name it, the first tab or comma of a
    line ends its key.
    """
    values = {}
    for line in text.splitlines():
        cells = line.split(separator) if separator else re.split(r"[\t,]", line, maxsplit=1)
        if cells[0].strip():
            values[cells[0].strip()] = [cell.strip().strip("\t,") for cell in cells[1:]]
    return values


def _decoded(raw: bytes) -> str:
    """Text of a header, which older versions write in the code page of their computer."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _next_line(content: bytes, position: int) -> int:
    end = content.find(b"\n", position)
    return len(content) if end < 0 else end + 1


def _header_start(content: bytes, begin: int, end: int) -> int:
    """Where the header before `end` begins: after the last row of numbers since `begin`."""
    position = end
    while position > begin:
        start = content.rfind(b"\n", begin, position - 1) + 1 or begin
        line = content[start:position].decode("latin-1")
        cells = [cell.strip() for cell in re.split(r"[\t,]", line) if cell.strip()]
        if cells and is_number(cells[0], "."):
            return position
        position = start
    return begin


def _segment(
    path: Path, header: dict[str, list[str]], names: list[str], region: bytes, separator: str
) -> LvmSegment:
    import pandas as pd

    layout = header.get("X_Columns", ["No"])[0].lower()
    count = int(header["Channels"][0])
    if not 0 < count <= len(names):
        raise UnreadableFile(path, f"announces {count} channels over {len(names)} columns")
    step = 2 if layout == "multi" else 1
    positions = range(1, 1 + step * count, step)
    columns = []
    for position in positions:
        if position >= len(names):
            raise UnreadableFile(path, f"announces {count} channels over {len(names)} columns")
        cell = {key: _cell(values, position) for key, values in header.items()}
        file_time = [header.get(key, [""])[0] for key in ("Date", "Time")]
        columns.append(
            LvmColumn(
                name=names[position],
                unit=cell.get("Y_Unit_Label", ""),
                position=position,
                x_position={"multi": position - 1, "one": 0}.get(layout, -1),
                declared=int(float((cell.get("Samples") or "0").replace(",", "."))),
                x0=cell.get("X0", "").replace(",", "."),
                delta_x=cell.get("Delta_X", "").replace(",", "."),
                dimension=cell.get("X_Dimension", "") or "Time",
                recorded_at=_moment(cell.get("Date", ""), cell.get("Time", ""))
                or _moment(*file_time),
            )
        )
    region = _whole_lines(region, max(column.declared for column in columns), separator)
    wanted = sorted({c.position for c in columns} | {c.x_position for c in columns} - {-1})
    first = [line.split(separator) for line in region[:4096].decode("latin-1").splitlines()]
    # The header may name no decimal sign, or another than its numbers have.
    seen = "".join(row[position] for row in first for position in wanted if position < len(row))
    decimal = "," if "," in seen else "."
    if not region.strip():
        return LvmSegment(columns, {}, LvmLines(b"", separator, decimal))
    frame = pd.read_csv(
        io.BytesIO(region),
        sep=separator,
        decimal=decimal,
        header=None,
        names=list(range(max(len(names), len(first[0])))),
        index_col=False,
        encoding="latin-1",
        engine="c",
        low_memory=False,
        skipinitialspace=True,
    )
    numbers = {}
    for position in wanted:
        column = frame[position]
        if column.dtype.kind not in "biuf":
            raise UnreadableFile(path, f"column {names[position] or position} holds text")
        numbers[position] = column.to_numpy(dtype=np.float64)
    return LvmSegment(columns, numbers, LvmLines(region, separator, decimal))


def _whole_lines(region: bytes, declared: int, separator: str) -> bytes:
    """Without a last line that was cut: one that is not ended and lacks cells or successors."""
    start = region.rfind(b"\n") + 1
    last, before = region[start:], region[region.rfind(b"\n", 0, max(0, start - 1)) + 1 : start]
    if not last or start == 0:
        return region
    lacks_cells = last.count(separator.encode()) < before.count(separator.encode())
    return region[:start] if lacks_cells or region.count(b"\n") + 1 < declared else region


def _cell(values: list[str], position: int) -> str:
    return values[position - 1] if position <= len(values) else ""


def _moment(date: str, time: str) -> datetime | None:
    """Date and time of day, in the time of the computer that wrote the file."""
    clock, _, fraction = time.replace(",", ".").partition(".")
    try:
        moment = datetime.strptime(f"{date} {clock}", "%Y/%m/%d %H:%M:%S")
        return moment.replace(microsecond=int(f"{fraction:0<6.6}"))
    except ValueError:
        return None


def length_of(column: LvmColumn, segment: LvmSegment) -> int:
    """Number of samples of a channel.

    As declared if there are as many rows, so that a missing value at its end still counts; more
    if more are filled, which a writer that appends to its file leaves; fewer if the file is cut.
    """
    values = segment.numbers.get(column.position)
    if values is None:
        return 0
    return max(filled(values), column.declared if column.declared <= len(values) else 0)
