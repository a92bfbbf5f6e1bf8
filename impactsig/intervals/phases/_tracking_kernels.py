"""Power of the harmonics of a train at trial rates, in windows."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import allocating, njit


@allocating
def window_scores(cycles, low, high, centre, first, step, width, share, scores):
    """Fill in the score of each rate 1 + first + r step in each window, weighted by a Gaussian.

    The score is the sum over harmonics h of share[h - 1] |sum_j w_j exp(2 pi i h (1 + r) t_j)|^2
    over sqrt(sum w^2 sum w), with t_j counted from the window's centre.
    """
    most = 1
    for k in range(len(low)):
        most = max(most, high[k] - low[k])
    weight, work = np.empty(most), np.empty((6, most))
    for k in range(len(centre)):
        for r in range(scores.shape[1]):
            scores[k, r] = 0.0
        if high[k] - low[k] < 2:
            continue
        since = cycles[low[k] : high[k]] - centre[k]
        squares = total = 0.0
        for j in range(len(since)):
            weight[j] = np.exp(-0.5 * (since[j] / width) ** 2)
            squares += weight[j] * weight[j]
            total += weight[j]
        _add_powers(since, weight, 1 + first, step, share, scores[k], work)
        size = np.sqrt(squares * total)
        for r in range(scores.shape[1]):
            scores[k, r] /= size


@allocating
def coherence(centred, first, rate, step, share, power):
    """Fill in the power of the harmonics at each rate + r step, summed over windows.

    `first` holds the first impact of each window.
    """
    weight, work = np.ones(len(centred)), np.empty((6, len(centred)))
    power[:] = 0.0
    for k in range(len(first)):
        end = first[k + 1] if k + 1 < len(first) else len(centred)
        _add_powers(centred[first[k] : end], weight, rate, step, share, power, work)


@njit(nogil=True, fastmath={"reassoc", "contract"})
def _add_powers(since, weight, rate, step, share, power, work):
    """Add the power of the harmonics of weighted instants at each rate + r step.

    A rotation takes an instant from one harmonic to the next, and another from one rate to the
    next: sines are taken twice an instant. Sums may be rearranged, as vector registers need it.
    """
    cosine, sine, turned, shifted, x, y = work
    n = len(since)
    for j in range(n):
        angle = 2 * np.pi * rate * since[j]
        cosine[j], sine[j] = np.cos(angle), np.sin(angle)
        angle = 2 * np.pi * step * since[j]
        turned[j], shifted[j] = np.cos(angle), np.sin(angle)
    for r in range(len(power)):
        for j in range(n):
            x[j], y[j] = weight[j], 0.0
        for h in range(len(share)):
            real = imag = 0.0
            for j in range(n):
                before = x[j]
                x[j] = before * cosine[j] - y[j] * sine[j]
                y[j] = before * sine[j] + y[j] * cosine[j]
                real += x[j]
                imag += y[j]
            power[r] += share[h] * (real * real + imag * imag)
        for j in range(n):
            before = cosine[j]
            cosine[j] = before * turned[j] - sine[j] * shifted[j]
            sine[j] = before * shifted[j] + sine[j] * turned[j]
