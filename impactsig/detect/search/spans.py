"""The search of one stretch of a record, a second at a time.

Every step looks at a bounded number of seconds around the one it is at, so the search can follow
a stream; and seconds are counted from the beginning of the stretch, so the result does not depend
on how the samples were delivered.
"""

from __future__ import annotations

import math

import numpy as np

from ..instrument.converter import converter_step
from ..instrument.coupling_kernels import uncouple
from ..instrument.dropout_kernels import BORDER, MOST, fill, find_dropouts
from ..instrument.line import Line
from ..instrument.mains import base_of
from ..signal.grid import Grid
from ..signal.ladder import MATCH
from ..signal.probability import LOWEST
from ._background import SQRT12, Background
from ._background_kernels import chunk_medians, take
from ._faint_kernels import find_faint
from ._noise_kernels import noise_around, read_noise
from ._response_kernels import CREST, Stretch, find_crests
from .events.event_kernels import find_events, near_crests, strongest_first
from .events.width_kernels import EVENT
from .span import NO_CRESTS, NO_EVENTS, NO_RUNS, Faint, Span, united

BESIDE = 2
"""Spans to either side whose noise and hum count."""
LEAST = 5.0
"""Standard deviations of its noise that a response must reach."""
CODES, CODES_IN_A_ROW = 1.35, 1.7
"""Steps of the converter that it must reach, where noise does not blur them; and that one of up to
four samples must, since noise of a third of a step moves as many by one code now and then."""
SETTLED = 0.5
"""Seconds in which what is undone of an AC coupling settles: four chunks of the baseline, which so
follows it, and many contacts, behind which so little is left."""
TINY = 1e-7
"""Of the range of the samples: the least noise that is assumed."""
REST = 2e-3
"""Of the hum that is taken off: what may be left."""
RARE = 3
"""Times as many impacts as samples that stand alone make these glitches, not short impacts."""
TINIEST = float(np.finfo(float).tiny)


class Spans:
    """Spans of one stretch, each advanced from stage to stage as its neighbours allow.

    Parameters
    ----------
    total : int
        Samples of the stretch.
    level : float, optional
        What a response must reach.
    sigmas : float, optional
        What it must reach in standard deviations of its noise, if there is no `level`.
    skip : bool
        Pass over what does not move at all.
    constant : float
        Time constant of the AC coupling that is undone, in samples; 0 if there is none.
    search : bool
        Look for events; else only hum is taken off.
    repeats : bool
        There may be dropouts, as values repeat.
    left_out : array (n, 2)
        First samples of what is not looked at, and those after the last.
    part : bool
        Look whether an event is two.
    """

    def __init__(
        self,
        grid: Grid,
        total: int,
        level: float | None = None,
        sigmas: float | None = None,
        skip: bool = True,
        constant: float = 0.0,
        search: bool = True,
        repeats: bool = True,
        left_out: np.ndarray = NO_RUNS,
        part: bool = True,
    ) -> None:
        self.left_out = left_out
        self.grid, self.total, self.constant, self.repeats = grid, total, constant, repeats
        self.level, self.sigmas, self.skip = level, LEAST if sigmas is None else sigmas, skip
        self.count, self.widest = grid.count(total), MATCH * grid.longest if part else 0.0
        self.spans: dict[int, Span] = {}
        self.stages = (
            self._fill,
            self._leave_out,
            self._cut,
            self._take_hum_off,
            self._clean,
            self._search,
            self._choose,
        )[: None if search else 4]
        self.ahead = (1, 1, 1, BESIDE, BESIDE, BESIDE, 1)
        self.done = [0] * (len(self.stages) + 1)
        self._line = Line(grid, total)
        self._room = np.empty((0, CREST))
        self._near, self._doubt = np.empty((0, CREST)), np.empty(0)
        self._events = np.empty((0, EVENT))
        self._background = Background(grid)
        self._sums = np.empty(0)
        self._runs = np.empty((MOST, 2), np.int64)
        self._coupled = (0.0, 0.0)  # integral of what is behind the coupling, its last sample
        self._level = self._held = np.nan  # what a dropout at the border began with, and its value

    def load(self, values: np.ndarray, reference: float, factor: float) -> None:
        """Add the values of the next span, and advance all spans as far as possible.

        Samples are `factor` times what the values are above the `reference`, with pulses upward.
        """
        k = self.done[0]
        first, last = self.grid.bounds(k, self.total)
        clean = self._line.samples(k)
        extent = take(values, reference, factor, clean)
        self.zero = (0.0 - reference) * factor
        before = np.empty(BORDER if k > 0 and self.repeats else 0)
        if len(before):
            take(self.spans[k - 1].values[-BORDER:], reference, factor, before)
        self.spans[k] = Span(first, last, values, before, clean, range=extent)
        self.done[0] += 1
        self._work()

    def turn_over(self) -> None:
        """Search again, for what points the other way, in a short stretch: the row holds it all."""
        for span in self.spans.values():
            np.negative(span.clean, out=span.clean)
            span.crests, span.events = NO_CRESTS, NO_EVENTS
        self.done[-2:] = [0, 0]
        self._work()

    def _work(self) -> None:
        """Bring each span from stage to stage, as far as those around it are."""
        moved = True
        while moved:
            moved = False
            for stage, work in enumerate(self.stages):
                k = self.done[stage + 1]
                if k < self.count and min(k + self.ahead[stage], self.count - 1) < self.done[stage]:
                    work(k)
                    self.done[stage + 1] += 1
                    moved = True

    def events(self) -> np.ndarray:
        """Those of all spans that are held."""
        return np.concatenate([span.events for span in self.spans.values()])

    def around(self, k: int, reach: int) -> list[Span]:
        """The spans at most `reach` from k."""
        return [self.spans[i] for i in range(max(0, k - reach), min(self.count, k + reach + 1))]

    def forget(self, before: int) -> None:
        """Drop the spans before one."""
        for k in [k for k in self.spans if k < before]:
            del self.spans[k]

    def stretch(self, k: int) -> Stretch:
        """Samples without hum of span k and of a margin to either side."""
        span = self.spans[k]
        samples, origin = self._line.around(k, self.grid.margin)
        return Stretch(
            samples, origin, self.total, span.first, span.last, self.grid.rungs, span.noise
        )

    def faint(self, k: int, rung: int) -> Faint:
        """Upward and downward crests in span k at one width, from LOWEST on."""
        span = self.spans[k]
        if rung not in span.faint:
            least = max(LOWEST * span.noise[rung], span.codes[rung])
            upward, found = find_faint(self.stretch(k), rung, least, self._room)
            span.faint[rung] = self._room[:upward].copy(), self._room[upward:found].copy()
        return span.faint[rung]

    # -- stages --------------------------------------------------------------------------------

    def _fill(self, k: int) -> None:
        """Fill dropouts, undo the coupling, and find the converter's step."""
        span = self.spans[k]
        live = self._filled(k) if self.repeats else span.clean
        if self.constant:
            self._uncouple(k)
        span.filled = span.dropouts
        span.step = converter_step(live) if span.range and len(live) else 0.0

    def _leave_out(self, k: int) -> None:
        """Put straight lines in place of what is not looked at; compute medians."""
        span = self.spans[k]
        runs = self.left_out
        near = runs[(runs[:, 1] > span.first) & (runs[:, 0] < span.last)]
        if len(near):
            beside = self.around(k, 1)
            seen = np.concatenate([one.clean for one in beside])
            fill(seen, np.clip(near - beside[0].first, 0, len(seen)), np.nan)
            span.clean[:] = seen[span.first - beside[0].first :][: len(span.clean)]
            own = np.clip(near - span.first, 0, len(span.clean))
            span.filled = united(np.concatenate((span.dropouts, own)))
        span.medians = np.empty(max(1, len(span.clean) // self.grid.chunk))
        chunk_medians(span.clean, self.grid.chunk, span.medians)
        span.moves = np.abs(span.medians[1:] - span.medians[:-1])

    def _filled(self, k: int) -> np.ndarray:
        """The samples of span k that are in no dropout, once these are filled."""
        span = self.spans[k]
        n, left = len(span.clean), len(span.before)
        after = self.spans[k + 1].clean[:BORDER] if k < self.count - 1 else span.clean[:0]
        seen, _ = self._line.around(k, BORDER)
        # The spans beside may be further, and what is filled in across a border is theirs to fill.
        beside = seen[:left].copy(), seen[left + n :].copy()
        seen[:left], seen[left + n :] = span.before, after
        count = find_dropouts(seen, self.zero, self._held, self._runs)
        live, self._held = span.clean, np.nan
        if count:
            runs = self._runs[:count].copy()
            begins = left + n - BORDER  # what is seen of the next span
            over = runs[(runs[:, 0] <= begins) & (begins < runs[:, 1])]
            self._held = float(seen[begins]) if len(over) else np.nan
            self._level = fill(seen, runs, self._level)
            inside = np.clip(runs - left, 0, n)
            span.dropouts = inside[inside[:, 1] > inside[:, 0]]
            rest = np.ones(n, np.bool_)
            for a, b in span.dropouts:
                rest[a:b] = False
            live = span.clean[rest]
            span.range = float(span.clean.max() - span.clean.min())
        else:
            self._level = np.nan
        seen[:left], seen[left + n :] = beside
        return live

    def _uncouple(self, k: int) -> None:
        """Invert the AC coupling of the sensor; a step then decays within SETTLED seconds."""
        span, leak = self.spans[k], 1.0 / (SETTLED * self.grid.rate)
        if k == 0:  # as if it had lasted for ever; what is coupled has no mean but an offset
            offset = float(span.clean.mean())
            self._coupled = (offset * (0.5 / math.tanh(0.5 * leak)), offset)
        self._coupled = uncouple(span.clean, 1.0 / self.constant, leak, *self._coupled)

    def _cut(self, k: int) -> None:
        """Separate the background from what stands out, and detect mains lines in it."""
        span = self.spans[k]
        if not span.range and self.skip:
            span.mask = np.zeros(len(span.clean), np.uint8)
        else:
            span.mask = np.empty(len(span.clean), np.uint8)
            span.lines = self._background.separate(span, self._medians(k))

    def _take_hum_off(self, k: int) -> None:
        """Remove mains lines that neighbouring seconds show as well."""
        span, lines = self.spans[k], self.spans[k].lines
        if not lines and (shown := [one.lines for one in self.around(k, BESIDE) if one.lines]):
            if not len(span.sums):
                return
            lines = self._background.lines_of(span, base=base_of(shown[0]))
        if lines:
            self._background.take_hum_off(span, self._medians(k), lines)

    def _medians(self, k: int) -> np.ndarray:
        """Medians of the chunks of span k and of its neighbours."""
        span = self.spans[k]
        medians = np.empty(len(span.medians) + 2)
        medians[0] = self.spans[k - 1].medians[-1] if k > 0 else span.medians[0]
        medians[1:-1] = span.medians
        medians[-1] = self.spans[k + 1].medians[0] if k < self.count - 1 else span.medians[-1]
        return medians

    def _clean(self, k: int) -> None:
        """Remove glitches, and measure the noise of each width."""
        span = self.spans[k]
        beside = self.around(k, BESIDE)
        # Where what stands out lasts, single samples are none of it.
        if RARE * sum(len(one.spikes) for one in beside) <= sum(one.runs for one in beside):
            span.glitches = span.spikes
        rungs = self.grid.rungs
        floor = max(max(one.step for one in beside) / SQRT12, TINY * span.range)
        if not span.range:
            span.own_noise = floor * rungs.gain / np.sqrt(rungs.width)
            return
        span.own_noise = np.empty(len(rungs.width))
        rest = REST * sum(span.hum.values())
        n = len(span.clean) + 1
        if len(self._sums) < n:
            self._sums = np.empty(n)
        read_noise(
            span.clean,
            span.glitches,
            span.mask,
            rungs,
            floor,
            rest,
            span.sigma if span.sigma > floor else 0.0,
            self._sums[:n],
            span.own_noise,
        )

    def _search(self, k: int) -> None:
        """Find the crests of the responses."""
        span, rungs = self.spans[k], self.grid.rungs
        self._line.join(k)
        beside = self.around(k, BESIDE)
        # Where nothing moves for seconds, anything but rounding is something.
        extent = max(one.range for one in beside)
        span.noise = np.empty(len(rungs.width))
        noise_around(
            np.array([one.own_noise for one in beside]),
            min(k, BESIDE),
            max(TINY**2 * extent, TINIEST),
            span.noise,
        )
        step = max(one.step for one in beside)
        if step and span.sigma < step:
            span.codes = np.where(rungs.width <= 4, CODES_IN_A_ROW, CODES) * step
        else:
            span.codes = np.zeros(len(span.noise))
        least = np.maximum(self.sigmas * span.noise, span.codes)
        if self.level is not None:
            least = np.full(len(least), self.level)
        if self.skip and not max(one.range for one in self.around(k, 1)):
            return
        if not len(self._room):
            self._room = np.empty((len(span.clean) + self.grid.span, CREST))
        count = find_crests(self.stretch(k), least, self._room)
        span.crests = self._room[:count].copy()

    def _choose(self, k: int) -> None:
        """Group the crests into events."""
        span = self.spans[k]
        if not len(span.crests):
            return
        before = self.spans[k - 1].crests if k > 0 else NO_CRESTS
        after = self.spans[k + 1].crests if k < self.count - 1 else NO_CRESTS
        most = len(before) + len(span.crests) + len(after)
        if len(self._near) < most:
            self._near, self._doubt = np.empty((2 * most, CREST)), np.empty(2 * most)
        widths = self.grid.rungs.width
        count = near_crests(
            before, span.crests, after, span.first, span.last, widths, self._near, self._doubt
        )
        order = strongest_first(self._doubt[:count])
        if len(self._events) < (most := 4 * len(span.crests) + 8):
            self._events = np.empty((2 * most, EVENT))
        near, room = self._near[:count], self._events[:most]
        found = find_events(self.stretch(k), near, order, self.widest, room)
        span.events = self._events[:found].copy()
