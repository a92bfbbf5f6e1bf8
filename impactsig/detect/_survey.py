"""The first pass over a force record: its range and its steepest stretches, in bounded memory."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from ._dropouts import without_dropouts
from ._stream import Frame

BLOCK = 512  # samples that share one least and one greatest value
KEPT = 5  # steepest stretches, which show the direction of the pulses
AROUND = 1 << 12  # samples to either side of the steepest block in such a stretch


@dataclass
class Survey:
    """What the first pass keeps of a record."""

    samples: int = 0
    lowest: float = math.inf
    highest: float = -math.inf
    segments: list[tuple[int, int]] = field(default_factory=list)  # first sample, length
    strong: list[np.ndarray] = field(default_factory=list)


def survey(stream: Iterable[Frame], copy: bool) -> Survey:
    """Range, stretches without gaps, and of the steepest frames the steepest parts.

    `copy` them where the frames do not stay valid.
    """
    record = Survey()
    strongest: list[tuple[float, int, np.ndarray]] = []
    for number, frame in enumerate(stream):
        x = without_dropouts(frame.samples)
        low, high = block_ranges(x)
        record.lowest = min(record.lowest, float(low.min()))
        record.highest = max(record.highest, float(high.max()))
        # The range within a block tells a pulse from drift.
        extents = high - low
        steepest = int(np.argmax(extents))
        extent = float(extents[steepest])
        if len(strongest) < KEPT or extent > strongest[0][0]:
            middle = steepest * BLOCK + BLOCK // 2
            part = x[max(0, middle - AROUND) : middle + AROUND]
            # Ties are broken by the frame number, never by comparing arrays.
            heapq.heappush(strongest, (extent, -number, part.copy() if copy else part))
            if len(strongest) > KEPT:
                heapq.heappop(strongest)
        record.samples += len(x)
        if frame.last:
            record.segments.append((frame.segment, frame.offset + len(x)))
    record.strong = [item[2] for item in sorted(strongest, key=lambda item: -item[1])]
    return record


def block_ranges(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest value of each BLOCK samples of x; the last block may be shorter."""
    whole = len(x) // BLOCK * BLOCK
    blocks, rest = x[:whole].reshape(-1, BLOCK), x[whole:]
    low, high = blocks.min(axis=1), blocks.max(axis=1)
    if len(rest):
        low, high = np.append(low, rest.min()), np.append(high, rest.max())
    return low, high
