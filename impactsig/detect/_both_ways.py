"""Impacts that point either way in one force record: a sensor between two stops.

A pulse draws down the flanks of the responses beside it, and what follows it closely passes for
ringing. So pulses of one direction are searched for where those of the other are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from ._force import detect_force
from ._force_impacts import ForceImpacts
from ._force_stretch import Wanted
from .search.judging_kernels import measured_ringing
from .signal.ladder import MATCH
from .signal.stream import Piece

AS_HIGH, AS_MANY, FEW = 0.3, 0.2, 5
"""Shares of their median height and of their number, and number, from which on those that point the
other way may be of a second stop."""
BESIDE = 0.1
"""Share of the interval between impacts, within which of one a structure rings that they shake."""
AT_ONCE = 1.0
"""Contacts between the end of one and the start of another, in which no mass flies across."""


def detect_both_ways(
    pieces: Callable[[], Iterable[Piece]], rate: float, wanted: Wanted, *, in_memory: bool
) -> tuple[ForceImpacts, ForceImpacts] | None:
    """Detect the impacts that point upward, and those that point downward.

    Parameters are those of `detect_force`; None if the record is constant or too short.
    """
    found = detect_force(pieces, rate, wanted, in_memory=in_memory)
    if found is None:
        return None
    ways = {found.sign: found}
    # The first search finds what is none beside pulses of the other direction. Left out, it takes
    # a part of these along, so they are measured once more without it.
    for sign in (-found.sign, found.sign, -found.sign):
        alone = wanted._replace(polarity=sign)
        found = detect_force(pieces, rate, alone, in_memory=in_memory, others=ways[-sign])
        assert found is not None
        ways[sign] = found
    up, down = ways[1.0], ways[-1.0]
    return _only(up, ~_swings(up, down)), _only(down, ~_swings(down, up))


def other_way(
    pieces: Callable[[], Iterable[Piece]],
    rate: float,
    wanted: Wanted,
    found: ForceImpacts,
    *,
    in_memory: bool,
) -> tuple[int, bool]:
    """Number of pulses about as high that point the other way, and whether most lie close to one.

    The number is 0 if they are few.
    """
    alone = wanted._replace(polarity=-found.sign)
    others = detect_force(pieces, rate, alone, in_memory=in_memory, others=found)
    if others is None or len(found.columns) < 2:
        return 0, False
    high = others.columns[:, 2] > AS_HIGH * np.median(found.columns[:, 2])
    start = others.columns[high & ~_swings(others, found), 0]
    if len(start) <= max(FEW, AS_MANY * len(found.columns)):
        return 0, False
    first = found.columns[:, 0]
    after = np.clip(np.searchsorted(first, start), 1, len(first) - 1)
    apart = np.minimum(np.abs(start - first[after - 1]), np.abs(start - first[after]))
    return len(start), bool(np.median(apart) < BESIDE * np.median(np.diff(first)))


def _only(found: ForceImpacts, kept: np.ndarray) -> ForceImpacts:
    each = ("columns", "errors", "shared", "flags", "sure", "probability")
    return found._replace(**{name: getattr(found, name)[kept] for name in each})


def _swings(found: ForceImpacts, others: ForceImpacts) -> np.ndarray:
    """Mask of the impacts in which a sensor rings after a higher one of the other direction."""
    if not len(others.columns):
        return np.zeros(len(found.columns), bool)
    after, length, height = others.columns[:, :3].T
    ringing = measured_ringing(
        found.columns, np.column_stack((after + 0.5 * length, MATCH * length, height))
    )
    start, contact, peak = found.columns[:, :3].T
    before = np.searchsorted(after, start) - 1
    gap = start - (after + length)[before]
    longer = np.maximum(contact, length[before])
    at_once = (before >= 0) & (gap < AT_ONCE * longer) & (height[before] > peak)
    return ringing | at_once
