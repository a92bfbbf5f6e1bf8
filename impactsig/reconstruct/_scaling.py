"""Which radii a dimension is read from: floors of resolution and noise, and the scaling region."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import erf

from ._estimators import takens

TOLERANCE = 0.03
"""Relative differences between scales no larger than this are taken for lacunarity, not bias."""

LARGEST_SUM = 0.1
"""C(r) above which the extent of the attractor shows in every slope."""


def quantum(x: np.ndarray) -> float:
    """The step in which the numbers were rounded, 0 where they were not.

    The smallest difference between values that differ, if values repeat far more often than those
    of a continuous quantity would, and if all differences are whole multiples of it.
    """
    values = np.unique(x)
    if len(values) < 2 or len(values) > 0.9 * len(x):
        return 0.0
    gaps = np.diff(values)
    step = float(gaps[gaps > 1e-12 * np.abs(values).max()].min(initial=np.inf))
    if not np.isfinite(step):
        return 0.0
    whole = gaps / step
    return step if np.abs(whole - whole.round()).max() < 0.05 * max(1.0, whole.max()) else 0.0


def noise_level(counts: np.ndarray, radii: np.ndarray, dimensions: tuple[int, ...]) -> float:
    r"""Standard deviation of Gaussian noise on the series, 0 where none shows.

    Noise of standard deviation s parts two neighbours by another difference in every coordinate,
    so that each further coordinate multiplies the correlation sum by

    .. math:: C_{m+1}(r) / C_m(r) = A_m \operatorname{erf}(r / 2 s)

    at radii well inside the attractor, where without noise the ratio hardly depends on r
    [Schreiber1993]_. The s that fits best is taken if it takes away nine tenths of the variation
    of the ratio that is more than that of the counts.

    Parameters
    ----------
    counts : ndarray, shape (dimensions, radii)
        Pairs within each radius.
    radii : ndarray, shape (radii,)
    dimensions : tuple of int
    """
    trial = np.append(0.0, np.geomspace(radii[0] / 2, radii[-1] / 4, 160))
    total = np.zeros(len(trial))
    freedom = 0
    for lower in range(len(dimensions) - 1):
        if dimensions[lower] < 2:
            continue
        below, above = counts[lower], counts[lower + 1]
        share = below / below[-1]
        use = np.flatnonzero((above >= 20) & (share <= 0.03))[::4]
        if len(use) < 4:
            continue
        ratio = np.log(above[use] / below[use])
        # A ratio of nested counts is binomial; a floor keeps huge counts from deciding by trifles.
        variance = (1 - above[use] / below[use]) / above[use] + 0.03**2
        steps = dimensions[lower + 1] - dimensions[lower]
        with np.errstate(divide="ignore"):
            model = np.array(
                [
                    np.zeros(len(use)) if s == 0 else steps * np.log(erf(radii[use] / (2 * s)))
                    for s in trial
                ]
            )
        rest = ratio - model
        rest -= (rest / variance).sum(1, keepdims=True) / (1 / variance).sum()
        total += (rest**2 / variance).sum(1)
        freedom += len(use) - 1
    if not freedom:
        return 0.0
    best = int(np.argmin(total))
    gain = total[0] - total[best]
    return float(trial[best]) if gain > 6 and gain > 0.5 * total[0] else 0.0


class Reading(NamedTuple):
    """A dimension read from one correlation sum, with what it was read from.

    `values` are the estimate of the data and of the resamples; `takens` the Takens estimate
    averaged over the region; `low`, `high` the ends of the scaling region (indices of radii).
    """

    values: np.ndarray
    takens: np.ndarray
    low: int
    high: int


def pair_variance(value: float, pairs: np.ndarray) -> np.ndarray:
    """Variance of a Takens estimate by the number of its pairs alone, D^2 / n."""
    return value**2 / np.maximum(pairs, 1)


def spread(values: np.ndarray, surplus: np.ndarray | float) -> np.ndarray:
    """Variance over the resamples, without what drawing pairs by both members counts twice over.

    The noise of a pair's own distance enters the drawing of its first member, of its second and of
    both at once, three times for once.
    """
    found = np.nanvar(values[1:], axis=0)
    return np.maximum(found - 2 * surplus, found / 3)


def read(
    sums: np.ndarray,
    pairs: float,
    points: int,
    radii: np.ndarray,
    floor: float,
    neighbours: np.ndarray | None,
) -> Reading | None:
    """The dimension at every scale, averaged as far as the scales agree; None if there are none.

    Parameters
    ----------
    sums : ndarray, shape (1 + resamples, radii)
    pairs : float
        Number of pairs C is a share of.
    points : int
        Number of delay vectors.
    radii : ndarray, shape (radii,)
        Evenly spaced in ln r.
    floor : float
        Radii below it are not used.
    neighbours : ndarray, shape (1 + resamples,), or None
        A dimension by nearest neighbours.
    """
    step = float(np.log(radii[1] / radii[0]))
    octave = round(np.log(2) / step)
    data = sums[0]
    anchor = int(np.searchsorted(data, 3 / points))
    lowest = int(np.searchsorted(radii, floor)) if floor else max(0, anchor - 5 * octave)
    anchor = max(anchor, lowest + octave)
    highest = int(np.searchsorted(data, LARGEST_SUM))
    first = max(int(np.searchsorted(data, 1 / points)), lowest + octave // 2)
    if highest < anchor:
        return None
    scales = np.arange(min(first, anchor), highest + 1)
    found = takens(sums, step, lowest)
    below = pairs * (data[scales] - data[lowest])
    at_anchor = found[:, anchor].copy()
    near = pairs * (data[anchor] - data[lowest])
    value = float(at_anchor[0])
    if not np.isfinite(value) or near < 30:
        return None
    noise = spread(at_anchor, pair_variance(value, near))
    if neighbours is not None and np.isfinite(neighbours[0]):
        weight = noise / (noise + np.nanvar(neighbours[1:]) + (TOLERANCE * value) ** 2)
        at_anchor += weight * (neighbours - at_anchor)
        noise = float(np.nanvar(at_anchor[1:]))
    found = found[:, scales]
    apart = found - at_anchor[:, None]
    surplus = pair_variance(value, below)
    variance = spread(apart, np.abs(pair_variance(value, near) - surplus))
    tolerated = variance + (TOLERANCE * value) ** 2
    # The extent of an attractor lowers the slope: a rise must be beyond doubt to be a bias.
    bias = np.where(apart[0] < 0, apart[0] ** 2, np.maximum(apart[0] ** 2 - 4 * variance, 0))
    share = tolerated / (tolerated + bias)
    values = at_anchor[:, None] + share * apart
    precision = 1 / (
        share * spread(found, surplus) + (1 - share) * noise + (TOLERANCE * value) ** 2
    )
    mean = _mean(values, precision)
    agree = np.flatnonzero(share < 0.5)
    beyond = agree[scales[agree] > anchor]
    high = int(scales[beyond[0]] - 1) if len(beyond) else int(scales[-1])
    inside = scales <= high
    return Reading(mean, _mean(found[:, inside], precision[inside]), lowest, high)


def _mean(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    known = np.isfinite(values)
    total = np.where(known, weights, 0.0).sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.where(known, weights * values, 0.0).sum(axis=1) / total
