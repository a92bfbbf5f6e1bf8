"""NumPy .npz: arrays of one length are channels, a number named rate or fs is the rate."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from ..errors import UnreadableFile
from ._npy import NO_RATE, ArrayHeader, along_time, read_array_header
from ._source import Signal, Source, sample_type
from ._timebase import TimeBase, time_base, time_factor
from .formats import SIZE_LIMIT

_RATES = frozenset(("rate", "fs", "sr", "sampling_rate", "sample_rate", "samplerate"))


def open_source(path: Path) -> Source:
    """Open an archive of arrays; see `impactsig.io.formats`.

    An array named as times (time, t, ...) gives the rate of the arrays that are as long.
    """
    with zipfile.ZipFile(path) as archive:
        headers = {}
        for entry in archive.infolist():
            if not entry.filename.endswith(".npy"):
                continue
            with archive.open(entry) as file:
                header = read_array_header(file)  # type: ignore[arg-type]
            if header.offset + header.bytes != entry.file_size and not header.dtype.hasobject:
                raise UnreadableFile(
                    path,
                    f"{entry.filename} announces {header.bytes} bytes of numbers and has "
                    f"{entry.file_size - header.offset}",
                )
            headers[entry.filename.removesuffix(".npy")] = header
    total = sum(header.bytes for header in headers.values() if not header.unusable())
    if total > SIZE_LIMIT:
        raise UnreadableFile(
            path,
            f"would grow to {total / 1e9:.1f} GB in memory (limit {SIZE_LIMIT / 1e9:.1f} GB)",
            "Save each channel as .npy, which is read in parts",
        )
    numbers = {name: h for name, h in headers.items() if not h.unusable()}
    singles = {name for name, h in headers.items() if h.shape in ((), (1,))}
    rates = sorted(name for name in singles if name.lower() in _RATES)
    rate = None
    if rates and headers[rates[0]].dtype.kind in "iuf":
        rate = float(_load(path, rates[0]).reshape(-1)[0])
        if not (np.isfinite(rate) and rate > 0):
            raise UnreadableFile(path, f"its {rates[0]} is {rate:g}, not a positive number [Hz]")
    bases = _time_bases(path, {n: h for n, h in numbers.items() if n not in singles})
    signals: list[Signal] = []
    columns: list[tuple[str, int]] = []
    for name, header in numbers.items():
        if name in singles or name in bases:
            continue
        count = 1 if len(header.shape) == 1 else min(header.shape)
        length = max(header.shape)
        base = next(
            (b for n, b in bases.items() if max(headers[n].shape) == length),
            TimeBase(None, 0.0, f"{NO_RATE}, and no scalar named {' or '.join(sorted(_RATES))}"),
        )
        for column in range(count):
            columns.append((name, column))
            signals.append(
                Signal(
                    name if count == 1 else f"{name} {column}",
                    "",
                    base.rate if rate is None else rate,
                    length,
                    base.start,
                    no_rate=base.problem,
                )
            )
    unusable = {n: h.unusable() for n, h in headers.items() if n not in singles and h.unusable()}
    notes = [f"array {name!r} is left out: it {reason}" for name, reason in unusable.items()]
    if not signals:
        raise UnreadableFile(
            path,
            "; ".join(notes) or "holds no array of samples",
            "Save arrays of shape (n,) or (n, channels) of numbers",
        )
    notes += [base.doubt for base in bases.values() if base.doubt and rate is None]
    loaded: dict[str, np.ndarray] = {}

    def read(channels: list[int], first: int, last: int) -> np.ndarray:
        parts = []
        for name, column in (columns[channel] for channel in channels):
            if name not in loaded:
                loaded[name] = along_time(_load(path, name))
            part = loaded[name][first:last, column]
            parts.append(part.astype(sample_type(part.dtype)))
        return np.column_stack(parts)

    return Source("NumPy npz", tuple(signals), read, in_memory=True, notes=tuple(notes))


def _load(path: Path, name: str) -> np.ndarray:
    with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def _time_bases(path: Path, headers: dict[str, ArrayHeader]) -> dict[str, TimeBase]:
    """Time base of every array that is named as one."""
    bases = {}
    for name, header in headers.items():
        factor = time_factor(name, "")
        if factor is not None and len(header.shape) == 1:
            times = _load(path, name)
            coarse = np.finfo(times.dtype).eps if times.dtype.kind == "f" else 0.0
            times = times.astype(np.float64)
            resolution = float(coarse * np.max(np.abs(times), initial=0.0))
            bases[name] = time_base(times * factor, resolution * factor)
    return bases
