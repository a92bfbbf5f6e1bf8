"""What lies near a crest of sound: how high, how many, how much of the time."""

from __future__ import annotations

import numpy as np

from ._nearby_kernels import (
    crests_apart,
    ends_about,
    ranked_between,
    ranked_in_each,
)

FEW = 16  # windows of which each is sorted, rather than all values


def ranked(values: np.ndarray, first: np.ndarray, last: np.ndarray, rank: np.ndarray) -> np.ndarray:
    """The rank[k]-th least of values[first[k] : last[k]], counted from 0; 0 if there is none.

    Neither `first` nor `last` falls.
    """
    out = np.zeros(len(first), values.dtype)
    if len(first) <= FEW:
        ranked_in_each(values, first, last, rank, np.empty_like(values), out)
        return out
    order = np.argsort(np.asarray(values, float))  # faster than of single precision
    found = np.empty(len(first), np.int64)
    ranked_between(order, first, last, rank, found)
    there = found >= 0
    out[there] = values[found[there]]
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


def separate_crests(values: np.ndarray, reach: int, least: float = 0.0) -> np.ndarray:
    """Indices of values above `least` that none within `reach` exceeds; the first of equals."""
    found = np.empty(len(values) // (reach + 1) + 1, np.int64)
    return found[: crests_apart(values, reach, least, found)]
