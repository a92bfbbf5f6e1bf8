"""NI TDMS, read by npTDMS: channels are named "group/channel"."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import UnreadableFile
from .._limits import Limits
from .._source import Signal, Source, sample_type
from ..times.time_columns import time_factor
from ..times.timebase import TimeBase, rate_of_step, time_base
from ._tdms_layout import layout

_EPOCH = np.datetime64("1904-01-01")  # what NI writes for "no time"


def open_source(path: Path, limits: Limits) -> Source:
    """Open a TDMS file; see `impactsig.io.formats`.

    The rate is that of the waveform (`wf_increment`); a channel without one takes it from a
    channel of times in its group.
    """
    from nptdms import TdmsFile

    # A file object and not a path: an index file beside it may be stale.
    file = path.open("rb")
    try:
        if file.read(4) == b"TDSh":
            raise UnreadableFile(path, "is the index of a TDMS file", "Give the .tdms beside it")
        file.seek(0)
        with _quiet():
            tdms = TdmsFile.open(file)
        size = path.stat().st_size
        status = tdms.file_status
        truncated = _lacking(status) or _left_over(tdms, size)
        channels, layouts, signals, notes = [], [], [], []
        for group in tdms.groups():
            found = [channel for channel in group.channels() if len(channel)]
            for channel in found:
                # One byte at least for each sample: what exceeds it is not in the file.
                if len(channel) > size:
                    raise UnreadableFile(
                        path,
                        f"channel {channel.path} announces {len(channel)} samples in {size} bytes",
                    )
            times = [c for c in found if _time_unit(c) is not None and not _increment(c)]
            for channel in found:
                if channel in times:
                    continue
                if channel.dtype.kind not in "biuf":
                    name = f"{group.name}/{channel.name}"
                    notes.append(f"channel {name!r} is left out: it holds {channel.dtype}")
                    continue
                base = _base(channel, times)
                if base.doubt and base.doubt not in notes:
                    notes.append(base.doubt)
                signals.append(
                    Signal(
                        f"{group.name}/{channel.name}",
                        str(channel.properties.get("unit_string") or ""),
                        base.rate,
                        len(channel),
                        base.start,
                        alias=channel.name,
                        recorded_at=_recorded_at(channel),
                        no_rate=base.problem,
                    )
                )
                channels.append(channel)
                layouts.append(layout(tdms, channel, size))
        if not signals:
            raise UnreadableFile(path, "; ".join(notes) or "contains no channel with samples")
    except BaseException:
        file.close()
        raise

    def read(chosen: list[int], first: int, last: int) -> np.ndarray:
        kind = np.result_type(*(sample_type(channels[i].dtype) for i in chosen))
        length = min(last, *(len(channels[i]) for i in chosen)) - first
        samples = np.empty((max(0, length), len(chosen)), kind)
        with _quiet():
            for column, index in enumerate(chosen):
                known = layouts[index]
                if known is None:
                    samples[:, column] = channels[index][first : first + len(samples)]
                else:
                    known.read(file, first, samples[:, column])
        return samples

    return Source(
        format="NI TDMS",
        signals=tuple(signals),
        read=read,
        close=file.close,
        truncated=truncated,
        notes=tuple(notes),
        metadata={str(name): str(value) for name, value in tdms.properties.items()},
    )


def _increment(channel: Any) -> float:
    try:
        return float(channel.properties.get("wf_increment") or 0.0)
    except (TypeError, ValueError):
        return 0.0


def _time_unit(channel: Any) -> float | None:
    """Seconds in a unit of the channel, if it is a channel of times."""
    if channel.dtype.kind == "M":
        return 1.0
    if channel.dtype.kind not in "iuf":
        return None
    return time_factor(channel.name, str(channel.properties.get("unit_string") or ""))


def _base(channel: Any, times: list[Any]) -> TimeBase:
    properties = channel.properties
    axis = str(properties.get("wf_xunit_string") or "s")
    factor = time_factor("t", axis)
    if factor is None:
        return TimeBase(None, 0.0, f"Its samples stand over an axis in {axis!r}, not over time")
    increment = _increment(channel)
    if increment > 0 and np.isfinite(increment):
        try:
            start = float(properties.get("wf_start_offset") or 0.0)
        except (TypeError, ValueError):
            start = 0.0
        return TimeBase(rate_of_step(increment * factor), start * factor)
    for other in times:
        if len(other) == len(channel):
            values = other[:]
            if values.dtype.kind == "M":
                return time_base((values - values[0]) / np.timedelta64(1, "s"), 1e-6)
            coarse = np.finfo(values.dtype).eps if values.dtype.kind == "f" else 0.0
            values = values.astype(np.float64) * (_time_unit(other) or 1.0)
            return time_base(values, float(coarse * np.max(np.abs(values))))
    return TimeBase(None, 0.0, "The channel has no wf_increment, and its group no channel of times")


def _recorded_at(channel: Any) -> datetime | None:
    """Start of the waveform, in UTC."""
    begin = channel.properties.get("wf_start_time")
    if not isinstance(begin, np.datetime64) or np.isnat(begin) or begin <= _EPOCH:
        return None
    moment = begin.astype("datetime64[us]").item()
    return moment.replace(tzinfo=UTC) if isinstance(moment, datetime) else None


def _lacking(status: Any) -> str:
    """What the last chunk of the last segment lacks, or ""."""
    short = {
        path: (state.read_length, state.expected_length)
        for path, state in (status.channel_statuses or {}).items()
        if state.read_length < state.expected_length
    }
    if not short:
        return "its last segment was not closed" if status.incomplete_final_segment else ""
    path, (got, expected) = max(short.items(), key=lambda item: item[1][1] - item[1][0])
    return f"its last chunk holds {got} of {expected} samples of {path}"


def _left_over(tdms: Any, size: int) -> str:
    """Whether bytes follow the last whole segment; npTDMS ignores them (uses a private name)."""
    try:
        rest = size - int(tdms._reader._segments[-1].next_segment_pos)
    except (AttributeError, IndexError, TypeError):
        return ""
    return f"its last {rest} bytes are no whole segment" if rest > 0 else ""


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep npTDMS from printing what impactsig reports as a warning."""
    loggers = [
        logger
        for name, logger in logging.root.manager.loggerDict.items()
        if name.startswith("nptdms") and isinstance(logger, logging.Logger)
    ]
    before = [logger.disabled for logger in loggers]
    try:
        for logger in loggers:
            logger.disabled = True
        yield
    finally:
        for logger, was in zip(loggers, before, strict=True):
            logger.disabled = was
