"""Repair of an aperiodic train: edit impacts where the new intervals match others of the train.

Impact j with its two neighbours on the right is the triple (phase of j in the forcing, the interval
after it, the next one), all in forcing periods. The support of a triple is the number of others of
the train within a radius; the radius is such that most triples have some.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..impacts import Impacts
from ._repair_slots import Edits
from .phases.tracking import is_sparse, steady_rate

LEAST_IMPACTS = 60
CLOCK_ERROR = 2e-3  # relative, of the forcing period against the clock of the recording
LIKE = 5  # others that three triples in four have within the radius
LEAST_LIKE = 3  # of every triple that a change makes
AWAY = 3.0  # radii within which a false impact has no like; a rare true one may have some
MOST_RADIUS = 0.08  # [forcing periods]; where it takes more the map is too sparsely known
FALSE_SHARE = 0.1  # support of what is there, of that of what a join makes of it
MISSED_SHARE = 0.4  # the same for a split: missed impacts look alike
PASSES = 5  # until nothing changes
AHEAD = 1.5  # by which the best change must be better supported than another


def map_edits(train: Impacts, forcing_period: float) -> Edits:
    """Impacts to remove and to insert, by the return map and the phases of the train itself.

    What is mended makes the sequences around it like others, and supports further changes, so the
    train is gone through until nothing changes.
    """
    removed: dict[int, str] = {}
    inserted: list[tuple[float, str]] = []
    time, source = train.time, np.arange(len(train))
    for _ in range(PASSES):
        taken, put_in = _one_pass(Impacts(time, gaps=train.gaps), source, forcing_period)
        if not taken and not put_in:
            break
        removed |= {int(source[i]): why for i, why in taken.items()}
        instants = [float(time[after] + offset) for after, offset, _ in put_in]
        inserted += [(at, why) for at, (_, _, why) in zip(instants, put_in, strict=True)]
        kept = np.ones(len(time), bool)
        kept[list(taken)] = False
        time = np.concatenate((time[kept], instants))
        source = np.concatenate((source[kept], np.full(len(instants), -1)))
        order = np.argsort(time, kind="stable")
        time, source = time[order], source[order]
    after = np.searchsorted(train.time, [at for at, _ in inserted], side="right") - 1
    return removed, [
        (int(k), at - float(train.time[k]), why)
        for k, (at, why) in zip(after, inserted, strict=True)
    ]


def _one_pass(train: Impacts, source: np.ndarray, forcing_period: float) -> Edits:
    """One pass of edits; impacts of source -1 were inserted, and stay."""
    none: Edits = {}, []
    if len(train) < LEAST_IMPACTS:
        return none
    given = (train.time - train.time[0]) / forcing_period
    if is_sparse(given):
        return none
    cycles = steady_rate(given, CLOCK_ERROR)
    base = forcing_period * float(given[-1] / cycles[-1])
    sequences = _Sequences(cycles, train.interval_spans_gap())
    if not sequences.usable:
        return none
    triples = sequences.triples(cycles)
    # not counting itself
    own, far = sequences.support(triples) - 1, sequences.support(triples, AWAY) - 1
    removed: dict[int, str] = {}
    inserted: list[tuple[int, float, str]] = []
    busy = np.zeros(len(train), bool)
    for i in np.argsort(own, kind="stable"):
        if own[i] > 1:
            break
        if busy[max(i - 3, 0) : i + 5].any():
            continue
        change = sequences.best_change(cycles, own, far, int(i))
        if change is None:
            continue
        kind, where, offset, like = change
        if kind == "join" and source[where] < 0:
            continue
        busy[max(where - 3, 0) : where + 4] = True
        if kind == "join":
            why = f"{like} sequences of the train go on so without it, next to none with it"
            removed[where] = why
        else:
            why = f"{like} sequences of the train go on so with it, next to none without"
            inserted.append((where, offset * base, why))
    return removed, inserted


def _phase(cycles: np.ndarray) -> np.ndarray:
    phase = cycles % 1
    return np.where(phase < 1, phase, 0.0)  # just below 0, the remainder is rounded to 1


class _Sequences:
    """Triples of successive impacts, and how many other triples are similar."""

    def __init__(self, cycles: np.ndarray, spans_gap: np.ndarray) -> None:
        from scipy.spatial import cKDTree

        self.broken = spans_gap
        whole = ~(spans_gap[:-1] | spans_gap[1:])
        self.library = self.triples(cycles)[whole]
        self.usable = len(self.library) >= LEAST_IMPACTS
        if not self.usable:
            return
        self.tree: Any = cKDTree(self.library, boxsize=(1, 0, 0))
        apart = self.tree.query(self.library, LIKE + 1, p=np.inf)[0][:, -1]
        self.radius = float(np.quantile(apart, 0.75))
        self.usable = 0 < self.radius <= MOST_RADIUS
        # four impacts with the third left out: what a missed one would look like
        step = np.diff(cycles)
        whole = ~(spans_gap[:-3] | spans_gap[1:-2] | spans_gap[2:-1] | spans_gap[3:])
        four = np.column_stack((_phase(cycles[:-4]), step[:-3], step[1:-2] + step[2:-1], step[3:]))[
            whole
        ]
        self.first_of_two = step[1:-2][whole]
        self.skipping: Any = cKDTree(four, boxsize=(1, 0, 0, 0)) if len(four) else None

    @staticmethod
    def triples(cycles: np.ndarray) -> np.ndarray:
        step = np.diff(cycles)
        return np.column_stack((_phase(cycles[:-2]), step[:-1], step[1:]))

    def support(self, triples: np.ndarray, radii: float = 1.0) -> np.ndarray:
        return self.tree.query_ball_point(
            triples, radii * self.radius, p=np.inf, return_length=True
        )

    def best_change(
        self, cycles: np.ndarray, own: np.ndarray, far: np.ndarray, i: int
    ) -> tuple[str, int, float, int] | None:
        """Of the edits that would mend triple i, the one whose new triples have most support."""
        found: list[tuple[int, str, int, float]] = []
        last = len(cycles) - 1
        for k in (i, i + 1, i + 2):
            if not 2 <= k <= last - 2 or self.broken[k - 2 : k + 2].any():
                continue
            made = np.concatenate((cycles[k - 2 : k], cycles[k + 1 : k + 3]))
            like = int(self.support(self.triples(made)).min())
            if like >= LEAST_LIKE and far[k - 2 : k + 1].max() <= max(1, FALSE_SHARE * like):
                found.append((like, "join", k, 0.0))
        for k in (i, i + 1):
            if not 1 <= k <= last - 2 or self.broken[k - 1 : k + 2].any():
                continue
            offset = self._missed(cycles[k - 1 : k + 3])
            if offset is None:
                continue
            made = np.concatenate(
                (cycles[k - 1 : k + 1], [cycles[k] + offset], cycles[k + 1 : k + 3])
            )
            like = int(self.support(self.triples(made)).min())
            if like >= LEAST_LIKE and own[k - 1 : k + 1].max() <= max(1, MISSED_SHARE * like):
                found.append((like, "split", k, offset))
        found.sort(reverse=True)
        if not found or (len(found) > 1 and found[0][0] < AHEAD * found[1][0]):
            return None
        like, kind, where, offset = found[0]
        return kind, where, offset, like

    def _missed(self, four: np.ndarray) -> float | None:
        """Time of an impact missed after the second of four, from similar sequences."""
        if self.skipping is None:
            return None
        step = np.diff(four)
        like = self.skipping.query_ball_point(
            np.concatenate((_phase(four[:1]), step)), self.radius, p=np.inf
        )
        if len(like) < LEAST_LIKE:
            return None
        first = self.first_of_two[like]
        if np.quantile(first, 0.9) - np.quantile(first, 0.1) > 2 * self.radius:
            return None
        return float(np.median(first))
