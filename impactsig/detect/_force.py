"""Impacts in a force record: load cell, strain gauge, accelerometer.

Two passes over the record. The first surveys it: ranges of its blocks, its strongest frames and a
bounded, evenly spread choice of frames; from these follow the direction and typical width of the
pulses, the noise and the levels. The second looks for stretches where the matched response
exceeds the threshold, and measures the pulse in each. Nothing depends on how the record was cut
into blocks, and memory is bounded by the frames kept and 1/256 of the record for the ranges.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..impacts import CLIPPED
from ._force_kernels import (
    BLOCK,
    Matched,
    block_ranges,
    respond,
    scan,
    strongest_responses,
)
from ._pulse import NO_PULSE, measure_all, measure_reach
from ._stream import FRAME, Frame, Piece, frames

KEPT_SPREAD = 64  # frames kept for the noise level
KEPT_STRONG = 6  # frames kept for the width and the direction of the pulses
NOISE_RUNS = 32  # estimates of the noise
NOISE_RUN = 2048  # samples of one, or 32 widths of a pulse
AROUND = 1 << 14  # samples kept to either side of the steepest block of such a frame
WIDEST = 2048  # widest matched response [samples]
FALSE_ALARMS = 0.05  # expected in a record, were the noise Gaussian; or, if that is more,
FALSE_SHARE = 0.002  # of the impacts found
LEAST_SIGMA = 5.0
ROW = 8  # start, contact, peak, impulse, rise, flags, clipped, response
DOUBTFUL = 0.02  # of the strongest response: quiet stretches must be quieter than this
LEAST_SAMPLES = 32  # a shorter record shows no noise to tell an impact from
# The mean over w of a half-sine of length T is most above white noise (by sqrt(w)) at
# tan(x) = 2 x, x = pi w / (2 T) = 1.16556; it is then sin(x)/x of the peak.
HALF_SINE_GAIN = 1.16556 / math.sin(1.16556)
FLOOR = 0.005  # of the strongest response: the least automatic threshold


class Levels(NamedTuple):
    """Levels of the matched response [unit], and the noise of the samples [unit]."""

    threshold: float
    release: float
    noise: float
    matched_noise: float


@dataclass
class Survey:
    """What the first pass keeps of a record."""

    samples: int = 0
    segments: list[tuple[int, int]] = field(default_factory=list)  # first sample, length
    low: list[np.ndarray] = field(default_factory=list)  # one array of block ranges a segment
    high: list[np.ndarray] = field(default_factory=list)
    spread: list[np.ndarray] = field(default_factory=list)
    strong: list[tuple[np.ndarray, bool]] = field(default_factory=list)  # is it a whole segment?

    @property
    def lowest(self) -> float:
        """Least sample of the record."""
        return float(min(part.min() for part in self.low))

    @property
    def highest(self) -> float:
        """Greatest sample of the record."""
        return float(max(part.max() for part in self.high))


class ForceImpacts(NamedTuple):
    """Columns of the impacts found, times in samples since the start of the record."""

    columns: np.ndarray  # (n, 5): start, contact, peak, impulse, rise
    flags: np.ndarray
    levels: Levels
    matched: Matched
    strongest: float  # response in the strongest frames of the record


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
            search = _Search(record, frame.segment, matched, levels, contact_level, skip)
        assert search is not None
        found.append(search.feed(frame))
    rows = np.concatenate(found)
    rows = rows[rows[:, 5] != NO_PULSE]
    if given is None and matched_noise > 0:
        certain = discovery_level(rows[:, 7] / matched_noise, record.samples / matched.width)
        levels = levels._replace(threshold=max(level, certain * matched_noise))
        rows = rows[rows[:, 7] >= levels.threshold]
    rows = rows[_distinct(rows)]
    flags = rows[:, 5].astype(np.uint8) | (CLIPPED * rows[:, 6]).astype(np.uint8)
    return ForceImpacts(rows[:, :5], flags, levels, matched, strongest)


def discovery_level(responses: np.ndarray, widths: float) -> float:
    """Level, in sigma, above which hardly any of the `responses` is noise.

    The lowest at which Gaussian noise would exceed it FALSE_ALARMS times in the whole record, or
    once for 1/FALSE_SHARE of the impacts that do, on average [Benjamini1995]_. The mean of white
    noise over a sliding window has the covariance 1 - |lag| / width, for which excursions above
    u begin u^2 Q(u) times a width, Q being the upper tail [Aldous1989]_.
    """

    def expected(u: float) -> float:
        return widths * u * u * 0.5 * math.erfc(u / math.sqrt(2))

    lowest = LEAST_SIGMA
    while expected(lowest) > FALSE_ALARMS:
        lowest += 0.01
    for rank, u in enumerate(sorted(responses, reverse=True), start=1):
        if u < lowest and expected(u) <= FALSE_SHARE * rank:
            lowest = float(u)
    return lowest


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


def survey(stream: Iterable[Frame], copy: bool) -> Survey:
    """Keep the ranges of all blocks, the strongest frames, and every 2^k-th frame."""
    record = Survey()
    strongest: list[tuple[float, int, np.ndarray, bool]] = []
    stride = 1
    spread: list[tuple[int, np.ndarray]] = []
    low: list[np.ndarray] = []
    high: list[np.ndarray] = []
    for number, frame in enumerate(stream):
        x = frame.samples
        blocks = -(-len(x) // BLOCK)
        low.append(np.empty(blocks))
        high.append(np.empty(blocks))
        block_ranges(x, low[-1], high[-1])
        if number % stride == 0:
            spread.append((number, x.copy() if copy else x))
            if len(spread) > KEPT_SPREAD:
                stride *= 2
                spread = [item for item in spread if item[0] % stride == 0]
        # The range within a block tells a pulse from drift.
        extents = high[-1] - low[-1]
        steepest = int(np.argmax(extents))
        extent = float(extents[steepest])
        if len(strongest) < KEPT_STRONG or extent > strongest[0][0]:
            whole = frame.last and frame.offset == 0
            middle = steepest * BLOCK + BLOCK // 2
            part = x if whole else x[max(0, middle - AROUND) : middle + AROUND]
            # Ties are broken by the frame number, never by comparing arrays.
            item = (extent, -number, part.copy() if copy else part, whole)
            heapq.heappush(strongest, item)
            if len(strongest) > KEPT_STRONG:
                heapq.heappop(strongest)
        record.samples += len(x)
        if frame.last:
            record.segments.append((frame.segment, frame.offset + len(x)))
            record.low.append(np.concatenate(low))
            record.high.append(np.concatenate(high))
            low, high = [], []
    record.spread = [item[1] for item in spread]
    record.strong = [item[2:] for item in sorted(strongest, key=lambda item: -item[1])]
    return record


def matched_response(
    strong: list[tuple[np.ndarray, bool]], polarity: float
) -> tuple[Matched, float]:
    """Direction and width of the pulses, from the strongest of each frame; its response.

    The width is the one at which the response, in units of the noise that white noise would have
    there (1/sqrt(width)), is greatest; the median over frames.
    """
    up: list[tuple[float, int]] = []  # strength and width of each frame's strongest
    down: list[tuple[float, int]] = []
    lean = 0.0
    for x, whole in strong:
        octaves = [_matched(1.0, width) for width in _widths(len(x), steps=1)]
        extremes = np.empty((len(octaves), 4))
        strongest_responses(x, whole, np.array(octaves), extremes)
        for sign, column, best in ((1.0, 0, up), (-1.0, 2, down)):
            best.append(_best_width(x, sign, octaves, extremes[:, column : column + 2]))
        middle = shortest_half(x[:: max(1, len(x) // 2048)])[0]
        lean += float(x.max()) + float(x.min()) - 2.0 * middle
    both = [sum(item[0] for item in side) for side in (up, down)]
    sign = 1.0 if both[0] >= both[1] else -1.0
    # Close-set pulses have gaps as strong as themselves; the values lean away from their floor.
    if max(both) < 1.5 * min(both):
        sign = 1.0 if lean >= 0 else -1.0
    sign = polarity or sign
    chosen = up if sign > 0 else down
    # Frames in which nothing but noise was strongest must not set the width.
    loud = [item for item in chosen if item[0] >= 0.25 * max(chosen)[0]]
    width = int(np.median([item[1] for item in loud]))
    strongest = max(abs(_matched(sign, w).gain) * x / math.sqrt(w) for x, w in chosen)
    return _matched(sign, width), max(strongest, 0.0)


def _best_width(
    x: np.ndarray, sign: float, octaves: list[Matched], extremes: np.ndarray
) -> tuple[float, int]:
    """Strength and width of the strongest response, to a quarter of an octave."""
    strengths = [_strength(sign * row[0], m) for row, m in zip(extremes, octaves, strict=True)]
    octave = int(np.argmax(strengths))
    index = int(extremes[octave, 1])
    best = (strengths[octave], octaves[octave].width)
    for width in _widths(len(x), steps=4):
        if 0.5 <= width / octaves[octave].width <= 2:
            trial = _matched(sign, width)
            response = _respond_near(x, trial, index, width)
            best = max(best, (_strength(float(response.max()), trial), width))
    return best


def _strength(response: float, matched: Matched) -> float:
    return response / abs(matched.gain) * math.sqrt(matched.width)


def _matched(sign: float, width: int) -> Matched:
    near = width + (width + 1) // 2 + 1
    gain = sign * HALF_SINE_GAIN if width > 1 else sign
    return Matched(gain, width, near, near + 4 * width + 4)


def _widths(samples: int, steps: int) -> list[int]:
    """From 1 up, `steps` an octave, as wide as the samples allow."""
    widest = max(1, min(WIDEST, samples // 8))
    return sorted({round(2 ** (k / steps)) for k in range(int(steps * math.log2(widest)) + 1)})


def _respond_near(x: np.ndarray, matched: Matched, index: int, around: int) -> np.ndarray:
    """Matched response of x at the samples at most `around` from `index`."""
    first, last = max(0, index - around), min(len(x), index + around + 1)
    return _response(x, matched, first, last)


def _response(x: np.ndarray, matched: Matched, first: int, last: int) -> np.ndarray:
    y = np.empty(last - first)
    sums = np.empty(last - first + 2 * (matched.far + matched.width) + 1)
    respond(x, 0, len(x), first, last, matched, sums, y)
    return y


def noise_levels(
    spread: list[np.ndarray], matched: Matched, strongest: float
) -> tuple[float, float]:
    """Standard deviation of the noise: of the samples above their flanks, and of the response.

    Each run of samples gives one estimate, from the shortest interval that holds half of the
    values: right as long as pulses and their flanks fill less than half of the run. Where they
    fill more, the quietest stretches of the run tell, if they are quiet beyond doubt. The upper
    quartile of the runs is taken: a record silent for a part of the time is as noisy as the rest
    of it.
    """
    single = matched._replace(gain=1.0, width=1)
    estimates: list[tuple[float, float]] = []
    length = max(NOISE_RUN, 32 * matched.width)
    step = max(1, len(spread) // NOISE_RUNS)
    runs = max(1, NOISE_RUNS // len(spread))
    for x in spread[::step]:
        count = min(runs, max(1, len(x) // length))
        for k in range(count):
            first = len(x) * k // count
            last = min(len(x), first + length)
            raw = shortest_half(_response(x, single, first, last))[1]
            filtered = shortest_half(_response(x, matched, first, last))[1]
            quiet = _quiet_stretches(x[first:last], matched.width)
            if quiet < DOUBTFUL * strongest:
                # Noise of any colour: at worst averaging over a width does not reduce it.
                raw, filtered = min(raw, quiet), min(filtered, abs(matched.gain) * quiet)
            estimates.append((raw, filtered))
    raw, filtered = np.quantile(np.array(estimates), 0.75, axis=0, method="nearest")
    return float(raw), float(filtered)


def _quiet_stretches(x: np.ndarray, width: int) -> float:
    """1.5 times the standard deviation that 15 % of the stretches of a pulse's width stay below.

    The factor makes it no lower than sigma for white noise in stretches of eight samples.
    """
    length = max(min(width, len(x) // 20), 8)
    count = len(x) // length
    if count < 4:
        return math.inf
    deviations = x[: count * length].reshape(count, length).astype(np.float64).std(axis=1)
    return 1.5 * float(np.quantile(deviations, 0.15, method="nearest"))


def shortest_half(values: np.ndarray) -> tuple[float, float]:
    """Middle of the shortest interval that holds half of the values, and the Gaussian sigma of it.

    Rousseeuw & Leroy's shorth [Rousseeuw1988]_: for Gaussian values the interval is 1.349 sigma
    long.
    """
    ordered = np.sort(values)
    half = len(ordered) // 2 + 1
    lengths = ordered[half - 1 :] - ordered[: len(ordered) - half + 1]
    at = int(np.argmin(lengths))
    return float(ordered[at] + ordered[at + half - 1]) / 2, float(lengths[at]) / 1.3489795


class _Search:
    """The second pass over one segment."""

    def __init__(
        self,
        record: Survey,
        segment: int,
        matched: Matched,
        levels: Levels,
        contact_level: float,
        skip: bool,
    ) -> None:
        index = next(i for i, part in enumerate(record.segments) if part[0] == segment)
        self.segment, self.total = record.segments[index]
        self.low, self.high = record.low[index], record.high[index]
        self.matched, self.levels = matched, levels
        self.contact_level, self.skip = contact_level, skip
        self.limit = record.highest if matched.gain > 0 else -record.lowest
        self.reach = matched.far + matched.width
        self.unit = max(1024, 1 << (4 * self.reach - 1).bit_length())
        self.buffer = np.empty(0)
        self.origin = 0  # sample of the segment that buffer[0] is
        self.scanned = 0
        self.state = np.zeros(4)
        self.candidates = np.empty((0, 3))
        self.measured = 0

    def feed(self, frame: Frame) -> np.ndarray:
        """Take the next frame; return the rows of the impacts that are now complete."""
        self.buffer = (
            np.concatenate((self.buffer, frame.samples)) if len(self.buffer) else frame.samples
        )
        end = self.origin + len(self.buffer)
        ready = self.total if frame.last else (end - self.reach) // self.unit * self.unit
        if ready > self.scanned:
            out = np.empty(((ready - self.scanned) // 2 + 2, 3))
            found = scan(
                self.buffer,
                self.origin,
                self.total,
                self.scanned,
                ready,
                self.unit,
                self.matched,
                (self.levels.threshold, self.levels.release),
                self.low,
                self.high,
                self.skip,
                self.state,
                out,
            )
            self.candidates = np.concatenate((self.candidates, out[:found]))
            self.scanned = ready
        if frame.last and self.state[0]:
            last = self.state[[2, 3, 1]]
            self.candidates = np.concatenate((self.candidates, last[None]))
        complete = len(self.candidates)
        reach = measure_reach(self.matched.width)
        if not frame.last:
            # A neighbour may still turn up within reach, or be the one under way.
            horizon = min(self.scanned, self.state[2] if self.state[0] else math.inf) - reach - 1
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
                self.levels.noise,
                self.contact_level,
                self.limit,
                rows,
            )
            rows[:, 0] += self.segment
            rows[:, 7] = self.candidates[self.measured : complete, 2]
            self.measured = complete
        needed = self.scanned - self.reach
        if self.measured < len(self.candidates):
            needed = min(needed, int(self.candidates[self.measured, 0]) - reach)
        if self.state[0]:
            needed = min(needed, int(self.state[2]) - reach)
        keep = max(needed - self.origin, 0)
        self.buffer, self.origin = self.buffer[keep:], self.origin + keep
        return rows
