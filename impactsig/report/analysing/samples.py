"""Raw samples around impacts: as many as a page can hold, the most interesting first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...recording import Recording
from .channels import delay_of, earlier, overview_of, typical

if TYPE_CHECKING:
    from ...impacts import Impacts
    from ...io import Blocks

MOST = 500_000
"""Samples held at most, of all channels together; each takes 2.7 bytes of a page."""
LEAST_MARGIN = 12
"""Samples held before an impact at least, and three times as many after its contact."""
UNMEASURED = 1e-3
"""As much in seconds, where no contact time tells how long a pulse lasts."""
WIDEST = 4.0
"""Times the least margin that is held where there is room."""
DOUBTFUL = 0.9
"""Probability below which an impact is looked at before those that are beyond doubt."""


class Span(NamedTuple):
    """Samples of one channel around one impact, on the clock of the first channel."""

    impact: int
    start: float
    samples: np.ndarray


def seen(
    sources: Sequence[Recording | Blocks], impacts: Impacts
) -> tuple[tuple[Recording, ...], tuple[tuple[Span, ...], ...]]:
    """The overview of each channel on the clock of the first, and samples around impacts.

    A channel whose overview is the channel itself has no such spans.
    """
    overviews, every = [], []
    for k, source in enumerate(sources):
        spans: list[Span] = []
        blocks = _taken(source, impacts, k, len(sources), spans)
        # A file is read once for both; what is in memory is its own overview, if it is short.
        drawn: Recording | Iterator[Recording] = blocks
        if isinstance(source, Recording):
            [drawn] = blocks
        overview = overview_of(drawn, source.duration)
        overviews.append(earlier(overview, delay_of(impacts, k)))
        every.append(tuple(spans) if overview.rate != source.rate else ())
    return tuple(overviews), tuple(every)


def _taken(
    source: Recording | Blocks, impacts: Impacts, channel: int, count: int, spans: list[Span]
) -> Iterator[Recording]:
    """Pass on the blocks of one channel of `count`, collecting its spans on the way."""
    delay, rate = delay_of(impacts, channel), source.rate
    index, low, high = windows(impacts, rate, MOST // count)
    first = np.ceil((low + delay - source.start) * rate - 1e-6).astype(np.int64)
    last = np.ceil((high + delay - source.start) * rate - 1e-6).astype(np.int64)
    pieces: dict[int, list[np.ndarray]] = {}
    begins, at = 0, 0
    for block in [source] if isinstance(source, Recording) else source:
        samples = block.channel(0).samples
        ends = begins + len(samples)
        # The windows neither overlap nor change their order.
        while at < len(index) and first[at] < ends:
            a, b = max(int(first[at]), begins), min(int(last[at]), ends)
            if a < b:
                # A copy: a view would keep the whole block.
                pieces.setdefault(at, []).append(samples[a - begins : b - begins].copy())
            if last[at] > ends:
                break
            at += 1
        begins = ends
        yield block
    for k, found in pieces.items():
        start = source.start + max(int(first[k]), 0) / rate - delay
        spans.append(Span(int(index[k]), start, np.concatenate(found)))


def windows(impacts: Impacts, rate: float, room: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The impacts whose samples are kept, and their windows [s], in order of time.

    Each begins a margin before the touch and ends three margins after the contact, or where that
    of the next begins. The margin is the contact time and at least 12 samples; it is wider where
    there is room for that.
    """
    if not len(impacts):
        return np.empty(0, int), np.empty(0), np.empty(0)
    if impacts.contact_time is None:
        contact = np.zeros(len(impacts))
        margin = np.full(len(impacts), max(UNMEASURED, LEAST_MARGIN / rate))
    else:
        contact = np.nan_to_num(impacts.contact_time)
        margin = np.maximum(contact, LEAST_MARGIN / rate)
    wider = (room / rate - contact.sum()) / (4 * margin).sum()
    margin = margin * np.clip(wider, 1.0, WIDEST)
    # One sample more, as a window may begin between two.
    cost = np.ceil((contact + 4 * margin) * rate) + 1
    order = by_interest(impacts)
    chosen = np.sort(order[np.cumsum(cost[order]) <= room])
    touch, margin = impacts.time[chosen], margin[chosen]
    low, high = touch - margin, touch + contact[chosen] + 3 * margin
    near = high[:-1] > low[1:]
    # Of two that overlap the later begins before its touch, by half of what lies between at most.
    low[1:][near] = (touch[1:] - np.minimum(margin[1:], np.diff(touch) / 2))[near]
    high[:-1] = np.minimum(high[:-1], low[1:])
    return chosen, low, high


def by_interest(impacts: Impacts) -> np.ndarray:
    """Indices of the impacts, the most interesting first.

    The weakest, the middle and the strongest; what is flagged; what is doubtful, the least
    probable first; then what lies farthest from the median in peak, contact time or the interval
    before or after it, in median deviations.
    """
    found = np.zeros(len(impacts))
    after = np.diff(impacts.time, append=np.nan) if len(impacts) else found
    before = np.diff(impacts.time, prepend=np.nan) if len(impacts) else found
    for values in (impacts.peak, impacts.contact_time, before, after):
        if values is None or not np.isfinite(values).any():
            continue
        off = np.nan_to_num(np.abs(values - np.nanmedian(values)), posinf=0.0)
        found = np.maximum(found, off / (np.median(off) or off.max() or 1.0))
    if impacts.probability is not None:
        doubtful = impacts.probability < DOUBTFUL
        found = np.where(doubtful, found.max(initial=0) + 2 - impacts.probability, found)
    found[impacts.flags != 0] = np.inf
    found[typical(impacts)] = np.inf
    order = np.argsort(-found, kind="stable")
    first = typical(impacts)
    return np.concatenate((np.array(first, int), order[~np.isin(order, first)]))
