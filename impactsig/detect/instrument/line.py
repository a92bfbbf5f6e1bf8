"""Buffer for the samples of successive spans of a stretch.

What is searched for in a span reaches into those beside it. Spans take places in a row in turn, so
that these are at hand; only from one end of the row to the other their margins are copied.
"""

from __future__ import annotations

import numpy as np

from ..signal.grid import Grid

PLACES = 16
"""Spans in the row: a few more than are at work from the one just loaded to the one measured."""


class Line:
    """Contiguous buffer for the samples of the last spans of a stretch."""

    def __init__(self, grid: Grid, total: int) -> None:
        self.grid, self.count = grid, grid.count(total)
        places = min(self.count, PLACES)
        first, last = grid.bounds(self.count - 1, total)
        self._last = last - first  # samples of the last span, which no other follows
        longer = max(self._last - grid.span, 0)
        self._row = np.empty(places * grid.span + longer + 2 * grid.margin)

    def _ends(self, k: int) -> tuple[int, int]:
        """Bounds of span k in the buffer."""
        start = self.grid.margin + k % PLACES * self.grid.span
        return start, start + (self.grid.span if k < self.count - 1 else self._last)

    def samples(self, k: int) -> np.ndarray:
        """Samples of span k."""
        start, stop = self._ends(k)
        return self._row[start:stop]

    def around(self, k: int, reach: int) -> tuple[np.ndarray, int]:
        """Samples of span k and up to `reach` on either side, and the index of the first."""
        start, stop = self._ends(k)
        left, right = reach * (k > 0), reach * (k < self.count - 1)
        return self._row[start - left : stop + right], k * self.grid.span - left

    def join(self, k: int) -> None:
        """Copy the margins of span k beside it where its neighbour is not in the buffer."""
        margin = self.grid.margin
        start, stop = self._ends(k)
        if k > 0 and k % PLACES == 0:
            self._row[start - margin : start] = self.samples(k - 1)[-margin:]
        if k < self.count - 1 and k % PLACES == PLACES - 1:
            self._row[stop : stop + margin] = self.samples(k + 1)[:margin]
