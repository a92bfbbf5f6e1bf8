"""Frames of a record with the samples beside them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ..signal.stream import Frame, Piece, frames


class Window(NamedTuple):
    """A frame of the stream with its neighbours."""

    segment: int  # its first sample in the record
    first: int  # first sample of the core, in the segment
    core: np.ndarray
    before: np.ndarray
    after: np.ndarray

    def samples(self, left: int, right: int, hop: int) -> tuple[np.ndarray, tuple[int, int]]:
        """The core in whole hops with `left`, `right` samples beside it; the span that is real.

        Beyond the ends of the segment its first and last samples go on.
        """
        before = self.before[max(len(self.before) - left, 0) :]
        right += -len(self.core) % hop
        after = self.after[:right]
        begin = left - len(before)
        x = joined([before, self.core, after])
        end = begin + len(x)
        if begin == 0 and len(after) == right:
            return x, (begin, end)
        out = np.empty(end + right - len(after), x.dtype)
        out[:begin], out[begin:end], out[end:] = x[0], x, x[-1]
        return out, (begin, end)

    def beside(self, most: int) -> tuple[np.ndarray, int]:
        """The core with at most so many samples on either side, and where it begins there."""
        before = self.before[max(len(self.before) - most, 0) :]
        return joined([before, self.core, self.after[:most]]), len(before)


def joined(parts: list[np.ndarray]) -> np.ndarray:
    """The parts as one array: a view of that in which they follow each other, if there is one."""
    parts = [part for part in parts if len(part)]
    if len(parts) == 1:
        return parts[0]
    whole = parts[0].base
    if not isinstance(whole, np.ndarray) or whole.ndim != 1 or not whole.flags.carray:
        return np.concatenate(parts)
    first = at = _address(parts[0])
    for part in parts:
        if part.base is not whole or part.dtype != whole.dtype or _address(part) != at:
            return np.concatenate(parts)
        at += part.nbytes
    begin = (first - _address(whole)) // whole.itemsize
    return whole[begin : begin + (at - first) // whole.itemsize]


def _address(samples: np.ndarray) -> int:
    return int(samples.__array_interface__["data"][0])


def windows(pieces: Iterable[Piece], size: int) -> Iterator[Window]:
    """The frames of `size` samples of a stream, each with its neighbours in the segment."""
    before: np.ndarray | None = None
    held: Frame | None = None
    for frame in frames(pieces, size):
        none = frame.samples[:0]
        if held is not None:
            yield _window(held, none if before is None else before, frame.samples)
            before = held.samples
        held = frame
        if frame.last:
            yield _window(frame, none if before is None else before, none)
            before, held = None, None


def _window(frame: Frame, before: np.ndarray, after: np.ndarray) -> Window:
    return Window(frame.segment, frame.offset, frame.samples, before, after)
