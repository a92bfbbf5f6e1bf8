"""The first pass over a force record: what the levels and the search need to know of it.

Memory is bounded: a few stretches of samples, and 1/256 of the record for the ranges of its
blocks.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from ._force_kernels import BLOCK, block_ranges
from ._stream import Frame

KEPT_SPREAD = 64  # frames kept for the noise level
KEPT_STRONG = 6  # stretches kept for the width and the direction of the pulses
AROUND = 1 << 14  # samples to either side of the steepest block in such a stretch


@dataclass
class Survey:
    """What the first pass keeps of a record."""

    samples: int = 0
    segments: list[tuple[int, int]] = field(default_factory=list)  # first sample, length
    low: list[np.ndarray] = field(default_factory=list)  # one array of block ranges a segment
    high: list[np.ndarray] = field(default_factory=list)
    spread: list[np.ndarray] = field(default_factory=list)
    strong: list[tuple[np.ndarray, bool]] = field(default_factory=list)  # is it a whole segment?

    @property
    def lowest(self) -> float:
        """Least sample of the record."""
        return float(min(part.min() for part in self.low))

    @property
    def highest(self) -> float:
        """Greatest sample of the record."""
        return float(max(part.max() for part in self.high))


def survey(stream: Iterable[Frame], copy: bool) -> Survey:
    """Keep the ranges of all blocks, the strongest frames, and every 2^k-th frame."""
    record = Survey()
    strongest: list[tuple[float, int, np.ndarray, bool]] = []
    stride = 1
    spread: list[tuple[int, np.ndarray]] = []
    low: list[np.ndarray] = []
    high: list[np.ndarray] = []
    for number, frame in enumerate(stream):
        x = frame.samples
        blocks = -(-len(x) // BLOCK)
        low.append(np.empty(blocks))
        high.append(np.empty(blocks))
        block_ranges(x, low[-1], high[-1])
        if number % stride == 0:
            spread.append((number, x.copy() if copy else x))
            if len(spread) > KEPT_SPREAD:
                stride *= 2
                spread = [item for item in spread if item[0] % stride == 0]
        # The range within a block tells a pulse from drift.
        extents = high[-1] - low[-1]
        steepest = int(np.argmax(extents))
        extent = float(extents[steepest])
        if len(strongest) < KEPT_STRONG or extent > strongest[0][0]:
            whole = frame.last and frame.offset == 0
            middle = steepest * BLOCK + BLOCK // 2
            part = x if whole else x[max(0, middle - AROUND) : middle + AROUND]
            # Ties are broken by the frame number, never by comparing arrays.
            item = (extent, -number, part.copy() if copy else part, whole)
            heapq.heappush(strongest, item)
            if len(strongest) > KEPT_STRONG:
                heapq.heappop(strongest)
        record.samples += len(x)
        if frame.last:
            record.segments.append((frame.segment, frame.offset + len(x)))
            record.low.append(np.concatenate(low))
            record.high.append(np.concatenate(high))
            low, high = [], []
    record.spread = [item[1] for item in spread]
    record.strong = [item[2:] for item in sorted(strongest, key=lambda item: -item[1])]
    return record
