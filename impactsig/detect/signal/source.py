"""Sources of samples: one channel of a recording, a file or blocks, in valid stretches."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..._arguments import choice
from ..._running.watched import progress
from ...errors import InvalidInput
from ...recording import Recording, Sensor, channel_index
from .stream import Piece, finite_runs

Gaps = Literal["refuse", "split"]


@dataclass
class Source:
    """One channel that can be read more than once."""

    blocks: Iterable[Recording]
    channel: str | int | None
    gaps: Gaps
    head: Recording  # that channel of the first block: rate, unit, sensor, where from
    in_memory: bool
    total: int | None  # samples, where known beforehand
    samples: int = 0  # samples gone through, gaps included
    spans: list[tuple[float, float]] = field(default_factory=list)  # gaps [s]
    runs: list[tuple[int, int]] = field(default_factory=list)  # of finite samples, of a block

    def pieces(self) -> Iterator[Piece]:
        """Stretches of finite samples; counts samples and gaps."""
        self.samples, self.spans = 0, []
        rate, start = self.head.rate, self.head.start
        expected = 0
        with progress(self.total, "S", leave=False) as advance:
            for block in self.blocks:
                if not isinstance(block, Recording):
                    kind = type(block).__name__
                    raise InvalidInput("source", f"a block of {kind}", "blocks of Recordings")
                x = _one_channel(block, self.channel)
                if block.rate != rate:
                    raise InvalidInput(
                        "source",
                        f"a block at {block.rate:g} Hz",
                        f"blocks at one rate ({rate:g} Hz)",
                    )
                chosen = 0 if self.channel is None else channel_index(block.channels, self.channel)
                if block.units[chosen] != self.head.unit:
                    raise InvalidInput(
                        "source",
                        f"a block in {block.units[chosen] or 'no unit'}",
                        f"blocks in one unit ({self.head.unit or 'none'})",
                    )
                first = round((block.start - start) * rate)
                if first != expected:
                    self._gap(expected, first, "no samples")
                # What is in memory is the same each time it is gone through.
                runs = self.runs if self.in_memory and self.runs else finite_runs(x)
                self.runs = runs
                edge = 0
                for a, b in runs:
                    if a > edge:
                        self._gap(first + edge, first + a, f"{x[edge]}")
                    yield Piece(first + a, x[a:b])
                    edge = b
                if edge < len(x):
                    self._gap(first + edge, first + len(x), f"{x[edge]}")
                expected = first + len(x)
                self.samples = expected
                advance(len(x))

    def _gap(self, first: int, last: int, what: str) -> None:
        t0 = self.head.start + first / self.head.rate
        t1 = self.head.start + last / self.head.rate
        if last < first:
            raise InvalidInput(
                "source",
                f"a block that begins at {t1:.9g} s, before {t0:.9g} s",
                "blocks in order of time that do not overlap",
            )
        if self.gaps == "refuse":
            raise InvalidInput(
                "samples",
                f"{what} at {t0:.9g} s",
                "finite samples without a gap",
                'Give gaps="split" (--gaps split) to go on around them; no interval is then taken '
                "across one",
            )
        if self.spans and self.spans[-1][1] == t0:
            t0 = self.spans.pop()[0]
        self.spans.append((t0, t1))


def open_source(
    source: Any, channel: str | int | None, sensor: Sensor | None, gaps: Gaps
) -> Source:
    """A Source from a Recording, a path, or blocks of Recordings.

    Raises
    ------
    InvalidInput
        If it is none of these, cannot be gone through twice, or has several channels and none
        was chosen.
    """
    choice("gaps", gaps, ("refuse", "split"))
    if isinstance(source, (str, Path)):
        from ...io import read_blocks

        source, channel = read_blocks(source, channel=channel, sensor=sensor), None
    in_memory = isinstance(source, Recording)
    blocks: Iterable[Recording]
    total: int | None
    if isinstance(source, np.ndarray):
        raise InvalidInput(
            "source",
            f"an array of shape {source.shape}",
            "a Recording, which has a sampling rate",
            "impactsig.Recording(samples, rate=50_000) makes one",
        )
    if isinstance(source, Recording):
        blocks, total = [source], len(source)
    elif isinstance(source, Iterable) and iter(source) is not source:
        blocks, total = source, getattr(source, "samples", None)
    else:
        raise InvalidInput(
            "source",
            type(source).__name__,
            "a Recording, a path, or blocks of Recordings that can be gone through twice",
            "Use impactsig.read_blocks, or a list instead of a generator",
        )
    head = next(iter(blocks), None)
    if not isinstance(head, Recording):
        kind = "no blocks" if head is None else f"blocks of {type(head).__name__}"
        raise InvalidInput("source", kind, "blocks of Recordings")
    _one_channel(head, channel)
    head = head.channel(0 if channel is None else channel)
    return Source(blocks, channel, gaps, head, in_memory, total)


def _one_channel(block: Recording, channel: str | int | None) -> np.ndarray:
    if channel is not None:
        block = block.channel(channel)
    if block.samples.ndim == 2:
        if block.samples.shape[1] > 1:
            raise no_channel_chosen(block.channels)
        block = block.channel(0)
    return np.ascontiguousarray(block.samples)


def no_channel_chosen(names: Sequence[str]) -> InvalidInput:
    """The error where a source has channels of these names and none was chosen."""
    listed = ", ".join(f"{i}: {name!r}" for i, name in enumerate(names))
    return InvalidInput(
        "channel", None, f"one of {listed}",
        "Impacts are detected in one channel: give channel= (--channel), or several where they are "
        "sensors of one machine",
    )  # fmt: skip
