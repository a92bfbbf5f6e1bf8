"""Block bootstrap of a correlation sum: blocks of time are drawn, and with them their pairs.

Pairs are not independent: each point takes part in n - 1 of them, and neighbours in time share
theirs. What is drawn is therefore points, in blocks longer than their memory. A pair is then
drawn as often as the blocks of both of its points.
"""

from __future__ import annotations

import numpy as np

RESAMPLES = 200


def block_count(vectors: int, theiler: int) -> int:
    """As many blocks as leave each longer than the Theiler window, from 8 to 20."""
    return int(np.clip(vectors // (2 * (theiler + 1)), 8, 20))


def block_weights(blocks: int, seed: int) -> np.ndarray:
    """How often each block is drawn, shape (1 + resamples, blocks); the first row is the data."""
    drawn = np.random.default_rng(seed).multinomial(blocks, np.full(blocks, 1 / blocks), RESAMPLES)
    return np.vstack([np.ones(blocks), drawn])


def resampled_sums(counts: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """C(r) of the data and of each resample, shape (1 + resamples, radii).

    Parameters
    ----------
    counts : ndarray of int, shape (blocks, blocks, radii)
        Pairs within each radius by the blocks of both members; within the last radius are all.
    weights : ndarray, shape (1 + resamples, blocks)
        How often each block was drawn. Two copies of a block make no pairs with each other.
    """
    between = counts.astype(np.float64)
    own = np.diagonal(between).T.copy()
    for block in range(len(between)):
        between[block, block] = 0
    first = np.tensordot(weights, between, axes=(1, 0))
    sums = np.einsum("wb,wbr->wr", weights, first) + weights @ own
    with np.errstate(invalid="ignore"):
        return sums / sums[:, -1:]
