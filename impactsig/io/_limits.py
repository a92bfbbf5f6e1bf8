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
    """Limits on the memory that a compressed file, or one that announces its size, may take.

    Files whose samples stand in them as they are need no limit, nor do blocks that keep below it.

    Parameters
    ----------
    size : int, optional
        Bytes in memory.
    expansion : float, optional
        Bytes in memory for each byte of the file. What grows to less than 64 MiB passes.

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
        """Refuse a file that would need `size` bytes.

        Parameters
        ----------
        path : pathlib.Path
            The file.
        size : int
            Bytes that are about to be taken.
        at_once : bool, optional
            It is packed as a whole, so that to read less of it would help nothing.

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
