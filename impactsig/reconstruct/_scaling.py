"""Which radii a dimension is read from: floors of resolution and noise, and the scaling region."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import erf

from . import _bending, _bootstrap
from ._estimators import takens_resampled

TOLERANCE = 0.03
"""Relative differences between scales no larger than this are taken for lacunarity, not bias."""

LEAST_PAIRS = 30
"""Pairs below the anchor, of which an estimate is made at all."""

ANCHOR = 0.17
"""C(r) times the square root of the number of vectors, where an estimate begins."""

CHANCE = 9.0
"""Square of the standard errors within which a difference is chance; of ten blocks 1 % are more."""

DEPARTS = 0.15
"""Relative departure of a local slope beyond what lacunarity does, at which a region ends."""

MOST_DOUBT = np.log(2)
"""Beyond it the noise level is as good as unknown, and the radii left out are a precaution."""

LARGEST_SUM = 0.1
"""C(r) above which the extent of the attractor shows in every slope."""


SATURATED = 0.4
"""What a further coordinate may add to the dimension at a plateau; of noise it adds nearly one."""


class Noise(NamedTuple):
    """What `noise_level` found.

    Attributes
    ----------
    level : float
        Standard deviation of Gaussian noise that would explain the correlation sums; 0 if none.
    certain : bool
        Whether only noise explains them, rather than a dimension that still rises with m.
    factor : float
        By which the level may be wrong either way, a standard error; 2 at most.
    """

    level: float
    certain: bool
    factor: float


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
    return step if np.abs(whole - whole.round()).max() < 0.05 else 0.0


def noise_level(
    counts: Sequence[np.ndarray], radii: np.ndarray, dimensions: tuple[int, ...]
) -> Noise:
    r"""Standard deviation of Gaussian noise on the series, 0 where none shows.

    Noise of standard deviation s parts two neighbours by another difference in every coordinate,
    so that each further coordinate multiplies the correlation sum by

    .. math:: C_{m+1}(r) / C_m(r) = A_m \operatorname{erf}(r / 2 s)

    at radii well inside the attractor, where without noise the ratio hardly depends on r
    [Schreiber1993]_. The s that fits best is taken if it explains three tenths of the
    variation of the ratios, and three units of their weighted sum of squares. It is certain if
    no power law of r explains them to three units as well, with an exponent of 0.4 at most, which
    is what a coordinate adds to the dimension while the attractor unfolds. How far it may be wrong
    is told by the levels without each block of time: the misfit does not, as ratios at neighbouring
    radii, of the same pairs, err together.

    Parameters
    ----------
    counts : sequence of ndarray of int, shape (blocks, blocks, radii)
        Pairs within each radius by the blocks of both members, of each embedding dimension.
    radii : ndarray, shape (radii,)
    dimensions : tuple of int
    """
    sums = np.stack([_bootstrap.pairs_without_each(one) for one in counts], axis=1)
    level, gain, by_rise = _fitted_noise(sums[0], radii, dimensions)
    if not gain > 0:
        return Noise(0.0, False, 1.0)
    left = [_fitted_noise(one, radii, dimensions)[0] for one in sums[1:]]
    logs = np.log([one for one in left if one > 0] or [level])
    doubt = np.sqrt(max(len(logs) - 1, 0)) * logs.std()
    return Noise(level, by_rise > 3, float(np.exp(min(doubt, MOST_DOUBT))))


def _fitted_noise(
    counts: np.ndarray, radii: np.ndarray, dimensions: tuple[int, ...]
) -> tuple[float, float, float]:
    """The level that fits best, what it gains (0 if too little), and how much more than a rise."""
    trial = np.append(0.0, np.geomspace(radii[0] / 2, radii[-1] / 4, 160))
    rises = np.linspace(0.0, SATURATED, 21)
    by_noise, by_rise = np.zeros(len(trial)), np.zeros(len(rises))
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
        r = radii[use]
        noise = np.zeros((len(trial), len(use)))
        with np.errstate(divide="ignore"):
            noise[1:] = np.log(erf(r / (2 * trial[1:, None])))
        by_noise += _misfit(ratio - steps * noise, variance)
        by_rise += _misfit(ratio - steps * rises[:, None] * np.log(r), variance)
    best = int(np.argmin(by_noise))
    gain = by_noise[0] - by_noise[best]
    level = float(trial[best])
    if 1 < best < len(trial) - 1:
        before, here, after = by_noise[best - 1 : best + 2]
        place = (before - after) / (2 * (before - 2 * here + after))
        level *= float(trial[-1] / trial[-2]) ** float(place)
    enough = gain > 3 and gain > 0.3 * by_noise[0]
    return level, float(gain) if enough else 0.0, float(by_rise.min() - by_noise[best])


def _misfit(rest: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Weighted sum of squares of each row about its own mean."""
    rest = rest - (rest / variance).sum(1, keepdims=True) / (1 / variance).sum()
    squares: np.ndarray = (rest**2 / variance).sum(1)
    return squares


def highest_scale(sums: np.ndarray) -> int:
    """The last radius of the scales looked at, by its index."""
    return int(np.searchsorted(sums, LARGEST_SUM))


class Reading(NamedTuple):
    """A dimension read from one correlation sum.

    Attributes
    ----------
    values : ndarray, shape (1 + resamples,)
        The estimate of the data, and of each resample.
    takens : ndarray, shape (1 + resamples,)
        The Takens estimate averaged over the scaling region alone.
    low, high : int
        Ends of the scaling region, as indices of radii.
    """

    values: np.ndarray
    takens: np.ndarray
    low: int
    high: int


class Scales(NamedTuple):
    """What one correlation sum tells at every scale, before scales are compared.

    Attributes
    ----------
    places : ndarray of int, shape (scales,)
        Indices of the radii looked at; the last is where C = 0.1.
    low, anchor : int
        Indices of the least radius used and of the anchor.
    takens : ndarray, shape (1 + resamples, scales)
        Takens' estimates of the data, and of each resample.
    start : ndarray, shape (1 + resamples,)
        The estimate at the anchor.
    pairs : ndarray of int, shape (scales,)
        Pairs from the least radius up to each.
    bend : ndarray, shape (1 + resamples,)
        `_bending.bend` of the scales that hold enough pairs.
    """

    places: np.ndarray
    low: int
    anchor: int
    takens: np.ndarray
    start: np.ndarray
    pairs: np.ndarray
    bend: np.ndarray


def scales(
    counts: np.ndarray,
    points: int,
    radii: np.ndarray,
    floor: float,
    neighbours: np.ndarray,
    draws: np.ndarray,
) -> Scales | None:
    """Takens' estimates from a thirtieth of the anchor's C to C = 0.1, and the anchor.

    The anchor is at C = 0.17 / sqrt(n) (or an octave above the floor): so it moves to small radii
    as n grows, but slowly enough to become certain. Its estimate is averaged with that of the
    nearest neighbours by inverse variance.

    Parameters
    ----------
    counts : ndarray of int, shape (blocks, blocks, radii)
        Pairs within each radius by the blocks of both members; within the last radius are all.
    points : int
        Number of delay vectors.
    radii : ndarray, shape (radii,)
        Evenly spaced in ln r.
    floor : float
        Radii below it are not used.
    neighbours : ndarray, shape (1 + resamples,)
        A dimension by nearest neighbours; nan where there is none.
    draws : ndarray, shape (resamples, blocks)
        From `_bootstrap.multipliers`.

    Returns
    -------
    Scales or None
        None if no radius between the floor and C = 0.1 holds enough pairs.
    """
    step = float(np.log(radii[1] / radii[0]))
    octave = round(np.log(2) / step)
    within = counts.sum(axis=(0, 1))
    sums = within / within[-1]
    anchor = int(np.searchsorted(sums, ANCHOR / np.sqrt(points)))
    first = int(np.searchsorted(sums, ANCHOR / np.sqrt(points) / 30))
    lowest = int(np.searchsorted(radii, floor)) if floor > radii[0] else 0
    lowest = max(lowest, anchor - 5 * octave)
    anchor = max(anchor, lowest + octave)
    highest = highest_scale(sums)
    first = max(first, lowest + octave // 2)
    if highest < anchor or within[anchor] - within[lowest] < LEAST_PAIRS:
        return None
    places = np.arange(min(first, anchor), highest + 1)
    found = takens_resampled(counts, step, lowest, draws)
    start = found[:, anchor].copy()
    if np.isfinite(neighbours[0]):
        noise = start[1:].var()
        tolerated = (TOLERANCE * float(start[0])) ** 2
        share = noise / (noise + neighbours[1:].var() + tolerated)
        start += share * (neighbours - start)
    pairs = within[places] - within[lowest]
    certain = pairs >= LEAST_PAIRS
    bend = _bending.bend(found[:, places[certain]], pairs[certain], step, TOLERANCE)
    return Scales(places, lowest, anchor, found[:, places], start, pairs, bend)


def read(given: Scales, odds: np.ndarray, slopes: tuple[np.ndarray, np.ndarray]) -> Reading:
    r"""The dimension at every scale, averaged as far as the scales agree.

    1. Takens' estimates T_k are drawn towards that of the anchor, S + s_k (T_k - S) with
       s_k = V_k / (V_k + b_k), where V_k is the variance of T_k - S (and 3 % of S squared) and b_k
       the squared bias: what of (T_k - S)^2 is beyond 9 V_k; of a fall, (T_k - S)^2 times the odds
       that the power law bends, if that is more, as the extent of an attractor lowers slopes.
    2. The value is their mean, with weights of the inverse variance cubed: the scales share most
       of their pairs, so that the certain ones gain nothing by the uncertain.

    All of it is done for each resample too, as which scales agree is itself uncertain. Variances
    are means of the jackknife's and of what the number of pairs lets expect (`_bending.by_pairs`).
    The scaling region ends where s_k falls below one half, or before: where the local slope departs
    from the value by 15 % and three standard errors, which Takens' estimate, being of all radii
    below, follows only late.

    Parameters
    ----------
    given : Scales
    odds : ndarray, shape (1 + resamples,)
        From `_bending.odds`.
    slopes : tuple of ndarray, shape (radii,)
        Local slopes and their standard errors.
    """
    found, start = given.takens, given.start
    dimension = float(start[0])
    tolerated = (TOLERANCE * dimension) ** 2
    apart = found - start[:, None]
    squared = apart**2
    alone = _bending.by_pairs(dimension, given.pairs)
    anchored = alone[given.anchor - given.places[0]]
    variance = (apart[1:].var(axis=0) + np.abs(alone - anchored)) / 2 + tolerated
    beyond = np.maximum(squared - CHANCE * variance, 0)
    bias = np.where(apart < 0, np.maximum(beyond, odds[:, None] * squared), beyond)
    share = variance / (variance + bias)
    noise = share * (found[1:].var(axis=0) + alone) / 2 + (1 - share) * start[1:].var() + tolerated
    weights = noise**-3.0
    values = _mean(start[:, None] + share * apart, weights)
    local, error = slopes[0][given.places], slopes[1][given.places]
    leaves = np.abs(local - values[0]) > np.maximum(DEPARTS * values[0], 3 * error)
    after = given.places[((share[0] < 0.5) | leaves) & (given.places > given.anchor)]
    high = int(after[0] - 1) if len(after) else int(given.places[-1])
    inside = given.places <= high
    takens = _mean(found[:, inside], weights[:, inside])
    return Reading(values, takens, given.low, high)


def read_region(
    counts: np.ndarray, radii: np.ndarray, low: int, high: int, draws: np.ndarray
) -> Reading | None:
    """The Takens estimate averaged over the upper octave, or half, of a region that was chosen."""
    step = float(np.log(radii[1] / radii[0]))
    if counts[..., high].sum() - counts[..., low].sum() < LEAST_PAIRS:
        return None
    first = max((low + high) // 2, high - round(np.log(2) / step)) + 1
    found = takens_resampled(counts, step, low, draws)[:, first : high + 1]
    values = _mean(found, np.ones(found.shape))
    return Reading(values, values, low, high)


def _mean(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted mean of each row, of what is known in it."""
    known = np.isfinite(values) & np.isfinite(weights)
    with np.errstate(invalid="ignore"):
        return np.where(known, weights * values, 0).sum(1) / np.where(known, weights, 0).sum(1)
