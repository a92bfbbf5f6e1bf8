"""Check the heaps of an HDF5 file, which hold variable-length texts, before the library reads them.

A heap is a row of objects, each after the one before by the size that it gives (HDF5 File Format
Specification, III.E). HDF5 up to 2.0 goes round for ever at a free object of size 0: one changed
byte hangs the process.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

SIGNATURE = b"\x89HDF\r\n\x1a\n"
HEAP = b"GCOL"
_LARGEST = 1 << 30  # bytes that are searched for heaps
_BLOCK = 1 << 24
_MOST = 1_000_000  # objects; overlapping heaps could have any number


class Heaps:
    """The heaps of one file, checked when the first text is read."""

    def __init__(self, path: Path) -> None:
        self._path = path

    @property
    def doubt(self) -> str:
        """Why no text may be read from them; "" if texts may be read."""
        return self._state()[0]

    @property
    def largest(self) -> int:
        """Bytes of the largest object, and so of the longest text."""
        return self._state()[1]

    def _state(self) -> tuple[str, int]:
        status = self._path.stat()
        state = self._path, status.st_size, status.st_mtime_ns, status.st_ino
        # Of a file changed just now the time of change does not tell this state from the next.
        settled = time.time_ns() - status.st_mtime_ns > 2_000_000_000
        return _known(*state) if settled else _known.__wrapped__(*state)


@lru_cache(64)
def _known(path: Path, size: int, *_: int) -> tuple[str, int]:
    """Result of the check, cached for as long as the file is unchanged."""
    with path.open("rb") as file:
        return _doubt(file, size)


def _doubt(file: BinaryIO, size: int) -> tuple[str, int]:
    """What is wrong with the heaps of a file, and the size of their largest object."""
    if size > _LARGEST:
        return f"are not looked for in more than {_LARGEST >> 30} GiB", 0
    if not has_long_sizes(file.read(4096)):
        return "have sizes of another length than 8 bytes", 0
    left, largest = _MOST, 0
    for start in _starts(file):
        file.seek(start + 8)
        (announced,) = struct.unpack("<Q", file.read(8).ljust(8, b"\0"))
        left, found = _walked(file, start + 16, min(start + announced, size), left - 1)
        if left <= 0:
            return f"have no end (heap at byte {start})", 0
        largest = max(largest, found)
    return "", largest


def has_long_sizes(head: bytes) -> bool:
    """Whether lengths and offsets take 8 bytes, as all common writers choose."""
    at = next((at for at in (0, 512, 1024, 2048) if head[at : at + 8] == SIGNATURE), -1)
    if at < 0:
        return False
    sizes = at + (13 if head[at + 8] < 2 else 9)
    return head[sizes : sizes + 2] == b"\x08\x08"


def _starts(file: BinaryIO) -> Iterator[int]:
    """Offsets at which a heap, or what looks like one, begins."""
    begin = 0
    while True:
        file.seek(begin)
        block = file.read(_BLOCK + len(HEAP) - 1)
        at = block.find(HEAP)
        while at >= 0:
            yield begin + at
            at = block.find(HEAP, at + 1)
        if len(block) < _BLOCK:
            return
        begin += _BLOCK


def _walked(file: BinaryIO, at: int, end: int, left: int) -> tuple[int, int]:
    """Objects that may still be checked after this heap, and the size of its largest.

    None may if it has no end.
    """
    largest = 0
    while at + 16 <= end and left > 0:
        file.seek(at)
        number, _, size = struct.unpack("<HHxxxxQ", file.read(16))
        step = size if number == 0 else 16 + size + -size % 8
        if step == 0 or step >= 1 << 62:
            return 0, 0
        # What runs out of its heap is no object, but samples that look like one.
        largest = max(largest, size if number and at + 16 + size <= end else 0)
        at, left = at + step, left - 1
    return left, largest
