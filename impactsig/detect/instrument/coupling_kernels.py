"""Kernels of AC coupling: regression of its time constant, and its inverse filter."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import njit

OFF = 4.0
"""Standard deviations beyond which a value does not lie on its line."""
ROUGH, FINE, START = 12, 8, 8.0
"""Rounds by least magnitudes, and those that leave out what is off; how wide the latter begin."""
BESIDE = 1
"""Values to either side of one that is off which count as little: a pulse crosses the line."""


@njit(nogil=True, fastmath={"reassoc", "nnan", "nsz"})
def regress(values, integrals, noise, rate, free, residuals):
    """Fit values = c + b t - rate * integrals, c and b for each window, one rate for all.

    Least sums of magnitudes first, which have one minimum, then without what is off (Tukey's
    weights), from wide to narrow.

    Parameters
    ----------
    values, integrals : arrays (windows, n)
    noise : array (windows,)
        Standard deviation of the values.
    rate : float
        To begin with.
    free : int
        0: the rate stays; 1: it is fitted to what is not off; 2: from the beginning.
    residuals : array (windows, n), filled

    Returns
    -------
    float
        The rate.
    """
    windows, n = values.shape
    weights, time = np.empty((windows, n)), np.linspace(-1.0, 1.0, n)
    for k in range(windows):
        for j in range(n):
            weights[k, j] = 1.0
    alone = np.empty(n)
    lines = np.empty((windows, 2, 2))  # through the values, and through the integrals
    for turn in range(ROUGH + FINE):
        across = within = 0.0
        for k in range(windows):
            one = one_t = tt = value = value_t = integral = integral_t = vi = ii = 0.0
            for j in range(n):
                w, t = weights[k, j], time[j]
                v, i = w * values[k, j], w * integrals[k, j]
                one += w
                one_t += w * t
                tt += w * t * t
                value += v
                value_t += v * t
                integral += i
                integral_t += i * t
                vi += i * values[k, j]
                ii += i * integrals[k, j]
            total = one * tt - one_t**2
            of_values, of_integrals = lines[k, 0], lines[k, 1]
            of_values[0] = (value * tt - value_t * one_t) / total
            of_values[1] = (value_t * one - value * one_t) / total
            of_integrals[0] = (integral * tt - integral_t * one_t) / total
            of_integrals[1] = (integral_t * one - integral * one_t) / total
            across += vi - of_values[0] * integral - of_values[1] * integral_t
            within += ii - of_integrals[0] * integral - of_integrals[1] * integral_t
        if within > 0.0 and (free == 2 or (free == 1 and turn >= ROUGH)):
            rate = -across / within
        for k in range(windows):
            c = lines[k, 0, 0] + rate * lines[k, 1, 0]
            b = lines[k, 0, 1] + rate * lines[k, 1, 1]
            if turn < ROUGH:
                least = noise[k] * max(1.0, 4.0 * START / 2.0**turn)
            else:
                least = noise[k] * OFF * max(1.0, START / 2.0 ** (turn - ROUGH))
            for j in range(n):
                r = values[k, j] + rate * integrals[k, j] - c - b * time[j]
                residuals[k, j] = r
                if turn < ROUGH - 1:
                    weights[k, j] = 1.0 / max(abs(r), least)
                else:
                    part = min((r / least) ** 2, 1.0)
                    weights[k, j] = max((1.0 - part) ** 2, 1e-9)
            if turn >= ROUGH - 1:
                _spread(weights[k], alone)
    return rate


@njit(nogil=True)
def _spread(weights, copy):
    """Replace each weight by the least of the BESIDE weights around it."""
    n = len(weights)
    for j in range(n):
        copy[j] = weights[j]
    for step in range(1, BESIDE + 1):
        for j in range(step, n):
            weights[j] = min(weights[j], copy[j - step])
        for j in range(n - step):
            weights[j] = min(weights[j], copy[j + step])


@njit(nogil=True)
def uncouple(x, rate, leak, integral, last):
    """Invert a first-order high-pass filter in place, up to a much slower one.

    Parameters
    ----------
    x : array (n,)
    rate, leak : float
        One over the time constant of either, per sample.
    integral, last : float
        Of what came before, and its last sample.

    Returns
    -------
    (integral, last sample as it was)
    """
    kept = math.exp(-leak)
    for k in range(len(x)):
        integral = kept * integral + 0.5 * (kept * last + x[k])
        last = x[k]
        x[k] = last + (rate - leak) * integral
    return integral, last
