"""Standard error of a mean over a run, by batch means."""

from __future__ import annotations

import math

import numpy as np

FEWEST = 8  # batches that still tell a scatter


def batch_error(rates: np.ndarray) -> np.ndarray:
    """Standard error of the mean of the rows, by batch means.

    Neighbouring pieces may depend on each other: they are joined two by two, and the greatest of
    the errors that the joined ones give is taken.

    Parameters
    ----------
    rates : ndarray, shape (n, ...)
        Means over n pieces of one length.

    Returns
    -------
    ndarray, shape (...)
        NaN where there are fewer than 8 pieces.
    """
    error = np.full(rates.shape[1:], math.nan)
    while len(rates) >= FEWEST:
        error = np.fmax(error, rates.std(axis=0, ddof=1) / math.sqrt(len(rates)))
        even = rates[: len(rates) // 2 * 2]
        rates = (even[::2] + even[1::2]) / 2
    return error
