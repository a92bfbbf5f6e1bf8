"""Recognition of a series before a dimension is estimated: periodic, tones, noise or motion.

The only place that decides it: `correlation_dimension`, the report and the command all ask here.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtri

from ...impacts import Impacts
from ...intervals import identify_period
from .._values import exact_period
from . import _periodic
from ._tones import tones
from .kinds import CERTAIN, Kind, is_certain, of_period

FINE = 0.02
"""Share of the standard deviation below which a resolution lets recurrences be told from chance."""

ORDER = 10
"""Of the autoregression that stands for linear noise."""

COORDINATES = 3
NEIGHBOURS = 4
MOST = 4000
"""Values that the test for noise looks at."""

BEYOND_CHANCE = 4.0
"""Standard errors from which on neighbours that share their innovation are no chance."""


def recognise(
    x: Impacts | None,
    values: np.ndarray,
    longest: np.ndarray,
    resolution: float,
    stated: float,
    theiler: int,
) -> Kind:
    """Recognise the kind of a series.

    Parameters
    ----------
    x : Impacts or None
        The impacts, where the values are their intervals.
    values : ndarray, shape (n,)
        Without gaps.
    longest : ndarray
        The longest stretch between gaps.
    resolution : float
        Step of the values; 0 where they are not rounded.
    stated : float
        The same where the caller gives it: within it, values are equal.
    theiler : int
        Theiler window.
    """
    greatest = float(np.abs(values).max())
    rounding = 8 * np.finfo(float).eps * greatest
    if np.ptp(values / (greatest or 1.0)) * greatest <= max(rounding, stated):
        return Kind("constant")
    deviation = float((values / greatest).std()) * greatest
    # Where the step is coarse, everything recurs to within it.
    tolerance = 2 * resolution if resolution < FINE * deviation else 0.0
    period = exact_period(values, tolerance + rounding)
    if period:
        return Kind("periodic", period)
    found = None if x is None else identify_period(x)
    if found is not None and is_certain(found):
        return of_period(found)
    # What strays from a period by a map or by a second tone is a motion, however near it stays.
    if found is None or not (found.aperiodic and found.impacts and found.confidence >= CERTAIN):
        cycle = _periodic.noisy_cycle(values, resolution, x is not None)
        if cycle:
            return Kind("periodic", cycle.steps, cycle.scatter)
    unit = (longest - longest.mean()) / (deviation or 1.0)
    series_of_tones = tones(unit, resolution / deviation)
    if series_of_tones is not None:
        return Kind("quasi-periodic", scatter=series_of_tones.scatter * deviation,
                    tones=series_of_tones.independent)  # fmt: skip
    if max(shared_innovations(unit, theiler), shared_innovations(unit[::-1], theiler)) < (
        BEYOND_CHANCE
    ):
        return Kind("noise")
    return Kind("motion")


def shared_innovations(x: np.ndarray, theiler: int) -> float:
    """Correlation of the linear residuals of neighbours, in standard errors.

    Of linear noise the residuals of an autoregression are independent of the state; of a motion
    they are a function of it, so that neighbours have similar ones [Theiler1992]_. Both directions
    of time are to be asked, as a motion driven at random is foretold only backwards. The values are
    made normal by their ranks first, which undoes a monotone instrument. Of fewer than 30 values
    nothing is beyond chance.
    """
    if len(x) < 10 * COORDINATES:
        return 0.0
    x = ndtri((_ranks(x[:MOST]) - 0.5) / min(len(x), MOST))
    order = min(ORDER, len(x) // 10)
    lagged = np.lib.stride_tricks.sliding_window_view(x, order + 1)
    design = np.column_stack([lagged[:, :-1], np.ones(len(lagged))])
    left = lagged[:, -1] - design @ np.linalg.lstsq(design, lagged[:, -1], rcond=None)[0]
    if not left.std() > 0:
        return 0.0
    ranks = _ranks(left)  # so that a few rare innovations do not decide
    ranks = (ranks - ranks.mean()) / ranks.std()
    states = lagged[:, order - COORDINATES : -1]
    _, near = cKDTree(states).query(states, k=min(NEIGHBOURS + 2 * theiler + 1, len(states)))
    apart = np.abs(near - np.arange(len(near))[:, None]) > theiler
    apart &= np.cumsum(apart, axis=1) <= NEIGHBOURS
    pairs = np.argwhere(apart)
    i, j = pairs[:, 0], near[pairs[:, 0], pairs[:, 1]]
    low, high = np.minimum(i, j), np.maximum(i, j)
    _, once = np.unique(low * len(near) + high, return_index=True)
    products = ranks[low[once]] * ranks[high[once]]
    return float(products.sum() / np.sqrt(max(len(products), 1)))


def _ranks(x: np.ndarray) -> np.ndarray:
    """Ranks from 1 on, averaged over ties."""
    _, place, count = np.unique(x, return_inverse=True, return_counts=True)
    return (np.cumsum(count) - (count - 1) / 2)[place]
