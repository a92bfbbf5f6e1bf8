"""MATLAB 5 to 7.2 (save -v6, -v7): variables, and the fields of structs, as "struct.field"."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import UnreadableFile
from .._arrays import Array, Facts, along_time, source_of, unusable
from .._limits import Limits
from .._source import Source, sample_type
from ._mat5_elements import COMPRESSED, Elements, Leaf

_HEADER = 128
_PEEK = 1 << 16  # more than the names and sizes of one array take
_PIECE = 1 << 14  # packed bytes that are unpacked while they stay in the cache
_NO_RATE = "The file has no number named fs or dt beside these samples, and no array of times"


class _Packed(NamedTuple):
    """A compressed variable: offset, size, and size when unpacked."""

    start: int
    size: int
    unpacked: int


def open_source(path: Path, limits: Limits) -> Source:
    """Open a MATLAB file; see `impactsig.io.formats`.

    Variables that are not compressed are mapped; a compressed one is unpacked when it is read.
    """
    content = np.memmap(path, np.uint8, "r")
    order = ">" if bytes(content[126:128]) == b"MI" else "<"
    store = _Store(path, content, order, limits)
    facts, notes = Facts(path), []
    arrays: list[Array] = []
    for leaf, packed in store.leaves:
        shown = ".".join(leaf.place)
        if leaf.refused:
            notes.append(f"{shown!r} is left out: it {leaf.refused}")
        elif leaf.stored is None:
            if leaf.size < 4096:
                text = store.bytes(leaf, packed).tobytes().decode(leaf.encoding, "replace")
                facts.add(leaf.place[:-1], leaf.place[-1], text)
        elif leaf.shape == (1, 1):
            facts.add(leaf.place[:-1], leaf.place[-1], store.numbers(leaf, packed).item())
        elif reason := unusable(leaf.shape, leaf.dtype):
            notes.append(f"{shown!r} is left out: it {reason}")
        else:
            arrays.append(Array(leaf.place, leaf.shape, leaf.dtype, store.reader(leaf, packed)))
    if not arrays and store.truncated:
        raise UnreadableFile(path, f"holds no whole variable: {store.truncated}")
    return source_of(
        path,
        "MATLAB 5",
        arrays,
        facts,
        notes,
        separator=".",
        no_rate=_NO_RATE,
        in_memory=any(packed is not None for _, packed in store.leaves),
        truncated=store.truncated,
    )


def _inflate(raw: memoryview, content: np.ndarray) -> tuple[int, bool]:
    """Decompress into `content`: number of bytes, and whether the stream ended.

    In pieces that stay in the cache: zlib would gather the whole, and copy it then.
    """
    stream = zlib.decompressobj()
    count = 0
    for at in range(0, len(raw), _PIECE):
        rest: bytes | memoryview = raw[at : at + _PIECE]
        while len(rest) and not stream.eof:
            # At the end one byte more is asked for, so that the checksum is reached.
            part = stream.decompress(rest, min(16 * _PIECE, len(content) - count) or 1)
            if count + len(part) > len(content):
                return count, False
            content[count : count + len(part)] = np.frombuffer(part, np.uint8)
            count += len(part)
            rest = stream.unconsumed_tail
    return count, stream.eof and count == len(content)


class _Store:
    """The arrays of a file and their bytes."""

    def __init__(self, path: Path, content: np.ndarray, order: str, limits: Limits) -> None:
        self._path, self._content, self._order, self._limits = path, content, order, limits
        self._held: dict[int, np.ndarray] = {}
        self.truncated = ""
        self.leaves: list[tuple[Leaf, _Packed | None]] = []
        elements, at = Elements(content, len(content), order), _HEADER
        while at < len(content):
            try:
                tag = elements.tag(at, len(content))
            except ValueError as error:
                self.truncated = str(error)
                return
            if tag.kind == COMPRESSED:
                self._list_packed(tag.start, tag.size)
            else:
                self.leaves += [(leaf, None) for leaf in elements.matrix(tag)]
            at = tag.end

    def _list_packed(self, start: int, size: int) -> None:
        """List the arrays of a compressed variable, unpacking all of it only if it is nested."""
        raw = self._content[start : start + size].data
        head = zlib.decompressobj().decompress(raw[:_PEEK], _PEEK)
        unpacked = 8 + int(np.frombuffer(head, self._order + "u4", 2)[1])
        packed = _Packed(start, size, unpacked)
        elements = Elements(head, unpacked, self._order)
        try:
            found = list(elements.matrix(elements.tag(0, unpacked)))
        except ValueError:
            if len(head) >= unpacked:
                raise
            elements = Elements(self._unpacked(packed), unpacked, self._order)
            found = list(elements.matrix(elements.tag(0, unpacked)))
        self.leaves += [(leaf, packed) for leaf in found]

    def _unpacked(self, packed: _Packed) -> np.ndarray:
        """The bytes of a compressed variable, as many as it announces and no more."""
        if packed.start not in self._held:
            held = sum(len(other) for other in self._held.values())
            self._limits.check(self._path, held + packed.unpacked, at_once=True)
            content = np.empty(packed.unpacked, np.uint8)
            raw = self._content[packed.start : packed.start + packed.size].data
            count, whole = _inflate(raw, content)
            if not whole:
                raise UnreadableFile(
                    self._path,
                    f"the variable at byte {packed.start} unpacks to {count} bytes and "
                    f"announces {packed.unpacked}",
                    "It is cut short or corrupt",
                )
            self._held[packed.start] = content
        return self._held[packed.start]

    def bytes(self, leaf: Leaf, packed: _Packed | None) -> np.ndarray:
        """The data of an array or a text."""
        content = self._content if packed is None else self._unpacked(packed)
        return content[leaf.start : leaf.start + leaf.size]

    def numbers(self, leaf: Leaf, packed: _Packed | None) -> np.ndarray:
        """An array, in the type in which the file stores it."""
        return np.ndarray(leaf.shape, leaf.stored, self.bytes(leaf, packed), order="F")

    def reader(
        self, leaf: Leaf, packed: _Packed | None
    ) -> Callable[[list[int], int, int], np.ndarray]:
        """Reads samples of an array of two dimensions."""

        def read(columns: list[int], first: int, last: int) -> np.ndarray:
            samples = along_time(self.numbers(leaf, packed))
            whole = columns == list(range(samples.shape[1]))
            part = samples[first:last] if whole else samples[first:last, columns]
            # What is unpacked is in memory; a map of the file is not to outlive this.
            kind = sample_type(leaf.dtype)
            return np.array(part, kind) if packed is None else np.require(part, kind, "A")

        return read
