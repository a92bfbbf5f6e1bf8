"""Recurrence plots and nonlinear prediction as their definitions read, and as slow."""

from __future__ import annotations

import math

import numpy as np


def vectors(x, dimension, delay):
    return [
        [x[i + c * delay] for c in range(dimension)]
        for i in range(len(x) - (dimension - 1) * delay)
    ]


def distance(v, w):
    return max(abs(a - b) for a, b in zip(v, w, strict=True))


def recurrence_matrix(x, dimension, delay, radius):
    v = vectors(x, dimension, delay)
    return np.array([[distance(a, b) <= radius for b in v] for a in v])


def runs(row):
    """Lengths of the unbroken runs of True in a row."""
    text = "".join("x" if one else " " for one in row)
    return [len(word) for word in text.split()]


def lines(matrix, theiler):
    """Lengths of all diagonal and of all vertical lines outside the Theiler window."""
    count = len(matrix)
    outside = [[abs(i - j) > theiler for j in range(count)] for i in range(count)]
    kept = matrix & np.array(outside)
    diagonal = [n for lag in range(-count + 1, count) for n in runs(np.diagonal(kept, lag))]
    vertical = [n for column in kept.T for n in runs(column)]
    return diagonal, vertical


def measures(lengths, least):
    """Share of the points in lines of `least` or more; their mean, entropy and maximum."""
    long = [n for n in lengths if n >= least]
    if not long:
        return (0.0 if lengths else None), None, None, 0
    counts = [long.count(n) / len(long) for n in set(long)]
    entropy = -sum(p * math.log(p) for p in counts)
    return sum(long) / sum(lengths), sum(long) / len(long), entropy, max(long)


def forecasts(x, dimension, delay, horizon, longest, neighbors, theiler):
    """Mean future of the nearest neighbours of every vector; of equally near, the earlier."""
    v = vectors(x, dimension, delay)[: len(x) - (dimension - 1) * delay - longest]
    end = (dimension - 1) * delay + horizon
    found = []
    for i, own in enumerate(v):
        others = [j for j in range(len(v)) if abs(i - j) > theiler]
        nearest = sorted(others, key=lambda j, own=own: (distance(own, v[j]), j))[:neighbors]
        total = 0.0
        for j in nearest:
            total += x[j + end]
        found.append(total / len(nearest))
    return np.array(found)
