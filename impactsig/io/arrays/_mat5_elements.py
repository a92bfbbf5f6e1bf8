"""The elements of a MATLAB 5 file; every tag is validated before its data are read.

A file is a row of elements, each a type, a size and that many bytes; an array is an element of
elements (MathWorks, "MAT-File Format"). scipy reads them too, but an element of a type that is not
defined ends its process.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from .._arrays import Place, bytes_of

MATRIX, COMPRESSED = 14, 15
_NUMBERS = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
_TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE = 1, 2, 3, 4, 5
_CLASSES = dict(enumerate(["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"], 6))
_COMPLEX = 0x0800
_DEEPEST, _MOST = 32, 10_000


class Tag(NamedTuple):
    """An element: type, offset and size of its data, and its end."""

    kind: int
    start: int
    size: int
    end: int


class Leaf(NamedTuple):
    """An array of numbers or a text, with the place of its data.

    `dtype` is the type that MATLAB shows and `stored` that of the file, None for a text. `refused`
    says why it cannot be read, where it cannot.
    """

    place: Place
    shape: tuple[int, ...]
    dtype: np.dtype
    stored: np.dtype | None
    start: int
    size: int
    encoding: str = ""
    refused: str = ""


class Elements:
    """Elements in a buffer; incomplete ones at its end are kept for later data.

    Parameters
    ----------
    content : buffer
        Bytes.
    size : int
        How many there would be, were the buffer whole.
    order : {"<", ">"}
        Byte order.
    """

    def __init__(self, content: Any, size: int, order: str) -> None:
        self._content, self.size, self._order = content, size, order
        self._found = 0

    def tag(self, at: int, end: int) -> Tag:
        """The element at byte `at` of a container that ends at byte `end`.

        Raises
        ------
        ValueError
            If it does not end there too.
        """
        if at + 8 > min(end, len(self._content)):
            raise ValueError(f"an element is cut off at byte {at}")
        kind, size = (int(x) for x in np.frombuffer(self._content, self._order + "u4", 2, at))
        if kind >> 16:
            kind, size, start, stop = kind & 0xFFFF, kind >> 16, at + 4, at + 8
            if size > 4:
                raise ValueError(f"a small element of {size} bytes at byte {at}")
        else:
            start, stop = at + 8, at + 8 + size
            if kind != COMPRESSED:
                stop += -size % 8
        if start + size > end:
            raise ValueError(
                f"the element at byte {at} announces {size} bytes where {end - start} are left"
            )
        return Tag(kind, start, size, min(stop, end))

    def bytes(self, tag: Tag) -> bytes:
        """The data of a small element."""
        if tag.size > 1 << 20 or tag.start + tag.size > len(self._content):
            raise ValueError(f"an element of {tag.size} bytes at byte {tag.start} is out of place")
        return bytes(self._content[tag.start : tag.start + tag.size])

    def integers(self, tag: Tag) -> list[int]:
        """The data of an element of 32-bit integers."""
        if tag.kind not in (5, 6) or tag.size % 4:
            raise ValueError(f"type {tag.kind} where integers belong, at byte {tag.start}")
        return np.frombuffer(self.bytes(tag), f"{self._order}i4").tolist()

    def matrix(self, tag: Tag, above: Place = (), name: str = "", depth: int = 0) -> Iterator[Leaf]:
        """The arrays and texts in an array, which may be a struct or a cell of arrays."""
        self._found += 1
        if tag.kind != MATRIX:
            raise ValueError(f"type {tag.kind} where an array belongs, at byte {tag.start}")
        if depth > _DEEPEST or self._found > _MOST:
            raise ValueError(f"arrays more than {_DEEPEST} deep, or more than {_MOST}")
        end = tag.start + tag.size
        if not tag.size:
            return
        part = self.tag(tag.start, end)
        flags = self.integers(part)[0]
        part = self.tag(part.end, end)
        shape = tuple(self.integers(part))
        if not 1 < len(shape) <= 32 or min(shape) < 0:
            raise ValueError(f"an array of shape {shape} at byte {part.start}")
        part = self.tag(part.end, end)
        place = (*above, name or self.bytes(part).decode("latin-1"))
        array_class = flags & 0xFF
        if array_class in _CLASSES:
            yield self._numbers(place, shape, np.dtype(_CLASSES[array_class]), flags, part.end, end)
        elif array_class == _CHAR:
            part = self.tag(part.end, end)
            if part.kind not in _TEXTS:
                raise ValueError(f"type {part.kind} where a text belongs, at byte {part.start}")
            encoding = _TEXTS[part.kind]
            if encoding.startswith("utf-") and encoding != "utf-8":
                encoding += "-le" if self._order == "<" else "-be"
            yield Leaf(place, shape, np.dtype("S1"), None, part.start, part.size, encoding)
        elif array_class in (_CELL, _STRUCT, _OBJECT):
            yield from self._nested(place, shape, array_class, part.end, end, depth + 1)
        else:
            what = (
                "is sparse"
                if array_class == _SPARSE
                else f"is of a kind without numbers ({array_class})"
            )
            yield Leaf(place, shape, np.dtype("V1"), None, 0, 0, refused=what)

    def _numbers(
        self, place: Place, shape: tuple[int, ...], dtype: np.dtype, flags: int, at: int, end: int
    ) -> Leaf:
        part = self.tag(at, end)
        if part.kind not in _NUMBERS:
            raise ValueError(f"type {part.kind} where numbers belong, at byte {at}")
        stored = np.dtype(self._order + _NUMBERS[part.kind])
        if bytes_of(shape, stored) != part.size:
            raise ValueError(
                f"{'.'.join(place)} of shape {shape} has {part.size} bytes of {stored} at byte {at}"
            )
        refused = "holds complex numbers" if flags & _COMPLEX else ""
        return Leaf(place, shape, dtype, stored, part.start, part.size, refused=refused)

    def _nested(
        self, place: Place, shape: tuple[int, ...], array_class: int, at: int, end: int, depth: int
    ) -> Iterator[Leaf]:
        """The fields of a struct, or the arrays of a cell."""
        count = bytes_of(shape, np.dtype("u1"))
        if array_class == _CELL:
            for number in range(count):
                part = self.tag(at, end)
                yield from self.matrix(part, place[:-1], f"{place[-1]}{{{number + 1}}}", depth)
                at = part.end
            return
        if array_class == _OBJECT:
            at = self.tag(at, end).end  # the name of its class
        part = self.tag(at, end)
        (width,) = self.integers(part)
        part = self.tag(part.end, end)
        names = self.bytes(part)
        if not 0 < width <= 4096 or len(names) % width:
            raise ValueError(f"field names of {width} bytes in {len(names)} at byte {part.start}")
        starts = range(0, len(names), width)
        fields = [names[i : i + width].split(b"\0")[0].decode("latin-1") for i in starts]
        at = part.end
        for number in range(count if fields else 0):
            folder = place if count == 1 else (*place[:-1], f"{place[-1]}({number + 1})")
            for field in fields:
                part = self.tag(at, end)
                yield from self.matrix(part, folder, field or "?", depth)
                at = part.end
