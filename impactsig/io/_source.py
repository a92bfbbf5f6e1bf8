"""The interface of a reader: the signals in a file, and a function that reads samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Signal:
    """One channel of a file.

    Parameters
    ----------
    name : str
        Full name, as the user gives it to choose the channel.
    unit : str
        Physical unit, "" where the file names none.
    rate : float or None
        Samples per second [Hz]; None where the file does not say.
    length : int
        Number of samples.
    start : float
        Time of the first sample [s].
    segment : int
        Signals of different segments were not recorded side by side.
    alias : str
        Short name, accepted where it is the only one of its kind.
    recorded_at : datetime or None
        Wall-clock time at time 0; with a time zone where the file tells it.
    no_rate : str
        Why there is no rate, where there is none.
    """

    name: str
    unit: str
    rate: float | None
    length: int
    start: float = 0.0
    segment: int = 0
    alias: str = ""
    recorded_at: datetime | None = None
    no_rate: str = ""


@dataclass(frozen=True)
class Source:
    """An opened file.

    Parameters
    ----------
    format : str
        Name of the format, for people.
    signals : tuple of Signal
        The channels, in the order of the file.
    read : callable
        ``read(channels, first, last)`` returns samples [first, last) of the signals with those
        indices, all of one length, as float32 or float64 of shape (n, len(channels)). A shorter
        array means that the file ended early.
    close : callable
        Lets go of the file. The source is not used afterwards.
    in_memory : bool
        The samples are held already; opening again would only repeat the work.
    audio : bool
        A container made for sound.
    truncated : str
        How much is missing, where the file ends before its header says so.
    notes : tuple of str
        What the user should know of (a column left out, a header that contradicts the data).
    times : callable, optional
        ``times()`` returns the time of each row [s], where these are uneven.
    metadata : mapping of str to str
        What the file says of the whole of it beside its channels.
    path : path-like, optional
        The file that holds the samples, where it is not the one that was opened.
    """

    format: str
    signals: tuple[Signal, ...]
    read: Callable[[list[int], int, int], np.ndarray]
    close: Callable[[], None] = lambda: None
    in_memory: bool = False
    audio: bool = False
    truncated: str = ""
    notes: tuple[str, ...] = ()
    times: Callable[[], np.ndarray] | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)
    path: Path | None = None


def memory_reader(columns: list[np.ndarray]) -> Callable[[list[int], int, int], np.ndarray]:
    """A `Source.read` for samples that are held in memory, one array a channel."""

    def read(channels: list[int], first: int, last: int) -> np.ndarray:
        if len(channels) == 1:
            return columns[channels[0]][first:last, np.newaxis]
        return np.column_stack([columns[channel][first:last] for channel in channels])

    return read


def sample_type(dtype: np.dtype) -> type[np.float32] | type[np.float64]:
    """float32 if it holds all numbers of `dtype` exactly, else float64."""
    small = dtype.kind in "biuf" and dtype.itemsize <= (4 if dtype.kind == "f" else 2)
    return np.float32 if small else np.float64


def in_utf8(path: Path) -> bool:
    """Whether a file name is valid UTF-8; pyarrow opens no other by name."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        return False
    return True
