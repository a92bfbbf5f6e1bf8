"""Mean logarithm of the distance to the k-th nearest neighbour, under the weights of resamples."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def mean_log_distances(logs, block_of, own_block, weights, ranks):
    """<ln r_k> by resample and rank; nan where a vector has no k neighbours.

    Parameters
    ----------
    logs : ndarray, shape (vectors, neighbours)
        ln of the distances, ascending; nan after the last that counts.
    block_of, own_block : ndarray of int, shapes (vectors, neighbours) and (vectors,)
        Blocks of the neighbours and of the vectors themselves.
    weights : ndarray, shape (resamples, blocks)
        How often each block was drawn: a neighbour drawn twice is two neighbours.
    ranks : ndarray of int, shape (ranks,)
        Ascending.
    """
    means = np.zeros((len(weights), len(ranks)))
    for row in range(len(weights)):
        total = 0.0
        for i in range(len(logs)):
            mine = weights[row, own_block[i]]
            if mine == 0:
                continue
            total += mine
            counted, k = 0.0, 0
            for j in range(logs.shape[1]):
                if np.isnan(logs[i, j]):
                    break
                counted += weights[row, block_of[i, j]]
                while k < len(ranks) and counted >= ranks[k]:
                    means[row, k] += mine * logs[i, j]
                    k += 1
                if k == len(ranks):
                    break
            means[row, k:] = np.nan
        means[row] /= total
    return means
