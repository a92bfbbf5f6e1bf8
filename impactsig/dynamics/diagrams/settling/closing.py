"""Orbits that motions converge to, by Newton's method on many return maps at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ....simulation.basis.events import STROBE_IMPACTS
from .strobing import least_of_each

LONGEST = 32  # periods of an orbit that are told
NEAR = 1e-2  # returns of a motion that may yet close, as a share of its size
TRIES = 4  # periods that a motion may be about to close with; chaos comes near itself after many
UNTOLD = 0.2  # of what a motion goes nearer in a return, the share its derivative may not tell
EXACT = 1e-9  # what an orbit may be off by after its periods, as a share of its size
ALIKE = 1e-6  # points of an orbit closer than this share of its size are one

# Of the motions with these numbers, from these points and after so many periods each: where they
# are, the derivative of that, and whether they came so far.
Returned = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
# Of the same: their strobes over so many periods, the same for all, and whether they came so far.
Strobed = Callable[[np.ndarray, np.ndarray, int], tuple[np.ndarray, np.ndarray]]


class Orbits(NamedTuple):
    """The orbit found for each motion."""

    point: np.ndarray  # of the orbit, in the engine's units, shape (n, 2)
    after: np.ndarray  # periods after which the motion is back, shape (n,); 0 where none was found
    period: np.ndarray  # the least such
    impacts: np.ndarray  # in a period


def orbits_beside(
    strobes: np.ndarray, last: np.ndarray, returned: Returned, strobed: Strobed,
    exact: float = 0.0,
) -> Orbits:  # fmt: skip
    """Find the orbits that motions converge to.

    Of an orbit of m periods the last returns are small, and the derivative of the motion, all of
    whose multipliers are within the unit circle, tells each of them from the one before. Then
    Newton's method finds the orbit, which must be stable, have as many impacts, and draw the motion
    as its own derivative says. A chaotic motion that passes an unstable orbit does none of that.

    Parameters
    ----------
    strobes : ndarray, shape (n, rows, 4)
        One a period, in the engine's units.
    last : ndarray of int, shape (n,)
        The last strobe of each.
    exact : float
        What the orbit may be off by after its periods, as a share of its size; as little as
        rounding allows unless given.
    """
    n = len(strobes)
    found = Orbits(np.zeros((n, 2)), *np.zeros((3, n), int))
    near = NEAR * np.abs(strobes[:, :, :2]).max(axis=(1, 2), initial=0.0)
    tries, back = np.zeros(n, int), np.zeros((TRIES, n), int)  # periods, in the order of the tries
    for m in range(1, min(LONGEST, int(last.max(initial=0)) // 3) + 1):
        able = np.flatnonzero((last >= 3 * m) & (tries < TRIES))
        able = able[_about_to_close(strobes, last, able, m, near)]
        back[tries[able], able] = m
        tries[able] += 1
    for own in back:
        left = np.flatnonzero((own > 0) & (found.after == 0))
        _approach(strobes, last, left, own[left], returned, strobed, exact, found)
    return found


def _about_to_close(
    strobes: np.ndarray, last: np.ndarray, which: np.ndarray, m: int, near: np.ndarray
) -> np.ndarray:
    """Whether the last 2 m returns are small and the impact counts of the last m agree."""
    found = np.zeros(len(which), bool)
    end, able = last[which], np.arange(len(which))
    for ago in range(2 * m):  # few come through the first
        now, before = strobes[which, end - ago], strobes[which, end - ago - m]
        good = np.abs(now - before)[:, :2].max(axis=1, initial=0.0) <= near[which]
        if ago < m:
            good &= now[:, STROBE_IMPACTS] == before[:, STROBE_IMPACTS]
        which, end, able = which[good], end[good], able[good]
        if not len(which):
            break
    found[able] = True
    return found


def _approach(
    strobes: np.ndarray, last: np.ndarray, which: np.ndarray, m: np.ndarray, returned: Returned,
    strobed: Strobed, exact: float, found: Orbits,
) -> None:  # fmt: skip
    """Find orbits of m periods for some motions."""
    if not len(which):
        return
    steps = last[which, None] - m[:, None] * np.arange(3, -1, -1)
    seen = strobes[which[:, None], steps, :2]
    point = seen[:, -1].copy()
    place, matrix, came = returned(which, point, m)
    gap = place - point
    good = came & _draws(np.diff(seen, axis=1), matrix)
    least_gap = np.full(len(which), math.inf)
    orbit, derivative = point.copy(), matrix.copy()
    active = good.copy()
    while True:  # until rounding ends it
        size = np.abs(gap).max(axis=1)
        active &= size < least_gap / 2
        now = np.flatnonzero(active)
        least_gap[now], orbit[now], derivative[now] = size[now], point[now], matrix[now]
        active &= least_gap > exact * np.abs(orbit).max(axis=1)
        now = np.flatnonzero(active)
        if not len(now):
            break
        a = np.eye(2) - matrix[now]
        determinant = a[:, 0, 0] * a[:, 1, 1] - a[:, 0, 1] * a[:, 1, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            x = (a[:, 1, 1] * gap[now, 0] - a[:, 0, 1] * gap[now, 1]) / determinant
            y = (a[:, 0, 0] * gap[now, 1] - a[:, 1, 0] * gap[now, 0]) / determinant
        point[now] += np.stack([x, y], axis=1)
        active[now] = np.isfinite(point[now]).all(axis=1)
        now = np.flatnonzero(active)
        if not len(now):
            break
        place, after, came = returned(which[now], point[now], m[now])
        gap[now], matrix[now] = place - point[now], after
        active[now] = came
    good &= least_gap <= EXACT * np.abs(orbit).max(axis=1)
    good &= _draws(seen - orbit[:, None], derivative)
    for several in np.unique(m[good]).tolist():
        chosen = np.flatnonzero(good & (m == several))
        cells = which[chosen]
        again, came = strobed(cells, orbit[chosen], 2 * several)
        back = np.arange(several)
        impacts = again[:, 2 * several - back, STROBE_IMPACTS].sum(axis=1)
        seen_impacts = strobes[cells[:, None], last[cells, None] - back, STROBE_IMPACTS]
        came &= impacts == seen_impacts.sum(axis=1)
        cells, rows = cells[came], again[came]
        found.point[cells], found.after[cells] = orbit[chosen[came]], several
        found.period[cells], found.impacts[cells] = least_of_each(rows, several, ALIKE)


def _draws(off: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Whether the orbit is stable, and these points approached it as the derivatives predict."""
    finite = np.isfinite(matrix).all(axis=(1, 2))
    safe = np.where(finite[:, None, None], matrix, 0.0)
    stable = np.abs(np.linalg.eigvals(safe)).max(axis=1) < 1
    told = off[:, :-1] @ safe.transpose(0, 2, 1)
    untold = np.linalg.norm(off[:, 1:] - told, axis=2)
    near = np.all(untold <= UNTOLD * np.linalg.norm(off[:, :-1], axis=2), axis=1)
    return finite & stable & near
