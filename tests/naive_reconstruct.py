"""The correlation sum and its relatives row by row, in plain numpy: slow, and easy to believe."""

from __future__ import annotations

import numpy as np


def delay_vectors(x, m, delay):
    n = len(x) - (m - 1) * delay
    return np.column_stack([x[k * delay : k * delay + n] for k in range(m)])


def rows_of_distances(x, m, delay, theiler):
    """(i, distances to the vectors i + theiler + 1 and later), of the maximum norm."""
    y = delay_vectors(np.asarray(x, float), m, delay)
    for i in range(len(y) - theiler - 1):
        yield i, np.abs(y[i] - y[i + theiler + 1 :]).max(axis=1)


def correlation_counts(x, dimensions, delay, theiler, radii):
    """Pairs within each radius, shape (dimensions, radii)."""
    counts = np.zeros((len(dimensions), len(radii)), np.int64)
    for row, m in enumerate(dimensions):
        for _, d in rows_of_distances(x, m, delay, theiler):
            counts[row] += [np.count_nonzero(d <= r) for r in radii]
    return counts


def kernel_sums(x, m, delay, theiler, covariance, scales):
    """Mean of the Gaussian kernel freed of noise, shape (scales,); vectors with nan are none."""
    y = delay_vectors(np.asarray(x, float), m, delay)
    exact = np.array([not np.isnan(row).any() for row in y])
    found = []
    for scale in scales:
        width = scale**2 * np.eye(m) - covariance
        factor = np.sqrt(scale ** (2 * m) / np.linalg.det(width))
        inverse = np.linalg.inv(width)
        kernel = [
            np.exp(-(y[i] - y[j]) @ inverse @ (y[i] - y[j]) / 4)
            for i in range(len(y))
            for j in range(i + theiler + 1, len(y))
            if exact[i] and exact[j]
        ]
        found.append(factor * np.mean(kernel))
    return np.array(found)
