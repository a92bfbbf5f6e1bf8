"""How far a slope may be off by chance: a jackknife of blocks of time.

Pairs are not independent, but those of two long blocks nearly are [EfronStein1981]_. The jackknife
takes in the chance of single pairs twice, once by each of the two blocks; a diallel analysis tells
how much that is [Griffing1956]_.
"""

from __future__ import annotations

import numpy as np


def without_each(parts: np.ndarray) -> np.ndarray:
    """Sums over all pairs of blocks, and over those without each block, shape (1 + blocks, ...).

    Parameters
    ----------
    parts : ndarray, shape (blocks, blocks, ...)
        Of the pairs whose earlier vector is in the first block, the later one in the second.
    """
    total = parts.sum(axis=(0, 1))
    own = np.moveaxis(np.diagonal(parts), -1, 0)
    left: np.ndarray = total - parts.sum(axis=0) - parts.sum(axis=1) + own
    return np.concatenate([total[None], left])


def variance(values: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """Variance of a statistic of pairs, shape (...).

    Parameters
    ----------
    values : ndarray, shape (1 + blocks, ...)
        The statistic of all, and without each block.
    parts : ndarray, shape (blocks, blocks, ...)
        What the pairs of two blocks add to it, to first order. The variance of the jackknife is
        lessened by `pair_variance` of them, by half at the most.
    """
    blocks = len(values) - 1
    change = values[1:] - values[1:].mean(axis=0)
    found = (blocks - 1) / blocks * (change**2).sum(axis=0)
    lessened: np.ndarray = np.maximum(found - pair_variance(parts), found / 2)
    return lessened


def pair_variance(parts: np.ndarray) -> np.ndarray:
    r"""Variance that a sum over pairs of blocks has by the chance of single pairs, shape (...).

    Of blocks a < b the part is taken for mu + g_a + g_b + e_ab, a diallel without its diagonal: the
    g are by the blocks, as they were visited; the e by the pairs, as they chanced to lie. Returned
    is the variance of the sum of all e,

    .. math:: \frac{B (B - 1)}{2} \frac{1}{B (B - 3) / 2} \sum_{a < b} \hat e_{ab}^2
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
