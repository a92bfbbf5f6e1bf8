"""The timing error of impacts in those states of which a correlation sum counts the most pairs.

Where intervals have delay vectors with errors of covariance S_ij, and S is taken off from all, the
sum over pairs at the scale H is off by the mean of (1 + (S_ij - S) / H^2)^((D - m)/2) over the
pairs without errors. To first order S is the mean of S_ij over close pairs, not over impacts: hard
impacts are known to less and weak ones to more than the usual, and a motion spends most of its
time near few of them.
"""

from __future__ import annotations

import math

import numpy as np

from ..._trains.interval_errors import errors_in_intervals
from ...impacts import Impacts
from .._series import series
from .._stated import FAR_OFF

NEAR = 3.0
"""Errors of an interval within which two vectors are close."""
ROUNDS = 3
LENGTH = 3
"""Values in a vector."""
MOST = 20_000
"""Vectors whose neighbours are counted."""


def error_among_pairs(impacts: Impacts, delay: int, usual: float) -> float:
    """Root mean square of the errors of instants [s], each as often as its vectors have neighbours.

    Parameters
    ----------
    impacts : Impacts
        With `time_error`.
    delay : int
        Of the vectors [steps].
    usual : float
        That of all impacts [s]; errors far beyond it have lost their neighbours.
    """
    from scipy.spatial import cKDTree

    if not usual:
        return usual
    error = errors_in_intervals(impacts, np.asarray(impacts.time_error))
    square = np.where(error < FAR_OFF * usual, error / usual, np.inf) ** 2
    times = np.where(impacts.interval_spans_gap(), delay, 1)
    between = np.repeat(0.5 * (square[1:] + square[:-1]), times)
    values = series(impacts, gap=delay)
    longest = float(np.nanmax(values))
    values = values / longest
    places = np.arange(max(len(values) - (LENGTH - 1) * delay, 0))[:, None]
    places = places + delay * np.arange(LENGTH)
    vectors, own = values[places], between[places].mean(axis=1)
    whole = np.isfinite(own) & np.isfinite(vectors).all(axis=1)
    vectors, own = vectors[whole], own[whole]
    if not len(vectors) or own.min() == own.max():
        return usual
    tree, step = cKDTree(vectors), -(-len(vectors) // MOST)
    vectors, own = vectors[::step], own[::step]
    found = 1.0
    for _ in range(ROUNDS):
        radius = NEAR * math.sqrt(2.0 * found) * (usual / longest)
        near = tree.query_ball_point(vectors, radius, p=np.inf, return_length=True) - 1.0
        if not near.any():
            break
        found = float(near @ own / near.sum())
    return math.sqrt(found) * usual
