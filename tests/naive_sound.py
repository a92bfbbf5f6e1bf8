"""Slow, readable twin of the sound detector, on a whole record at once."""

from __future__ import annotations

import numpy as np

SMOOTH = np.array([-1, 2, 6, 2, -1]) / 8  # LeGall 5/3, the filters that its lifting steps amount to
DETAIL = np.array([-1, 2, -1]) / 2


def extended(x, hop, frames=40):
    """Whole hops of x, with its first and last sample going on beyond its ends."""
    more = frames * hop
    return np.concatenate((np.full(more, x[0]), x, np.full(more + -len(x) % hop, x[-1]))), frames


def octave_powers(x, octaves):
    """Mean square of the details of each octave (rows) in each frame of 2**octaves samples."""
    frames = len(x) // 2**octaves
    rows = []
    for _ in range(octaves):
        # Row i of each: the filter about sample 2 i (smooth) or 2 i + 1 (detail).
        detail = np.convolve(np.append(x, x[-1]), DETAIL, mode="valid")[::2]
        detail = np.append(detail, np.zeros(len(x) // 2 - len(detail)))
        rows.append((detail**2).reshape(frames, -1).mean(axis=1))
        x = np.convolve(np.pad(x, 2, mode="edge"), SMOOTH, mode="valid")[::2]
    return np.array(rows)


def rise(power, past, forward, floor):
    """D of each frame, and the forward powers."""
    weights = np.arange(forward, 0, -1) / np.arange(forward, 0, -1).sum()
    d, ahead = np.zeros(power.shape[1]), np.zeros_like(power)
    for j in range(past, power.shape[1] - forward):
        ahead[:, j] = power[:, j : j + forward] @ weights
        behind = power[:, j - past : j].mean(axis=1)
        ratio = (ahead[:, j] + floor) / (behind + floor)
        d[j] = np.maximum(0, np.log(ratio)).mean()
    return d, ahead


def attack(x, at, scale):
    """First sample after the likeliest change of variance."""
    best = (-1.0, at)
    first = max(at - scale.past * scale.hop, scale.long_lag + scale.slope)
    last = min(at + scale.forward * scale.hop, len(x))
    for lag in (scale.short_lag, scale.long_lag):
        y = []
        for i in range(first, last):
            slope = (x[i - lag] - x[i - lag - scale.slope]) / scale.slope
            y.append(x[i] - (x[i - lag] + lag * slope))
        y = np.array(y)
        for k in range(1, len(y)):
            before, after = np.mean(y[:k] ** 2), np.mean(y[k:] ** 2)
            if abs(first + k - at) <= scale.reach and after > before > 0:
                gain = len(y) * np.log(np.mean(y**2))
                gain -= k * np.log(before) + (len(y) - k) * np.log(after)
                best = max(best, (gain, first + k), key=lambda item: item[0])
    return best[1]


def impacts(x, scale, floor, least_rise):
    """Instants, in samples, and peaks."""
    whole, more = extended(x, scale.hop)
    d, _ = rise(octave_powers(whole, scale.octaves), scale.past, scale.forward, floor)
    d = d[more:]
    d[: scale.past] = d[len(x) // scale.hop - 4 - scale.forward :] = 0
    found = []
    for j in np.flatnonzero(d >= least_rise):
        near = d[max(j - scale.spacing, 0) : j + scale.spacing + 1]
        if d[j] == near.max():
            split = attack(x, int(j) * scale.hop, scale)
            before = x[max(split - scale.past * scale.hop, 0) : split]
            after = x[split : split + scale.forward * scale.hop]
            found.append((split - 0.5, np.abs(after - before.mean()).max()))
    return np.array(found).reshape(-1, 2)


def log_probability(y, q, k, error, prior):
    """ln of the density of y = Q a + K b + e where Q' leaves off: b ~ N(0, E V), e ~ N(0, s E).

    Q has orthonormal columns, and a may be anything, so only what is orthogonal to Q counts.
    """
    energy = y @ y
    rest = np.linalg.svd(q, full_matrices=True)[0][:, q.shape[1] :]
    z, b = rest.T @ y, rest.T @ k
    covariance = energy * (b @ np.diag(prior) @ b.T + error * np.eye(len(z)))
    sign, logarithm = np.linalg.slogdet(covariance)
    assert sign > 0
    return -0.5 * z @ np.linalg.solve(covariance, z) - 0.5 * logarithm


def crossing(y, begin, end, level, fine):
    """Where |y|, by a sinc under a cosine, first reaches a level, in steps of 1 / fine samples."""
    k = np.arange(len(y))
    for i in range(fine * (end - begin)):
        away = begin + i / fine - k
        window = np.where(np.abs(away) < 8, np.cos(np.pi * away / 16) ** 2, 0.0)
        if abs(np.sum(y * np.sinc(away) * window)) >= level:
            return begin + i / fine
    return np.nan
