"""Layout of a TDMS channel in its file, so that a part can be read alone.

npTDMS reads a whole chunk to return any part of it, and a defragmented file is one chunk: going
through it in blocks would read all of it for every block. The positions come from what npTDMS
found in the headers, by names that are not public; where they, or plain numbers, are missing
(DAQmx raw data), `layout` returns None and npTDMS reads.
"""

from __future__ import annotations

from typing import Any, BinaryIO, NamedTuple

import numpy as np

_BIG_ENDIAN, _INTERLEAVED = 1 << 6, 1 << 5
_STEP = 1 << 18  # samples that are read and converted while they stay in the cache


class Layout(NamedTuple):
    """Runs of samples: run k holds samples ``starts[k]`` to ``starts[k + 1]`` of the channel.

    They begin at byte ``offsets[k]``, ``strides[k]`` bytes apart, most significant byte first where
    ``swapped[k]``. `scaling` turns them into the unit of the channel.
    """

    dtype: np.dtype
    scaling: Any
    starts: np.ndarray
    offsets: np.ndarray
    strides: np.ndarray
    swapped: np.ndarray

    def read(self, file: BinaryIO, first: int, samples: np.ndarray) -> None:
        """Read and scale samples from number `first` on into `samples`."""
        held = np.empty(min(len(samples), _STEP), self.dtype)
        for at in range(0, len(samples), _STEP):
            part = samples[at : at + _STEP]
            stored = held[: len(part)]
            self._fill(file, first + at, stored)
            part[:] = stored if self.scaling is None else self._scaled(stored)

    def _fill(self, file: BinaryIO, first: int, stored: np.ndarray) -> None:
        run = int(np.searchsorted(self.starts, first, side="right")) - 1
        done, size = 0, self.dtype.itemsize
        while done < len(stored):
            within = first + done - int(self.starts[run])
            count = min(int(self.starts[run + 1] - self.starts[run]) - within, len(stored) - done)
            part, stride = stored[done : done + count], int(self.strides[run])
            file.seek(int(self.offsets[run]) + within * stride)
            if stride == size:
                # Without a copy; arrays show their bytes only where they are not empty.
                if count and file.readinto(part.view(np.uint8)) < part.nbytes:  # type: ignore[attr-defined]
                    raise EOFError("the file has become shorter")
            else:
                raw = file.read((count - 1) * stride + size if count else 0)
                part[:] = np.ndarray((count,), self.dtype, raw, strides=(stride,))
            if self.swapped[run]:
                part.byteswap(inplace=True)
            done, run = done + count, run + 1

    def _scaled(self, stored: np.ndarray) -> np.ndarray:
        from nptdms.base_segment import RawChannelDataChunk

        return self.scaling.scale(RawChannelDataChunk.channel_data(stored))


def layout(tdms: Any, channel: Any, size: int) -> Layout | None:
    """Layout of a channel in a file of `size` bytes; None if npTDMS has to read it."""
    try:
        found = (_runs(segment, channel.path) for segment in tdms._reader._segments)
        runs = [run for run in found if run is not None]
        kinds = {run[0] for run in runs}
        scaling = channel._scaling
    except (AttributeError, TypeError, LookupError):
        return None
    if len(kinds) != 1 or None in kinds:
        return None
    dtype = np.dtype(kinds.pop())
    counts, offsets, strides, swapped = (
        np.concatenate([run[part] for run in runs]) for part in range(1, 5)
    )
    filled = counts > 0
    counts, offsets, strides = counts[filled], offsets[filled], strides[filled]
    ends = offsets + (counts - 1) * strides + dtype.itemsize
    if dtype.kind not in "biuf" or counts.sum() != len(channel) or ends.max(initial=0) > size:
        return None
    starts = np.concatenate(([0], np.cumsum(counts)))
    return Layout(dtype, scaling, starts, offsets, strides, swapped[filled])


def _runs(segment: Any, path: str) -> tuple[Any, ...] | None:
    """Type, counts, offsets, strides and byte order of a channel's runs in one segment."""
    described = segment.get_segment_object(path)
    if described is None or not described.has_data or not segment.num_chunks:
        return None
    if segment._have_daqmx_objects():
        raise TypeError("DAQmx raw data")
    objects = [o for o in segment.ordered_objects if o.has_data]
    before = objects[: objects.index(described)]
    chunks = int(segment.num_chunks)
    counts = np.full(chunks, described.number_values, np.int64)
    base = segment.data_position + np.arange(chunks, dtype=np.int64) * segment._get_chunk_size()
    override = segment.final_chunk_lengths_override
    if override is not None:
        counts[-1] = override.get(path, 0)
    if segment.toc_mask & _INTERLEAVED:
        offsets = base + sum(o.data_type.size for o in before)
        stride = sum(o.data_type.size for o in objects)
    else:
        offsets = base + sum(o.data_size for o in before)
        stride = described.data_type.size
        if override is not None:
            offsets[-1] = base[-1] + sum(o.data_type.size * override.get(o.path, 0) for o in before)
    swapped = np.full(chunks, bool(segment.toc_mask & _BIG_ENDIAN))
    return described.data_type.nptype, counts, offsets, np.full(chunks, stride, np.int64), swapped
