"""Read variable-length texts of an HDF5 file from their heaps, without the HDF5 library.

h5py writes every text so, thus most units: an attribute keeps the place of a heap in which the text
is one of the objects. HDF5 may be asked only once all heaps of the file are known to be in order
(`_heaps`), and to look for them costs reading the file. What is done here instead follows the
HDF5 File Format Specification (IV.A.1 and 2.m, object headers and attributes; III.E, heaps), and is
bounded in every step; what it does not know, such as attributes in an index, is left to HDF5.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ._heaps import HEAP, SIGNATURE, Heaps, has_long_sizes

_ATTRIBUTE, _CONTINUED = 0x0C, 0x10
_SHARED = 0x02
_LARGEST_BLOCK, _LARGEST_TEXT = 1 << 20, 1 << 16  # bytes of a header's block, and of a text
_LARGEST_SUM = (
    1 << 24
)  # bytes of all texts of a file: an object of a heap may be referred to many times
_STRING = 64  # bytes that a string takes at least
_MOST = 1_000_000  # objects of heaps, and messages of headers, that are gone through for a file
_PLACE = 16  # bytes of a text's length, heap and number


class _Unknown(Exception):
    """The layout is not known here, so that HDF5 has to read it."""


class Texts:
    """The texts of one open file.

    Attributes
    ----------
    doubts : list of str
        Why some of them could not be read.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._heaps = path, Heaps(path)
        self._left, self._bytes = _MOST, _LARGEST_SUM
        self._objects: dict[int, dict[int, tuple[int, int]]] = {}
        self._header: tuple[int, dict[bytes, bytes]] = (-1, {})
        self.doubts: list[str] = []

    def attribute(self, item: Any, name: str) -> Any:
        """An attribute that is a text or an array of texts; None if it cannot be read."""
        kind = item.attrs.get_id(name)
        if not kind.get_type().is_variable_str():
            return None
        size = math.prod(kind.shape) * _PLACE

        def places(raw: BinaryIO, base: int) -> bytes:
            data = self._attributes(raw, base, item).get(name.encode("utf-8", "surrogateescape"))
            return (data or b"")[:size]  # what follows fills the message up

        return self._read(kind.shape, places, lambda: item.attrs[name])

    def dataset(self, dataset: Any) -> Any:
        """A dataset that is a text or an array of texts; None if it cannot be read."""
        if not dataset.id.get_type().is_variable_str():
            return None

        def places(raw: BinaryIO, base: int) -> bytes:
            at = dataset.id.get_offset()
            raw.seek(at or 0)
            return raw.read(dataset.size * _PLACE) if at else b""

        return self._read(dataset.shape, places, lambda: dataset[()])

    def _read(
        self,
        shape: tuple[int, ...],
        places: Callable[[BinaryIO, int], bytes],
        by_hdf5: Callable[[], Any],
    ) -> Any:
        """Texts by location; through HDF5 if the layout is unknown and all heaps are sound."""
        try:
            with self._path.open("rb") as raw:
                head = raw.read(4096)
                if not has_long_sizes(head):
                    raise _Unknown
                base = head.index(SIGNATURE)
                locations = places(raw, base)
                if len(locations) != math.prod(shape) * _PLACE:
                    raise _Unknown
                found = [
                    self._text(raw, base, *one) for one in struct.iter_unpack("<IQI", locations)
                ]
        except (_Unknown, OverflowError):
            try:
                if doubt := self._heaps.doubt:
                    raise ValueError(doubt) from None
                self._take(math.prod(shape), self._heaps.largest)
            except ValueError as error:
                return self._unread(str(error))
            return by_hdf5()
        except ValueError as error:
            return self._unread(str(error))
        texts = np.empty(len(found), object)
        texts[:] = found
        return texts.reshape(shape) if shape else texts[0]

    def _unread(self, doubt: str) -> None:
        if doubt not in self.doubts:
            self.doubts.append(doubt)

    def _take(self, count: int, length: int) -> None:
        """Reserve memory for texts of some length."""
        self._bytes -= count * (length + _STRING)
        if self._bytes < 0:
            raise ValueError(f"hold more than {_LARGEST_SUM >> 20} MiB of texts")

    def _text(self, raw: BinaryIO, base: int, length: int, heap: int, number: int) -> str:
        self._take(1, length)
        if not length:
            return ""
        if heap not in self._objects:
            self._objects[heap] = dict(self._in_heap(raw, base + heap))
        at, size = self._objects[heap].get(number, (0, 0))
        if length > _LARGEST_TEXT:
            raise ValueError(f"hold a text of {length} bytes, longer than is read")
        if length > size:
            raise ValueError(f"hold no text {number} of {length} bytes (heap at byte {heap})")
        raw.seek(at)
        return raw.read(length).decode("utf-8", "replace")

    def _count(self) -> None:
        self._left -= 1
        if self._left < 0:
            raise _Unknown

    def _in_heap(self, raw: BinaryIO, start: int) -> Iterator[tuple[int, tuple[int, int]]]:
        """Number, offset and size of the objects of a heap, as far as it is sound."""
        size = self._path.stat().st_size
        if start + 16 > size:
            return
        raw.seek(start)
        signature, announced = struct.unpack("<4s4xQ", raw.read(16))
        if signature != HEAP:
            return
        at, end = start + 16, min(start + announced, size)
        while at + 16 <= end:
            self._count()
            raw.seek(at)
            number, length = struct.unpack("<H6xQ", raw.read(16))
            if number == 0 or at + 16 + length > end:
                return
            yield number, (at + 16, length)
            at += 16 + length + -length % 8

    def _attributes(self, raw: BinaryIO, base: int, item: Any) -> dict[bytes, bytes]:
        """Raw data of the attributes in an object's header, by name."""
        import h5py

        address = h5py.h5o.get_info(item.id).addr
        if address != self._header[0]:
            found: dict[bytes, bytes] = {}
            for kind, flags, content in self._messages(raw, base, base + address):
                if kind == _ATTRIBUTE and not flags & _SHARED:
                    name, data = _named(content)
                    found[name] = b"" if name in found else data
            self._header = address, found
        return self._header[1]

    def _messages(self, raw: BinaryIO, base: int, at: int) -> Iterator[tuple[int, int, bytes]]:
        """Type, flags and content of the messages in an object's header, of either version."""
        raw.seek(at)
        head = raw.read(16).ljust(16, b"\0")
        if head[:5] == b"OHDR\2":
            flags = head[5]
            at += 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
            width = 1 << (flags & 3)
            raw.seek(at)
            blocks = [(at + width, int.from_bytes(raw.read(width), "little"))]
            layout, around = struct.Struct("<BHB" + ("2x" if flags & 0x04 else "")), 4
        elif head[0] == 1:
            blocks = [(at + 16, int.from_bytes(head[8:12], "little"))]
            layout, around = struct.Struct("<HHB3x"), 0
        else:
            raise _Unknown
        while blocks:
            at, size = blocks.pop(0)
            self._count()
            if not 0 <= size <= _LARGEST_BLOCK:
                raise _Unknown
            raw.seek(at)
            block, place = raw.read(size), 0
            while place + layout.size <= len(block):
                self._count()
                kind, length, flags = layout.unpack_from(block, place)
                place += layout.size + length
                content = block[place - length : place]
                yield kind, flags, content
                if kind == _CONTINUED and len(content) >= 16:
                    where, length = struct.unpack("<QQ", content[:16])
                    # Of the newer version: with a signature before it and a checksum behind.
                    blocks.append((base + where + around, length - 2 * around))


def _named(content: bytes) -> tuple[bytes, bytes]:
    """Name and data of an attribute message; no data if type or shape is stored elsewhere."""
    version, flags, *sizes = struct.unpack("<BBHHH", content[:8].ljust(8, b"\0"))
    if version == 1:
        sizes = [size + -size % 8 for size in sizes]
    start = 8 + (version == 3)
    name = content[start : start + sizes[0]].split(b"\0")[0]
    plain = version == 1 or (version in (2, 3) and not flags)
    return name, content[start + sum(sizes) :] if plain else b""
