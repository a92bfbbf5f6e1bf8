"""Repair of a periodic train: impacts that were not due, and due ones that are missing."""

from __future__ import annotations

import itertools

import numpy as np

from ..impacts import Impacts
from .phases.locking import due
from .phases.reading import Reading
from .phases.slot_kernels import REACH

RESOLUTION = 1e-3  # [forcing periods]
LATEST = 0.1  # [forcing periods] by which an impact may be late
CHANCE = 0.5  # share of the impacts that seem late that chance must account for, if all are false
SHORT_RUN = 3  # missed impacts in a row that are always put in
LIKELY = 0.01  # times that a longer run is expected in the train, from which on it is silence

Edits = tuple[dict[int, str], list[tuple[int, float, str]]]
"""Why an impact is taken out, by its index; after which, when [s] later and why one is put in."""


def slot_edits(train: Impacts, reading: Reading, name: str) -> Edits:
    """Impacts off the slots of the period, and due instants without an impact.

    Satellites stay: whether an echo or a second touch makes them is not known.
    """
    fit = reading.lock.fit
    which = np.arange(len(train))
    if reading.satellites is not None:
        which = which[~reading.satellites.which]
    time = train.time[which]
    reach = REACH * max(fit.jitter, RESOLUTION)

    gap_after = train.interval_spans_gap()
    gap_before = np.append(True, gap_after)
    beside_gap = (gap_before | np.append(gap_after, True))[which]
    beyond = np.abs(fit.offset) > reach
    # beyond reach of an instant due at which none came, but near it: late, or false and one missed
    doubtful = beyond & (np.abs(fit.offset) < LATEST) & ~np.isin(fit.instant, fit.instant[fit.hit])
    if _by_chance(reading, reach) > CHANCE * doubtful.sum():
        doubtful[:] = False
    removed = {
        int(which[i]): f"{abs(fit.offset[i]):.2g} forcing periods from any instant due in {name}"
        for i in np.flatnonzero(beyond & ~doubtful & ~beside_gap)
    }
    left_alone = set(fit.instant[fit.hit].tolist()) | set(fit.instant[doubtful].tolist())
    inserted, why = [], f"due in {name}, and did not come"
    hits = np.flatnonzero(fit.hit)
    instants, longest = due(fit), _longest_run(reading)
    m = len(fit.centre)
    for left, right in itertools.pairwise(hits):
        absent = range(int(fit.instant[left]) + 1, int(fit.instant[right]))
        if not 1 <= len(absent) <= longest or gap_after[which[left] : which[right]].any():
            continue
        for one in absent:
            if one in left_alone:
                continue
            at = one // m * fit.fold + fit.centre[one % m]
            share = (at - instants[left]) / (instants[right] - instants[left])
            instant = time[left] + share * (time[right] - time[left])
            after = int(np.searchsorted(train.time, instant, side="right")) - 1
            inserted.append((after, float(instant - train.time[after]), why))
    return removed, inserted


def _by_chance(reading: Reading, reach: float) -> float:
    """Expected number of spurious impacts near a due instant that has none."""
    fit = reading.lock.fit
    others, missed = fit.impacts - int(fit.hits.sum()), int((fit.due - fit.hits).sum())
    span = max(float(fit.cycles[-1] - fit.cycles[0]), 1e-9)
    return missed * (others / span) * 2 * max(LATEST - reach, 0.0)


def _longest_run(reading: Reading) -> int:
    """Longest run of missed impacts to expect at the rate of single misses."""
    hits, total = int(reading.lock.fit.hits.sum()), int(reading.lock.fit.due.sum())
    missed = 1 - hits / total
    if missed <= 0:
        return SHORT_RUN
    return max(SHORT_RUN, int(np.log(LIKELY / total) / np.log(missed)))
