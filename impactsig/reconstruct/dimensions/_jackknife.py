"""Jackknife errors of statistics of pairs, over blocks of time.

Pairs are not independent, but those of two long blocks nearly are [EfronStein1981]_. What a pair of
blocks adds is taken for a diallel [Griffing1956]_: a part by each of the two, as they were visited,
and a part by their pairs, as they chanced to lie. A jackknife, which leaves out one block after the
other, counts the latter part more than twice; here the variances of both are estimated apart.
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
    left: np.ndarray = total - _with_each(parts)
    return np.concatenate([total[None], left])


def variance(parts: np.ndarray) -> np.ndarray:
    r"""Jackknife variance of a statistic of pairs, shape (...).

    With mu + g_a + g_b + e_ab of blocks a and b, and half as many pairs within a block, the sum of
    all parts has the variance

    .. math:: B^3 \sigma_g^2 + \tfrac12 B^2 \sigma_e^2

    and what the pairs with a vector in block a add scatters over a by
    (B - 1)^2 s_g^2 + (B - 3/2) s_e^2.

    Parameters
    ----------
    parts : ndarray, shape (blocks, blocks, ...)
        What the pairs of two blocks add to the statistic, to first order; the earlier one first.
    """
    blocks = len(parts)
    of_pairs = pair_variance(parts) / (blocks * (blocks - 1) / 2)
    scatter = _with_each(parts).var(axis=0, ddof=1)
    of_blocks = (scatter - (blocks - 1.5) * of_pairs) / (blocks - 1) ** 2
    found: np.ndarray = blocks**3 * np.maximum(of_blocks, 0.0) + blocks**2 / 2 * of_pairs
    return found


def pair_variance(parts: np.ndarray) -> np.ndarray:
    r"""Variance of a sum over pairs of different blocks, from single pairs alone.

    It is that of the sum of all e_ab,

    .. math:: \frac{B (B - 1)}{2} \frac{1}{B (B - 3) / 2} \sum_{a < b} \hat e_{ab}^2 .
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


def _with_each(parts: np.ndarray) -> np.ndarray:
    """Sums over the pairs with a vector in each block, shape (blocks, ...)."""
    own = np.moveaxis(np.diagonal(parts), -1, 0)
    found: np.ndarray = parts.sum(axis=0) + parts.sum(axis=1) - own
    return found
