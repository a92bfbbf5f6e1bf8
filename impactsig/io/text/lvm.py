"""NI LVM, the text format of LabVIEW's "Write To Measurement File".

The time base of a channel, in this order:

1. its own X column, or the file's one X column if the header gives the channel the same Delta_X
   as the first channel, for which alone NI guarantees that column;
2. a channel that is itself named as times, if the file has no X column: rows are written in step,
   so it holds for every channel, and goes on at the same pace for those that are longer;
3. Delta_X of the header, which LabVIEW prints with few digits and, for signals it was not told
   the timing of, guesses.

Columns count where they are uniform within their printed digits. A Delta_X that contradicts the
column taken is reported.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import UnreadableFile
from .._limits import Limits
from .._source import Signal, Source, memory_reader
from .._units import is_unit
from ..formats import is_lvm
from ..times.time_columns import time_factor
from ..times.timebase import (
    DOUBTFUL,
    TimeBase,
    printed_digits,
    printed_resolution,
    printed_step,
    time_base,
)
from . import text as _text
from ._lvm_file import LvmColumn, LvmSegment, length_of, read_segments


def open_source(path: Path, limits: Limits) -> Source:
    """Open an LVM file, with or without a header; see `impactsig.io.formats`."""
    with path.open("rb") as file:
        head = file.read(64)
    if not is_lvm(head):
        return replace(_text.open_source(path, limits), format="NI LVM")
    segments = read_segments(path)
    notes: list[str] = []
    parts = [_signals(segment, index, notes) for index, segment in enumerate(segments)]
    signals, columns = _joined(parts, notes)
    if not signals:
        raise UnreadableFile(path, "contains no samples")
    short = [
        f"channel {column.name!r} has {length_of(column, segment)} of {column.declared} samples"
        for segment in segments
        for column in segment.columns
        if length_of(column, segment) < column.declared
    ]
    return Source(
        format="NI LVM",
        signals=tuple(signals),
        read=memory_reader(columns),
        in_memory=True,
        truncated="; ".join(short[:3]) + (f"; {len(short) - 3} more" if len(short) > 3 else ""),
        notes=tuple(dict.fromkeys(notes)),
    )


Part = tuple[list[Signal], list[np.ndarray]]


def _signals(segment: LvmSegment, index: int, notes: list[str]) -> Part:
    """Signals and samples of one segment."""
    clock, clock_base = _clock(segment)
    signals, columns = [], []
    wrong: dict[str, list[str]] = {}
    for column in segment.columns:
        length = length_of(column, segment)
        if column is clock or length == 0:
            continue
        base = clock_base or _base_of(column, segment, length, notes)
        if base.rate is not None and _contradicts(column.delta_x, base.rate):
            wrong.setdefault(column.delta_x, []).append(repr(column.name))
        if base.doubt:
            notes.append(base.doubt)
        signals.append(
            Signal(
                column.name,
                column.unit,
                base.rate,
                length,
                base.start,
                segment=index,
                recorded_at=column.recorded_at,
                no_rate=base.problem,
            )
        )
        columns.append(segment.numbers[column.position][:length])
        if 0 < column.declared < length:
            notes.append(
                f"the header announces {column.declared} samples and {length} are there: what "
                "was appended is taken to follow without a gap"
            )
    for delta_x, names in wrong.items():
        notes.append(
            f"the Delta_X of {delta_x} s of {', '.join(names)} contradicts the column of times, "
            "which is taken"
        )
    return signals, columns


def _clock(segment: LvmSegment) -> tuple[LvmColumn | None, TimeBase | None]:
    """The channel that holds the times of all others, and what follows from it."""
    for column in segment.columns:
        unit = column.unit if is_unit(column.unit) else ""
        factor = time_factor(column.name, unit)
        if column.x_position >= 0 or factor is None or len(segment.columns) < 2:
            continue
        base = _column_base(segment, column.position, length_of(column, segment), factor)
        if base.rate is not None:
            return column, base
    return None, None


def _base_of(column: LvmColumn, segment: LvmSegment, length: int, notes: list[str]) -> TimeBase:
    """Time base of a channel from its X column or its Delta_X."""
    if column.dimension.lower() != "time":
        return TimeBase(None, 0.0, f"Its samples stand over {column.dimension}, not over time")
    first = segment.columns[0]
    shared = column.x_position == first.x_position and column is not first
    if column.x_position >= 0 and not (shared and column.delta_x != first.delta_x):
        base = _column_base(segment, column.x_position, length, 1.0)
        if base.rate is not None:
            return base
        if length > 1:
            notes.append(f"{base.problem}. The Delta_X of the header is taken")
    try:
        start = float(column.x0 or 0.0)
        return printed_step(column.delta_x, start if np.isfinite(start) else 0.0)
    except ValueError:
        return TimeBase(None, 0.0, f"Its header gives a Delta_X of {column.delta_x!r}")


def _column_base(segment: LvmSegment, position: int, length: int, factor: float) -> TimeBase:
    times = segment.numbers[position][:length]
    texts = segment.lines.cells(position, len(times))
    return time_base(times * factor, printed_digits(texts, times, factor))


def _contradicts(delta_x: str, rate: float) -> bool:
    """Whether a printed step cannot be that of a rate."""
    try:
        step = float(delta_x)
    except ValueError:
        return False
    return abs(step - 1 / rate) > max(printed_resolution([delta_x]), DOUBTFUL * step)


def _joined(parts: list[Part], notes: list[str]) -> Part:
    """One part of segments that follow each other without a gap; otherwise each under its number.

    A part follows another if it has the same channels and begins where that ends, to half a step.
    """
    runs: list[Part] = []
    for signals, columns in parts:
        if runs and _follows(runs[-1][0], signals):
            before, held = runs[-1]
            longer = [
                replace(a, length=a.length + b.length) for a, b in zip(before, signals, strict=True)
            ]
            pairs = zip(held, columns, strict=True)
            runs[-1] = (longer, [np.concatenate(pair) for pair in pairs])
        else:
            runs.append((signals, columns))
    if len(runs) == 1:
        return runs[0]
    notes.append(f"its {len(runs)} segments do not follow each other without a gap")
    named = [
        replace(signal, name=f"segment {number}/{signal.name}", alias=signal.name)
        for number, (signals, _) in enumerate(runs)
        for signal in signals
    ]
    return named, [column for _, columns in runs for column in columns]


def _follows(before: list[Signal], after: list[Signal]) -> bool:
    if len(before) != len(after):
        return False
    for a, b in zip(before, after, strict=True):
        if (a.name, a.unit, a.rate) != (b.name, b.unit, b.rate) or a.rate is None:
            return False
        gap = b.start - a.start - a.length / a.rate
        if a.recorded_at is not None and b.recorded_at is not None:
            gap += (b.recorded_at - a.recorded_at).total_seconds()
        if abs(gap) > 0.5 / a.rate:
            return False
    return True
