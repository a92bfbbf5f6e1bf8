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


def error_among_pairs(train, delay, usual):
    """Root mean square of the errors of vectors of three intervals, over all pairs that are close.

    Three times; close are vectors within three errors of an interval, those of the last time.
    """
    time, error, crossing = train.time, train.time_error, train.interval_spans_gap()
    slots = []  # one for each interval, `delay` for one across a gap
    for i in range(len(time) - 1):
        if crossing[i]:
            slots += [None] * delay
        elif max(error[i], error[i + 1]) >= 5 * usual:
            slots += [None]
        else:
            slots += [(time[i + 1] - time[i], (error[i] ** 2 + error[i + 1] ** 2) / 2)]
    vectors = []
    for i in range(len(slots) - 2 * delay):
        three = [slots[i], slots[i + delay], slots[i + 2 * delay]]
        if all(three):
            vectors.append(np.array(three).T)
    found = usual
    for _ in range(3):
        total = count = 0.0
        for a, (values, squares) in enumerate(vectors):
            for b, (others, _) in enumerate(vectors):
                if a != b and np.abs(values - others).max() <= 3 * np.sqrt(2) * found:
                    total, count = total + squares.mean(), count + 1
        found = np.sqrt(total / count)
    return found
