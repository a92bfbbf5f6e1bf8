"""What a series is like before any embedding: rounded, recurring, how far apart its values are."""

from __future__ import annotations

import numpy as np

from ._series import known, stretches, unbroken


def resolution(values: np.ndarray) -> float:
    """Least difference of two values where many are equal, as rounding makes them; else 0."""
    levels = np.unique(known(values))
    if len(levels) > 0.9 * len(known(values)):
        return 0.0
    gaps = np.diff(levels)
    return float(gaps[gaps > 1e-9 * (levels[-1] - levels[0])].min())


def rounding_doubt(values: np.ndarray) -> str:
    """In words, how few of the values are different; nothing where most are."""
    if not resolution(values):
        return ""
    present = known(values)
    return f"only {len(np.unique(present))} different values in {len(present)}"


def exact_period(values: np.ndarray) -> int | None:
    """After how many values the series recurs to rounding, three times at least.

    What is on either side of a gap is not compared: how many values are lost is not known.
    """
    tolerance = 1e-9 * np.ptp(known(values))
    longest = max(stretches(values), key=len)
    near = np.abs(longest[1 : len(longest) // 3 + 1] - longest[0]) <= tolerance
    for lag in (np.flatnonzero(near) + 1).tolist():
        if np.any(np.abs(longest[lag : lag + 32] - longest[:32]) > tolerance):
            continue
        together = unbroken(values, lag + 1)
        if np.all(np.abs(values[lag:] - values[:-lag])[together] <= tolerance):
            return lag
    return None


def typical_gap(values: np.ndarray) -> float:
    """Median gap of two values, that are not equal, anywhere in the series."""
    values = known(values)
    half = len(values) // 2
    gaps = np.concatenate(
        [np.abs(np.roll(values, by) - values) for by in (half, half // 2 + 1, half // 3 + 1)]
    )
    return float(np.median(gaps[gaps > 0]))
