"""Collect the results of a force record span by span."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..impacts import CLIPPED, Disturbance
from .pulses.edges import ERRORS, FIT, SHARED
from .pulses.shape.few_pulses import FewPulses
from .search.disturbances import joined
from .search.span import Span, united
from .search.spans import LEAST

COLUMNS = 5  # start, contact, peak, impulse, rise
ROW = FIT  # those, then flags, clipped, width, height over noise, height; errors, shared one
SLOW = 3.0
"""Times the noise that the baseline moves by, where something slow may be an impact."""


class ForceImpacts(NamedTuple):
    """Detected impacts; times in samples since the beginning of the record."""

    columns: np.ndarray  # (n, 5): start, contact, peak, impulse, rise
    errors: np.ndarray  # (n, 4): standard errors of the first four
    shared: np.ndarray  # (n, 2): what starts and peaks within a second share of theirs
    flags: np.ndarray
    sure: np.ndarray  # height over noise
    probability: np.ndarray  # that they are impacts
    width: float  # median, of the response
    sign: float
    noise: float  # of the samples
    response_noise: float  # at the median width
    threshold: float  # median over the record, at the median width
    step: float  # of the converter
    saturation: float | None  # value that pulses were cut off at
    hum: dict[float, float]  # amplitude by frequency
    constant: float  # time constant of an AC coupling, 0 if there is none
    disturbances: list[Disturbance]
    longest: float  # contact that was searched for [s]
    moves: bool  # something slower than that does
    silent: bool  # nothing at all moves between impacts
    in_step: int  # weak events that came once in each period of the mains, and were left out
    either: bool = False  # many events point the other way
    codes: tuple[float, ...] = ()  # values that stand for missing samples


BESIDE, AT_LEAST = 0.5, 2.0
"""Contacts, and samples at least, to either side of a pulse that is left out with it."""


def stretches_of(found: ForceImpacts) -> np.ndarray:
    """First samples of the pulses with their margins, and those after the last, in order."""
    start, contact = found.columns[:, 0], found.columns[:, 1]
    margin = np.maximum(BESIDE * contact, AT_LEAST)
    ends = (np.floor(start - margin), np.ceil(start + contact + margin) + 1.0)
    return united(np.column_stack(ends).astype(np.int64))


class Found:
    """The results so far."""

    def __init__(self, longest: float, scale: float, constant: float, timed: bool) -> None:
        self.longest, self.scale, self.constant = longest, scale, constant
        self.few = FewPulses(timed)
        self.rows = [np.empty((0, ROW))]
        self.probability = [np.empty(0)]
        self.noise: list[np.ndarray] = []
        self.certain: list[float] = []
        self.sigma: list[float] = []
        self.steps: list[float] = []
        self.hum: list[dict[float, float]] = []
        self.disturbances: list[Disturbance] = []
        self.widths = np.empty(0)
        self.moves = False
        self.in_step = 0

    def add(
        self,
        rows: np.ndarray,
        probability: np.ndarray,
        span: Span,
        certain: float,
        widths: np.ndarray,
    ) -> None:
        self.rows.append(rows)
        self.probability.append(probability)
        self.noise.append(span.noise)
        self.sigma.append(span.sigma)
        self.certain.append(certain)
        self.steps.append(span.step)
        self.hum.append(span.hum)
        self.widths = widths
        moved = span.medians.max() - span.medians.min()
        self.moves |= bool(moved > SLOW * span.sigma) or bool(self.disturbances)

    def result(self, sign: float, limit: float) -> ForceImpacts:
        """The final result; `limit` is the extreme value in the direction of the pulses."""
        self.few.finish()
        rows = np.concatenate(self.rows)
        order = np.argsort(rows[:, 0], kind="stable")
        rows = rows[order]
        flags = rows[:, 5].astype(np.uint8) | (CLIPPED * rows[:, 6]).astype(np.uint8)
        width = float(np.median(rows[:, 7])) if len(rows) else 1.0
        noise = np.median(self.noise, axis=0) if self.noise else np.zeros(1)
        rung = int(np.argmin(np.abs(np.log(self.widths / width)))) if len(self.widths) else 0
        steps = [one for one in self.steps if one]
        hum = {
            f: float(np.median([one.get(f, 0.0) for one in self.hum]))
            for f in sorted({f for one in self.hum for f in one})
        }
        back = 1.0 / self.scale
        columns = rows[:, :COLUMNS].copy()
        columns[:, 2:4] *= back
        errors = rows[:, ERRORS:SHARED].copy()
        errors[:, 2:] *= back
        shared = rows[:, SHARED:FIT].copy()
        shared[:, 1] *= back
        tiny = np.finfo(float).tiny
        response = float(noise[rung]) if noise[rung] > 2 * tiny else 0.0
        return ForceImpacts(
            columns,
            errors,
            np.minimum(shared, errors[:, (0, 2)]),
            flags,
            rows[:, 8],
            np.concatenate(self.probability)[order],
            width,
            sign,
            float(np.median(self.sigma)) * back if self.sigma else 0.0,
            response * back,
            (float(np.median(self.certain)) if self.certain else LEAST) * response * back,
            (float(np.median(steps)) if len(steps) > len(self.steps) / 2 else 0.0) * back,
            limit if (flags & CLIPPED).any() else None,
            {f: a * back for f, a in hum.items() if a > 0},
            self.constant,
            joined([self._in_the_unit(one, sign * back) for one in self.disturbances]),
            self.longest,
            self.moves,
            not any(self.sigma),
            self.in_step,
        )

    @staticmethod
    def _in_the_unit(one: Disturbance, factor: float) -> Disturbance:
        """A move of the baseline is up or down; other heights are above it."""
        return one._replace(height=one.height * (factor if one.kind == "baseline" else abs(factor)))
