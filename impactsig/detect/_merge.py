"""Impacts that belong together made one, or those after a first ignored."""

from __future__ import annotations

import numpy as np

Columns = dict[str, np.ndarray]


def group_starts(time: np.ndarray, within: float) -> np.ndarray:
    """Indices of the impacts that open a group: all within `within` of the first belong to it."""
    starts = []
    k = 0
    while k < len(time):
        starts.append(k)
        k = int(np.searchsorted(time, time[k] + within, side="right"))
    return np.array(starts, np.intp)


def keep_first(columns: Columns, dead_time: float) -> Columns:
    """Drop the impacts at most `dead_time` after one that is kept."""
    first = group_starts(columns["time"], dead_time)
    return {name: values[first] for name, values in columns.items()}


def merge(columns: Columns, within: float) -> Columns:
    """Make one of the impacts at most `within` after the first of them.

    The first one's instant and contact time; the greatest peak, and the rise from the first touch
    to it; impulses added; flags joined; how many they were.
    """
    first = group_starts(columns["time"], within)
    if not len(first):
        return columns
    merged = {"time": columns["time"][first]}
    merged["peak"] = np.maximum.reduceat(columns["peak"], first)
    merged["flags"] = np.bitwise_or.reduceat(columns["flags"], first)
    merged["pulses"] = np.diff(np.append(first, len(columns["time"]))).astype(float)
    if "contact_time" in columns:
        merged["contact_time"] = columns["contact_time"][first]
    if "impulse" in columns:
        merged["impulse"] = np.add.reduceat(columns["impulse"], first)
    if "rise_time" in columns:
        group = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(columns["time"]))))
        # lexsort puts the greatest peak of each group last.
        order = np.lexsort((columns["peak"], group))
        greatest = order[np.append(first[1:], len(order)) - 1]
        crest = columns["time"][greatest] + columns["rise_time"][greatest]
        merged["rise_time"] = crest - merged["time"]
    return merged
