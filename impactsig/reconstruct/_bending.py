"""Whether a correlation sum is one power law up to large radii, or bends before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

RUNS = 10.0
"""Variance of Takens' estimate in units of that of independent pairs.

Close pairs come in runs and share their vectors: of seven systems it is 4 to 17 where C = 0.01,
whether of 300 values or of 1000.
"""


def by_pairs(dimension: float, pairs: np.ndarray) -> np.ndarray:
    """Variance of Takens' estimate of so many pairs, as it is on average over systems.

    Of one series it is right but for a factor of two or so, and so is the variance that a dozen
    blocks tell, as a few of them hold most of the close pairs. The mean of both scatters less.
    """
    return RUNS * dimension**2 / np.maximum(pairs, 1)


def bend(takens: np.ndarray, pairs: np.ndarray, step: float, tolerance: float) -> np.ndarray:
    r"""Square of the slope of Takens' estimates against ln r, in standard errors.

    An estimate at a small radius differs from one at a large radius by chance, of which most is of
    the small one: their difference alone tells little. But the estimates share their pairs, so that
    what each adds to the one before is nearly independent, with a covariance of D^2 times

    .. math:: \operatorname{RUNS} / \max(n_k, n_l) + \epsilon^2 \delta_{kl}

    for n_k pairs and the tolerance epsilon. The slope is that of generalised least squares.

    Parameters
    ----------
    takens : ndarray, shape (1 + resamples, scales)
    pairs : ndarray, shape (scales,)
        Pairs behind each estimate.
    step : float
        Between successive ln r.
    tolerance : float
        Relative differences between scales that are no bend.

    Returns
    -------
    ndarray, shape (1 + resamples,)
        0 for fewer than four scales, and where an estimate is not known.
    """
    scales = takens.shape[1]
    if scales < 4 or not np.isfinite(takens).all():
        return np.zeros(len(takens))
    dimension = float(takens[0, -1])
    chance = by_pairs(dimension, np.maximum.outer(pairs, pairs))
    tolerated = (tolerance * dimension) ** 2
    design = np.column_stack([np.ones(scales), step * np.arange(scales)])
    weighed = np.linalg.solve(chance + tolerated * np.eye(scales), design)
    weights = np.linalg.solve(design.T @ weighed, weighed.T)[1]
    slope = takens @ weights
    variance = (weights @ chance @ weights + slope[1:].var()) / 2 + tolerated * weights @ weights
    squared: np.ndarray = slope**2 / variance
    return squared


def odds(bends: Sequence[np.ndarray], points: int) -> np.ndarray:
    r"""Odds that the power law bends below C = 0.1, of the data and of each resample.

    .. math:: \exp\tfrac12 (\overline{z^2} - \ln n)

    by Schwarz's criterion for one parameter more [Schwarz1978]_, z being the slope in standard
    errors; the mean is over embedding dimensions, as all tell of the same attractor by the same
    vectors.

    Parameters
    ----------
    bends : sequence of ndarray, shape (1 + resamples,)
        `bend` of each embedding dimension.
    points : int
        Number n of delay vectors.
    """
    squared = np.mean(bends, axis=0)
    found: np.ndarray = np.exp(np.clip((squared - np.log(points)) / 2, -50, 50))
    return found
