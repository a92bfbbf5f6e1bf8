"""Impacts in a force record: load cell, strain gauge, accelerometer.

Two passes over the record. The first surveys it: ranges of its blocks, its strongest frames and a
bounded, evenly spread choice of frames; from these follow the direction and typical width of the
pulses, the noise and the levels. The second looks for stretches where the matched response
exceeds the threshold, and measures the pulse in each. Nothing depends on how the record was cut
into blocks, and memory is bounded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from ._force_kernels import Matched, scan
from ._levels import LEAST_SIGMA, Levels, discovery_level, matched_response, noise_levels
from ._pulse import NO_PULSE, measure_all, measure_reach
from ._stream import FRAME, Frame, Piece, frames, refuse_huge
from ._survey import Survey, survey

LEAST_SAMPLES = 32  # a shorter record shows no noise to tell an impact from
FLOOR = 0.005  # of the strongest response: the least automatic threshold
ROW = 8  # start, contact, peak, impulse, rise, flags, response, noise of it


class ForceImpacts(NamedTuple):
    """Columns of the impacts found, times in samples since the start of the record."""

    columns: np.ndarray  # (n, 5): start, contact, peak, impulse, rise
    flags: np.ndarray
    levels: Levels
    matched: Matched
    strongest: float  # response in the strongest frames of the record, at the best of all widths
    reached: float  # greatest response of a stretch that was measured, pulse or not; 0 if none was


def detect_force(
    pieces: Callable[[], Iterable[Piece]],
    *,
    threshold: Callable[[float], float | None],
    polarity: float,
    contact_level: float,
    in_memory: bool,
    skip: bool,
) -> ForceImpacts | None:
    """Find and measure the impacts; None if the record is constant or too short.

    Parameters
    ----------
    pieces : callable
        Gives the record's stretches of finite samples, anew at each call.
    threshold : callable
        From the noise of the matched response, the threshold to use; None for the automatic one.
    polarity : {1.0, -1.0, 0.0}
        Direction of the pulses; 0 takes that of the strongest.
    contact_level : float
        Level above the baseline the contact time refers to; 0 is the touch.
    in_memory : bool
        The pieces are views that stay valid: no frame needs to be copied.
    skip : bool
        Pass over stretches that cannot hold an impact.
    """
    record = survey(frames(pieces()), copy=not in_memory)
    if record.samples < LEAST_SAMPLES or record.lowest == record.highest:
        return None
    refuse_huge(record.lowest, record.highest)
    matched, strongest = matched_response(record.strong, polarity)
    noise, matched_noise = noise_levels(record.spread, matched, strongest)
    automatic = max(LEAST_SIGMA * matched_noise, FLOOR * strongest)
    given = threshold(matched_noise)
    level = automatic if given is None else given
    levels = Levels(level, 0.5 * level, noise, matched_noise)
    found = [np.empty((0, ROW))]
    size = max(length for _, length in record.segments) if in_memory else 16 * FRAME
    search: _Search | None = None
    for frame in frames(pieces(), size):
        if frame.offset == 0:
            search = _Search(
                record, frame.segment, matched, levels, given is None, contact_level, skip
            )
        assert search is not None
        found.append(search.feed(frame))
    rows = np.concatenate(found)
    reached = float(np.max(rows[:, 6], initial=0.0))
    rows = rows[rows[:, 5] != NO_PULSE]
    if given is None:
        # Where there is no noise at all, every response is certain.
        sigmas = np.full(len(rows), np.inf)
        np.divide(rows[:, 6], rows[:, 7], out=sigmas, where=rows[:, 7] > 0)
        certain = discovery_level(sigmas, record.samples / matched.width)
        rows = rows[sigmas >= certain]
        levels = levels._replace(threshold=max(level, certain * matched_noise))
    rows = rows[_distinct(rows)]
    return ForceImpacts(
        rows[:, :5], rows[:, 5].astype(np.uint8), levels, matched, strongest, reached
    )


def _distinct(columns: np.ndarray) -> np.ndarray:
    """Indices, in order of time, of the pulses that do not lie on a pulse already there.

    The response of one pulse may cross the threshold twice; the greater of two pulses that share
    more than half of the first's contact is kept.
    """
    order = np.argsort(columns[:, 0], kind="stable")
    start, contact, peak = columns[order, :3].T
    if not np.any(start[1:] < start[:-1] + 0.5 * contact[:-1]):
        return order
    kept: list[int] = []
    for k in range(len(order)):
        if kept and start[k] < start[kept[-1]] + 0.5 * contact[kept[-1]]:
            if peak[k] > peak[kept[-1]]:
                kept[-1] = k
        else:
            kept.append(k)
    return order[kept]


class _Search:
    """The second pass over one segment."""

    def __init__(
        self,
        record: Survey,
        segment: int,
        matched: Matched,
        levels: Levels,
        adaptive: bool,
        contact_level: float,
        skip: bool,
    ) -> None:
        index = next(i for i, part in enumerate(record.segments) if part[0] == segment)
        self.segment, self.total = record.segments[index]
        self.low, self.high = record.low[index], record.high[index]
        self.matched = matched
        self.limits = (
            levels.threshold,
            levels.release,
            levels.noise,
            levels.matched_noise,
            LEAST_SIGMA if adaptive else 0.0,
        )
        self.contact_level, self.skip = contact_level, skip
        self.limit = record.highest if matched.gain > 0 else -record.lowest
        # Long against the reach of the response, which is summed anew for each unit.
        self.unit = max(1024, 1 << (4 * (matched.far + matched.width) - 1).bit_length())
        self.buffer = np.empty(0)
        self.origin = 0  # sample of the segment that buffer[0] is
        self.scanned = 0
        self.state = np.zeros(6)
        self.candidates = np.empty((0, 5))
        self.measured = 0

    def feed(self, frame: Frame) -> np.ndarray:
        """Take the next frame; return the rows of the impacts that are now complete."""
        self.buffer = (
            np.concatenate((self.buffer, frame.samples)) if len(self.buffer) else frame.samples
        )
        end = self.origin + len(self.buffer)
        # The noise of the unit after the last one searched is looked at as well.
        ready = self.total if frame.last else (end - self.unit) // self.unit * self.unit
        if ready > self.scanned:
            out = np.empty(((ready - self.scanned) // 2 + 2, 5))
            found = scan(
                self.buffer,
                self.origin,
                self.total,
                self.scanned,
                ready,
                self.unit,
                self.matched,
                self.limits,
                self.low,
                self.high,
                self.skip,
                self.state,
                out,
            )
            self.candidates = np.concatenate((self.candidates, out[:found]))
            self.scanned = ready
        if frame.last and self.state[0]:
            self.candidates = np.concatenate((self.candidates, self.state[None, 1:]))
        complete = len(self.candidates)
        reach = measure_reach(self.matched.width)
        if not frame.last:
            # A neighbour may still turn up within reach, or be the one under way.
            horizon = min(self.scanned, self.state[1] if self.state[0] else math.inf) - reach - 1
            complete = int(np.searchsorted(self.candidates[:, 0], horizon))
        rows = np.empty((max(complete - self.measured, 0), ROW))
        if len(rows):
            measure_all(
                self.buffer,
                self.origin,
                self.total,
                self.candidates,
                (self.measured, complete),
                math.copysign(1.0, self.matched.gain),
                self.matched.width,
                self.contact_level,
                self.limit,
                rows,
            )
            rows[:, 0] += self.segment
            rows[:, 6:] = self.candidates[self.measured : complete][:, [2, 4]]
            self.measured = complete
        needed = self.scanned - self.unit
        if self.measured < len(self.candidates):
            needed = min(needed, int(self.candidates[self.measured, 0]) - reach)
        if self.state[0]:
            needed = min(needed, int(self.state[1]) - reach)
        keep = max(needed - self.origin, 0)
        self.buffer, self.origin = self.buffer[keep:], self.origin + keep
        return rows
