"""Channels of a file reduced for drawing, and excerpts around impacts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InvalidInput
from ...recording import Recording

if TYPE_CHECKING:
    from ...impacts import Impacts
    from ...io import Blocks

OVERVIEW_BINS = 10_000
"""Spans the overview is reduced to: the least and the greatest sample of each are kept."""

EXCERPT = 20e-3
"""Time shown on either side of an impact whose contact time was not measured [s]."""


def overview_of(source: Recording | Iterable[Recording], duration: float) -> Recording:
    """The source, reduced to envelopes if it is long, so that no spike is lost.

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
        return source.channel(0)
    first, pieces, covered = None, [], 0.0
    for block in [source] if isinstance(source, Recording) else source:
        first = first or block.between().channel(0)
        covered += block.duration
        share = block.duration / duration if duration else 1.0
        _, low, high = block.channel(0).envelope(max(1, round(OVERVIEW_BINS * share)))
        pieces.append(np.column_stack((low, high)).ravel())
    if first is None:
        raise InvalidInput("source", "no blocks", "at least one block of samples")
    samples = np.concatenate(pieces)
    # A file that is cut short has fewer samples than it says.
    rate = len(samples) / covered if len(samples) else first.rate
    return replace(first, samples=samples, rate=rate)


def around(
    impacts: Impacts,
    index: int,
    sources: Sequence[Recording | Blocks],
    readings: Sequence[Mapping[str, Any]],
) -> Recording:
    """Excerpt of the sensor of an impact around it, on the clock of the first channel."""
    k = _sensor_of(impacts, index)
    source, delay = sources[k], delay_of(impacts, k)
    touch = float(impacts.time[index]) + delay
    contact = 0.0 if impacts.contact_time is None else float(impacts.contact_time[index])
    margin = 4 * contact or EXCERPT
    low, high = max(source.start, touch - margin), min(source.stop, touch + contact + margin)
    if isinstance(source, Recording):
        return earlier(source.between(low, high).channel(0), delay)
    from ...io import read

    near = read(source.source, **{**readings[k], "start": low, "stop": high})
    return earlier(near.channel(0), delay)


def typical(impacts: Impacts) -> list[int]:
    """The weakest, the median and the strongest impact; without peaks the first, middle, last."""
    if not len(impacts):
        return []
    order = np.arange(len(impacts)) if impacts.peak is None else np.argsort(impacts.peak)
    chosen = order[[0, len(order) // 2, -1]]
    return [int(index) for index in dict.fromkeys(chosen.tolist())]


def earlier(recording: Recording, delay: float) -> Recording:
    """A recording shifted by a delay [s], to the clock of the first channel."""
    return replace(recording, start=recording.start - delay)


def delay_of(impacts: Impacts, k: int) -> float:
    """Delay of a channel relative to the first [s]; 0 if it was not searched."""
    delays = list(impacts.settings.get("delay", {}).values())
    return delays[k] if k < len(delays) else 0.0


def _sensor_of(impacts: Impacts, index: int) -> int:
    """The channel that shows an impact best: that of its stop, else the first."""
    stops = impacts.settings.get("stops")
    if not stops or impacts.stop_index is None or impacts.stop_index[index] not in stops:
        return 0
    return int(stops.index(impacts.stop_index[index]))
