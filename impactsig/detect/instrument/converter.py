"""Quantisation step of a record."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit

EPS = float(np.finfo(float).eps)


def converter_step(samples: np.ndarray) -> float:
    """Quantisation step of the samples, after any gain; 0 if none shows.

    Values that differ by less than rounding are one. All differences of the values seen must be
    whole multiples of the step.
    """
    seen = np.sort(samples[:: max(1, len(samples) // 2048)])
    rounding = 64 * EPS * max(abs(float(seen[0])), abs(float(seen[-1])))
    if not 1 <= _differing(seen, rounding) < 0.7 * len(seen):
        return 0.0
    differences = seen[1:] - seen[:-1]
    differences = differences[differences > rounding]
    least = float(differences.min())
    least = float(np.median(differences[differences < 1.5 * least]))
    if len(differences) == 1 and least > 0.05 * float(samples.max() - samples.min()):
        return 0.0
    multiples = differences / least
    single = multiples < 1.5
    if single.mean() < 0.05:
        return 0.0
    few = multiples < 1e4
    step = float(differences[few].sum() / np.round(multiples[few]).sum())
    off = np.abs(differences / step - np.round(differences / step))
    return step if step > 40 * rounding and np.quantile(off[few], 0.95) < 0.05 else 0.0


@njit(nogil=True)
def _differing(seen: np.ndarray, rounding: float) -> int:
    """Number of sorted values that exceed their predecessor by more than rounding."""
    count = 0
    for k in range(1, len(seen)):
        count += seen[k] - seen[k - 1] > rounding
    return count
