"""Divide consecutive blocks of samples into segments without gaps and equal frames.

Frames are counted from the start of their segment, so that whatever is computed on them does not
depend on how the samples were delivered.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ...errors import InvalidInput

FRAME = 1 << 16


class Piece(NamedTuple):
    """A stretch of valid samples: `samples[0]` is sample `first` of the record."""

    first: int
    samples: np.ndarray


class Frame(NamedTuple):
    """A frame: samples from `offset` on of the segment that begins at sample `segment`."""

    segment: int
    offset: int
    samples: np.ndarray
    last: bool


def frames(pieces: Iterable[Piece], size: int = FRAME) -> Iterator[Frame]:
    """Frames of `size` samples; the last of a segment may be shorter.

    Pieces that follow each other without a gap belong to one segment.
    """
    held: list[np.ndarray] = []
    count, segment, offset, expected = 0, 0, 0, None
    for first, samples in pieces:
        if first != expected:
            if count:
                yield Frame(segment, offset, _joined(held), True)
            held, count, segment, offset = [], 0, first, 0
        expected = first + len(samples)
        held.append(samples)
        count += len(samples)
        if count > size:
            joined = _joined(held)
            # One sample at least stays behind, so that the last frame can be told as such.
            whole = (count - 1) // size * size
            for start in range(0, whole, size):
                yield Frame(segment, offset + start, joined[start : start + size], False)
            offset += whole
            held, count = [joined[whole:]], count - whole
    if count:
        yield Frame(segment, offset, _joined(held), True)


def _joined(arrays: list[np.ndarray]) -> np.ndarray:
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def finite_runs(samples: np.ndarray) -> list[tuple[int, int]]:
    """The stretches [first, last) of finite samples, in order."""
    finite = np.isfinite(samples)
    if len(samples) and np.count_nonzero(finite) == len(samples):  # as nearly always
        return [(0, len(samples))]
    finite = np.concatenate(([False], finite, [False]))
    edges = np.flatnonzero(np.diff(finite.astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def refuse_huge(lowest: float, highest: float) -> None:
    """Raise InvalidInput if squares of the samples would overflow."""
    greatest = max(abs(lowest), abs(highest))
    if greatest > 1e100:
        raise InvalidInput(
            "samples",
            f"{greatest:.3g}",
            "magnitudes below 1e100",
            "Calibrate the recording to another unit",
        )
