"""Slow twins of the reconstruction, written as the equations are, and series of known exponents."""

from __future__ import annotations

import numpy as np


def nearest(vectors, theiler, maximum):
    """Distance from each vector to the nearest that is apart in time and not equal; else inf."""
    found = np.full(len(vectors), np.inf)
    for i, one in enumerate(vectors):
        for j, other in enumerate(vectors):
            gap = np.abs(one - other)
            distance = gap.max() if maximum else np.sqrt(np.sum(gap * gap))
            if abs(i - j) > theiler and 0 < distance < found[i]:
                found[i] = distance
    return found


def within(vectors, radius, theiler, i):
    """Neighbours of vector i within a Euclidean radius, apart in time and not equal."""
    distance = np.sqrt(np.sum((vectors - vectors[i]) ** 2, axis=1))
    apart = np.abs(np.arange(len(vectors)) - i) > theiler
    return set(np.flatnonzero(apart & (distance > 0) & (distance <= radius)).tolist())


def false_neighbors(x, m, delay, theiler, growth, size):
    """Shares of false neighbours by growth and by size, by Kennel's two criteria."""
    count = len(x) - m * delay
    vectors = [np.array([x[i + k * delay] for k in range(m)]) for i in range(count)]
    by_growth, by_size, seen = 0, 0, 0
    for i in range(count):
        best, who = np.inf, None
        for j in range(count):
            distance = np.linalg.norm(vectors[i] - vectors[j])
            if abs(i - j) > theiler and 0 < distance < best:
                best, who = distance, j
        if who is not None:
            gap = abs(x[i + m * delay] - x[who + m * delay])
            by_growth += gap / best > growth
            by_size += np.sqrt(best**2 + gap**2) / np.std(x) > size
            seen += 1
    return by_growth / seen, by_size / seen


def stretch(x, dimension, delay, theiler, steps):
    """Median and mean logarithm of the newest coordinate's gap, by Rosenstein's neighbours."""
    count = len(x) - steps - (dimension - 1) * delay
    vectors = [x[i : i + (dimension - 1) * delay + 1 : delay] for i in range(count)]
    logs = []
    for i in range(count):
        best, who = np.inf, None
        for j in range(count):
            distance = np.linalg.norm(vectors[i] - vectors[j])
            if abs(i - j) > theiler and 0 < distance < best:
                best, who = distance, j
        newest = (dimension - 1) * delay
        logs.append(
            [np.log(abs(x[i + newest + k] - x[who + newest + k])) for k in range(steps + 1)]
        )
    return np.median(logs, axis=0), np.mean(logs, axis=0)


def kernel_width(gaps, noise, level):
    """ln H at which the Gaussian kernel over gaps, freed of noise, has the mean `level`."""
    low, high = np.log(1.2 * noise), np.log(10 * np.max(np.abs(gaps)))
    for _ in range(60):
        middle = (low + high) / 2
        square = np.exp(2 * middle)
        left = square - noise**2
        total = 0.0
        for gap in gaps:
            total += np.exp(-(gap**2) / 4 / left) * np.sqrt(square / left)
        low, high = (middle, high) if total / len(gaps) < level else (low, middle)
    return low


def henon(n, start=0.1):
    """x of the Henon map (1.4, 0.3); its largest exponent is 0.4192."""
    x, y, found = start, 0.1, np.empty(n)
    for k in range(-100, n):
        x, y = 1 - 1.4 * x * x + y, 0.3 * x
        if k >= 0:
            found[k] = x
    return found


def logistic(n, start=0.31):
    """The logistic map at r = 4; its exponent is ln 2."""
    x, found = start, np.empty(n)
    for k in range(-100, n):
        x = 4 * x * (1 - x)
        if k >= 0:
            found[k] = x
    return found


def tent(n, slope=1.9, start=0.31):
    """The tent map; its exponent is ln slope. (At slope 2 binary numbers run out.)"""
    x, found = start, np.empty(n)
    for k in range(-100, n):
        x = slope * min(x, 1 - x)
        if k >= 0:
            found[k] = x
    return found


def lorenz_x(n, dt=0.04, parts=4, start=(1.0, 1.0, 20.0)):
    """x of the Lorenz flow (10, 28, 8/3) by Runge-Kutta; its exponent is 0.9056 per unit."""

    def rate(x, y, z):
        return 10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z

    (x, y, z), h, found = start, dt / parts, np.empty(n)
    for k in range(-500, n):
        for _ in range(parts):
            a, b, c = rate(x, y, z)
            d, e, f = rate(x + h / 2 * a, y + h / 2 * b, z + h / 2 * c)
            g, i, j = rate(x + h / 2 * d, y + h / 2 * e, z + h / 2 * f)
            p, q, r = rate(x + h * g, y + h * i, z + h * j)
            x += h / 6 * (a + 2 * d + 2 * g + p)
            y += h / 6 * (b + 2 * e + 2 * i + q)
            z += h / 6 * (c + 2 * f + 2 * j + r)
        if k >= 0:
            found[k] = x
    return found


def autoregressive(n, correlation, seed=0):
    """Gaussian values of variance 1; those k apart have the correlation `correlation`**k."""
    noise = np.random.default_rng(seed).normal(size=n)
    found, step = noise.copy(), np.sqrt(1 - correlation**2)
    for k in range(1, n):
        found[k] = correlation * found[k - 1] + step * noise[k]
    return found
