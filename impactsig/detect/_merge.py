"""Merge impacts that belong together, or drop those within a dead time."""

from __future__ import annotations

import numpy as np

Columns = dict[str, np.ndarray]


def group_starts(time: np.ndarray, within: float) -> np.ndarray:
    """Indices of the first impact of each group, which spans at most `within`."""
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
    """Merge impacts at most `within` after the first of them.

    The first one's instant and contact time; the greatest peak, and the rise from the first touch
    to it; impulses added; flags joined; how many they were; the probability that one of them is an
    impact, were they independent of each other.
    """
    first = group_starts(columns["time"], within)
    if not len(first):
        return columns
    size = np.diff(np.append(first, len(columns["time"])))
    # lexsort puts the greatest peak of each group last.
    order = np.lexsort((columns["peak"], np.repeat(np.arange(len(first)), size)))
    greatest = order[np.append(first[1:], len(order)) - 1]
    merged = {"pulses": size}
    for name, values in columns.items():
        if name == "flags":
            merged[name] = np.bitwise_or.reduceat(values, first)
        elif name == "impulse":
            merged[name] = np.add.reduceat(values, first)
        elif name == "impulse_error":
            merged[name] = np.sqrt(np.add.reduceat(values**2, first))
        elif name == "probability":
            merged[name] = 1.0 - np.multiply.reduceat(1.0 - values, first)
        elif name in ("peak", "peak_error", "shared_peak_error"):
            merged[name] = values[greatest]
        elif name == "rise_time":
            merged[name] = columns["time"][greatest] + values[greatest] - columns["time"][first]
        else:
            merged[name] = values[first]
    return merged
