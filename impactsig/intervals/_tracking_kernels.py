"""Power of the harmonics of a train at trial rates, in windows."""

from __future__ import annotations

import numpy as np

from .._compiled import njit


@njit(nogil=True)
def window_scores(cycles, low, high, centre, rates, width, share, scores):
    """Fill in the score of each rate (1 + rates) in each window, weighted by a Gaussian.

    The score is the sum over harmonics h of share[h - 1] |sum_j w_j exp(2 pi i h (1 + r) t_j)|^2
    over sqrt(sum w^2 sum w), with t_j counted from the window's centre.
    """
    top = len(share)
    real, imag = np.empty(top), np.empty(top)
    for k in range(len(centre)):
        squares = total = 0.0
        for j in range(low[k], high[k]):
            weight = np.exp(-0.5 * ((cycles[j] - centre[k]) / width) ** 2)
            squares += weight * weight
            total += weight
        if high[k] - low[k] < 2:
            scores[k, :] = 0.0
            continue
        for r in range(len(rates)):
            real[:] = 0.0
            imag[:] = 0.0
            for j in range(low[k], high[k]):
                since = cycles[j] - centre[k]
                weight = np.exp(-0.5 * (since / width) ** 2)
                angle = 2 * np.pi * (1 + rates[r]) * since
                _add_harmonics(real, imag, np.cos(angle), np.sin(angle), weight)
            power = 0.0
            for h in range(top):
                power += share[h] * (real[h] ** 2 + imag[h] ** 2)
            scores[k, r] = power / np.sqrt(squares * total)


@njit(nogil=True)
def coherence(centred, first, rates, share, power):
    """Fill in the power of the harmonics at each rate, summed over windows from `first` on."""
    top = len(share)
    real, imag = np.empty(top), np.empty(top)
    for r in range(len(rates)):
        power[r] = 0.0
        for k in range(len(first)):
            end = first[k + 1] if k + 1 < len(first) else len(centred)
            real[:] = 0.0
            imag[:] = 0.0
            for j in range(first[k], end):
                angle = 2 * np.pi * rates[r] * centred[j]
                _add_harmonics(real, imag, np.cos(angle), np.sin(angle), 1.0)
            for h in range(top):
                power[r] += share[h] * (real[h] ** 2 + imag[h] ** 2)


@njit(nogil=True)
def _add_harmonics(real, imag, cosine, sine, weight):
    """Add weight exp(i h angle) for h = 1, 2, ..., from the cosine and sine of the angle."""
    x, y = weight, 0.0
    for h in range(len(real)):
        x, y = x * cosine - y * sine, x * sine + y * cosine
        real[h] += x
        imag[h] += y
