"""Logarithms of the distances to the k-th nearest neighbour, with and without blocks of time."""

import numpy as np

from .._compiled import njit


@njit(nogil=True)
def log_distances_by_block(logs, block_of, own_block, weights, ranks):
    """Sums of ln r_k over the vectors of each block, shape (rows, blocks, ranks).

    Neighbours in blocks of weight 0 are passed over; the vectors themselves are all summed. nan
    where a vector has no k neighbours.

    Parameters
    ----------
    logs : ndarray, shape (vectors, neighbours)
        ln of the distances, ascending; nan after the last that counts.
    block_of, own_block : ndarray of int, shapes (vectors, neighbours) and (vectors,)
        Blocks of the neighbours and of the vectors themselves.
    weights : ndarray, shape (rows, blocks)
        0 or 1 for each block.
    ranks : ndarray of int, shape (ranks,)
        Ascending.
    """
    sums = np.zeros((len(weights), weights.shape[1], len(ranks)))
    for row in range(len(weights)):
        for i in range(len(logs)):
            counted, k = 0.0, 0
            for j in range(logs.shape[1]):
                if np.isnan(logs[i, j]):
                    break
                counted += weights[row, block_of[i, j]]
                while k < len(ranks) and counted >= ranks[k]:
                    sums[row, own_block[i], k] += logs[i, j]
                    k += 1
                if k == len(ranks):
                    break
            sums[row, own_block[i], k:] = np.nan
    return sums
