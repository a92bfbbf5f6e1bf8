"""`info`: the content of a file without its samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from os import PathLike
from pathlib import Path

from ._limits import DEFAULT_LIMITS, Limits
from ._raw import RawLayout
from .formats import open_file


@dataclass(frozen=True)
class ChannelInfo:
    """One channel of a file.

    Parameters
    ----------
    name, unit : str
        Name, and unit or "".
    rate : float or None
        Samples per second [Hz]; None if the file does not tell.
    length : int
        Number of samples.
    """

    name: str
    unit: str
    rate: float | None
    length: int


@dataclass(frozen=True, repr=False)
class FileInfo:
    """Format and channels of a file.

    Parameters
    ----------
    path : str
        The file; that of the samples, where settings stand in another.
    format : str
        Name of its format.
    bytes : int
        Size of the file.
    channels : tuple of ChannelInfo
        Its channels, in order; the position is the index by which `read` knows them.
    recorded_at : datetime or None
        Beginning of the first channel that has one; with a time zone where the file tells it.
    truncated : bool
        The file ends before its header says it does.
    metadata : mapping of str to str
        What TDMS and audio files say of themselves beside their channels.
    """

    path: str
    format: str
    bytes: int
    channels: tuple[ChannelInfo, ...]
    recorded_at: datetime | None
    truncated: bool
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        lines = [f"{self.path}: {self.format}, {self.bytes} bytes"]
        if self.recorded_at is not None:
            lines[0] += f", recorded at {self.recorded_at.isoformat(sep=' ')}"
        if self.truncated:
            lines[0] += ", TRUNCATED"
        for index, channel in enumerate(self.channels):
            rate = "rate unknown" if channel.rate is None else f"{channel.rate:g} Hz"
            parts = [channel.name or "(no name)", f"{channel.length} samples", rate]
            if channel.rate is not None:
                parts.append(f"{channel.length / channel.rate:.6g} s")
            parts.append(channel.unit)
            lines.append(f"  {index}: " + "; ".join(part for part in parts if part))
        return "\n".join(lines)


def info(
    path: str | PathLike[str], *, raw: RawLayout | None = None, limits: Limits = DEFAULT_LIMITS
) -> FileInfo:
    """List format and channels of a file, without reading samples (except in text and LVM files).

    Parameters
    ----------
    path : path-like
        The file.
    raw, limits
        As in `read`.

    Returns
    -------
    FileInfo

    Raises
    ------
    UnreadableFile, MissingExtra
        As `read` does.

    See Also
    --------
    read, read_many

    Examples
    --------
    >>> from impactsig import info
    >>> found = info("data_samples/loadcell_periodic_22.1Hz.wav")
    >>> [(channel.rate, channel.length) for channel in found.channels]
    [(50000.0, 500000)]
    """
    source = open_file(path, limits, raw)
    source.close()
    channels = tuple(ChannelInfo(s.name, s.unit, s.rate, s.length) for s in source.signals)
    holding = source.path or Path(path)
    return FileInfo(
        str(holding),
        source.format,
        holding.stat().st_size,
        channels,
        next((s.recorded_at for s in source.signals if s.recorded_at is not None), None),
        bool(source.truncated),
        source.metadata,
    )
