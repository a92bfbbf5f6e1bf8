"""Runs of impacts with gaps, and what their vectors are, in plain numpy."""

from __future__ import annotations

import numpy as np

from impactsig import Impacts


def with_gaps(intervals, crossing) -> Impacts:
    """Impacts with these intervals, of which those at the indices `crossing` cross a gap."""
    time = np.concatenate(([0.0], np.cumsum(intervals)))
    spans = [time[i] + np.array([0.4, 0.6]) * (time[i + 1] - time[i]) for i in crossing]
    return Impacts(time, gaps=spans)


def parts(intervals, crossing) -> list[np.ndarray]:
    """The intervals between the gaps."""
    cut = np.split(np.asarray(intervals, float), crossing)
    return [cut[0], *(part[1:] for part in cut[1:])]


def vectors(intervals, crossing, m, delay):
    """Places in time and delay vectors between the gaps, a gap being `delay` steps long."""
    places, found, start = [], [], 0
    for part in parts(intervals, crossing):
        for i in range(len(part) - (m - 1) * delay):
            places.append(start + i)
            found.append(part[i : i + (m - 1) * delay + 1 : delay])
        start += len(part) + delay
    return np.array(places), np.array(found)
