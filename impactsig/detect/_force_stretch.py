"""Second pass over a force record, span by span: impacts are judged, measured and reported.

Events become impacts or disturbances, and each impact is measured at its own width, then by the
shape that the impacts of a span share. What turns out to be no pulse is taken out, and its
neighbours, which it bounded, are measured again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..impacts import Disturbance
from ._force_impacts import ROW, Found
from .instrument.dropout_kernels import cut_off
from .pulses.alike.pairs import PairsAlike, near_pulses
from .pulses.coarse import COARSE, add_hidden_feet, noise_below
from .pulses.edges import NO_PULSE, mark_clipped
from .pulses.fit_errors import KEPT
from .pulses.pairs import measure_pairs, with_partners
from .pulses.pulse import measure_all
from .pulses.shape.shared_shape import LEAST as LEAST_ALIKE
from .pulses.shape.shared_shape import share_shape
from .pulses.shape.told import nothing_told, told_by_last
from .search.disturbances import disturbances
from .search.events.burst_kernels import bursts, follow_closely
from .search.events.ringing_kernels import swings_back
from .search.events.shoulder_kernels import Noise, tails
from .search.events.width_kernels import RESPONSE, place
from .search.judging import LEAST_SAMPLES, Judge, Level, one_sided_noise
from .search.judging_kernels import (
    bounds,
    consistent,
    draw_together,
    leave_alone,
    measured_ringing,
    own_width,
    too_long,
    with_neighbors,
    worst,
)
from .search.span import Span
from .search.spans import BESIDE, LEAST, Spans
from .signal.grid import Grid
from .signal.stream import Frame

APART = 4.0
"""Times the mean distance of the crests of bursts: two bursts are so far apart."""


class Wanted(NamedTuple):
    """Options of the search."""

    polarity: float  # 1, -1, or 0 for that of the record
    level: Level
    contact_level: float
    relative: bool  # the contact level is a share of the peak
    shortest: float  # contact [s]
    longest: float | None
    skip: bool


class _First(NamedTuple):
    """The first span that tells of shapes; the next that does says more of the first, too."""

    rows: np.ndarray
    samples: np.ndarray
    origin: int
    dropouts: np.ndarray
    measured: np.ndarray


class StretchSearch:
    """The second pass over one stretch without gaps."""

    def __init__(
        self,
        grid: Grid,
        total: int,
        sign: float,
        scale: float,
        limit: float,
        wanted: Wanted,
        found: Found,
        *,
        repeats: bool,
        left_out: np.ndarray,
    ) -> None:
        self.grid, self.total, self.wanted, self.found = grid, total, wanted, found
        self.factor, self.limit = sign * scale, limit * scale
        self.spans = Spans(
            grid,
            total,
            wanted.level.unit and wanted.level.unit * scale,
            wanted.level.sigma,
            wanted.skip,
            found.constant,
            repeats=repeats,
            left_out=left_out,
        )
        self.told = nothing_told()  # of shapes, by the spans so far
        self.first: _First | None = None  # which nothing was told
        self.pairs = PairsAlike(wanted.contact_level == 0)
        self.sigma = self.below = self.step = 0.0  # noise, and that below a converter's step
        self.held = np.empty(0)
        self.offset = 0  # sample of the stretch that held[0] is
        self.reference = 0.0
        self.measured = 0

    def feed(self, frame: Frame) -> None:
        """Take the next frame, and report finished spans."""
        if self.total < LEAST_SAMPLES:
            return
        held = np.concatenate((self.held, frame.samples)) if len(self.held) else frame.samples
        spans = self.spans
        while (k := spans.done[0]) < spans.count:
            first, last = self.grid.bounds(k, self.total)
            if last > self.offset + len(held):
                break
            if k == 0:
                self.reference = float(held[0])
            spans.load(held[first - self.offset : last - self.offset], self.reference, self.factor)
            while (m := self.measured) < spans.count and (
                min(m + BESIDE, spans.count - 1) < spans.done[-1]
            ):
                self._report(m, frame.segment)
                self.measured += 1
                spans.forget(self.measured - BESIDE - 1)
        done = max(spans.done[0] * self.grid.span - self.offset, 0)
        self.held, self.offset = held[done:], self.offset + min(done, len(held))

    def _report(self, k: int, segment: int) -> None:
        """Measure the impacts of span k, and note its disturbances."""
        spans, grid = self.spans, self.grid
        span = spans.spans[k]
        beside = spans.around(k, BESIDE)
        near = np.concatenate([one.events for one in beside])
        seconds = sum(one.last - one.first for one in beside) / grid.rate
        judge = Judge(near, seconds, grid, self.wanted.level, self.wanted.shortest)
        if (rung := judge.rung()) is not None and not self.wanted.level.given:
            reach = range(max(k - BESIDE, 0), min(k + BESIDE + 1, spans.count))
            judge.look_again(rung, [spans.faint(i, rung) for i in reach])
        judge.decide()
        first = sum(len(one.events) for one in beside if one.first < span.first)
        own = slice(first, first + len(span.events))
        if judge.in_step:
            self.found.in_step += int(np.count_nonzero(judge.high[own] & judge.fits[own]))
        group = near[judge.passing]
        events = span.events[judge.passing[own]]
        probability = judge.probability[own][judge.passing[own]]
        if len(judge.faint):
            inside = (judge.faint[:, 0] >= span.first) & (judge.faint[:, 0] < span.last)
            events = np.concatenate((events, judge.faint[inside]))
            probability = np.concatenate((probability, judge.faint_probability[inside]))
            order = np.argsort(events[:, 0], kind="stable")
            events, probability = events[order], probability[order]
        draw_together(events, group)
        crests = events[:, 0].copy()  # what each came from, wherever its pulse turns out to lie
        dropouts = np.concatenate([one.first + one.dropouts for one in spans.around(k, 1)])
        noise = Noise(grid.rungs.width, span.noise, span.step)
        self.sigma, self.below, self.step = float(span.noise[0]) / RESPONSE, 0.0, span.step
        if 0.0 < self.sigma < COARSE * span.step:
            self.below = noise_below(span.values, span.step, abs(self.factor))
            self.sigma = max(self.sigma, math.hypot(self.below, span.step / math.sqrt(12.0)))
        whole = True
        samples, origin = np.empty(0), span.first
        rows, again = np.empty((len(events), ROW + KEPT)), np.ones(len(events), np.bool_)
        while len(events):
            samples, origin = self._measure(k, events, group, again, rows)
            marks, ends, swung, trailing = np.zeros((4, len(rows)), np.bool_)
            if own_width(events, rows, grid.rungs.width, span.noise, marks):
                self._measure(k, events, group, with_neighbors(marks), rows)
            if too_long(rows, judge.longest, marks):
                # No impact: nothing rings after it, and it bounds none.
                self.found.disturbances += [
                    Disturbance("wide", row[0] + segment, row[1], row[2]) for row in rows[marks]
                ]
                if self._took_out(span, crests[marks]):
                    return self._report(k, segment)
                rows[marks, 5] = NO_PULSE  # faint ones, which nothing was judged by
            if close := follow_closely(rows):
                swings_back(samples, origin, dropouts, rows, swung)
                tails(samples, origin, noise, rows, events, trailing)
            of_noise = span.sigma, judge.longest
            if close and whole and bursts(samples, origin, *of_noise, rows, swung, marks):
                span.bursts += _stretches(rows, marks, judge.longest)
                if self._took_out(span, crests[marks]):
                    return self._report(k, segment)
                swung |= marks
            for one in beside:
                for start, end, height in one.bursts:
                    swung |= (rows[:, 0] >= start) & (rows[:, 0] < end) & (rows[:, 2] < height)
            kept = marks
            consistent(rows, self.total, judge.shortest, kept, ends)
            if ends.any():
                for i in np.flatnonzero(kept & ends):
                    kept[i] = rows[i, 9] > LEAST * one_sided_noise(span, rows[i, 7])
            kept &= ~measured_ringing(rows, group)
            kept &= ~(swung | trailing)
            if leave_alone(rows, kept):
                break
            whole = False
            dropped = worst(~kept, rows[:, 8])  # what is no pulse bounds none
            again = with_neighbors(dropped)[~dropped]
            events, rows, crests = events[~dropped], rows[~dropped], crests[~dropped]
            probability = probability[~dropped]
        self.found.disturbances += [
            one._replace(start=one.start + segment)
            for one in disturbances(spans, k, span.events[judge.too_wide[own]])
        ]
        self.found.disturbances += [
            Disturbance("burst", start + segment, end - start, height)
            for start, end, height in span.bursts
        ]
        measured = self._measured_together(rows, samples, origin, dropouts, segment)
        self.found.add(measured, probability, span, judge.usual_level, grid.rungs.width)

    def _measured_together(
        self,
        rows: np.ndarray,
        samples: np.ndarray,
        origin: int,
        dropouts: np.ndarray,
        segment: int,
    ) -> np.ndarray:
        """Measure the impacts of a span by the shape that they share; the rows to report.

        Those of a few, and of the first span that tells of shapes, may be measured anew later.
        """
        if len(rows) < LEAST_ALIKE:
            if len(dropouts):
                cut_off(rows, dropouts)
            if len(rows):
                near = near_pulses(rows)
                self.pairs.measure(rows, near, self.sigma, samples, origin, learn=False)
                self.found.few.add(rows, samples, origin)
            rows[:, 0] += segment
            return rows[:, :ROW]
        measured = rows[:, :ROW].copy()  # without what is kept of fits
        alone = None if self.told.any() else rows.copy()
        self._share(rows, samples, origin, dropouts, measured, segment, self.told)
        if alone is not None and self.told.any():
            self.first = _First(alone, samples.copy(), origin, dropouts, measured)
        elif self.first is not None and (told := told_by_last(self.told)).any():
            earliest, self.first = self.first, None
            self._share(*earliest, segment, told)
        return measured

    def _share(
        self,
        rows: np.ndarray,
        samples: np.ndarray,
        origin: int,
        dropouts: np.ndarray,
        measured: np.ndarray,
        segment: int,
        told: np.ndarray,
    ) -> None:
        """Measure impacts by the shape that they share, and put what is reported of them."""
        close_by = near_pulses(rows)
        share_shape(rows, samples, origin, self.wanted.contact_level == 0, told)
        self.pairs.measure(rows, close_by, self.sigma, samples, origin, learn=True)
        if self.below and self.wanted.contact_level == 0:
            add_hidden_feet(rows, self.step, self.below)
        if len(dropouts):
            cut_off(rows, dropouts)
        rows[:, 0] += segment
        measured[:] = rows[:, :ROW]

    @staticmethod
    def _took_out(span: Span, crests: np.ndarray) -> bool:
        """Take the events with these crests out of those of a span; whether there were any."""
        others = ~np.isin(span.events[:, 0], crests)
        if others.all():
            return False
        span.events = span.events[others]
        return True

    def _measure(
        self, k: int, events: np.ndarray, group: np.ndarray, again: np.ndarray, rows: np.ndarray
    ) -> tuple[np.ndarray, int]:
        """Measure the events of span k that are marked `again`, each at its width.

        The group bounds the first and the last. The samples that they were measured in are
        returned, and the number of the first.
        """
        spans, span, grid = self.spans, self.spans.spans[k], self.grid
        events = events.copy()
        here = spans.stretch(k)
        samples, origin = here.x, here.origin
        places = np.empty((len(events), 4))
        place(here, events, grid.white, places)
        before, after = bounds(group, span.first, span.last, self.total)
        # Where nothing moves but impacts, the least noise that was assumed is none.
        sigma = self.sigma if span.sigma else 0.0
        relative = self.wanted.relative
        level = self.wanted.contact_level * (1.0 if relative else abs(self.factor))
        chosen = np.empty(len(again), np.bool_)
        in_pairs = with_partners(places, again, chosen)
        measure_all(
            samples, origin, self.total, places, chosen, sigma, before, after, level, relative, rows
        )
        limit = self.limit - self.factor * self.reference
        mark_clipped(span.values, span.first, self.reference, self.factor, limit, rows)
        if in_pairs:
            measure_pairs(samples, origin, places, chosen, sigma, level, relative, rows)
        rows[:, 7], rows[:, 8], rows[:, 9] = events[:, 1], events[:, 3], events[:, 2]
        return samples, origin


def _stretches(
    rows: np.ndarray, marks: np.ndarray, longest: float
) -> list[tuple[float, float, float]]:
    """Start, end and height of the bursts of marked rows, none of which has longer gaps."""
    crests = rows[marks]
    gaps = np.diff(crests[:, 0])
    far = min(APART * gaps.mean(), longest) if len(gaps) else longest
    apart = np.flatnonzero(gaps > far) + 1
    return [
        (one[0, 0], float((one[:, 0] + one[:, 1]).max()), float(one[:, 2].max()))
        for one in np.split(crests, apart)
    ]
