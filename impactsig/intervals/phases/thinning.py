"""Periods with randomly missed impacts, distinguished from chaos, which skips by a pattern."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...impacts import Impacts
from ..periodicity import Candidate
from .locking import THINNED
from .reading import Clock, Reading, Recurrence, forced_readings, free_readings, weigh
from .slots import SlotFit

PARTS = 4  # of the offsets of the impacts before, equally many in each
Weighed = tuple[Reading | None, float, tuple[Candidate, ...]]


def thinned(
    usual: Weighed,
    impacts: Impacts,
    clock: Clock | None,
    recurring: list[Recurrence],
    span: float,
    max_periods: int,
    resolution: float,
) -> Weighed:
    """The answer of `weigh` with randomly missed impacts, if it is more probable."""
    from scipy.special import expit

    if clock is None:
        readings = free_readings(impacts, recurring, span, resolution, None, max_periods, THINNED)
        gaps = impacts.gaps
    else:
        readings = forced_readings(clock, max_periods, resolution, THINNED)
        gaps = clock.gaps
    best, locked, candidates = weigh(readings, len(impacts), span)
    if best is None or locked <= usual[1]:
        return usual
    if clock is None:
        gaps = (gaps - impacts.time[0]) / best.unit
    random = float(expit(-pattern_odds(best.lock.fit, best.cycles, gaps)))
    if locked * random <= usual[1]:
        return usual
    if locked * random <= 0.5:
        return None, locked * random, usual[2]
    found = tuple(replace(one, probability=one.probability * random) for one in candidates)
    return best, locked * random, found


def pattern_odds(fit: SlotFit, cycles: np.ndarray, gaps: np.ndarray) -> float:
    """Log-odds that earlier impacts predict which impacts are missed, against chance.

    With nothing, all slots are hit with one probability. A pattern has one for each slot, or for
    each slot and context: whether the instant before was hit; whether the two before were; in which
    quarter of the offsets the hit before was. The prior of a probability is Beta(1/2, 1/2), so that
    h hits of d instants have the evidence B(h + 1/2, d - h + 1/2)/B(1/2, 1/2). What gaps hide does
    not count.
    """
    m = len(fit.centre)
    first, last = int(fit.instant[fit.hit].min()), int(fit.instant[fit.hit].max())
    hit = np.zeros(last - first + 1, np.int64)
    part = np.zeros(len(hit), np.int64)
    known = np.ones(len(hit), bool)
    place, offset = fit.instant[fit.hit] - first, fit.offset[fit.hit]
    hit[place] = 1
    edges = np.quantile(offset, np.arange(1, PARTS) / PARTS)
    part[place] = 1 + np.searchsorted(edges, offset)
    at = cycles[fit.hit]
    for low, high in gaps:
        before, after = np.searchsorted(at, low, side="right"), np.searchsorted(at, high)
        begin = place[before - 1] + 1 if before > 0 else 0
        known[begin : place[after] if after < len(place) else len(hit)] = False
    asked = known[2:] & known[1:-1] & known[:-2]
    slot = (np.arange(first, last + 1) % m)[2:][asked]
    now, once, twice = hit[2:][asked], hit[1:-1][asked], hit[:-2][asked]
    alone = _evidence(np.zeros_like(slot), now)
    contexts = [once, 2 * once + twice, part[1:-1][asked]]
    if m > 1:
        contexts.append(np.zeros_like(slot))
    odds = [_evidence(slot + m * context, now) - alone for context in contexts]
    return float(np.logaddexp.reduce(odds) - np.log(len(odds)))


def _evidence(context: np.ndarray, hit: np.ndarray) -> float:
    """Log-evidence of hits whose probability depends on a context."""
    from scipy.special import betaln

    due = np.bincount(context)
    hits = np.bincount(context, hit, len(due))
    return float(np.sum(betaln(hits + 0.5, due - hits + 0.5) - betaln(0.5, 0.5)))
