"""First pass over a force record: range and steepest stretches, in bounded memory."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from ..._compiling.compiled import kernel
from ..signal.stream import Frame
from ._dropouts import without_dropouts
from .dropout_kernels import may_repeat

BLOCK = 512  # samples that share one least and one greatest value
KEPT = 5  # steepest stretches, which show the direction of the pulses
AROUND = 1 << 12  # samples to either side of the steepest block in such a stretch


@dataclass
class Survey:
    """Results of the first pass."""

    samples: int = 0
    lowest: float = math.inf
    highest: float = -math.inf
    at_lowest: int = 0  # blocks that reach it
    at_highest: int = 0
    repeats: bool = False  # values, so that there may be dropouts
    segments: list[tuple[int, int]] = field(default_factory=list)  # first sample, length
    frames: list[tuple[np.ndarray, int]] = field(default_factory=list)  # and its steepest sample

    def extend(self, low: np.ndarray, high: np.ndarray) -> None:
        """Extend the range by the least and greatest values of blocks."""
        lowest, highest = float(low.min()), float(high.max())
        if lowest <= self.lowest:
            blocks = int(np.count_nonzero(low == lowest))
            self.at_lowest = blocks + (self.at_lowest if lowest == self.lowest else 0)
            self.lowest = lowest
        if highest >= self.highest:
            blocks = int(np.count_nonzero(high == highest))
            self.at_highest = blocks + (self.at_highest if highest == self.highest else 0)
            self.highest = highest

    @property
    def strong(self) -> list[np.ndarray]:
        """The steepest parts of the steepest frames."""
        return [x[max(0, at - AROUND) : at + AROUND] for x, at in self.frames]


def survey(stream: Iterable[Frame], copy: bool) -> Survey:
    """Range, stretches without gaps, and the steepest frames of a record.

    `copy` them where the frames do not stay valid.
    """
    record = Survey()
    strongest: list[tuple[float, int, np.ndarray, int]] = []
    for number, frame in enumerate(stream):
        x = frame.samples
        if may_repeat(x):
            record.repeats, x = True, without_dropouts(x)
        low, high = block_ranges(x)
        record.extend(low, high)
        # The range within a block tells a pulse from drift.
        extents = high - low
        steepest = int(np.argmax(extents))
        extent = float(extents[steepest])
        if len(strongest) < KEPT or extent > strongest[0][0]:
            middle = steepest * BLOCK + BLOCK // 2
            # Ties are broken by the frame number, never by comparing arrays.
            heapq.heappush(strongest, (extent, -number, x.copy() if copy else x, middle))
            if len(strongest) > KEPT:
                heapq.heappop(strongest)
        record.samples += len(x)
        if frame.last:
            record.segments.append((frame.segment, frame.offset + len(x)))
    record.frames = [item[2:] for item in sorted(strongest, key=lambda item: -item[1])]
    return record


def block_ranges(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest value of each BLOCK samples of x; the last block may be shorter."""
    low, high = np.empty((2, -(-len(x) // BLOCK)), x.dtype)
    _put_ranges(x, low, high)
    return low, high


@kernel
def _put_ranges(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Fill `low` and `high`, four samples at a time: each comparison waits for the one before."""
    for k in range(len(low)):
        part = x[k * BLOCK : (k + 1) * BLOCK]
        low0 = low1 = low2 = low3 = high0 = high1 = high2 = high3 = part[0]
        fours = len(part) // 4 * 4
        for i in range(0, fours, 4):
            x0, x1, x2, x3 = part[i], part[i + 1], part[i + 2], part[i + 3]
            low0, high0 = x0 if x0 < low0 else low0, x0 if x0 > high0 else high0
            low1, high1 = x1 if x1 < low1 else low1, x1 if x1 > high1 else high1
            low2, high2 = x2 if x2 < low2 else low2, x2 if x2 > high2 else high2
            low3, high3 = x3 if x3 < low3 else low3, x3 if x3 > high3 else high3
        for i in range(fours, len(part)):
            low0, high0 = min(low0, part[i]), max(high0, part[i])
        low[k] = min(min(low0, low1), min(low2, low3))
        high[k] = max(max(high0, high1), max(high2, high3))
