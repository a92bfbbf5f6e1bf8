"""Repair of a train: insert missed impacts and remove spurious ones."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from .._arguments import number
from .._showing import Shown
from .._trains.impact_columns import filled
from ..impacts import INFERRED, Impacts
from ._repair_map import map_edits
from ._repair_slots import slot_edits
from .pairs import Intervals, as_intervals
from .period import read_period
from .periodicity import LEAST_IMPACTS, Periodicity

CERTAIN = 0.95  # confidence from which on a period is evidence


@dataclass(frozen=True)
class Split(Shown):
    """A missed impact that was inserted.

    Attributes
    ----------
    after : int
        Index of the impact before it in the given train; for intervals, index of the one that was
        split.
    offset : float
        Time from that impact to the inserted one [s].
    why : str
        The evidence.

    See Also
    --------
    repair_intervals, results.Repair, results.Join

    Examples
    --------
    >>> from impactsig import repair_intervals
    >>> found = repair_intervals([0.05] * 20 + [0.1] + [0.05] * 20, 0.05)
    >>> [(split.after, round(split.offset, 6)) for split in found.splits]
    [(20, 0.05)]
    """

    after: int
    offset: float
    why: str


@dataclass(frozen=True)
class Join(Shown):
    """A spurious impact that was removed.

    Attributes
    ----------
    impact : int
        Its index in the given train; for intervals, index of the later of the two that were joined.
    why : str
        The evidence.

    See Also
    --------
    repair_intervals, results.Repair, results.Split

    Examples
    --------
    >>> from impactsig import repair_intervals
    >>> found = repair_intervals([0.05] * 20 + [0.02, 0.03] + [0.05] * 20, 0.05)
    >>> [join.impact for join in found.joins]
    [21]
    """

    impact: int
    why: str


@dataclass(frozen=True, eq=False, repr=False)
class Repair(Shown):
    """A repaired train, with the list of edits.

    Attributes
    ----------
    intervals : ndarray, shape (n,)
        Interspike intervals [s]; unchanged ones are identical to the last bit.
    impacts : Impacts or None
        The repaired train, if one was given. Inserted impacts have the flag `INFERRED`, and the
        means of the quantities of their neighbours.
    splits : tuple of Split
        Inserted impacts, in order of time.
    joins : tuple of Join
        Removed impacts, in order of time.
    period : Periodicity
        Result of `identify_period` for the given train.

    See Also
    --------
    repair_intervals, results.Split, results.Join

    Examples
    --------
    >>> from impactsig import repair_intervals
    >>> found = repair_intervals([0.05] * 20 + [0.1] + [0.05] * 20, 0.05)
    >>> len(found.splits), len(found.joins), len(found.intervals)
    (1, 0, 42)
    """

    intervals: np.ndarray
    impacts: Impacts | None
    splits: tuple[Split, ...]
    joins: tuple[Join, ...]
    period: Periodicity

    def describe(self) -> str:
        """Describe the repair in words."""
        by = "its period" if _is_certain(self.period) else "its return map"
        if not (self.splits or self.joins):
            return f"nothing repaired ({self.period.describe()})"
        return (
            f"{len(self.splits)} missed impacts put in, {len(self.joins)} spurious ones taken out, "
            f"by {by} ({self.period.describe()})"
        )


def repair_intervals(intervals: Intervals, forcing_period: float) -> Repair:
    """Split intervals at missed impacts and join them at spurious ones, if the evidence is clear.

    *A periodic train* (by `identify_period`, with a confidence of 95 %): m impacts are expected at
    known phases. An impact far from all of them is removed. A missing one is inserted, at most
    three in a row; more count as silence. An impact near an expected instant, but more than four
    standard deviations of the others away, may be late or false and is not changed.

    *Any other train*: for a deterministic orbit, similar sequences of impacts recur. For every
    three successive impacts, the phase of the first in the forcing and the two intervals, all in
    forcing periods, are compared with those of the rest of the train. A change is made if the
    sequences without it have next to no similar ones, those with it have many, and no other change
    is as good. If an impact barely occurs or not (grazing), both have similar sequences and nothing
    is changed; in chaos many false and missed impacts therefore remain. If impacts are less
    frequent than one in a hundred forcing periods, nothing is changed, since phases then do not
    determine the intervals.

    Parameters
    ----------
    intervals : Impacts or array_like, shape (n,)
        The train, or its interspike intervals [s]. Nothing is changed at a gap of the run.
    forcing_period : float
        Period of the forcing [s], accurate to 0.1 %.

    Returns
    -------
    Repair
        The repaired `intervals` [s], the repaired train if `intervals` is one, and the list of
        edits (`splits`, `joins`).

    Raises
    ------
    InvalidInput
        If an interval is negative or not finite, or `forcing_period` is not positive.

    See Also
    --------
    identify_period, Impacts.edit

    Examples
    --------
    >>> from impactsig import repair_intervals
    >>> found = repair_intervals([0.05] * 20 + [0.1] + [0.05] * 20 + [0.02, 0.03], 0.05)
    >>> len(found.splits), len(found.joins)
    (1, 1)
    """
    forcing_period = number("forcing_period", forcing_period, above=0)
    if isinstance(intervals, Impacts):
        train = intervals
    else:
        train = Impacts(np.concatenate(([0.0], np.cumsum(as_intervals(intervals, least=0)))))
    period, reading = read_period(train, forcing_period)
    removed, inserted = np.zeros(len(train), bool), list[tuple[int, float, str]]()
    why: dict[int, str] = {}
    if len(train) >= LEAST_IMPACTS and period.kind not in ("too few impacts", "too short a run"):
        if reading is not None and _is_certain(period):
            why, inserted = slot_edits(train, reading, period.name)
        elif period.kind in ("chaotic", "irregular"):
            why, inserted = map_edits(train, forcing_period)
    removed[list(why)] = True
    splits = tuple(Split(after, offset, reason) for after, offset, reason in sorted(inserted))
    joins = tuple(Join(int(i), why[int(i)]) for i in np.flatnonzero(removed))
    if isinstance(intervals, Impacts):
        repaired = _edited(train, removed, splits)
        values = repaired.intervals()
        values.flags.writeable = False
        return Repair(values, repaired, splits, joins, period)
    values = _edited_intervals(as_intervals(intervals, least=0), removed, splits)
    values.flags.writeable = False
    return Repair(values, None, splits, joins, period)


def _is_certain(period: Periodicity) -> bool:
    """Whether the train has slots, whatever drift, tone or narrow bands they have."""
    best = max((candidate.probability for candidate in period.candidates), default=0.0)
    return period.periods is not None and best >= CERTAIN


def _edited(train: Impacts, removed: np.ndarray, splits: tuple[Split, ...]) -> Impacts:
    """The train after the edits."""
    if not (splits or removed.any()):
        return train
    before = np.array([split.after for split in splits], np.intp)
    instant = train.time[before] + np.array([split.offset for split in splits])
    time = np.concatenate((train.time[~removed], instant))
    order = np.argsort(time, kind="stable")
    kept = np.flatnonzero(~removed)
    # the neighbours that stay: an impact is never put in beside one that is taken out unseen
    left = kept[np.searchsorted(kept, before, side="right") - 1]
    right = kept[np.searchsorted(kept, before, side="right")]
    known: dict[str, Any] = {}
    for item in fields(train):
        value = getattr(train, item.name)
        if item.name in ("time", "gaps", "flags") or not isinstance(value, np.ndarray):
            continue
        new = filled(item.name, value, left, right)
        known[item.name] = np.concatenate((value[~removed], new))[order]
    flags = np.concatenate((train.flags[~removed], np.full(len(splits), INFERRED, np.uint8)))
    return replace(train, time=time[order], flags=flags[order], **known)


def _edited_intervals(
    given: np.ndarray, removed: np.ndarray, splits: tuple[Split, ...]
) -> np.ndarray:
    """The intervals after joins and splits; their sum is unchanged."""
    kept = np.flatnonzero(~removed)
    instants: dict[int, list[float]] = {}
    for split in splits:
        first = int(kept[np.searchsorted(kept, split.after, side="right") - 1])
        offset = float(given[first : split.after].sum()) + split.offset
        instants.setdefault(first, []).append(offset)
    values: list[float] = []
    for first, last in itertools.pairwise(kept.tolist()):
        whole = given[first] if last == first + 1 else float(given[first:last].sum())
        edges = [0.0, *instants.get(first, []), whole]
        if len(edges) == 2:
            values.append(float(whole))
        else:
            values.extend(np.diff(edges).tolist())
    return np.array(values)
