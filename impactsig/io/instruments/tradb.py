"""Waveforms of Vallen's acoustic emission systems (tradb), an SQLite database.

Each row of the table `tr_data` is a record: samples of one channel that follow each other, as
16-bit counts or packed as FLAC. Records that continue each other without a gap make one signal.
"""

from __future__ import annotations

import io
import sqlite3
import struct
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from itertools import groupby
from os import fsencode
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np

from ...errors import UnreadableFile
from .._limits import Limits
from .._source import Signal, Source
from ..times.timebase import rate_of_step

_COUNTS, _FLAC = 0, 2  # values of DataFormat
_LONGEST = 1 << 48  # samples of a record, or ticks of its clock
_FIRST_PAGE = struct.Struct(">16xH10xI")  # size of a page, and their number

_RECORDS = """
    SELECT SetID, Chan, Time, SampleRate, Samples, Pretrigger, DataFormat, coalesce(TRAI, SetID),
           length(Data), (SELECT TR_mV FROM tr_params WHERE ID = tr_data.ParamID)
    FROM tr_data WHERE typeof(Data) = 'blob' ORDER BY Chan, Time, SetID
"""


class _Record(NamedTuple):
    """A row of `tr_data`, with its start [s] and the volts of one count."""

    key: int
    channel: int
    start: float
    rate: float
    samples: int
    packed: bool
    number: int
    volts: float | None


@dataclass(frozen=True)
class _Run:
    """Contiguous records of a channel, and the sample at which each begins."""

    records: tuple[_Record, ...]
    begins: tuple[int, ...]

    @property
    def length(self) -> int:
        return self.begins[-1] + self.records[-1].samples


def is_sqlite(head: bytes) -> bool:
    """Whether a file is a database of SQLite."""
    return head[:16] == b"SQLite format 3\x00"


def open_source(path: Path, limits: Limits) -> Source:
    """Open a tradb; see `impactsig.io.formats`."""
    database = _opened(path)
    try:
        records, truncated = _records(database, path)
        runs = [
            run
            for _, of_channel in groupby(records, key=lambda record: record.channel)
            for run in _runs(list(of_channel), 1 / _time_base(database))
        ]
    except BaseException:
        database.close()
        raise
    alone = {
        channel: len(list(found)) == 1
        for channel, found in groupby(runs, key=lambda run: run.records[0].channel)
    }

    def read(chosen: list[int], first: int, last: int) -> np.ndarray:
        length = min([last, *(runs[index].length for index in chosen)]) - first
        limits.check(path, 8 * max(0, length) * len(chosen))
        columns = [_samples(database, path, runs[index], first, first + length) for index in chosen]
        return np.column_stack(columns)

    return Source(
        "Vallen tradb",
        tuple(_signal(run, alone[run.records[0].channel]) for run in runs),
        read,
        database.close,
        truncated=truncated,
        notes=_notes(runs),
    )


def _opened(path: Path) -> sqlite3.Connection:
    """The database, opened so that none of its code runs and no other file is touched."""
    size = path.stat().st_size
    with path.open("rb") as file:
        page, pages = _FIRST_PAGE.unpack(file.read(_FIRST_PAGE.size))
    page = 65536 if page == 1 else page
    if page * pages > size:
        raise UnreadableFile(path, f"is cut short after {size} of {page * pages} bytes")
    address = f"file:{quote(fsencode(path.resolve()))}?mode=ro&immutable=1"
    database = sqlite3.connect(address, uri=True, check_same_thread=False)
    # No value is longer than the file, unless an expression in its schema makes it so.
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(size + 4096, (1 << 31) - 1))
    for setting in ("trusted_schema = OFF", "query_only = ON", "cell_size_check = ON"):
        database.execute(f"PRAGMA {setting}").close()
    steps = iter(range(1000 + size // 16))  # of a thousand instructions: far more than it takes
    database.set_progress_handler(lambda: next(steps, None) is None, 1000)
    try:
        # Neither views nor virtual tables, which run what the file says.
        query = "SELECT name FROM sqlite_master WHERE type = 'table' AND rootpage > 0"
        with closing(database.execute(query)) as found:
            tables = {name for (name,) in found}
        if "ae_data" in tables:
            raise UnreadableFile(path, "contains hits, not samples", "Give the .tradb beside it")
        if not tables >= {"tr_data", "tr_params", "tr_globalinfo"}:
            raise UnreadableFile(path, "is an SQLite database, but contains no Vallen waveforms")
    except BaseException:
        database.close()
        raise
    return database


def _time_base(database: sqlite3.Connection) -> float:
    """Ticks of the clock in a second."""
    query = "SELECT Value FROM tr_globalinfo WHERE Key = 'TimeBase'"
    with closing(database.execute(query)) as found:
        ticks = float((found.fetchone() or (1e7,))[0])
    if not 1 <= ticks <= 1e15:
        raise ValueError(f"its time base is {ticks:g} ticks in a second")
    return ticks


def _records(database: sqlite3.Connection, path: Path) -> tuple[list[_Record], str]:
    """All records by channel and time, and notes on missing ones."""
    records, truncated, ticks = [], "", _time_base(database)
    with closing(database.execute(_RECORDS)) as rows:
        for key, *numbers, stored, millivolts in rows:
            if not all(isinstance(number, int) for number in numbers):
                raise UnreadableFile(path, f"record {key} is described by {numbers}, not integers")
            channel, time, rate, samples, before, kind, index = numbers
            sizes = (samples, abs(time), abs(before))
            if rate <= 0 or samples <= 0 or max(sizes) > _LONGEST:
                raise UnreadableFile(path, f"record {index} is of {samples} samples at {rate} Hz")
            if kind not in (_COUNTS, _FLAC):
                raise UnreadableFile(path, f"record {index} is packed in a way {kind} of no name")
            if kind == _COUNTS and stored < 2 * samples:
                truncated = f"record {index} holds {stored // 2} of {samples} samples"
                samples = stored // 2
            scale = millivolts if isinstance(millivolts, float) and 0 < millivolts < 1e9 else None
            volts = None if scale is None else 1e-3 * scale
            start = time / ticks - before * (1 / rate)
            found = (key, channel, start, float(rate), samples, kind == _FLAC, index, volts)
            if samples:
                records.append(_Record(*found))
    if not records:
        raise UnreadableFile(path, truncated or "contains no record of samples")
    return records, truncated


def _runs(records: list[_Record], tick: float) -> Iterator[_Run]:
    """Group records into runs without interruption."""
    run, begins, length = [records[0]], [0], records[0].samples
    for record in records[1:]:
        first = run[0]
        late = record.start - (first.start + length * (1 / first.rate))
        alike = (record.rate, record.volts) == (first.rate, first.volts)
        if alike and abs(late) < max(0.5 / first.rate, 1.5 * tick):
            run.append(record)
            begins.append(length)
            length += record.samples
        else:
            yield _Run(tuple(run), tuple(begins))
            run, begins, length = [record], [0], record.samples
    yield _Run(tuple(run), tuple(begins))


def _signal(run: _Run, alone: bool) -> Signal:
    first = run.records[0]
    name = f"channel {first.channel}"
    return Signal(
        name if alone else f"{name}/record {first.number}",
        "" if first.volts is None else "V",
        rate_of_step(1 / first.rate),
        run.length,
        first.start,
    )


def _notes(runs: list[_Run]) -> tuple[str, ...]:
    raw = sorted({run.records[0].channel for run in runs if run.records[0].volts is None})
    if not raw:
        return ()
    listed = ", ".join(map(str, raw[:8]))
    return (f"the file does not say what a count of channel {listed} is in volts; counts are read",)


def _samples(
    database: sqlite3.Connection, path: Path, run: _Run, first: int, last: int
) -> np.ndarray:
    """Samples [first, last) of a run; fewer, if a record ends early."""
    samples, filled = np.empty(max(0, last - first)), 0
    for record, begin in zip(run.records, run.begins, strict=True):
        begins, ends = max(first - begin, 0), min(last - begin, record.samples)
        if begins < ends:
            part = _part(database, path, record, begins, ends)
            samples[filled : filled + len(part)] = part
            filled += len(part)
            if len(part) < ends - begins:
                break
    scale = run.records[0].volts
    return samples[:filled] if scale is None else samples[:filled] * scale


def _part(
    database: sqlite3.Connection, path: Path, record: _Record, first: int, last: int
) -> np.ndarray:
    """Counts [first, last) of a record."""
    if not record.packed:
        with database.blobopen("tr_data", "Data", record.key, readonly=True) as blob:
            blob.seek(2 * first)
            return np.frombuffer(blob.read(2 * (last - first)), "<i2")
    import soundfile

    query = "SELECT Data FROM tr_data WHERE SetID = ?"
    with closing(database.execute(query, (record.key,))) as found:
        data: Any = found.fetchone()[0]
    with soundfile.SoundFile(io.BytesIO(data)) as packed:
        held = (packed.frames, packed.channels, packed.subtype)
        if held != (record.samples, 1, "PCM_16"):
            raise UnreadableFile(
                path,
                f"record {record.number} is packed with {held[0]} samples of {held[1]} channels in "
                f"{held[2]}, not {record.samples} of one in 16 bits",
            )
        packed.seek(first)
        return np.asarray(packed.read(last - first, dtype="int16"))
