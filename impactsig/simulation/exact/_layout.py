"""The modes of an oscillator and the events that end them, apart from all parameter values."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...oscillators.laws import PUSHER, RIGID
from ..basis.columns import Columns, kinds_of_stops, order_of_stops


class Structure(NamedTuple):
    """What oscillators of one layout share."""

    upper: tuple[tuple[int, int], ...]  # place in `stops` and kind, in the order they are reached
    lower: tuple[tuple[int, int], ...]
    has_friction: bool


@dataclass(frozen=True, eq=False)
class Layout:
    """The modes of all oscillators of one structure, and their gaps, as tables of signs and places.

    A mode is a combination of soft stops that are pressed on, with friction twice: for motion up,
    then for motion down. A gap is alpha q + beta q' + gamma, with beta = `lag` times the lag of its
    stop + `halt`, gamma = `toward` times the way from the mode's origin to the stop.
    """

    form: Structure
    modes: dict[tuple[int, int, frozenset[int]], int]  # by side, level and what is lifted
    soft: np.ndarray  # whether each mode presses on each stop, shape (modes, stops)
    at: np.ndarray  # the stop that is the mode's origin, -1 for the rest position
    way: np.ndarray  # sign of the velocity where friction acts, else 0
    pressed: np.ndarray  # how many soft stops each mode presses on
    gaps: np.ndarray  # how many each mode has
    alpha: np.ndarray  # shape (modes, gaps), as all down to lands
    lag: np.ndarray
    halt: np.ndarray
    toward: np.ndarray
    stop: np.ndarray  # the gap's stop, 0 where it has none
    lands: np.ndarray  # whether the mode beyond has another origin
    meanings: np.ndarray  # meaning, stop, mode beyond; shape (modes, gaps, 3)
    side: np.ndarray  # of each stop: 1 upper, -1 lower


def structure(columns: Columns) -> Structure:
    """What decides the layout of the oscillators of one group (`columns.groups`)."""
    kinds = kinds_of_stops(columns)[:, :1]
    upper: list[tuple[int, int]] = []
    lower: list[tuple[int, int]] = []
    for number in order_of_stops(columns)[:, :1].ravel().tolist():
        row = upper if columns.form.stops[number][0] > 0 else lower
        row.append((number, int(kinds[number, 0])))
    return Structure(tuple(upper), tuple(lower), bool(columns.static[0] > 0))


@dataclass
class _Region:
    """A set of soft stops in contact: up to `level` on one side, without those in `lifted`.

    A gap is alpha, sign of the lag, halt, toward, stop, whether it lands at another origin,
    meaning, and the region beyond, None for this one.
    """

    side: int
    level: int
    lifted: frozenset[int]
    gaps: list[tuple[int, int, int, int, int, int, int, int | None]] = field(default_factory=list)


@lru_cache(maxsize=256)
def layout(form: Structure) -> Layout:
    """The layout of a structure."""
    from .passing import CLEAR, ENTER, HALT, HIT, LEAVE, LIFT, PRESS

    rows = {1: form.upper, -1: form.lower}
    stops = len(form.upper) + len(form.lower)
    regions = [_Region(0, 0, frozenset())]
    for side, row in rows.items():
        kinds = [kind for _, kind in row if kind != RIGID]
        for level in range(1, len(kinds) + 1):
            able = [m for m in range(level) if kinds[m] == PUSHER]
            for mask in range(2 ** len(able)):
                lifted = frozenset(m for n, m in enumerate(able) if mask >> n & 1)
                regions.append(_Region(side, level, lifted))
    known = {(r.side, r.level, r.lifted): k for k, r in enumerate(regions)}

    for region in regions:
        level, lifted = region.level, region.lifted
        for side in (1, -1) if level == 0 else (region.side,):
            if level < len(rows[side]):
                number, kind = rows[side][level]
                rigid = kind == RIGID
                meaning, beyond = HIT, None
                if not rigid:
                    meaning, beyond = ENTER, known[side, level + 1, lifted]
                region.gaps.append((-side, 0, 0, side, number, 0, meaning, beyond))
        if level == 0:
            continue
        side, row, last = region.side, rows[region.side], level - 1
        left = lifted - {last}
        beyond = known[(side, last, left) if last else (0, 0, left)]
        meaning = CLEAR if last in lifted else LEAVE
        region.gaps.append((side, 0, 0, 0, row[last][0], 1, meaning, beyond))
        for m in range(level):
            if row[m][1] == PUSHER:
                sign = -side if m in lifted else side
                meaning = PRESS if m in lifted else LIFT
                beyond = known[side, level, lifted ^ {m}]
                region.gaps.append((sign, sign, 0, -sign, row[m][0], 0, meaning, beyond))

    ways = (1, -1) if form.has_friction else (0,)
    modes = [(region, way) for region in regions for way in ways]
    soft, at = np.zeros((len(modes), max(stops, 1)), bool), np.full(len(modes), -1)
    size = max(len(region.gaps) for region in regions) + form.has_friction
    table = np.zeros((len(modes), size, 6), np.int64)
    meanings = np.zeros((len(modes), size, 3), np.int64)
    for i, (region, way) in enumerate(modes):
        row = rows.get(region.side, ())
        for m in range(region.level):
            soft[i, row[m][0]] = m not in region.lifted
            at[i] = row[m][0]
        for g, (*signs, number, lands, meaning, target) in enumerate(region.gaps):
            table[i, g] = *signs, number, lands
            beyond = i if target is None else len(ways) * target + (way < 0)
            meanings[i, g] = meaning, number, beyond
        if form.has_friction:
            table[i, len(region.gaps)] = 0, 0, way, 0, 0, 0
            meanings[i, len(region.gaps)] = HALT, -1, i
    sides = np.zeros(max(stops, 1), np.int64)
    for sign, row in rows.items():
        for number, _ in row:
            sides[number] = sign
    return Layout(
        form=form,
        modes={key: len(ways) * k for key, k in known.items()},
        soft=soft,
        at=at,
        way=np.array([way for _, way in modes]),
        pressed=np.array([region.level - len(region.lifted) for region, _ in modes]),
        gaps=np.array([len(region.gaps) + form.has_friction for region, _ in modes]),
        alpha=table[:, :, 0],
        lag=table[:, :, 1],
        halt=table[:, :, 2],
        toward=table[:, :, 3],
        stop=table[:, :, 4],
        lands=table[:, :, 5],
        meanings=meanings,
        side=sides,
    )
