"""Properties of a series before embedding: rounding, exact recurrence, typical differences."""

from __future__ import annotations

import numpy as np

from ._series import known, stretches


def resolution(values: np.ndarray) -> float:
    """Least nonzero difference of two values if many are equal by rounding; else 0."""
    levels = np.unique(known(values))
    if len(levels) > 0.9 * len(known(values)):
        return 0.0
    gaps = np.diff(levels)
    return float(gaps[gaps > 1e-9 * (levels[-1] - levels[0])].min())


def quantum(values: np.ndarray) -> float:
    """Step to which numbers are rounded, 0 if they are not.

    The smallest difference between values that differ, if values repeat far more often than those
    of a continuous quantity would, and if all differences are whole multiples of it.
    """
    levels = np.unique(values)
    if len(levels) < 2 or len(levels) > 0.9 * len(values):
        return 0.0
    gaps = np.diff(levels)
    step = float(gaps[gaps > 1e-12 * np.abs(levels).max()].min(initial=np.inf))
    if not np.isfinite(step):
        return 0.0
    whole = gaps / step
    return step if np.abs(whole - whole.round()).max() < 0.05 else 0.0


def rounding_doubt(values: np.ndarray) -> str:
    """Warning that few of the values are different; empty if most are."""
    if not resolution(values):
        return ""
    present = known(values)
    return f"only {len(np.unique(present))} different values in {len(present)}"


def exact_period(values: np.ndarray, tolerance: float | None = None) -> int | None:
    """Number of values after which a series repeats exactly, at least three times.

    To within rounding, unless a tolerance is given. What is on either side of a gap is not
    compared: how many values are lost is not known. What recurs but for noise is another question
    (`_periodic.noisy_cycle`), as is what a surrogate test calls periodic (`surrogate_testing`).
    """
    if tolerance is None:
        tolerance = 1e-9 * float(np.ptp(known(values)))
    parts = stretches(values)
    longest = max(parts, key=len)
    most = len(longest) // 3
    head = min(8, len(longest) - most)
    later = np.lib.stride_tricks.sliding_window_view(longest, head)[1 : most + 1]
    likely = np.flatnonzero((np.abs(later - longest[:head]) <= tolerance).all(axis=1)) + 1
    for lag in likely.tolist():
        # Against the first cycle, as a slow drift is small from any one cycle to the next.
        off = (np.abs(part - np.resize(part[:lag], len(part))).max() for part in parts)
        if all(one <= tolerance for one in off):
            return int(lag)
    return None


def typical_gap(values: np.ndarray) -> float:
    """Median difference of two unequal values from anywhere in the series."""
    values = known(values)
    half = len(values) // 2
    gaps = np.concatenate(
        [np.abs(np.roll(values, by) - values) for by in (half, half // 2 + 1, half // 3 + 1)]
    )
    return float(np.median(gaps[gaps > 0]))
