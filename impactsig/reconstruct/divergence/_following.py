"""Neighbours in an embedding, and their distance after every further step."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...errors import InvalidInput
from .._neighbors import NOBODY, Tree, nearest, tree, within
from .._series import stretches, unbroken
from ._freed import freed_curve, unrelated_width, width
from ._region import Curve, median_curve
from ._stretch import LOWEST, group_gaps, pair_gaps

LEAST = 50
"""Fewest references with a neighbour."""

MOST_STEPS = 512
"""Steps that neighbours are followed for at the most, unless told."""

STILL_CLOSE = 0.6
"""Share of the pairs that must not be that far apart, in the scaling region."""

SATURATED, SATURATED_FREED = 1.5, 1.2
"""A pair is as far apart as any two from a factor exp(-1.5) of their median gap on."""

IN_PHASE = 0.5
"""Gaps that level off by so much, or more, below those of any two values are of pairs in phase."""

BELOW = 0.75
"""The region then ends by so much below that level."""

LOOKS = 16
"""Steps at which the level is read."""

FLAT = 0.3
"""Rise over these steps at which gaps that never were as wide as any have not levelled off."""


class Setting(NamedTuple):
    """The series and parameters; see `lyapunov_exponent`."""

    values: np.ndarray
    dimension: int
    delay: int
    theiler: int
    method: str
    radius: float | None
    far: float  # logarithm of the typical gap of two values
    noise: float | None = None  # standard deviation on a value; None where it is not known

    @property
    def span(self) -> int:
        """Steps from the first to the newest coordinate of a vector."""
        return (self.dimension - 1) * self.delay


class Followed(NamedTuple):
    """Distances of neighbours over some steps; `freed` of noise if it is known."""

    curve: Curve
    freed: Curve | None
    mean: np.ndarray
    close: np.ndarray
    references: int
    end: int  # last step at which few enough are far apart
    ended: bool  # and more are at some later one
    limit: float  # about the level of the curve from which on that is not so
    level: float | None = None  # at which gaps level off, if below that of any two values
    released: Curve | None = None  # the curve without that level


def follow_on(given: Setting, steps: int, further: bool) -> Followed:
    """Follow neighbours for `steps`, or further until half of the pairs are far apart."""
    longest = max(len(part) for part in stretches(given.values))
    most = min(MOST_STEPS, (longest - given.span) // 4)
    while True:
        found, pairs = _follow(given, steps)
        if not further or found.ended or 2 * steps > most:
            last = len(found.close) - 1
            return _in_phase(given, found, pairs, last if found.ended or not further else last // 3)
        steps *= 2


def _in_phase(
    given: Setting, found: Followed, pairs: tuple[np.ndarray, np.ndarray], reach: int
) -> Followed:
    """The same, freed of the level of the gaps where pairs stay in phase.

    Rossler's orbits keep their phase for hundreds of turns: neighbours forget how wide their turn
    is, but not when it began, and their gaps level off at a quarter of those of any two values.
    So do those of neighbours within one of the bands that a map visits in turn. Such a curve bends
    long before its gaps are as wide as any, and is followed over `reach` to twice as many more
    steps to see where to. Its growth is taken for that of d' = d (1 - d / exp(level)).
    """
    if not found.ended and np.ptp(found.curve.stretch[1:]) < 1:
        return found
    newest = given.values[given.span :]
    levels = np.empty(LOOKS)
    for look, k in enumerate(np.linspace(2 * reach, 3 * reach, LOOKS).astype(int)):
        there = np.maximum(*pairs) + k < len(newest)
        gaps = np.abs(newest[pairs[0][there] + k] - newest[pairs[1][there] + k])
        gaps = gaps[np.isfinite(gaps)]
        if len(gaps) < LEAST:
            return found
        log = np.log(np.where(gaps > 0, gaps, math.exp(LOWEST / 2)))
        levels[look] = np.median(log) if given.noise is None else width(log, given.noise)
    level = float(np.median(levels))
    rise = levels[LOOKS // 2 :].mean() - levels[: LOOKS // 2].mean()
    far = found.limit + (SATURATED if given.noise is None else SATURATED_FREED)
    if not LOWEST / 2 < level <= far - IN_PHASE or (abs(rise) > FLAT and not found.ended):
        return found
    curve = found.freed or found.curve
    beyond = curve.stretch > level - BELOW
    end = int(np.argmax(beyond)) - 1 if beyond.any() else found.end
    left = -np.expm1(np.minimum(curve.stretch - level, -BELOW))
    raised = -np.log(left)
    return found._replace(
        end=min(end, found.end),
        limit=level - BELOW + float(raised.max()),
        level=level,
        released=Curve(curve.stretch + raised, curve.blocks / left, curve.freed, raised),
    )


def _follow(given: Setting, steps: int) -> tuple[Followed, tuple[np.ndarray, np.ndarray]]:
    length = given.span + steps + 1
    # A vector counts if it can be followed to the last step without crossing a gap.
    vectors = sliding_window_view(given.values, length)[:, : given.span + 1 : given.delay]
    newest = given.values[given.span :]
    found = tree(vectors, unbroken(given.values, length))
    if given.method == "rosenstein":
        other, _ = nearest(found, given.theiler, False)
        one = np.flatnonzero(other != NOBODY)
        _enough(len(one))
        # Two vectors that are each other's nearest are followed twice, but are one pair.
        mutual = float(np.mean(other[other[one]] == one))
        log = pair_gaps(newest, one, other[one], steps)
        pairs = one, other[one]
    else:
        one, start, who = _companies(found, given.theiler, given.radius)
        _enough(len(one))
        # A pair within the radius counts from both its ends, in two blocks of time as a rule.
        mutual = 1.0
        log = group_gaps(newest, one, start, who, steps)
        pairs = np.repeat(one, np.diff(start)), who
    close = np.mean(log < given.far - SATURATED, axis=1)
    told = log > LOWEST
    mean = np.where(told, log, 0).sum(axis=1) / np.maximum(told.sum(axis=1), 1)
    curve = _widened(median_curve(log, one), mutual)
    if given.noise is None:
        beyond, ended, freed = close < STILL_CLOSE, close.min() < 0.5, None
        limit = given.far - SATURATED
    else:
        freed = _widened(freed_curve(log, one, given.noise), mutual)
        limit = unrelated_width(given.values, given.theiler, given.noise) - SATURATED_FREED
        beyond = freed.stretch > limit
        ended = bool(beyond.any())
    end = int(np.argmax(beyond)) - 1 if beyond.any() else steps
    return Followed(curve, freed, mean, close, len(one), end, bool(ended), limit), pairs


def _widened(curve: Curve, mutual: float) -> Curve:
    """The curve with the scatter of the number of independent pairs."""
    return curve._replace(blocks=math.sqrt(1 + mutual) * curve.blocks)


def _companies(
    found: Tree, window: int, radius: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """At most 4000 references with all their neighbours, for the method of Kantz."""
    n = len(found.points)
    # By place in the tree, and so evenly over the attractor.
    places = np.arange(0, n, max(n // 4000, 1))
    if radius is None:
        some = places[:: max(len(places) // 400, 1)]
        low, high = 0.0, float(np.ptp(found.points))
        for _ in range(24):
            radius = 0.5 * (low + high)
            _, start, _ = within(found, some, radius, window, False, 1)
            enough = np.count_nonzero(np.diff(start)) >= len(some) / 2
            low, high = (low, radius) if enough else (radius, high)
        radius = high
    one, start, who = within(found, places, radius, window, False, 500)
    parts = np.split(who, start[1:-1])
    # References without company say nothing; in the order of time they make blocks of time.
    order = [r for r in np.argsort(one) if len(parts[r])]
    sizes = [len(parts[r]) for r in order]
    chosen = [parts[r] for r in order]
    return (
        one[order],
        np.concatenate(([0], np.cumsum(sizes))).astype(np.int64),
        np.concatenate(chosen) if chosen else np.empty(0, np.int64),
    )


def _enough(references: int) -> None:
    if references < LEAST:
        raise InvalidInput(
            "x",
            f"{references} vectors with a neighbour that is not equal",
            f"at least {LEAST}",
            "The series takes too few different values, or radius or theiler leave no neighbours",
        )
