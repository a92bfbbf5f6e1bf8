"""MATLAB 5 to 7.2 (save -v6, -v7): variables, and the fields of structs, as "struct.field"."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import UnreadableFile
from ._arrays import Array, Facts, along_time, source_of, unusable
from ._limits import Limits
from ._mat5_elements import COMPRESSED, Elements, Leaf
from ._source import Source

_HEADER = 128
_PEEK = 1 << 16  # more than the names and sizes of one array take
_NO_RATE = "The file has no number named fs or dt beside these samples, and no array of times"


class _Packed(NamedTuple):
    """A compressed variable: where its bytes stand, and how many they unpack to."""

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


class _Store:
    """The arrays of a file, and their bytes."""

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
            stream = zlib.decompressobj()
            raw = self._content[packed.start : packed.start + packed.size].data
            content = stream.decompress(raw, packed.unpacked)
            stream.decompress(stream.unconsumed_tail, 1)  # as far as its checksum
            if len(content) < packed.unpacked or not stream.eof:
                raise UnreadableFile(
                    self._path,
                    f"the variable at byte {packed.start} unpacks to {len(content)} bytes and "
                    f"announces {packed.unpacked}",
                    "It is cut short or corrupt",
                )
            self._held[packed.start] = np.frombuffer(content, np.uint8)
        return self._held[packed.start]

    def bytes(self, leaf: Leaf, packed: _Packed | None) -> np.ndarray:
        """The data of an array or a text."""
        content = self._content if packed is None else self._unpacked(packed)
        return content[leaf.start : leaf.start + leaf.size]

    def numbers(self, leaf: Leaf, packed: _Packed | None) -> np.ndarray:
        """An array, in the type that the file keeps it in."""
        return np.ndarray(leaf.shape, leaf.stored, self.bytes(leaf, packed), order="F")

    def reader(
        self, leaf: Leaf, packed: _Packed | None
    ) -> Callable[[list[int], int, int], np.ndarray]:
        """Reads samples of an array of two dimensions."""

        def read(columns: list[int], first: int, last: int) -> np.ndarray:
            samples = along_time(self.numbers(leaf, packed))
            whole = columns == list(range(samples.shape[1]))
            return np.array(samples[first:last] if whole else samples[first:last, columns])

        return read
