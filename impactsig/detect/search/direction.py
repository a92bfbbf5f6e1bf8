"""Polarity of the pulses of a force record."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np

from ..instrument.survey import KEPT, Survey
from ..signal.grid import Grid
from ..signal.ladder import MATCH
from ..signal.order_kernels import centre_of
from .events.width_kernels import EVENT
from .judging import LEAST_SAMPLES
from .span import NO_EVENTS
from .spans import LEAST, Spans

FIRST, AGREED, MANY = 2, 0.7, 10
"""Steepest stretches that are looked at first; the lead, and the clear events in it, that make it
needless to look at the others."""
HUMS = 2
"""Frames that are looked at for hum. Where there is some, they show the direction: the first alone,
unless that is in doubt."""
AT = np.eye(1, EVENT)[0]
"""The place of an event among what is known of it."""
CELL = 1 << 12
"""Samples whose events have one vote, so that a burst or a spike outweighs no train of pulses."""
USUAL, FURTHER = 0.5, 2.0
"""Share and number of these that have less energy than what counts no more, however loud."""
UNCLEAR = 0.5
"""Lead, as a share of the squares of the heights of events, that longer stretches may turn."""
FEW = 5
"""Clear events: fewer may be steps of the baseline, and longer stretches are looked at."""
SINGLE = 0.25
"""Share of the votes from which on single samples, perhaps glitches, make the lead doubtful."""
CHANCE = 3.0
"""Standard deviations of the lead that chance gives, from which single samples are left out."""
UNDECIDED = 0.2
"""Lead that does not decide on the direction."""


def direction(record: Survey, grid: Grid, scale: float, constant: float) -> tuple[float, bool]:
    """Polarity of the pulses, by a vote of the events in the steepest stretches.

    What is recorded behind an AC coupling of that time constant [samples] swings either way. Hum
    does so too, and a short stretch does not show it.

    Returns
    -------
    (1 or -1, whether many events point the other way)
    """
    frames, strong = [x for x, _ in record.frames], record.strong

    def votes(parts: list[np.ndarray], *counts: int) -> Iterator[_Vote]:
        """Those of the first few stretches, then of more."""
        searched: list[_Searched] = []
        for count in counts:
            searched += [_search(x, grid, scale, constant) for x in parts[len(searched) : count]]
            yield _count(searched)

    if any(_hums(x, scale, grid) for x in frames[:HUMS]):
        turns = votes(frames, 1, HUMS, KEPT)
    else:
        turns = chain(votes(strong, FIRST, KEPT), votes(frames, KEPT))
        found = next(turns)
        if abs(found.lead) > AGREED and found.clear >= MANY and found.single <= SINGLE:
            return math.copysign(1.0, found.lead), False
    for found in turns:
        if not found.doubtful:
            break
    if found.doubtful:
        # Single samples that stand high hide what is lower, unless impacts are such themselves.
        again = next(votes([_median_of_three(x) for x in frames], KEPT))
        clear = abs(again.lead) > UNCLEAR and again.clear >= FEW
        if clear or abs(again.lead) > min(CHANCE / math.sqrt(again.votes), abs(found.lead)):
            found = again
    # Close-set pulses have gaps as strong as themselves; the values lean away from their floor.
    lead = found.lead if abs(found.lead) > UNDECIDED else found.lead + found.lean
    return math.copysign(1.0, lead), abs(found.lead) <= UNCLEAR and found.clear >= FEW


class _Vote(NamedTuple):
    """Votes of the events of stretches."""

    lead: float  # of those that point upward, from -1 to 1
    lean: float  # of the values away from their floor
    votes: float  # stretches of `CELL` samples, as many as would count alike
    clear: int  # events clear of the noise that are no single samples
    single: float  # share of the votes that single samples have

    @property
    def doubtful(self) -> bool:
        return abs(self.lead) <= UNCLEAR or self.clear < FEW or self.single > SINGLE


class _Searched(NamedTuple):
    """Events of a stretch that point upward and downward, and how its values lean."""

    both: list[np.ndarray]
    lean: float
    samples: int


def _search(part: np.ndarray, grid: Grid, scale: float, constant: float) -> _Searched:
    if len(part) < LEAST_SAMPLES:
        return _Searched([NO_EVENTS, NO_EVENTS], 0.0, 0)
    x = (part.astype(np.float64) - float(part[0])) * scale
    some = x[:: max(1, len(x) // 2048)].copy()
    middle = centre_of(some, len(some))
    low, high = float(x.min()), float(x.max())
    lean = (high + low - 2.0 * middle) / (high - low) if high > low else 0.0
    return _Searched(_events(x, grid, constant), lean, len(x))


def _count(stretches: list[_Searched]) -> _Vote:
    lean, first = 0.0, 0
    found = []
    for one in stretches:
        if not one.samples:
            continue
        found.append([way + first * AT for way in one.both])
        first += -(-one.samples // CELL) * CELL
        lean += one.lean
    if not found:
        return _Vote(0.0, 0.0, 1.0, 0, 0.0)
    ways = [np.concatenate(way) for way in zip(*found, strict=True)]
    clear = np.concatenate([one[one[:, 3] >= 2 * LEAST] for one in ways])
    up, down = (_by_cell(one, first // CELL) for one in ways)
    energy = up + down
    telling = energy > 0
    if not telling.any():
        return _Vote(0.0, lean / len(found), 1.0, 0, 0.0)
    certain = _by_cell(clear, first // CELL) > 0
    loud = energy[certain if certain.any() else telling]
    usual = np.quantile(loud, min(USUAL + FURTHER / len(loud), 1.0), method="higher")
    weight = np.minimum(energy, usual)[telling] / usual
    whole = weight.sum()
    lead = weight @ ((up - down)[telling] / energy[telling]) / whole
    # Glitches point either way, and among the steepest stretches they are many.
    single = clear[:, 1] < 2.0
    glitches = _by_cell(clear[single], first // CELL)[telling] > 0.5 * energy[telling]
    return _Vote(
        lead,
        lean / len(found),
        whole**2 / (weight @ weight),
        int(len(clear) - np.count_nonzero(single)),
        weight[glitches].sum() / whole,
    )


def _by_cell(events: np.ndarray, count: int) -> np.ndarray:
    """Sums of squared heights, in which ringing counts less with every swing."""
    cells = np.minimum((events[:, 0] / CELL).astype(np.int64), count - 1)  # some end the last
    return np.bincount(cells, events[:, 2] ** 2, count)


def _median_of_three(x: np.ndarray) -> np.ndarray:
    """Running median of three samples."""
    pair = np.minimum(x[:-2], x[1:-1]), np.maximum(x[:-2], x[1:-1])
    return np.concatenate((x[:1], np.maximum(pair[0], np.minimum(pair[1], x[2:])), x[-1:]))


def _hums(x: np.ndarray, scale: float, grid: Grid) -> bool:
    """Whether the first second of a frame shows mains lines."""
    first = x[: grid.span]
    spans = Spans(grid, len(first), search=False)
    spans.load((first.astype(np.float64) - float(first[0])) * scale, 0.0, 1.0)
    return bool(spans.spans[0].hum)


def _events(x: np.ndarray, grid: Grid, constant: float) -> list[np.ndarray]:
    """Those of a stretch that point upward, and downward, no longer than a contact."""
    spans = _spans_of(x, 1.0, grid, constant)
    both = [spans.events()]
    if any(len(one.medians) == 1 for one in spans.spans.values()):
        # The baseline of one chunk alone is low in it, so each direction has its own.
        spans = _spans_of(x, -1.0, grid, constant)
    else:
        spans.turn_over()
    both.append(spans.events())
    return [one[one[:, 1] <= MATCH * grid.longest] for one in both]


def _spans_of(x: np.ndarray, sign: float, grid: Grid, constant: float) -> Spans:
    spans = Spans(grid, len(x), constant=constant, part=False)
    for k in range(spans.count):
        first, last = grid.bounds(k, len(x))
        spans.load(x[first:last], 0.0, sign)
    return spans
