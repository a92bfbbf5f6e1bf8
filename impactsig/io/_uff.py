"""UFF, dataset 58 and 58b: functions at nodal degrees of freedom, as text or as numbers.

The universal file format of SDRC. A dataset stands between two lines of "    -1"; its header has
eleven lines of fixed columns. Datasets of other numbers, and functions that are no time histories,
are passed over and named.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import UnreadableFile
from ._limits import Limits
from ._source import Signal, Source
from ._timebase import TimeBase, printed_resolution, printed_step, time_base, time_factor

_DELIMITER = re.compile(rb"^    -1[ \r]*$", re.M)
_LINES = 11
_TIME = 17
_KINDS = {2: "f4", 4: "f8", 5: "c8", 6: "c16"}
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_AXES = {0: "", 1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z"}

Read = Callable[[int, int], np.ndarray]


class _Header(NamedTuple):
    """The header of a function; `step` stays as text, for its digits."""

    name: str
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


class _Function(NamedTuple):
    """A function, its time base, how many values are there, and a way to them."""

    header: _Header
    base: TimeBase
    length: int
    read: Read


def open_source(path: Path, limits: Limits) -> Source:
    """Open a universal file; see `impactsig.io.formats`."""
    content = np.memmap(path, np.uint8, "r").data
    functions: list[_Function] = []
    notes: list[str] = []
    for number, binary, start, end in _datasets(path, content):
        if number != 58:
            continue
        lines, at = _header_lines(path, content, start)
        header = _header(path, lines, len(functions) + len(notes))
        if header.kind > 4:
            notes.append(f"{header.name!r} is left out: it holds complex numbers")
        elif not header.over_time:
            notes.append(
                f"{header.name!r} is left out: it stands over {header.axis}, not over time"
            )
        else:
            read = _numbers if binary is None else _packed
            functions.append(read(path, content, header, at, end, binary or b""))
    if not functions:
        raise UnreadableFile(
            path, "; ".join(notes[:3]) or "holds no function (dataset 58)", "Export time histories"
        )
    short = [f for f in functions if f.length < f.header.length]
    notes += [f.base.doubt for f in functions if f.base.doubt]
    signals = tuple(
        Signal(
            f.header.name,
            f.header.unit,
            f.base.rate,
            f.length,
            f.base.start,
            recorded_at=f.header.recorded_at,
            no_rate=f.base.problem,
        )
        for f in functions
    )

    def read_channels(channels: list[int], first: int, last: int) -> np.ndarray:
        parts = [functions[channel].read(first, last) for channel in channels]
        return parts[0][:, np.newaxis] if len(parts) == 1 else np.column_stack(parts)

    return Source(
        format="UFF 58",
        signals=signals,
        read=read_channels,
        truncated="; ".join(
            f"{f.header.name!r} has {f.length} of {f.header.length} values" for f in short[:3]
        ),
        notes=tuple(dict.fromkeys(notes)),
    )


def _datasets(path: Path, content: memoryview) -> Iterator[tuple[int, bytes | None, int, int]]:
    """Number of each dataset, the rest of its first line if it is binary, where it begins, ends."""
    at = 0
    while opening := _DELIMITER.search(content, at):
        first = _line_end(content, opening.end())
        line_end = _line_end(content, first)
        line = bytes(content[first:line_end])
        numbered = re.match(rb" *(\d+)(b?)", line)
        if numbered is None:
            raise UnreadableFile(path, f"has no number of a dataset at byte {first}")
        number, binary = int(numbered[1]), line[numbered.end() :] if numbered[2] else None
        start = line_end
        if binary is not None and number == 58:
            # The bytes of its numbers may look like a line of -1.
            _, at = _header_lines(path, content, start)
            start_of_end = min(at + _sizes(path, binary)[3], len(content))
        else:
            start_of_end = start
        closing = _DELIMITER.search(content, start_of_end)
        end = closing.start() if closing else len(content)
        yield number, binary, start, end
        if closing is None:
            return
        at = closing.end()


def _line_end(content: memoryview, at: int) -> int:
    """Where the line after the next line end begins."""
    part = bytes(content[at : at + 256])
    end = part.find(b"\n")
    return at + (len(part) if end < 0 else end + 1)


def _header_lines(path: Path, content: memoryview, at: int) -> tuple[list[bytes], int]:
    lines = []
    for _ in range(_LINES):
        end = _line_end(content, at)
        if end == at:
            raise UnreadableFile(path, f"ends in the header of a function at byte {at}")
        lines.append(bytes(content[at:end]).rstrip(b"\r\n"))
        at = end
    return lines, at


def _header(path: Path, lines: list[bytes], index: int) -> _Header:
    """What the eleven lines say; the sixth names the function, the seventh its numbers."""
    size = lines[6].split()
    if len(size) != 6:
        cuts = (0, 10, 20, 30, 43, 56, 69)
        size = [lines[6][a:b].strip() for a, b in pairwise(cuts)]
    try:
        kind, count, spacing = (int(x) for x in size[:3])
        start = float(size[3] or 0)
    except ValueError:
        raise UnreadableFile(path, f"has a function of unknown size, {_text(lines[6])!r}") from None
    if kind not in _KINDS or count < 0:
        raise UnreadableFile(path, f"has a function of {count} numbers of unknown type {kind}")
    node, direction = _integer(lines[5][41:51]), _integer(lines[5][51:55])
    names = (_text(lines[5][31:41]), _text(lines[8][26:46]), _text(lines[0]))
    name = next((n for n in names if n), f"function {index}")
    axis_kind, label, unit = _integer(lines[7][:10]), _text(lines[7][26:46]), _text(lines[7][47:67])
    factor = time_factor("t", unit)
    timed = axis_kind == _TIME or (axis_kind == 0 and time_factor(label, unit) is not None)
    return _Header(
        name=f"{name} {node}{_AXES.get(direction, '')}" if node else name,
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


def _numbers(
    path: Path, content: memoryview, header: _Header, at: int, end: int, _: bytes
) -> _Function:
    """The values of a function written as text; they are read at once."""
    text = bytes(content[at:end]).upper().replace(b"D", b"E")
    # Numbers of full width have nothing between them.
    text = re.sub(rb"(?<=\d)(?=[+-]\d*\.)", b" ", text)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            values = np.fromstring(text, np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            raise UnreadableFile(
                path, f"function {header.name!r} holds what is no number, after byte {at}"
            ) from None
    if end == len(content) and not text.rstrip(b" ").endswith(b"\n"):
        values = values[:-1]  # of the last number, the end may be missing
    if header.even:
        values = values[: header.length]
        base = _even(header)
    else:
        values = values[: 2 * header.length]
        times, values = values[: len(values) // 2 * 2 : 2], values[1::2]
        base = time_base(
            times * header.factor, printed_resolution(_last_cells(text)) * header.factor
        )
    return _Function(header, base, len(values), lambda first, last: values[first:last])


def _last_cells(text: bytes) -> list[str]:
    return [cell.decode("latin-1") for cell in text[-4096:].split()[1:]]


def _packed(
    path: Path, content: memoryview, header: _Header, at: int, end: int, line: bytes
) -> _Function:
    """The values of a function written as numbers; mapped."""
    order, form, _, size = _sizes(path, line)
    if order not in (1, 2) or form != 2:
        raise UnreadableFile(
            path,
            f"function {header.name!r} holds numbers of an old computer (order {order}, "
            f"format {form})",
            "Only IEEE 754 is read",
        )
    mark = "<" if order == 1 else ">"
    y = mark + _KINDS[header.kind]
    rows = [np.dtype([("y", y)])]
    if not header.even:  # writers differ in the width of the times
        rows = [np.dtype([("t", mark + t), ("y", y)]) for t in ("f4", "f8")]
    fitting = [row for row in rows if header.length * row.itemsize == size]
    row = fitting[0] if fitting else rows[0]
    if size and not fitting:
        raise UnreadableFile(
            path,
            f"function {header.name!r} announces {header.length} values of {row.itemsize} bytes "
            f"in {size} bytes",
        )
    count = min(header.length, max(0, len(content) - at) // row.itemsize)
    values = np.ndarray((count,), row, content, at)
    if header.even:
        base = _even(header)
    else:
        times = values["t"].astype(np.float64)
        coarse = np.finfo(values.dtype["t"]).eps * np.max(np.abs(times), initial=0.0)
        base = time_base(times * header.factor, float(coarse) * header.factor)
    native = np.dtype(_KINDS[header.kind])
    return _Function(header, base, count, lambda a, b: values["y"][a:b].astype(native))


def _even(header: _Header) -> TimeBase:
    try:
        base = printed_step(header.step, header.start * header.factor)
    except (ValueError, OverflowError):
        return TimeBase(None, header.start, f"Its header gives a step of {header.step!r}")
    if header.factor == 1 or base.rate is None:
        return base
    return base._replace(rate=base.rate / header.factor)


def _sizes(path: Path, line: bytes) -> list[int]:
    """Byte order, floating format, lines of text and bytes of numbers of a dataset 58b."""
    try:
        sizes = [int(cell) for cell in line.split()[:4]]
    except ValueError:
        sizes = []
    if len(sizes) < 4 or sizes[2] != _LINES or sizes[3] < 0:
        raise UnreadableFile(path, f"has a dataset 58b with the header {_text(line)!r}")
    return sizes


def _text(raw: bytes) -> str:
    """A cell of a header; "NONE" is what stands there for nothing."""
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
    """A date such as "18-Apr-16 13:49:58", in the time of the computer that wrote it."""
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
