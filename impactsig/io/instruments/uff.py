"""UFF, dataset 58 and 58b: functions at nodal degrees of freedom, as text or as numbers.

The universal file format of SDRC. Datasets of other numbers are passed over; functions that are no
time histories are passed over and named.
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import UnreadableFile
from .._limits import Limits
from .._source import Signal, Source
from ..times.timebase import TimeBase, printed_digits, printed_step, time_base
from ._uff_datasets import Dataset, datasets
from ._uff_header import KINDS, Header, binary_sizes, header_lines, parsed_header, value_layouts

Read = Callable[[int, int], np.ndarray]


class _Function(NamedTuple):
    """A function: header, time base, number of values, and a reader."""

    header: Header
    base: TimeBase
    length: int
    read: Read


def open_source(path: Path, limits: Limits) -> Source:
    """Open a universal file; see `impactsig.io.formats`."""
    content = np.memmap(path, np.uint8, "r").data
    functions: list[_Function] = []
    notes: list[str] = []
    sets = (dataset for dataset in datasets(path, content, notes) if dataset.number == 58)
    for index, dataset in enumerate(sets):
        lines, at = header_lines(path, content, dataset.start)
        header = parsed_header(path, lines, index)
        if header.kind > 4:
            notes.append(f"{header.name!r} is left out: it holds complex numbers")
        elif not header.over_time:
            notes.append(
                f"{header.name!r} is left out: it stands over {header.axis}, not over time"
            )
        else:
            read = _numbers if dataset.binary is None else _packed
            functions.append(read(path, content, header, at, dataset))
    if not functions:
        raise UnreadableFile(
            path, "; ".join(notes[:3]) or "has no function (dataset 58)", "Export time histories"
        )
    short = [f for f in functions if f.length < f.header.length]
    notes += [f.base.doubt for f in functions if f.base.doubt]
    uses = Counter(f.header.name for f in functions)
    signals = tuple(
        Signal(
            f"{f.header.name} ({f.header.title})"
            if uses[f.header.name] > 1 and f.header.title
            else f.header.name,
            f.header.unit,
            f.base.rate,
            f.length,
            f.base.start,
            alias=f.header.name,
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


def _numbers(
    path: Path, content: memoryview, header: Header, at: int, dataset: Dataset
) -> _Function:
    """The values of a function written as text, read at once."""
    text = bytes(content[at : dataset.end]).upper().replace(b"D", b"E")
    # Numbers of full width have nothing between them.
    text = re.sub(rb"(?<=\d)(?=[+-]\d*\.)", b" ", text)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            values = np.fromstring(text, np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            raise UnreadableFile(
                path, f"function {header.name!r} has an invalid number after byte {at}"
            ) from None
    if dataset.end == len(content) and not text.rstrip(b" ").endswith(b"\n"):
        values = values[:-1]  # of the last number, the end may be missing
    if header.even:
        values = values[: header.length]
        base = _even(header)
    else:
        values = values[: 2 * header.length]
        times, values = values[: len(values) // 2 * 2 : 2], values[1::2]
        printed = printed_digits(_last_cells(text), times, header.factor)
        base = time_base(times * header.factor, printed)
    return _Function(header, base, len(values), lambda first, last: values[first:last])


def _last_cells(text: bytes) -> list[str]:
    return [cell.decode("latin-1") for cell in text[-4096:].split()[1:]]


def _packed(
    path: Path, content: memoryview, header: Header, at: int, dataset: Dataset
) -> _Function:
    """The values of a binary function, memory-mapped."""
    order, form, _, size = binary_sizes(path, dataset.binary or b"")
    if order not in (1, 2) or form != 2:
        raise UnreadableFile(
            path,
            f"function {header.name!r} holds numbers of an old computer (order {order}, "
            f"format {form})",
            "Only IEEE 754 is read",
        )
    size = dataset.end - at if dataset.end < len(content) else size
    rows = value_layouts(header, "<" if order == 1 else ">")
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
    native = np.dtype(KINDS[header.kind])
    return _Function(header, base, count, lambda a, b: values["y"][a:b].astype(native))


def _even(header: Header) -> TimeBase:
    start = header.start * header.factor
    try:
        return printed_step(header.step, start, header.factor)
    except (ValueError, OverflowError):
        return TimeBase(None, start, f"Its header gives a step of {header.step!r}")
