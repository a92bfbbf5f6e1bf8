"""Estimators of a dimension from a correlation sum, or from distances to neighbours.

All take many correlation sums at once, shape (..., radii), with radii evenly spaced in ln r: the
first is that of the data, the others are its resamples.
"""

from __future__ import annotations

import numpy as np
from scipy.special import digamma

from . import _bootstrap
from ._nearest import log_distances_by_block

NEIGHBOURS = 32

LATTICE = 0.6
"""Half of what chance gives as standard deviation of ln r_1, times the dimension."""


def takens(sums: np.ndarray, step: float, low: int) -> np.ndarray:
    r"""Takens and Theiler's maximum-likelihood dimension below every radius r, shape (..., radii).

    .. math:: D(r) = \frac{C(r) - C(r_0)}{\int_{r_0}^{r} C(r') \, d\ln r'}

    is 1 / <ln(r / d)> over the distances d below r, without those below r0 (index `low`)
    [Takens1985]_, [Theiler1988]_. nan up to `low`, and where there are no pairs.
    """
    before, after = sums[..., :-1], sums[..., 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        # Exact for a power law between two radii.
        part = np.where(
            (before > 0) & (after > before),
            (after - before) / np.log(after / before),
            (before + after) / 2,
        )
        integral = np.zeros_like(sums)
        np.cumsum(step * part, axis=-1, out=integral[..., 1:])
        found = (sums - sums[..., low, None]) / (integral - integral[..., low, None])
    found[..., : low + 1] = np.nan
    return found


def takens_resampled(counts: np.ndarray, step: float, low: int, draws: np.ndarray) -> np.ndarray:
    """`takens` of the data and of each resample, shape (1 + resamples, radii).

    Parameters
    ----------
    counts : ndarray of int, shape (blocks, blocks, radii)
        Pairs within each radius by the blocks of both members.
    step, low
        As of `takens`.
    draws : ndarray, shape (resamples, blocks)
        From `_bootstrap.multipliers`.
    """
    found = takens(_bootstrap.sums_without_each(counts), step, low)
    above = (counts - counts[..., low, None]).astype(np.float64)
    integral = np.zeros_like(above)
    part = step * (counts[..., :-1] + counts[..., 1:]) / 2
    np.cumsum(part[..., low:], axis=-1, out=integral[..., low + 1 :])
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = (above - found[0] * integral) / integral.sum(axis=(0, 1))
    return _bootstrap.resampled(found, _bootstrap.pair_variance(parts), draws)


def slopes_resampled(counts: np.ndarray, step: float, reach: int, draws: np.ndarray) -> np.ndarray:
    """`local_slopes` of the data and of each resample, shape (1 + resamples, radii)."""
    found = local_slopes(_bootstrap.sums_without_each(counts), step, reach)
    parts = np.full(counts.shape, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = counts / counts.sum(axis=(0, 1))
        parts[..., reach:-reach] = (share[..., 2 * reach :] - share[..., : -2 * reach]) / (
            2 * reach * step
        )
    return _bootstrap.resampled(found, _bootstrap.pair_variance(parts), draws)


def slope(sums: np.ndarray, step: float, low: int, high: int) -> np.ndarray:
    """Least-squares slope of ln C against ln r between two radii, weighted evenly in ln r."""
    with np.errstate(divide="ignore"):
        logs = np.log(sums[..., low : high + 1])
    x = step * (np.arange(logs.shape[-1]) - (logs.shape[-1] - 1) / 2)
    with np.errstate(invalid="ignore"):
        found = logs @ x / (x @ x)
    return np.where(np.isfinite(found), found, np.nan)


def local_slopes(sums: np.ndarray, step: float, reach: int) -> np.ndarray:
    """Slopes d ln C / d ln r between the radii `reach` places before and after; nan at the ends."""
    found = np.full(sums.shape, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(sums)
        middle = (logs[..., 2 * reach :] - logs[..., : -2 * reach]) / (2 * reach * step)
    found[..., reach:-reach] = np.where(np.isfinite(middle), middle, np.nan)
    return found


SPACINGS = 4.0
"""Spacings of a lattice from which on it is counted; at r, its steps are wrong by about 1 / 2 r."""


class Neighbours:
    """Distances to the nearest neighbours in one embedding, for the fixed-mass dimension.

    Parameters
    ----------
    vectors : ndarray, shape (n, m)
        Delay vectors in the order of time.
    theiler : int
        Neighbours no further away in time are not counted.
    blocks : int
        Blocks of time of the bootstrap.
    seed : int
        Chooses the vectors looked from, where there are more than `MOST`.
    """

    MOST = 1000

    def __init__(self, vectors: np.ndarray, theiler: int, blocks: int, seed: int) -> None:
        from scipy.spatial import cKDTree

        n = len(vectors)
        places = np.flatnonzero(~np.isnan(vectors).any(axis=1))  # not those across a gap
        vectors = vectors[places]
        at = np.arange(len(places))
        if len(at) > self.MOST:
            at = np.sort(np.random.default_rng(seed).choice(len(at), self.MOST, replace=False))
        # Twice as many as are used, as resamples leave some out.
        wanted = min(len(places), 2 * NEIGHBOURS + 2 * theiler + 1)
        distance, index = cKDTree(vectors).query(vectors[at], k=wanted, p=np.inf)
        at, index = places[at], places[index]
        near = (np.abs(index - at[:, None]) <= theiler) | (distance <= 0)
        order = np.argsort(near, axis=1, kind="stable")[:, : 2 * NEIGHBOURS]
        near = np.take_along_axis(near, order, axis=1)
        distance = np.where(near, np.nan, np.take_along_axis(distance, order, axis=1))
        with np.errstate(invalid="ignore"):
            self.logs = np.log(distance)
        self.block_of = np.take_along_axis(index, order, axis=1) * blocks // n
        self.own_block = at * blocks // n

    def even_up_to(self, dimension: float) -> float:
        """The distance below which vectors are spaced too evenly to be counted, 0 if there is none.

        Of vectors that lie where chance puts them, ln of the distance to the nearest has a standard
        deviation of 1.28 / D or more. Those of a quasi-periodic motion lie like a lattice on a
        circle; below its spacing there is nothing to count, and above it too much at once.
        """
        nearest = self.logs[np.isfinite(self.logs[:, 0]), 0]
        if len(nearest) < 20 or nearest.std() * dimension > LATTICE:
            return 0.0
        return float(SPACINGS * np.exp(np.quantile(nearest, 0.9)))

    def dimension(self, draws: np.ndarray, floor: float) -> np.ndarray:
        r"""D1 of the data and of each resample, shape (1 + resamples,); nan where there is none.

        The slope of psi(k) against <ln r_k>, psi being the digamma function, over the ranks k to
        8 k, where k is the first whose mean ln r_k is above `floor` [Badii1985]_,
        [Grassberger1985]_.

        Parameters
        ----------
        draws : ndarray, shape (resamples, blocks)
            From `_bootstrap.multipliers`.
        floor : float
            Distances below it are not used.
        """
        blocks = draws.shape[1]
        none = np.full(1 + len(draws), np.nan)
        most = NEIGHBOURS // 4
        complete = np.isfinite(self.logs[:, most - 1])
        if not complete.any():
            return none
        mean = self.logs[complete, :most].mean(axis=0)
        above = np.flatnonzero(mean >= np.log(floor)) if floor else np.array([0])
        if not len(above):
            return none
        first = int(above[0]) + 1
        last = min(8 * first, NEIGHBOURS)
        ranks = np.unique(np.geomspace(first, last, 6).round().astype(int))
        # Not the logarithms themselves but what each adds to 1 / D, a sum over vectors and ranks.
        mass = digamma(ranks) - digamma(ranks).mean()
        weights = _bootstrap.without_each(blocks)
        sums = log_distances_by_block(self.logs, self.block_of, self.own_block, weights, ranks)
        sums = sums @ (mass / (mass @ mass))
        vectors = np.bincount(self.own_block, minlength=blocks)
        left = np.append(sums[0].sum(), [np.delete(sums[1 + b], b).sum() for b in range(blocks)])
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.append(vectors.sum(), vectors.sum() - vectors) / left
        if not found[0] > 0:
            return none
        parts = found[0] * (sums[0] - sums[1:]) / left[0]
        found = np.where(found > 0, found, np.nan)
        return _bootstrap.resampled(found, _bootstrap.pair_variance(parts), draws)
