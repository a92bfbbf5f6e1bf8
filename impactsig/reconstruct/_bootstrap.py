"""Block bootstrap of a statistic of pairs: what it would be, had other blocks of time been seen.

Pairs are not independent: each point takes part in n - 1 of them, and neighbours in time share
theirs. Every statistic is therefore formed anew without each of the blocks in turn, blocks being
longer than the memory of the series, and a resample is the statistic of the data plus its changes
so found, each times a standard normal number: the multiplier bootstrap of the block jackknife
[EfronStein1981]_. Drawing blocks with replacement, with the pairs among them, does worse: nearest
neighbours drawn with their own block make distances that no series has.
"""

from __future__ import annotations

import numpy as np

RESAMPLES = 200


def block_count(vectors: int, theiler: int) -> int:
    """Blocks of four Theiler windows, 20 at most; of two where that makes fewer than 8; never 3.

    A phase remembers longer than the two periods that the window spans.
    """
    fewest = np.clip(vectors // (2 * (theiler + 1)), 4, 8)
    return int(np.clip(vectors // (4 * (theiler + 1)), fewest, 20))


def without_each(blocks: int) -> np.ndarray:
    """Weights of the blocks, shape (1 + blocks, blocks): all, then all but each in turn."""
    return np.vstack([np.ones(blocks), 1 - np.eye(blocks)])


def multipliers(blocks: int, seed: int) -> np.ndarray:
    """Standard normal numbers, shape (resamples, blocks), the same for all that is resampled."""
    return np.random.default_rng(seed).standard_normal((RESAMPLES, blocks))


def pairs_without_each(counts: np.ndarray) -> np.ndarray:
    """Pairs within each radius, of all and without each block, shape (1 + blocks, radii).

    Parameters
    ----------
    counts : ndarray of int, shape (blocks, blocks, radii)
        Pairs within each radius by the blocks of both members; within the last radius are all.
    """
    total = counts.sum(axis=(0, 1))
    own = np.diagonal(counts).T
    left: np.ndarray = total - counts.sum(axis=0) - counts.sum(axis=1) + own
    return np.vstack([total, left])


def sums_without_each(counts: np.ndarray) -> np.ndarray:
    """C(r) of all and without each block, shape (1 + blocks, radii); see `pairs_without_each`."""
    sums = pairs_without_each(counts).astype(np.float64)
    with np.errstate(invalid="ignore"):
        return sums / sums[:, -1:]


def pair_variance(parts: np.ndarray) -> np.ndarray:
    r"""Variance that a sum over pairs of blocks has by the chance of single pairs, shape (...).

    Of blocks a < b the part is taken for mu + g_a + g_b + e_ab, a diallel without its diagonal: the
    g are by the blocks, as they were visited; the e by the pairs, as they chanced to lie. Returned
    is the variance of the sum of all e,

    .. math:: \frac{B (B - 1)}{2} \frac{1}{B (B - 3) / 2} \sum_{a < b} \hat e_{ab}^2

    [Griffing1956]_. The jackknife takes it in twice, once by each of the two blocks.

    Parameters
    ----------
    parts : ndarray, shape (blocks, blocks, ...)
        What the pairs of two blocks contribute, in either order of the two; the diagonal, pairs
        within a block, is not looked at.
    """
    blocks = len(parts)
    between = parts + parts.swapaxes(0, 1)
    between[np.arange(blocks), np.arange(blocks)] = 0
    rows = between.sum(axis=1)
    total = rows.sum(axis=0) / 2
    rest = (
        (between**2).sum(axis=(0, 1)) / 2
        - (rows**2).sum(axis=0) / (blocks - 2)
        + 2 * total**2 / ((blocks - 1) * (blocks - 2))
    )
    return rest * (blocks - 1) / (blocks - 3)


def resampled(values: np.ndarray, by_pairs: np.ndarray, draws: np.ndarray) -> np.ndarray:
    """A statistic of the data and of its resamples, shape (1 + resamples, ...).

    Parameters
    ----------
    values : ndarray, shape (1 + blocks, ...)
        Of all, and without each block; nan where it is not known.
    by_pairs : ndarray, shape (...)
        `pair_variance` of it. The variance of the jackknife is lessened by it, by half at most.
    draws : ndarray, shape (resamples, blocks)
        From `multipliers`.
    """
    blocks = len(values) - 1
    change = values[1:] - values[:1]
    change = np.where(np.isfinite(change), change, 0)
    change = (change - change.mean(axis=0)) * np.sqrt((blocks - 1) / blocks)
    variance = (change**2).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        kept = np.nan_to_num(1 - by_pairs / variance, nan=1.0)
    change *= np.sqrt(np.clip(kept, 0.5, 1.0))
    return np.concatenate([values[:1], values[0] + np.tensordot(draws, change, axes=(1, 0))])
