"""Kernel of nonlinear prediction: nearest delay vectors, and their futures."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit


@njit(nogil=True)
def forecasts(x, references, rank, dimension, delay, horizons, neighbors, theiler, linear):
    """Predictions from the nearest vectors of each delay vector, shape (h, references).

    `references` are the places in time, ascending, of the vectors and their futures; `rank` sorts
    them by x there, and leaves equal ones as they are.

    Vectors are sorted by their first coordinate. Those within a radius of the reference in it are
    measured (by the largest difference of a coordinate) in loops without a branch, which compile to
    vector instructions; the radius is what the last reference needed and grows until it holds
    enough. Of equally distant ones the earlier is the nearer.
    """
    span = (dimension - 1) * delay
    count = len(references)
    order = np.empty(count, np.int64)
    for k in range(count):
        order[k] = references[rank[k]]
    columns = np.empty((dimension, count))
    for c in range(dimension):
        for k in range(count):
            columns[c, k] = x[order[k] + c * delay]
    first = columns[0]
    least = 1e-3 * (first[count - 1] - first[0])  # equal values need no radius at all
    radius = 100 * least
    apart = np.empty(count)
    near = np.empty(count + 1, np.int64)
    found = np.empty((len(horizons), count))
    index = np.empty(neighbors, np.int64)
    distance = np.empty(neighbors)
    matrix = np.empty((dimension, dimension))
    right = np.empty((len(horizons), dimension))
    centre = np.empty(dimension)
    for place in range(count):
        i = order[place]
        while True:
            low = _number_below(first, first[place] - radius, False)
            high = _number_below(first, first[place] + radius, True)
            off = apart[: high - low]
            _measure(columns, place, low, off)
            bound = np.inf if high - low == count else radius
            close = 0
            for k in range(len(off)):
                near[close] = k
                close += off[k] <= bound
            if close >= neighbors + 2 * theiler + 1 or high - low == count:
                break
            radius *= 1.4
        held = 0
        for k in range(close):
            one, j = off[near[k]], order[low + near[k]]
            if abs(j - i) <= theiler:
                continue
            if held == neighbors:
                if one > distance[held - 1] or (one == distance[held - 1] and j > index[held - 1]):
                    continue
                held -= 1
            at = held
            while at > 0 and (
                distance[at - 1] > one or (distance[at - 1] == one and index[at - 1] > j)
            ):
                distance[at], index[at] = distance[at - 1], index[at - 1]
                at -= 1
            distance[at], index[at] = one, j
            held += 1
        radius = max(1.1 * distance[held - 1], least)
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
def _number_below(values, limit, or_equal):
    """How many of ascending values are less than a limit, or equal to it."""
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if values[middle] < limit or (or_equal and values[middle] == limit):
            low = middle + 1
        else:
            high = middle
    return low


@njit(nogil=True)
def _measure(columns, place, low, off):
    """Distances of the vectors from `low` on to a reference."""
    off[:] = 0.0
    for c in range(len(columns)):
        column, own = columns[c, low : low + len(off)], columns[c, place]
        for k in range(len(off)):
            one = abs(column[k] - own)
            off[k] = one if one > off[k] else off[k]


@njit(nogil=True)
def _add_slopes(x, i, index, held, dimension, delay, horizons, found, matrix, right, centre):
    """Replace the mean future by a local linear fit (least squares, Cholesky).

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
