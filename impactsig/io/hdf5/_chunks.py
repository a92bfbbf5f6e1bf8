"""Check the chunks of an HDF5 dataset before the library reads them.

HDF5 up to 2.0 takes the checksum of a stored chunk from its last four bytes without asking whether
it has four: a stored size of 0 in the file ends the process. Of a chunk that is not compressed, it
fills what is missing with whatever stands in memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import UnreadableFile

_SHUFFLE, _FLETCHER32 = 2, 3
_CHECKSUM = 4  # bytes
_FEW = 16  # lookups of single chunks: each takes as long as it takes to count up to the chunk

Place = tuple[int, ...]


class Chunks:
    """The chunks of one dataset, if it is stored in chunks."""

    def __init__(self, path: Path, dataset: Any) -> None:
        self._path, self._dataset = path, dataset
        self._lookups = 0
        self._short: dict[Place, int] | None = None
        if dataset.chunks is not None:
            plan = dataset.id.get_create_plist()
            self._filters = [plan.get_filter(i)[0] for i in range(plan.get_nfilters())]
            shape = np.array(dataset.chunks, object)
            self._whole = int(shape.prod()) * dataset.id.get_type().get_size()

    def check(self, spans: Sequence[tuple[int, int]] | None = None) -> None:
        """Refuse the dataset if a chunk within the spans is stored in too few bytes.

        Parameters
        ----------
        spans : sequence of (int, int), optional
            What is to be read along each axis; by default all.

        Raises
        ------
        UnreadableFile
            If there is such a chunk.
        """
        extents, chunks = self._dataset.shape, self._dataset.chunks
        if chunks is None:
            return
        spans = spans or [(0, extent) for extent in extents]
        places = [
            range(first // chunk * chunk, last, chunk)
            for (first, last), chunk in zip(spans, chunks, strict=True)
        ]
        short = self._short_filtered if self._filters else self._short_plain
        for place, size, least in short(places):
            raise UnreadableFile(
                self._path,
                f"dataset {self._dataset.name!r} keeps the chunk at {place} in {size} bytes, and "
                f"it takes {least} at least",
                "It is corrupt",
            )

    def _short_filtered(self, places: list[range]) -> Iterator[tuple[Place, int, int]]:
        """Chunks that are too short, with their sizes and the least sizes."""
        # Only a chunk that may be too short fits in, and its bytes are copied but not unpacked.
        room = bytearray(self._whole + _CHECKSUM * self._filters.count(_FLETCHER32) - 1)
        for place in product(*places):
            try:
                skipped, stored = self._dataset.id.read_direct_chunk(place, out=room)
            except ValueError:  # it is longer
                continue
            except RuntimeError:  # it was never written
                continue
            applied = [f for i, f in enumerate(self._filters) if not skipped >> i & 1]
            if len(stored) < (least := _least(applied, self._whole)):
                yield place, len(stored), least

    def _short_plain(self, places: list[range]) -> Iterator[tuple[Place, int, int]]:
        """The same without filters, where the library itself does not check the stored sizes."""
        identifier = self._dataset.id
        self._lookups += int(np.prod([len(along) for along in places], dtype=object))
        if self._short is None and self._lookups <= _FEW:
            for place in product(*places):
                chunk = identifier.get_chunk_info_by_coord(place)
                if chunk.byte_offset is not None and chunk.size < self._whole:
                    yield place, chunk.size, self._whole
            return
        if self._short is None:
            found: dict[Place, int] = {}

            def look(chunk: Any) -> None:
                if chunk.size < self._whole:
                    found[tuple(chunk.chunk_offset)] = chunk.size

            identifier.chunk_iter(look)
            self._short = found
        for place, size in self._short.items():
            if all(at in along for at, along in zip(place, places, strict=True)):
                yield place, size, self._whole


def _least(filters: Sequence[int], whole: int) -> int:
    """Fewest bytes in which filters can store a chunk of `whole` bytes."""
    least = whole
    for number in filters:
        if number == _FLETCHER32:
            least += _CHECKSUM
        elif number != _SHUFFLE:
            least = 1  # it compresses
    return least
