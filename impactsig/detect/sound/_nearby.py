"""What lies near a crest of sound: how high, how many, how much of the time."""

from __future__ import annotations

import numpy as np

from ._kernels import GROUP
from ._nearby_kernels import (
    as_high_near,
    crests_apart,
    ends_about,
    greatest_about,
    ranked_between,
    strongest_about,
)

CRESTS = 40.0  # a second, that only rattling makes
UNHEARD = 10.0  # [s], without impacts, by which a stretch counts as longer
FEW = 16  # windows of which each is sorted, rather than all values
RAREST = 1.0 / 60.0  # impacts a second that may come where none is evident


def rate_of_others(evident: np.ndarray, duration: float) -> np.ndarray:
    """How many other evident crests come in a second of a stretch of that duration."""
    others = np.asarray(np.count_nonzero(evident) - evident.astype(int))
    return RAREST + others / (duration + UNHEARD)


def nearest_group(frame: np.ndarray, count: int) -> np.ndarray:
    """The GROUP, of so many, whose first frame is nearest to each frame."""
    return np.minimum(np.rint(frame / GROUP).astype(int), count - 1)


def heard_share(silent: np.ndarray, place: np.ndarray, within: float, seconds: float) -> np.ndarray:
    """Fraction of the time `within` each place that is not digital silence."""
    if not silent.any():
        return np.ones(len(place))
    reach = round(within / (GROUP * seconds))
    return 1.0 - local_mean(silent, nearest_group(place, len(silent)), reach, reach)


def crowd(
    height: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    within: float,
    share: np.ndarray,
    order: np.ndarray,
) -> np.ndarray:
    """Height that CRESTS a second reach `within` of places, by the crests there; 0 if fewer.

    These are those from `first` to before `last`. Only a `share` of their time is audible: the rank
    is the geometric mean of that share of them and of all. `order` sorts the heights.
    """
    rank = np.round(2.0 * within * CRESTS * np.sqrt(share)).astype(np.int64)
    return ranked(height, first, last, last - first - np.maximum(rank, 1), order)


def ranked(
    values: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    rank: np.ndarray,
    order: np.ndarray | None = None,
) -> np.ndarray:
    """The rank[k]-th least of values[first[k] : last[k]], counted from 0; 0 if there is none.

    Neither `first` nor `last` falls. `order` sorts the values, if that is known.
    """
    if order is None:
        if len(first) <= FEW:
            out = np.zeros(len(first), values.dtype)
            for k, (low, high, at) in enumerate(zip(first, last, rank, strict=True)):
                if 0 <= at < high - low:
                    out[k] = np.partition(values[low:high], at)[at]
            return out
        order = np.argsort(np.asarray(values, float))  # faster than of single precision
    found = np.empty(len(first), np.int64)
    ranked_between(order, first, last, rank, found)
    out = values[found] if len(values) else np.zeros(len(found), values.dtype)
    out[found < 0] = 0
    return out


def places_about(
    places: np.ndarray, at: np.ndarray, before: float, after: float
) -> tuple[np.ndarray, np.ndarray]:
    """First and end of the places, which ascend, from `before` each of `at` to less than `after`.

    As by `np.searchsorted`, but sooner, as `at` ascends too.
    """
    first, last = np.empty((2, len(at)), np.int64)
    ends_about(np.asarray(places, float), np.asarray(at, float), before, after, first, last)
    return first, last


def number_as_high(
    place: np.ndarray, height: np.ndarray, asked: np.ndarray, reach: float, share: float
) -> np.ndarray:
    """How many others at most `reach` from each given place are higher than a fraction of it."""
    whole = float(int(reach))
    first, last = places_about(place, place[asked], whole, whole + 1.0)
    count = np.empty(len(asked), np.int64)
    as_high_near(height, asked, first, last, share, count)
    return count


def greatest_near(place: np.ndarray, height: np.ndarray, reach: float) -> np.ndarray:
    """The greatest height at most `reach` before each place, or less than that after it."""
    out = np.empty(len(place))
    greatest_about(place, height, reach, np.empty(len(place), np.int64), out)
    return out


def local_mean(values: np.ndarray, at: np.ndarray, before: int, after: int) -> np.ndarray:
    """Mean of the value at each place and of those so many before and after it."""
    total = np.zeros(len(values) + 1)
    np.cumsum(values, out=total[1:])
    low, high = np.maximum(at - before, 0), np.minimum(at + after + 1, len(values))
    return np.maximum(total[high] - total[low], 0.0) / (high - low)


def strongest_beside(values: np.ndarray, at: np.ndarray, reach: int) -> np.ndarray:
    """Index of the greatest value at most `reach` from each place; the first of equal ones.

    Places beyond the ends are those of the first and the last value.
    """
    index = np.empty(len(at), np.int64)
    strongest_about(values, at, reach, index)
    return index


def greatest_beside(values: np.ndarray, at: np.ndarray, reach: int) -> np.ndarray:
    """The greatest value at most `reach` from each place."""
    return np.asarray(values[strongest_beside(values, at, reach)])


def greatest_within(values: np.ndarray, reach: int) -> np.ndarray:
    """The greatest of each value and of those at most `reach` away."""
    count = len(values)
    padded = np.empty(count + 2 * reach, values.dtype)  # np.pad takes longer than all that follows
    padded[reach : reach + count] = values
    padded[:reach], padded[reach + count :] = values[0], values[-1]
    size = 1  # of what the greatest is known of
    while 2 * size <= 2 * reach + 1:
        padded = np.maximum(padded[:-size], padded[size:])
        size *= 2
    rest = 2 * reach + 1 - size
    return np.maximum(padded[: len(padded) - rest], padded[rest:]) if rest else padded


def middle(values: np.ndarray) -> float:
    """Median, in a fraction of numpy's time."""
    ordered = np.sort(values)
    return float(0.5 * (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]))


def middles(rows: np.ndarray) -> np.ndarray:
    """Median of each column."""
    ordered = np.sort(rows, axis=0)
    return np.asarray(0.5 * (ordered[(len(rows) - 1) // 2] + ordered[len(rows) // 2]))


def separate_crests(values: np.ndarray, reach: int, least: float = 0.0) -> np.ndarray:
    """Indices of values above `least` that none within `reach` exceeds; the first of equals."""
    found = np.empty(len(values) // (reach + 1) + 1, np.int64)
    return found[: crests_apart(values, reach, least, found)]
