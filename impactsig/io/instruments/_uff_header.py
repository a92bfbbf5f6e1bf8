"""The header of a function in a universal file: eleven lines of fixed columns."""

from __future__ import annotations

import re
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import UnreadableFile
from ..times.time_columns import time_factor

_LINES = 11
_TIME = 17
KINDS = {2: "f4", 4: "f8", 5: "c8", 6: "c16"}
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_AXES = {0: "", 1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z"}


class Header(NamedTuple):
    """The header of a function; `step` stays as text, for its digits."""

    name: str
    title: str
    unit: str
    recorded_at: datetime | None
    kind: int
    length: int
    even: bool
    start: float
    step: str
    axis: str
    over_time: bool
    factor: float


def header_lines(path: Path, content: memoryview, at: int) -> tuple[list[bytes], int]:
    lines = []
    for _ in range(_LINES):
        end = line_end(content, at)
        if end == at:
            raise UnreadableFile(path, f"ends in the header of a function at byte {at}")
        lines.append(bytes(content[at:end]).rstrip(b"\r\n"))
        at = end
    return lines, at


def parsed_header(path: Path, lines: list[bytes], index: int) -> Header:
    """Parse the eleven lines; the sixth names the function, the seventh its numbers."""
    size = lines[6].split()
    if len(size) != 6:
        cuts = (0, 10, 20, 30, 43, 56, 69)
        size = [lines[6][a:b].strip() for a, b in pairwise(cuts)]
    try:
        kind, count, spacing = (int(x) for x in size[:3])
        start = float(size[3] or 0)
    except ValueError:
        raise UnreadableFile(path, f"has a function of unknown size, {_text(lines[6])!r}") from None
    if kind not in KINDS or count < 0:
        raise UnreadableFile(path, f"has a function of {count} numbers of unknown type {kind}")
    node, direction = _integer(lines[5][41:51]), _integer(lines[5][51:55])
    names = (_text(lines[5][31:41]), _text(lines[8][26:46]), _text(lines[0]))
    name = next((n for n in names if n), f"function {index}")
    axis_kind, label, unit = _integer(lines[7][:10]), _text(lines[7][26:46]), _text(lines[7][47:67])
    place = f"{node}{_AXES.get(direction, '')}" if node else name
    factor = time_factor("t", unit)
    timed = axis_kind == _TIME or (axis_kind == 0 and time_factor(label, unit) is not None)
    return Header(
        name=name if name == place else f"{name} {place}",
        title=_text(lines[0]),
        unit=_text(lines[8][47:67]),
        recorded_at=_moment(_text(lines[2])),
        kind=kind,
        length=count,
        even=spacing == 1,
        start=start if np.isfinite(start) else 0.0,
        step=size[4].decode("latin-1"),
        axis=label or f"an axis of type {axis_kind}",
        over_time=timed and factor is not None,
        factor=factor or 1.0,
    )


def value_layouts(header: Header, mark: str) -> list[np.dtype]:
    """Possible layouts of a value, or of time and value; writers differ in the width of times."""
    y = mark + KINDS[header.kind]
    if header.even:
        return [np.dtype([("y", y)])]
    return [np.dtype([("t", mark + t), ("y", y)]) for t in ("f4", "f8")]


def binary_sizes(path: Path, line: bytes) -> list[int]:
    """Byte order, floating format, lines of text and bytes of numbers of a dataset 58b."""
    try:
        sizes = [int(cell) for cell in line.split()[:4]]
    except ValueError:
        sizes = []
    if len(sizes) < 4 or sizes[2] != _LINES or sizes[3] < 0:
        raise UnreadableFile(path, f"has a dataset 58b with the header {_text(line)!r}")
    return sizes


def line_end(content: memoryview, at: int) -> int:
    """Where the line after the next line end begins."""
    part = bytes(content[at : at + 256])
    end = part.find(b"\n")
    return at + (len(part) if end < 0 else end + 1)


def _text(raw: bytes) -> str:
    """A cell of a header; "NONE" means nothing."""
    try:
        text = raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        text = raw.decode("latin-1").strip()
    return "" if text == "NONE" else text


def _integer(raw: bytes) -> int:
    try:
        return int(raw)
    except ValueError:
        return 0


def _moment(text: str) -> datetime | None:
    """A date such as "18-Apr-16 13:49:58", in the writer's local time."""
    match = re.match(r"(\d+)-(\w{3})-(\d\d) +(\d+):(\d+):(\d+)", text)
    if match is None or match[2].lower() not in _MONTHS:
        return None
    day, year, *clock = (int(match[i]) for i in (1, 3, 4, 5, 6))
    try:
        year += 1900 if year >= 70 else 2000
        month = _MONTHS.index(match[2].lower()) + 1
        return datetime(year, month, day, clock[0], clock[1], clock[2])
    except ValueError:
        return None
