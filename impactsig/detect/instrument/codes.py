"""Error codes: one value far from all others, such as -9999, that stands for missing samples.

A glitch is told from an impact by being rare. Codes may be as frequent as impacts; they are told by
being equal to the last bit, and by the empty range between them and all other samples. Pulses that
reach the limit of an instrument have samples within that range.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from ...impacts import Disturbance
from ..signal.stream import Piece
from .survey import Survey

FEWEST = 3
"""Blocks of the survey that have a code: so many equal glitches are no coincidence."""
FAR = 8.0
"""Times the range of all other samples: how far a code is from them."""


def find_codes(record: Survey, pieces: Iterable[Piece]) -> tuple[float, ...]:
    """Error codes in a record; the pieces are gone through only if there may be some."""
    ends = ((record.lowest, record.at_lowest), (record.highest, record.at_highest))
    codes = tuple(value for value, blocks in ends if blocks >= FEWEST)
    strong = (x for x, _ in record.frames)
    if codes and (codes := _far_from(codes, strong)):
        codes = _far_from(codes, (samples for _, samples in pieces))
    return codes


def _far_from(codes: tuple[float, ...], parts: Iterable[np.ndarray]) -> tuple[float, ...]:
    """Those of the values that are far from all others."""
    least, greatest = math.inf, -math.inf
    for x in parts:
        others = x[~np.isin(x, codes)]
        if len(others):
            least, greatest = min(least, others.min()), max(greatest, others.max())
    if least > greatest:
        return ()  # as of a switch
    far = FAR * (greatest - least)
    return tuple(one for one in codes if least - one > far or one - greatest > far)


def without_codes(
    pieces: Iterable[Piece], codes: tuple[float, ...], runs: list[Disturbance]
) -> Iterator[Piece]:
    """The pieces with the nearest sample in place of codes; `runs` is filled with their places."""
    runs.clear()
    before: float | None = None  # last sample that is no code, if the next piece follows it
    held, start = np.empty(0), 0  # codes at the end of the piece before
    for first, samples in pieces:
        if first != start + len(held):
            if len(held):
                yield _filled(start, held, np.ones(len(held), bool), before, runs)
            before, held, start = None, held[:0], first
        x = np.concatenate((held, samples)) if len(held) else samples
        coded = np.isin(x, codes)
        valid = np.flatnonzero(~coded)
        end = int(valid[-1]) + 1 if len(valid) else 0
        if end:
            yield _filled(start, x[:end], coded[:end], before, runs)
            before = float(x[end - 1])
        held, start = x[end:], start + end
    if len(held):
        yield _filled(start, held, np.ones(len(held), bool), before, runs)


def _filled(
    start: int,
    x: np.ndarray,
    coded: np.ndarray,
    before: float | None,
    runs: list[Disturbance],
) -> Piece:
    """A piece with its codes filled; `before` is the sample before it."""
    if coded.any():
        edges = np.flatnonzero(np.diff(coded, prepend=False, append=False))
        runs += [
            Disturbance("code", float(start + a), float(b - a), float(x[a]))
            for a, b in edges.reshape(-1, 2)
        ]
        at, known = np.flatnonzero(~coded), x[~coded]
        if before is not None:
            at, known = np.append(-1, at), np.append(before, known)
        if len(at):
            x = x.astype(float)
            # Values between those of a coarse converter would hide its step.
            nearest = np.interp(np.flatnonzero(coded), at, np.arange(len(at)))
            x[coded] = known[np.ceil(nearest - 0.5).astype(int)]
    return Piece(start, x)
