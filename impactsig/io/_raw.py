"""Raw binary files: numbers without a header, in a layout that the user gives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from .._arguments import choice, instance
from ..errors import InvalidInput, UnreadableFile
from ._source import Signal, Source, sample_type


@dataclass(frozen=True)
class RawLayout:
    """Layout of the numbers in a file without a header.

    Parameters
    ----------
    dtype : str
        Type of one number, as NumPy names it: "int16", "uint8", "float32", ...
    channels : int, optional
        Number of channels, whose samples are interleaved.
    byte_order : {"little", "big"}, optional
        Byte order: least or most significant byte first.
    skip : int, optional
        Bytes before the first number.

    Raises
    ------
    InvalidInput
        If the type is not one of real numbers, or a count is invalid.

    See Also
    --------
    read, Limits

    Examples
    --------
    >>> from impactsig import RawLayout
    >>> RawLayout(">i2", channels=4).sample
    dtype('>i2')
    """

    dtype: str
    channels: int = 1
    byte_order: Literal["little", "big"] = "little"
    skip: int = 0

    def __post_init__(self) -> None:
        choice("raw.byte_order", self.byte_order, ("little", "big"))
        required = 'a type of real numbers, such as "int16" or "float32"'
        try:
            kind = np.dtype(self.dtype).kind
        except Exception:  # a value's own methods may raise anything
            raise InvalidInput("raw.dtype", self.dtype, required) from None
        if kind not in "biuf" or self.dtype is None:
            raise InvalidInput("raw.dtype", self.dtype, required)
        for name, value, least in (("channels", self.channels, 1), ("skip", self.skip, 0)):
            if not isinstance(value, (int, np.integer)) or value < least:
                raise InvalidInput(f"raw.{name}", value, f"a whole number, at least {least}")

    @property
    def sample(self) -> np.dtype:
        """NumPy type of one number, with its byte order."""
        given = np.dtype(self.dtype)
        # A type that names its own order, as ">i2" does, keeps it.
        named = str(self.dtype)[:1] in "<>"
        return given if named else given.newbyteorder(self.byte_order)


def open_source(path: Path, raw: RawLayout) -> Source:
    """Map a file of bare numbers; an incomplete last row is reported as missing."""
    instance("raw", raw, RawLayout, "a RawLayout", 'Give raw=impactsig.RawLayout("int16")')
    dtype = raw.sample
    row = dtype.itemsize * raw.channels
    size = path.stat().st_size - raw.skip
    rows, rest = divmod(size, row)
    if rows < 1:
        raise UnreadableFile(
            path,
            f"contains no row of {raw.channels} x {dtype} in the {max(0, size)} bytes after byte "
            f"{raw.skip}",
            "Check dtype, channels and skip",
        )
    count = int(raw.channels)
    names = ("",) if count == 1 else tuple(f"channel {i}" for i in range(count))
    no_rate = "Raw numbers carry no sampling rate"

    def read(channels: list[int], first: int, last: int) -> np.ndarray:
        # A map of this part alone: what has been read of a map stays in memory as long as it does.
        at = raw.skip + first * row
        part = np.memmap(path, dtype, "r", at, (last - first, count))
        chosen = part if len(channels) == count else part[:, channels]
        return np.array(chosen, dtype=sample_type(dtype))

    return Source(
        format="raw binary",
        signals=tuple(Signal(name, "", None, rows, no_rate=no_rate) for name in names),
        read=read,
        truncated=f"its last row has {rest} of {row} bytes" if rest else "",
    )
