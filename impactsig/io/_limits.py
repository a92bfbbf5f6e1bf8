"""Limits on the memory that the samples of a file may take."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .._arguments import number
from ..errors import UnreadableFile

HARMLESS = 64 << 20
"""Bytes that a file may grow to whatever its own size: a short silence packs well."""


@dataclass(frozen=True)
class Limits:
    """Limits on the memory that reading a file may take.

    They apply to compressed files, and to files that state their own size. Uncompressed samples,
    and blocks below the limit, are not limited.

    Parameters
    ----------
    size : int, optional
        Bytes in memory.
    expansion : float, optional
        Bytes in memory per byte of the file. Less than 64 MiB is always allowed.

    Raises
    ------
    InvalidInput
        If one of them is not positive.

    See Also
    --------
    read, info

    Examples
    --------
    >>> from impactsig import Limits, read
    >>> recording = read("data_samples/loadcell_periodic_22.1Hz.wav", limits=Limits(size=10**7))
    """

    size: int = 2 << 30
    expansion: float = 200.0

    def __post_init__(self) -> None:
        for name, value in (("size", self.size), ("expansion", self.expansion)):
            number(f"limits.{name}", value, "a positive number", above=0)

    def check(self, path: Path, size: int, *, at_once: bool = False) -> None:
        """Raise an error if a file would need more memory than allowed.

        Parameters
        ----------
        path : pathlib.Path
            The file.
        size : int
            Bytes that will be allocated.
        at_once : bool, optional
            Whether the file is compressed as a whole, so that reading a part of it takes as much
            memory.

        Raises
        ------
        UnreadableFile
            If that is more than the limits allow.
        """
        way = "Choose a part with start and stop, go through it with read_blocks, or raise "
        way = "If you trust it, raise " if at_once else way
        if size > self.size:
            raise UnreadableFile(
                path,
                f"would grow to {size / 1e9:.3g} GB in memory (limit {self.size / 1e9:.3g} GB)",
                f"{way}limits=Limits(size=...)",
            )
        packed = path.stat().st_size
        if size > max(HARMLESS, self.expansion * packed):
            raise UnreadableFile(
                path,
                f"would grow from {packed} bytes to {size / 1e9:.3g} GB in memory "
                f"(limit {self.expansion:g} times its size)",
                f"{way}limits=Limits(expansion=...)",
            )


DEFAULT_LIMITS = Limits()
