"""ASAM's measurement data (MDF 2 to 4), read by asammdf."""

from __future__ import annotations

import gc
import sys
from collections import Counter
from datetime import datetime
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np

from ..._extras import quiet
from ...errors import UnreadableFile
from .._limits import Limits
from .._source import Signal, Source, sample_type
from ..times.timebase import TimeBase, time_base

_NUMERIC = {True: {0, 1, 2, 4, 5}, False: {65535, 0, 1, 2, 9}}
"""Conversions of version 4, and of 2 and 3, that are numbers: of formulas, none is evaluated."""

_LINEAR = {True: 1, False: 0}
_TIME = 1  # what a master channel of version 4 holds; others hold angles, distances, numbers
_OTHER_AXES = {2: "an angle", 3: "a distance", 4: "a number"}


def is_mdf(head: bytes) -> bool:
    """Whether a file is MDF of any version, closed by its writer or not."""
    return head[:8] in (b"MDF     ", b"UnFinMF ")


def open_source(path: Path, limits: Limits) -> Source:
    """Open an MDF file; see `impactsig.io.formats`.

    A channel takes its rate from the master channel of its group.
    """
    # A file object and not a path: archives, which some endings stand for, are not unpacked.
    opened = path.open("rb")
    try:
        unfinished = opened.read(8) == b"UnFinMF "
        opened.seek(0)
        file = _opened(opened, path)
        signals, places, notes = _signals(file, path, limits)
    except BaseException:
        opened.close()
        raise

    def close() -> None:
        file.close()
        opened.close()

    def read(chosen: list[int], first: int, last: int) -> np.ndarray:
        limits.check(path, 8 * max(0, last - first) * len(chosen))
        columns = [_samples(file, *places[index], first, last - first) for index in chosen]
        length = min(map(len, columns))
        return np.column_stack([column[:length] for column in columns])

    return Source(
        f"MDF {file.version}",
        tuple(signals),
        read,
        close,
        truncated="it was not closed by its writer" if unfinished else "",
        notes=tuple(notes),
    )


def _opened(opened: BufferedReader, path: Path) -> Any:
    """The file, opened by asammdf.

    What asammdf leaves half made of a file that it cannot read writes tracebacks when it is
    deleted, so it is deleted here, with the error that holds it.
    """
    from asammdf import MDF

    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        try:
            with quiet():
                return MDF(opened)
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        gc.collect()
    finally:
        sys.unraisablehook = hook
    raise UnreadableFile(path, f"cannot be read as MDF ({reason})")


def _signals(
    file: Any, path: Path, limits: Limits
) -> tuple[list[Signal], list[tuple[int, int]], list[str]]:
    """Numeric channels with group and index of each, and notes on the others."""
    signals: list[Signal] = []
    places, notes = [], []
    often = Counter(channel.name for group in file.groups for channel in group.channels)
    begun = file.header.start_time
    for number, group in enumerate(file.groups):
        length, master = int(group.channel_group.cycles_nr), file.masters_db.get(number)
        if not length:
            continue
        base = _base(file, path, limits, number, length)
        notes += [base.doubt] if base.doubt else []
        for index, channel in enumerate(group.channels):
            if index == master:
                continue
            name = str(channel.name)
            full = name if often[name] == 1 else f"group {number}/{name}"
            why = _unusable(file, number, index)
            if why:
                notes.append(f"channel {full!r} is left out: it {why}")
                continue
            signals.append(
                Signal(
                    full,
                    _unit(channel),
                    base.rate,
                    length,
                    base.start,
                    segment=number,
                    alias=name,
                    recorded_at=begun if isinstance(begun, datetime) else None,
                    no_rate=base.problem,
                )
            )
            places.append((number, index))
    if not signals:
        raise UnreadableFile(path, "; ".join(notes[:3]) or "contains no channel with samples")
    return signals, places, notes


def _unusable(file: Any, group: int, index: int) -> str:
    """Why a channel cannot be a recording; "" if it can."""
    channel = file.groups[group].channels[index]
    if _kind(file, channel) not in _NUMERIC[_is_4(file)]:
        return "has a conversion by a formula, or to words, and neither is followed"
    samples = _samples(file, group, index, 0, 1)
    if samples.dtype.kind not in "biuf" or samples.ndim != 1:
        return f"holds {samples.dtype} of {samples.ndim} dimensions, not real numbers"
    return ""


def _samples(file: Any, group: int, index: int, first: int, count: int) -> np.ndarray:
    """Samples of a channel; NaN where the file marks one as not valid."""
    with quiet():
        # Those that are not valid would be left out, which moves all behind them.
        found = file.get(
            group=group,
            index=index,
            record_offset=first,
            record_count=count,
            ignore_invalidation_bits=True,
        )
    samples, invalid = np.asarray(found.samples), found.invalidation_bits
    if samples.dtype.kind in "biuf":
        samples = samples.astype(sample_type(samples.dtype), copy=False)
        if invalid is not None and np.any(invalid):
            samples = np.where(np.asarray(invalid, bool), np.nan, samples)
    return samples


def _base(file: Any, path: Path, limits: Limits, group: int, length: int) -> TimeBase:
    """Rate of a group, from its master channel."""
    index = file.masters_db.get(group)
    if index is None:
        return TimeBase(None, 0.0, "Its group has no master channel of times")
    channel = file.groups[group].channels[index]
    axis = int(channel.sync_type) if _is_4(file) else _TIME
    if axis != _TIME:
        other = _OTHER_AXES.get(axis, "what is not named")
        return TimeBase(None, 0.0, f"Its samples stand over {other}, not over time")
    if _kind(file, channel) not in _NUMERIC[_is_4(file)]:
        return TimeBase(None, 0.0, "Its times are given by a formula, which is not evaluated")
    limits.check(path, 8 * length)
    with quiet():
        times = np.asarray(file.get_master(group), np.float64)
    coarse = 0.0
    if _kind(file, channel) == _LINEAR[_is_4(file)]:
        coarse = abs(float(channel.conversion.a if _is_4(file) else channel.conversion.b))
    elif np.array_equal(times, times.astype(np.float32)):
        coarse = float(np.finfo(np.float32).eps * np.max(np.abs(times), initial=0.0))
    return time_base(times, coarse)


def _is_4(file: Any) -> bool:
    return str(file.version) >= "4"


def _kind(file: Any, channel: Any) -> int:
    """The conversion from stored numbers to physical values."""
    nothing = 0 if _is_4(file) else 65535
    return nothing if channel.conversion is None else int(channel.conversion.conversion_type)


def _unit(channel: Any) -> str:
    unit = channel.unit or (channel.conversion.unit if channel.conversion is not None else "")
    return (unit.decode("latin-1") if isinstance(unit, bytes) else str(unit or "")).rstrip("\0 ")
