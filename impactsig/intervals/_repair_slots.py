"""What to change in a periodic train: impacts that were not due, and those that did not come."""

from __future__ import annotations

import itertools

import numpy as np

from ..impacts import Impacts
from ._phase import to_cycles
from ._slots import REACH, fit_slots, nearest_slot, once
from .periodicity import Periodicity

CLOCK_ERROR = 2e-3
RESOLUTION = 1e-3  # [forcing periods]
WIDEST = 0.03  # [forcing periods]
NEAR = 0.1  # [forcing periods]: an impact so near to an instant due may be a late one
LONGEST_RUN = 3  # missed impacts in a row; more is silence

Edits = tuple[dict[int, str], list[tuple[int, float, str]]]
"""Why an impact is taken out, by its index; after which, when [s] later and why one is put in."""


def slot_edits(train: Impacts, forcing_period: float, period: Periodicity) -> Edits:
    """Impacts off the slots of the period, and instants due at which none came."""
    assert period.periods is not None
    fold = period.periods
    time = train.time
    cycles, _ = to_cycles(time, forcing_period, CLOCK_ERROR)
    gaps = np.interp(train.gaps, time, cycles)
    fit = fit_slots(cycles, fold, gaps, RESOLUTION, WIDEST)
    # the fit keeps its last refinement of period and phase to itself
    _, offset = nearest_slot(cycles % fold, fit.centre, fold)
    close = np.abs(offset) < NEAR
    cycles = cycles - np.polyval(np.polyfit(cycles[close], offset[close], 1), cycles)
    slot, offset = nearest_slot(cycles % fold, fit.centre, fold)
    turn = np.round((cycles - offset - fit.centre[slot]) / fold).astype(np.int64)
    due = turn * len(fit.centre) + slot
    reach = REACH * max(fit.jitter, RESOLUTION)
    hit = once(due, offset, reach)
    name = f"period({period.impacts},{period.periods})"

    gap_after = train.interval_spans_gap()
    gap_before = np.append(True, gap_after)
    beside_gap = gap_before | np.append(gap_after, True)
    beyond = np.abs(offset) > reach
    # beyond reach of an instant due at which none came, but near it: late, or false and one missed
    doubtful = beyond & (np.abs(offset) < NEAR) & ~np.isin(due, due[hit])
    removed = {
        int(i): f"{abs(offset[i]):.2g} forcing periods from any instant due in {name}"
        for i in np.flatnonzero(beyond & ~doubtful & ~beside_gap)
    }
    left_alone = set(due[hit].tolist()) | set(due[doubtful].tolist())
    inserted, why = [], f"due in {name}, and did not come"
    hits = np.flatnonzero(hit)
    for left, right in itertools.pairwise(hits):
        absent = range(int(due[left]) + 1, int(due[right]))
        if not 1 <= len(absent) <= LONGEST_RUN or gap_after[left:right].any():
            continue
        for one in absent:
            if one in left_alone:
                continue
            at = one // len(fit.centre) * fold + fit.centre[one % len(fit.centre)]
            first, last = (turn[k] * fold + fit.centre[slot[k]] for k in (left, right))
            share = (at - first) / (last - first)
            instant = time[left] + share * (time[right] - time[left])
            after = int(np.searchsorted(time, instant, side="right")) - 1
            inserted.append((after, float(instant - time[after]), why))
    return removed, inserted
