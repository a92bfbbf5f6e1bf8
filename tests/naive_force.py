"""Slow, readable twins of the force detector's kernels."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from impactsig.detect.pulses._model import FLAT_MEAN, FLAT_SD, LENGTH_SD, POWER_SD, SKEW_SD
from impactsig.detect.pulses.pair_fit import ALIKE_SD
from impactsig.detect.search.events.event_kernels import INSIDE, NARROW
from impactsig.detect.search.events.width_kernels import LEAST
from impactsig.detect.signal.ladder import MATCH


def responses(x, unit, near, far, gain, gate):
    """The response of one width, value by value, from its definition."""
    before = (unit - 1) // 2
    y = np.full(len(x), -np.inf)
    for n in range(before, len(x) - unit + before + 1):
        centre = x[n - before : n - before + unit].mean()
        left, right = x[max(n - far, 0) : max(n - near, 0)], x[n + near + 1 : n + far + 1]
        sides = [side.mean() for side in (left, right) if len(side) >= unit] or [centre]
        left, right = sides[0], sides[-1]
        y[n] = gain * min(centre - (left + right) / 2, (centre - max(left, right)) / gate)
    return y


def crests(y, threshold, valley):
    """Index and height of each crest, two of them only with a valley between them."""
    found, best, low = [], None, 0.0
    for n, value in enumerate(y):
        if best is None:
            low = min(low, value)
            if value >= threshold and valley * value > low:
                best = n
        elif value > y[best]:
            best = n
        elif value < valley * y[best]:
            found.append((best, y[best]))
            best, low = None, value
    return found if best is None else [*found, (best, y[best])]


def leading(crests, order, widths, explained):
    """Crests that those before them in `order` do not explain, each compared with all of these."""
    kept = []
    for index in order:
        centre, rung, height, sure = crests[index]
        width, rest = widths[int(rung)], height
        noise = LEAST * height / sure
        least = max(0.5 * height, noise)
        for other in kept:
            wide, apart = widths[int(crests[other, 1])], abs(crests[other, 0] - centre)
            if apart > 0.5 * (wide / MATCH + width):
                continue
            if width < wide and apart < 0.5 * wide / MATCH:
                narrow = width <= NARROW * wide
                least = max(least, INSIDE * crests[other, 2] + noise if narrow else np.inf)
            rest -= max(crests[other, 2] * explained(apart, width, wide), 0.0)
        if rest >= least:
            kept.append(index)
    return kept


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
    amplitude, start, skew, flatness, log_power, middle = p
    parts = np.exp([middle + skew / 2, middle + flatness, middle - skew / 2])
    shape = pulse_shape(t, amplitude, start, *parts, np.exp(log_power))
    return np.concatenate(
        (
            x - shape,
            [
                skew / SKEW_SD,
                (flatness - FLAT_MEAN) / FLAT_SD,
                log_power / POWER_SD,
                (middle - log_edge) / LENGTH_SD,
            ],
        )
    )


def fit_pulse(t, x, log_edge, p):
    """The posterior's minimum by scipy, with finite differences: parameters and cost."""
    result = least_squares(posterior_residuals, p, args=(t, x, log_edge), xtol=1e-12, ftol=1e-12)
    return result.x, 2 * result.cost


def pair_shape(t, *p):
    """Two half-sines: height, start and logarithm of the length of either."""
    y = np.zeros(len(t))
    for height, start, log_length in (p[:3], p[3:]):
        u = (t - start) / np.exp(log_length)
        y += np.where((u > 0) & (u < 1), height * np.sin(np.pi * u), 0.0)
    return y


def pair_residuals(p, t, x):
    """Residuals of samples (in units of the noise) and of the prior, which comes last."""
    return np.append(x - pair_shape(t, *p), (p[5] - p[2]) / ALIKE_SD)


def fit_pair(t, x, p):
    """The least squares by scipy, with finite differences: parameters and cost."""
    result = least_squares(pair_residuals, p, args=(t, x), xtol=1e-12, ftol=1e-12)
    return result.x, 2 * result.cost
