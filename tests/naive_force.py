"""Slow, readable twins of the force detector's kernels."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from impactsig.detect._pulse_fit import FLAT_MEAN, FLAT_SD, LENGTH_SD, POWER_SD, SKEW_SD


def matched_response(x, gain, width, near, far):
    """The response, sample by sample, from its definition."""
    before = (width - 1) // 2
    padded = np.concatenate((np.full(far, x[:width].mean()), x, np.full(far, x[-width:].mean())))
    y = np.empty(len(x))
    for n in range(len(x)):
        centre = x[max(n - before, 0) : n - before + width].mean()
        at = n + far
        left, right = padded[at - far : at - near], padded[at + near + 1 : at + far + 1]
        y[n] = gain * (centre - (left.mean() + right.mean()) / 2)
    return y


def regions(y, threshold, release):
    """Index of the greatest response of each stretch from threshold until below release."""
    peaks, inside = [], False
    for n, value in enumerate(y):
        if not inside and value >= threshold:
            inside, best = True, n
        elif inside and value < release:
            inside = False
            peaks.append(best)
        elif inside and value > y[best]:
            best = n
    return [*peaks, best] if inside else peaks


def pulse_shape(t, amplitude, start, rise, flat, fall, power):
    """Quarter-sine rise and fall to a power, with a flat top."""
    u = t - start
    y = np.zeros(len(t))
    up, down = (u > 0) & (u < rise), (u >= rise + flat) & (u < rise + flat + fall)
    y[up] = np.sin(np.pi / 2 * u[up] / rise) ** power
    y[(u >= rise) & (u < rise + flat)] = 1.0
    y[down] = np.cos(np.pi / 2 * (u[down] - rise - flat) / fall) ** power
    return amplitude * y


def posterior_residuals(p, t, x, log_edge):
    """Residuals of samples (in units of the noise) and of the priors."""
    amplitude, start, log_rise, log_flat, log_fall, log_power = p
    shape = pulse_shape(t, amplitude, start, *np.exp([log_rise, log_flat, log_fall, log_power]))
    return np.concatenate(
        (
            x - shape,
            [
                (log_rise - log_fall) / SKEW_SD,
                (log_flat - 0.5 * (log_rise + log_fall) - FLAT_MEAN) / FLAT_SD,
                log_power / POWER_SD,
                (0.5 * (log_rise + log_fall) - log_edge) / LENGTH_SD,
            ],
        )
    )


def fit_pulse(t, x, log_edge, p):
    """The posterior's minimum by scipy, with finite differences: parameters and cost."""
    result = least_squares(posterior_residuals, p, args=(t, x, log_edge), xtol=1e-12, ftol=1e-12)
    return result.x, 2 * result.cost
