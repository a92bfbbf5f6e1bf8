"""Kernel of the nonlinear prediction: nearest delay vectors, and what came after them."""

from __future__ import annotations

import numpy as np

from .._compiled import njit


@njit(nogil=True)
def forecasts(x, references, dimension, delay, horizons, neighbors, theiler, linear):
    """What the nearest vectors of each delay vector say it is followed by, shape (h, references).

    `references` are the places in time, ascending, of the vectors and their futures.

    The vectors are gone through outwards from the reference in the order of their first
    coordinate, until that alone is farther away than the worst neighbour: the largest difference
    of a coordinate is the distance. Of equally distant ones the earlier is the nearer.
    """
    span = (dimension - 1) * delay
    count = len(references)
    rank = np.argsort(x[references], kind="mergesort")
    order = references[rank]
    found = np.empty((len(horizons), count))
    index = np.empty(neighbors, np.int64)
    distance = np.empty(neighbors)
    matrix = np.empty((dimension, dimension))
    right = np.empty((len(horizons), dimension))
    centre = np.empty(dimension)
    for place in range(count):
        i = order[place]
        low, high, held = place - 1, place + 1, 0
        while low >= 0 or high < count:
            below = x[i] - x[order[low]] if low >= 0 else np.inf
            above = x[order[high]] - x[i] if high < count else np.inf
            if held == neighbors and min(below, above) > distance[held - 1]:
                break
            if below <= above:
                j = order[low]
                low -= 1
            else:
                j = order[high]
                high += 1
            if abs(i - j) <= theiler:
                continue
            worst = distance[held - 1] if held == neighbors else np.inf
            apart = 0.0
            for c in range(0, span + 1, delay):
                apart = max(apart, abs(x[i + c] - x[j + c]))
                if apart > worst:
                    break
            if held == neighbors:
                if apart > worst or (apart == worst and j > index[held - 1]):
                    continue
                held -= 1
            at = held
            while at > 0 and (
                distance[at - 1] > apart or (distance[at - 1] == apart and index[at - 1] > j)
            ):
                distance[at], index[at] = distance[at - 1], index[at - 1]
                at -= 1
            distance[at], index[at] = apart, j
            held += 1
        for h in range(len(horizons)):
            total = 0.0
            for k in range(held):
                total += x[index[k] + span + horizons[h]]
            found[h, rank[place]] = total / held
        if linear:
            _add_slopes(
                x,
                i,
                index,
                held,
                dimension,
                delay,
                horizons,
                found[:, rank[place]],
                matrix,
                right,
                centre,
            )
    return found


@njit(nogil=True)
def _add_slopes(x, i, index, held, dimension, delay, horizons, found, matrix, right, centre):
    """Correct the mean of the futures by the plane fitted to them; by least squares (Cholesky).

    Directions in which the neighbours do not spread (pivot below 1e-10 of the greatest variance)
    get no slope.
    """
    span = (dimension - 1) * delay
    for a in range(dimension):
        total = 0.0
        for k in range(held):
            total += x[index[k] + a * delay]
        centre[a] = total / held
    scale = 0.0
    for a in range(dimension):
        for b in range(a + 1):
            total = 0.0
            for k in range(held):
                total += (x[index[k] + a * delay] - centre[a]) * (
                    x[index[k] + b * delay] - centre[b]
                )
            matrix[a, b] = total
        scale = max(scale, matrix[a, a])
        for h in range(len(horizons)):
            total = 0.0
            for k in range(held):
                future = x[index[k] + span + horizons[h]] - found[h]
                total += (x[index[k] + a * delay] - centre[a]) * future
            right[h, a] = total
    for a in range(dimension):
        for b in range(a + 1):
            total = matrix[a, b]
            for c in range(b):
                total -= matrix[a, c] * matrix[b, c]
            if a == b:
                matrix[a, a] = np.sqrt(total) if total > 1e-10 * scale else 0.0
            else:
                matrix[a, b] = total / matrix[b, b] if matrix[b, b] > 0 else 0.0
    for h in range(len(horizons)):
        for a in range(dimension):
            total = right[h, a]
            for c in range(a):
                total -= matrix[a, c] * right[h, c]
            right[h, a] = total / matrix[a, a] if matrix[a, a] > 0 else 0.0
        for a in range(dimension - 1, -1, -1):
            total = right[h, a]
            for c in range(a + 1, dimension):
                total -= matrix[c, a] * right[h, c]
            right[h, a] = total / matrix[a, a] if matrix[a, a] > 0 else 0.0
            found[h] += right[h, a] * (x[i + a * delay] - centre[a])
