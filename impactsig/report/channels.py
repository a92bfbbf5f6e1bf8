"""The channels of a file: opened, searched, reduced to be drawn, and seen from near."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import PER_CHANNEL
from ..errors import InvalidInput
from ..recording import Recording

if TYPE_CHECKING:
    from ..impacts import Impacts
    from ..io import Blocks, FileInfo

WHOLE_BELOW = 20_000_000
"""Samples up to which a recording is held in memory; longer ones go through in blocks."""

OVERVIEW_BINS = 10_000
"""Spans the overview is reduced to: the least and the greatest sample of each are kept."""

EXCERPT = 20e-3
"""Time shown on either side of an impact whose contact time was not measured [s]."""


def detect_file(path: Path, reading: Mapping[str, Any], detecting: Mapping[str, Any]) -> Impacts:
    """The impacts of a file, with its corrections made; a long one goes through in blocks."""
    from ..detect._detect import detect_opened
    from ..io import info

    file = info(path, raw=reading.get("raw"))
    each = channel_readings(reading)
    sources = [open_recording(file, **one) for one in each]
    return detect_opened(sources, [one.get("channel", 0) for one in each], path, **detecting)


def channel_readings(reading: Mapping[str, Any]) -> list[dict[str, Any]]:
    """How each channel is read; those of one command differ in `PER_CHANNEL` at most.

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
    """One channel of a file: the recording, or its blocks where it is too long for memory.

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
        listed = ", ".join(f"{i}: {channel.name!r}" for i, channel in enumerate(file.channels))
        raise InvalidInput(
            "channel",
            None,
            f"one of {listed}",
            "Impacts are looked for in one channel: give channel= (--channel)",
        )
    return source


def overview_of(source: Recording | Iterable[Recording], duration: float) -> Recording:
    """The source, reduced where it is long; no spike is lost by drawing the result.

    Parameters
    ----------
    source : Recording or iterable of Recording
        One channel, whole or in successive blocks.
    duration : float
        Length of the whole [s].

    Returns
    -------
    Recording
        The source itself where it has few samples. Otherwise the least and the greatest sample
        of each span, alternating, at the rate which that makes.
    """
    if isinstance(source, Recording) and len(source) <= 2 * OVERVIEW_BINS:
        return _flat(source)
    first, pieces, covered = None, [], 0.0
    for block in [source] if isinstance(source, Recording) else source:
        first = first or _flat(block.between())
        covered += block.duration
        share = block.duration / duration if duration else 1.0
        _, low, high = _flat(block).envelope(max(1, round(OVERVIEW_BINS * share)))
        pieces.append(np.column_stack((low, high)).ravel())
    if first is None:
        raise InvalidInput("source", "no blocks", "at least one block of samples")
    samples = np.concatenate(pieces)
    # A file that is cut short has fewer samples than it says.
    rate = len(samples) / covered if len(samples) else first.rate
    return replace(first, samples=samples, rate=rate)


def overviews_of(sources: Sequence[Recording | Blocks], impacts: Impacts) -> tuple[Recording, ...]:
    """The overview of each channel, in the clock of the first."""
    return tuple(
        _earlier(overview_of(source, source.duration), delay)
        for source, delay in zip(sources, _delays(impacts), strict=True)
    )


def around(
    impacts: Impacts,
    index: int,
    sources: Sequence[Recording | Blocks],
    readings: Sequence[Mapping[str, Any]],
) -> Recording:
    """What the sensor of an impact recorded around it, in the clock of the first channel."""
    k = _sensor_of(impacts, index)
    source, delay = sources[k], _delays(impacts)[k]
    touch = float(impacts.time[index]) + delay
    contact = 0.0 if impacts.contact_time is None else float(impacts.contact_time[index])
    margin = 4 * contact or EXCERPT
    low, high = max(source.start, touch - margin), min(source.stop, touch + contact + margin)
    if isinstance(source, Recording):
        return _earlier(_flat(source.between(low, high)), delay)
    from ..io import read

    near = read(source.source, **{**readings[k], "start": low, "stop": high})
    return _earlier(_flat(near), delay)


def typical(impacts: Impacts) -> list[int]:
    """The weakest, the middle and the strongest impact; without peaks the first, middle, last."""
    if not len(impacts):
        return []
    order = np.arange(len(impacts)) if impacts.peak is None else np.argsort(impacts.peak)
    chosen = order[[0, len(order) // 2, -1]]
    return [int(index) for index in dict.fromkeys(chosen.tolist())]


def _flat(recording: Recording) -> Recording:
    return recording if recording.samples.ndim == 1 else recording.channel(0)


def _earlier(recording: Recording, delay: float) -> Recording:
    """A recording in a clock that is behind its own by that delay [s]."""
    return replace(recording, start=recording.start - delay)


def _delays(impacts: Impacts) -> list[float]:
    """How late each channel is against the first [s]."""
    return list(impacts.settings.get("delay", {"": 0.0}).values())


def _sensor_of(impacts: Impacts, index: int) -> int:
    """Which channel shows an impact best: that of its stop, else the first."""
    stops = impacts.settings.get("stops")
    if not stops or impacts.stop_index is None or impacts.stop_index[index] not in stops:
        return 0
    return int(stops.index(impacts.stop_index[index]))
