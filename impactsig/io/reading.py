"""`read` and `read_blocks`: from a path to a Recording, whole or in blocks."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from os import PathLike

from .._arguments import number
from .._showing import html_table
from ..recording import Recording, Sensor
from ._limits import DEFAULT_LIMITS, Limits
from ._plan import Plan, prepare, recording
from ._raw import RawLayout
from ._source import Source
from .formats import open_file
from .times.uneven import resampled


@dataclass(frozen=True, eq=False, repr=False)
class Blocks:
    """A recording that is read block by block, as often as it is iterated over.

    Iterating yields `Recording` objects that follow each other without gap or overlap, each with
    its own `start`. Every iteration opens the file anew, so that iterations are independent.

    Attributes
    ----------
    rate : float
        Samples per second [Hz].
    channels, units : tuple of str
        Name and unit of each channel.
    samples : int
        Number of samples of each channel in all blocks together.
    block_size : int
        Number of samples of each channel in one block; the last may have fewer.
    start : float
        Time of the first sample [s].
    sensor : {"force", "sound"}
        As in `Recording`.
    source : str
        The file.
    recorded_at : datetime or None
        As in `Recording`.
    truncated : bool
        The file ends before its header says it does.

    See Also
    --------
    read_blocks, Recording

    Examples
    --------
    >>> from impactsig import read_blocks
    >>> blocks = read_blocks("data_samples/loadcell_periodic_22.1Hz.wav", seconds=4.0)
    >>> blocks.samples, blocks.rate, next(iter(blocks)).duration
    (500000, 50000.0, 4.0)
    """

    rate: float
    channels: tuple[str, ...]
    units: tuple[str, ...]
    samples: int
    block_size: int
    start: float
    sensor: Sensor
    source: str
    recorded_at: datetime | None
    truncated: bool
    _opened: Callable[[], Source] = field(repr=False)
    _plan: Plan = field(repr=False)

    @property
    def duration(self) -> float:
        """Length of all blocks together [s]."""
        return self.samples / self.rate

    @property
    def stop(self) -> float:
        """Time just after the last sample [s]."""
        return self.start + self.duration

    def __iter__(self) -> Iterator[Recording]:
        source = self._opened()
        try:
            for first in range(self._plan.first, self._plan.last, self.block_size):
                last = min(first + self.block_size, self._plan.last)
                block = recording(source, self._plan, first, last, self.source)
                if len(block):
                    yield block
                if len(block) < last - first:
                    return
        finally:
            source.close()

    def __repr__(self) -> str:
        shape = f"{self.samples} samples" + (f" x {len(self.units)}" if len(self.units) > 1 else "")
        return (
            f"Blocks({shape}; {self.rate:g} Hz; {self.duration:.6g} s; "
            f"{self.block_size} a block; {self.sensor}; {self.source})"
        )

    def _repr_html_(self) -> str:
        named = zip(self.channels, self.units, strict=True)
        rows = [(name or "(no name)", unit or "no unit") for name, unit in named]
        rows.append(("blocks", f"{-(-self.samples // self.block_size)}, read when asked for"))
        return f"<div><code>{html.escape(repr(self))}</code>{html_table(rows)}</div>"


def read(
    path: str | PathLike[str],
    channel: str | int | None = None,
    start: float | None = None,
    stop: float | None = None,
    scale: float = 1.0,
    offset: float = 0.0,
    unit: str | None = None,
    rate: float | None = None,
    sensor: Sensor | None = None,
    *,
    resample: float | None = None,
    raw: RawLayout | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Recording:
    """Read a recording from a file.

    The format is recognised by the content of the file, then by its extension: audio (WAV, FLAC,
    OGG, AIFF, W64, RF64), NI TDMS, NI LVM, HDF5, MATLAB (4 to 7.3), universal files (UFF 58),
    enDAQ IDE, ASAM MDF, Vallen tradb, Parquet, Feather, NumPy npy and npz, and text tables (CSV,
    TSV, TXT).

    Parameters
    ----------
    path : path-like
        The file.
    channel : str or int, optional
        One channel, by name or index (see `info`). By default all channels with the same rate and
        length; if the file has several such sets, the one with the most samples (the first, if two
        have as many), and a warning names the others.
    start, stop : float, optional
        Read the samples with start <= time < stop [s], where time is that of the file's own time
        column, if it has one. Only that part is read, except from text, LVM and files that are
        compressed as a whole (npz, MATLAB 5).
    scale, offset : float, optional
        Calibration: ``scale * samples + offset``. Samples of audio files run from -1 to 1.
    unit : str, optional
        Unit of the result; by default that of the file.
    rate : float, optional
        Samples per second [Hz]; takes precedence over the rate in the file, with a warning where
        the two differ by more than 0.01 %.
    sensor : {"force", "sound"}, optional
        Kind of sensor, used by detection. By default an audio file at a common audio rate (8,
        11.025, 12, 16, 22.05, 24, 32, 44.1, 48, 88.2, 96, 176.4 or 192 kHz) is "sound" unless
        `unit` is given, and everything else is "force".
    resample : float, optional
        Rate [Hz] to which unevenly spaced samples, as recorded by a phone, are interpolated; a
        warning states how uneven they are. An error if the samples are evenly spaced.
    raw : RawLayout, optional
        Layout of a file without a header; requires `rate`.
    limits : Limits, optional
        Limits on the memory for a compressed file; by default 2 GiB and 200 times its size.

    Returns
    -------
    Recording
        Samples of shape (n,), or (n, channels) if there are several; float32 if that holds the
        numbers of the file exactly (16 bits, or float32), else float64.

    Raises
    ------
    UnreadableFile
        If the file is missing, empty, corrupt, of no known format, or contains no samples.
    InvalidInput
        If there is no such channel, no rate is known, or the span holds no sample.
    MissingExtra
        If the format needs a library that is not installed.

    Warns
    -----
    ImpactsigWarning
        If channels are left out, the file is cut short, its header contradicts its data, or `rate`
        contradicts the file.

    See Also
    --------
    info, read_blocks, read_many, Recording

    Examples
    --------
    >>> from impactsig import read
    >>> recording = read("data_samples/loadcell_periodic_22.1Hz.wav", unit="V", start=1.0, stop=3.0)
    >>> recording.rate, recording.duration
    (50000.0, 2.0)
    """
    opened = partial(open_file, path, limits, raw)
    source, plan = prepare(
        path, channel, start, stop, scale, offset, unit, rate, sensor, resample, opened
    )
    try:
        return recording(source, plan, plan.first, plan.last, str(path))
    finally:
        source.close()


def read_blocks(
    path: str | PathLike[str],
    seconds: float = 10.0,
    channel: str | int | None = None,
    start: float | None = None,
    stop: float | None = None,
    scale: float = 1.0,
    offset: float = 0.0,
    unit: str | None = None,
    rate: float | None = None,
    sensor: Sensor | None = None,
    *,
    resample: float | None = None,
    raw: RawLayout | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Blocks:
    """Read a recording in blocks; joined, they equal what `read` returns, bit for bit.

    Memory is bounded by a block for audio, TDMS, HDF5, MATLAB, binary UFF, tradb, npy and raw files
    of any size, by a block and the column of times for MDF, by a group of rows for Parquet and
    Feather, and by 16 MB of text and the column of times for text tables. LVM files with a header,
    UFF written as text, npz, IDE and compressed MATLAB 5 files are read as a whole, once, and then
    divided.

    Parameters
    ----------
    path : path-like
        The file.
    seconds : float, optional
        Length of a block [s]; at least one sample.
    channel, start, stop, scale, offset, unit, rate, sensor, resample, raw, limits
        As in `read`.

    Returns
    -------
    Blocks
        The blocks, which can be iterated over any number of times.

    Raises
    ------
    UnreadableFile, InvalidInput, MissingExtra
        As `read` does; errors in the samples are raised while iterating.

    See Also
    --------
    read, detect_impacts

    Examples
    --------
    >>> from impactsig import read_blocks
    >>> blocks = read_blocks("data_samples/loadcell_periodic_22.1Hz.wav", seconds=4.0)
    >>> [block.duration for block in blocks]
    [4.0, 4.0, 2.0]
    """
    seconds = number("seconds", seconds, "a positive time [s]", above=0)
    opened = partial(open_file, path, limits, raw)
    source, plan = prepare(
        path, channel, start, stop, scale, offset, unit, rate, sensor, resample, opened
    )
    signals = [source.signals[index] for index in plan.channels]
    if not source.in_memory:
        source.close()

    def again() -> Source:
        return opened() if resample is None else resampled(opened(), resample, path)

    return Blocks(
        rate=plan.rate,
        channels=tuple(signal.name for signal in signals),
        units=tuple(signal.unit if unit is None else unit for signal in signals),
        samples=plan.last - plan.first,
        block_size=max(1, round(seconds * plan.rate)),
        start=plan.origin + plan.first / plan.rate,
        sensor=plan.sensor,
        source=str(path),
        recorded_at=signals[0].recorded_at,
        truncated=bool(source.truncated),
        _opened=(lambda: source) if source.in_memory else again,
        _plan=plan,
    )
