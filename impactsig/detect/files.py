"""Detection in files, whole or in blocks, with the options of each channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._arguments import PER_CHANNEL
from ..errors import InvalidInput
from ..recording import Recording
from .signal.source import no_channel_chosen

if TYPE_CHECKING:
    from ..impacts import Impacts
    from ..io import Blocks, FileInfo

WHOLE_BELOW = 20_000_000
"""Samples up to which a recording is held in memory; longer ones go through in blocks."""


def detect_file(path: Path, reading: Mapping[str, Any], detecting: Mapping[str, Any]) -> Impacts:
    """The impacts of a file with its corrections; long files are read in blocks."""
    from ..io import info
    from .detect import detect_opened

    file = info(path, raw=reading.get("raw"))
    each = channel_readings(reading)
    sources = [open_recording(file, **one) for one in each]
    return detect_opened(sources, [one.get("channel", 0) for one in each], path, **detecting)


def channel_readings(reading: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Options for reading each channel; they may differ in `PER_CHANNEL` only.

    Raises
    ------
    InvalidInput
        If there are several of such an option, and not as many channels.
    """
    channels: Any = reading.get("channel")
    count = len(channels) if _is_several(channels) else 1
    for name in PER_CHANNEL:
        value: Any = reading.get(name)
        if _is_several(value) and len(value) != count:
            raise InvalidInput(
                name, list(value), f"one, or as many as channels, of which there are {count}",
                "Give channel= (--channel) for each sensor",
            )  # fmt: skip
    own = [name for name in ("channel", *PER_CHANNEL) if _is_several(reading.get(name))]
    return [dict(reading) | {name: reading[name][k] for name in own} for k in range(count)]


def _is_several(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def open_recording(file: FileInfo, **reading: Any) -> Recording | Blocks:
    """One channel of a file: the recording, or its blocks if it is too long for memory.

    Raises
    ------
    InvalidInput
        If there are several channels and none was chosen; the message lists those of the file,
        under the numbers by which they are chosen.
    """
    from ..io import read, read_blocks

    longest = max((channel.length for channel in file.channels), default=0)
    opened = read if longest <= WHOLE_BELOW else read_blocks
    source = opened(file.path, **reading)
    if len(source.channels) > 1:
        raise no_channel_chosen([channel.name for channel in file.channels])
    return source
