"""Division of a record into seconds, chunks and blocks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .ladder import FACTOR, Ladder, ladder, white_noise


@dataclass
class Grid:
    """Division of a record, in samples."""

    rate: float
    longest: float  # contact
    rungs: Ladder = field(init=False)
    white: np.ndarray = field(init=False)  # noise of the rungs where it is white, over the first's
    span: int = field(init=False)
    chunk: int = field(init=False)  # of a median that the baseline follows
    margin: int = field(init=False)  # beside a span: what its search takes in
    block: int = field(init=False)  # of the means that hum is seen in

    def __post_init__(self) -> None:
        self.rungs = ladder(self.longest)
        self.white = white_noise(self.rungs)
        unit = FACTOR ** int(self.rungs.level[-1])
        self.margin = -(-(14 * int(self.rungs.width[-1]) + 64) // unit) * unit
        self.span = -(-max(round(self.rate), 4096, self.margin) // unit) * unit
        self.chunk = max(8, min(round(4 * self.longest), self.span // 2))
        self.block = max(1, round(self.rate / 1500))

    @property
    def pace(self) -> float:
        """Means a second."""
        return self.rate / self.block

    def count(self, total: int) -> int:
        """Number of spans of a stretch; a short remainder joins the last."""
        whole, rest = divmod(total, self.span)
        return max(1, whole + (rest >= max(self.span // 2, self.margin)))

    def bounds(self, k: int, total: int) -> tuple[int, int]:
        """First sample of span k, and of the next."""
        return k * self.span, total if k == self.count(total) - 1 else (k + 1) * self.span
