"""Recordings of enDAQ's loggers (IDE), read by idelib: a channel is named "sensor/quantity"."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..._extras import quiet
from ...errors import UnreadableFile
from .._limits import Limits
from .._source import Signal, Source
from ..times.timebase import rate_of_step

_EBML = b"\x1a\x45\xdf\xa3"
_STEPS = 1.0  # how far the stamp of a block may lie from a uniform grid, in sampling steps
_TICKS = 2.0  # the same, in ticks of the recorder's clock
_NUMBER = r" *(\d+\.?\d*|\.\d+) *"
_RATIO = re.compile(rf"{_NUMBER}(/{_NUMBER})?", re.ASCII)
"""What a scale is in a file that no one tampered with; idelib evaluates it as Python."""


def is_ide(head: bytes) -> bool:
    """Whether a file is EBML with Mide's document type."""
    return head[:4] == _EBML and b"\x42\x82\x84mide" in head[:200]


def open_source(path: Path, limits: Limits) -> Source:
    """Open an IDE file; see `impactsig.io.formats`."""
    file = path.open("rb")
    try:
        with quiet():
            from idelib.importer import openFile, readData

            truncated = _checked(file, path)
            dataset = openFile(file, quiet=True)
            readData(dataset)
        if dataset.fileDamaged and not truncated:
            truncated = "it has a block that cannot be read"
        signals, places, notes = [], [], []
        for channel in dataset.channels.values():
            for segment, session in enumerate(dataset.sessions):
                events = channel.getSession(session.sessionId)
                held = sum(len(block.payload) for block in events._data)
                if not held:
                    continue
                if held < len(events):
                    truncated = f"{channel.name!r} holds {held} of {len(events)} samples"
                rate, start, doubt = _rate(events, held)
                notes += [f"channel {channel.name!r}: {doubt}"] if doubt and rate else []
                for number, sub in enumerate(channel.subchannels):
                    quantity = str(sub.displayName or sub.name)
                    unit = sub.units[1] if sub.units else ""
                    signals.append(
                        Signal(
                            f"{channel.name}/{quantity}",
                            str(unit or ""),
                            rate,
                            held,
                            start,
                            segment,
                            alias=quantity,
                            recorded_at=_recorded_at(session),
                            no_rate="" if rate else doubt,
                        )
                    )
                    places.append((events, number, held))
    except BaseException:
        file.close()
        raise

    @cache
    def values(place: int) -> np.ndarray:
        events, _, held = places[place]
        columns = len(events.parent.children) + 1
        limits.check(path, 8 * held * columns, at_once=True)
        with quiet():
            return np.asarray(events.arraySlice(0, held))[1:]

    def read(chosen: list[int], first: int, last: int) -> np.ndarray:
        columns = []
        for index in chosen:
            events, number, _ = places[index]
            same = next(i for i, place in enumerate(places) if place[0] is events)
            columns.append(values(same)[number, first:last])
        return np.column_stack(columns)

    return Source(
        "enDAQ IDE",
        tuple(signals),
        read,
        file.close,
        in_memory=True,
        truncated=truncated,
        notes=tuple(notes),
        metadata={str(name): str(value) for name, value in dataset.recorderInfo.items()},
    )


def _checked(file: BinaryIO, path: Path) -> str:
    """What is missing at the end of the file, or "".

    Scales and rates that are not numbers or ratios are refused: `9**9**9` would never end.
    """
    import ebmlite

    document = ebmlite.loadSchema("mide_ide.xml").load(file, headers=True)
    end, header = 0, True
    wrong = ""
    with suppress(OSError):  # of an element without its beginning
        for element in document:
            end = element.payloadOffset + element.size
            header = header and element.name != "ChannelDataBlock"
            for name, value in _texts(element) if header else ():
                if name in ("TimeCodeScale", "SampleRate") and not _RATIO.fullmatch(value):
                    wrong = f"its {name} is {value[:40]!r}, not a number or a ratio"
    if wrong:
        raise UnreadableFile(path, wrong)
    file.seek(0)
    size = path.stat().st_size
    return "" if end == size else f"its last element ends at byte {end} of {size}"


def _texts(element: Any) -> Iterator[tuple[str, str]]:
    """Names and values of the texts in an element and its children."""
    if isinstance(element.value, list):
        for within in element.value:
            yield from _texts(within)
    elif isinstance(element.value, str):
        yield element.name, element.value


def _rate(events: Any, held: int) -> tuple[float | None, float, str]:
    """Rate [Hz] and start [s] from the timestamps of the blocks, and a note."""
    blocks = events._data
    first, last = blocks[0], blocks[-1]
    start = 1e-6 * first.startTime
    span = 1e-6 * (last.endTime - first.startTime)
    if not span > 0 or held < 2:
        return None, start, "Its blocks have no stamps that rise"
    step = span / (held - 1)
    stamps = 1e-6 * np.array([block.startTime for block in blocks], float)
    numbers = np.array([block.indexRange[0] for block in blocks])
    off = np.abs(stamps - start - step * numbers)
    worst = int(np.argmax(off))
    parsers = events.dataset._parsers
    tick = 1e-6 * parsers["ChannelDataBlock"].timeScalars.get(events.parent.id, 1e6 / 2**15)
    deviation = (
        f"the stamps of its blocks lie up to {off[worst] / step:.3g} samples from a uniform grid "
        f"(worst at t = {stamps[worst]:.6g} s)"
    )
    if off[worst] > max(_STEPS * step, _TICKS * tick):
        return None, start, f"Samples are missing, or the clock wanders: {deviation}"
    rate = rate_of_step(step)
    whole = float(round(rate))
    if whole and abs(whole - rate) <= rate * tick / span:  # the stamps allow a whole number
        rate = whole
    return rate, start, deviation if off[worst] > max(0.01 * step, _TICKS * tick) else ""


def _recorded_at(session: Any) -> datetime | None:
    seconds = session.utcStartTime
    return datetime.fromtimestamp(seconds, UTC) if isinstance(seconds, (int, float)) else None
