"""Standard deviation of z-scores, with an interval over the records that they come from.

Errors of one record have causes in common: its modes, its shape of pulse, the filter that was
chosen. Impacts of one record are therefore no independent draws, and an interval has to be taken
over records.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
WANTED = 0.8, 1.25
"""What the standard deviation of z-scores should lie in, for errors as large as stated."""


def spread_over_records(
    groups: Sequence[np.ndarray], *, about_mean: bool = True
) -> tuple[float, float, float]:
    """Standard deviation of all z-scores, and the ends of its interval.

    Parameters
    ----------
    groups : z-scores of each record
    about_mean : about the mean of all; otherwise about 0

    Notes
    -----
    With v_i the logarithm of the variance without record i, of n, that of all has the jackknife's
    variance (n - 1) / n sum (v_i - mean v)^2, and Student's distribution of n - 1 degrees of
    freedom. (Intervals of 95 % by a bootstrap over four or five records hold in 76 to 80 %, these
    in 93 to 94 %.) With fewer than two records nothing is known: 0 to infinity.
    """
    sums = np.array([(len(z), np.sum(z), np.sum(np.square(z))) for z in groups if len(z)])
    if not len(sums):
        return np.nan, 0.0, np.inf
    total = sums.sum(axis=0)
    spread = float(np.sqrt(_variance(total, about_mean)))
    count = len(sums)
    if count < 2:
        return spread, 0.0, np.inf
    without = np.log(_variance((total - sums).T, about_mean))
    error = np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2))
    factor = float(np.exp(0.5 * stats.t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1) * error))
    return spread, spread / factor, spread * factor


def within(spread: float | np.ndarray) -> bool | np.ndarray:
    """Whether standard deviations of z-scores are as WANTED."""
    return (spread >= WANTED[0]) & (spread <= WANTED[1])


def contradicted(least: float, most: float) -> str:
    """The side of WANTED, "above" or "below", where all of an interval lies; "" if not all does."""
    return "above" if least > WANTED[1] else "below" if most < WANTED[0] else ""


def _variance(sums: np.ndarray, about_mean: bool) -> np.ndarray:
    """Variance from the number, the sum and the sum of squares."""
    number, total, squares = sums
    mean = total / number if about_mean else 0.0
    return np.asarray(np.maximum(squares / number - mean**2, 1e-12))
