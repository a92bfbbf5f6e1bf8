"""NumPy .npy: one array, mapped and not loaded, never unpickled."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from ...errors import UnreadableFile
from .._arrays import bytes_of, unusable
from .._limits import Limits
from .._source import Signal, Source, sample_type

NO_RATE = "A NumPy array carries no sampling rate"


class ArrayHeader(NamedTuple):
    """Header of an array in a file: its data begin at byte `offset`."""

    shape: tuple[int, ...]
    fortran: bool
    dtype: np.dtype
    offset: int

    @property
    def bytes(self) -> int:
        """Size of the data."""
        return bytes_of(self.shape, self.dtype)


def read_array_header(file: BinaryIO) -> ArrayHeader:
    """Read the header; leaves `file` at the data."""
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
    else:  # version 3 differs in the encoding of field names only
        shape, fortran, dtype = np.lib.format.read_array_header_2_0(file)
    if any(extent < 0 for extent in shape):
        raise ValueError(f"negative shape {shape}")
    return ArrayHeader(shape, fortran, dtype, file.tell())


def open_source(path: Path, limits: Limits) -> Source:
    """Open an array of shape (n,), (n, channels) or (channels, n); see `impactsig.io.formats`."""
    with path.open("rb") as file:
        header = read_array_header(file)
    if reason := unusable(header.shape, header.dtype):
        raise UnreadableFile(
            path, reason, "Save an array of shape (n,) or (n, channels) of numbers"
        )
    lacking = header.offset + header.bytes - path.stat().st_size
    shape, truncated = header.shape, ""
    if lacking > 0:
        rows = (header.bytes - lacking) // max(1, header.bytes // max(1, shape[0]))
        if header.fortran and len(shape) == 2:
            raise UnreadableFile(path, f"{lacking} of its {header.bytes} bytes are missing")
        truncated = f"{shape[0] - rows} of its {shape[0]} rows are missing"
        shape = (rows, *shape[1:])
    if 0 in shape:
        raise UnreadableFile(path, f"contains no samples (shape {shape})")
    order = "F" if header.fortran else "C"

    def mapped() -> np.ndarray:
        # Anew for each part: what has been read of a map stays in memory as long as the map does.
        samples: np.ndarray = np.memmap(path, header.dtype, "r", header.offset, shape, order)  # type: ignore[call-overload]
        if samples.ndim == 1:
            return samples[:, np.newaxis]
        # As its header says: of what is left of a file that is cut, either axis may be longer.
        return samples if header.shape[0] >= header.shape[1] else samples.T

    length, count = mapped().shape
    names = ("",) if count == 1 else tuple(f"channel {i}" for i in range(count))

    def read(channels: list[int], first: int, last: int) -> np.ndarray:
        part = mapped()[first:last]
        chosen = part if len(channels) == count else part[:, channels]
        return np.array(chosen, dtype=sample_type(header.dtype))

    return Source(
        format="NumPy npy",
        signals=tuple(Signal(name, "", None, length, no_rate=NO_RATE) for name in names),
        read=read,
        truncated=truncated,
    )
