"""Smooth drift of the phase of impacts, and the evidence for its size."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._drift_kernels import LEAST_SPAN, settle

KNOTS = 4.0  # [cycles] from one knot to the next
WANDERS = np.array([1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3])  # of the rate, per square root of a cycle


class Drift(NamedTuple):
    """A linear spline through offsets, its knots a random walk of the rate."""

    at: np.ndarray  # [cycles] of the knots
    phase: np.ndarray  # [cycles] at the knots
    log_evidence: float  # of the offsets
    log_odds: float  # that the rate wanders, against a straight phase


def fit_drift(
    x: np.ndarray, offset: np.ndarray, floor: float, wanders: np.ndarray = WANDERS
) -> Drift:
    """Fit the drift of the phase to offsets of impacts at x.

    Offsets y are B c plus white noise of variance s^2, where B interpolates linearly between the
    knots c and the second differences of c are normal with variance q^2 dx^3, so that the rate is a
    random walk. For each wander q of the rate the evidence, in which the line that the prior leaves
    free is integrated over a flat prior, is

        (2 - N)/2 ln(2 pi s^2) - R/(2 s^2) - ln det(B'B + L D'D)/2 + (K - 2)/2 ln L

    with K knots, L = s^2/(q^2 dx^3) and R the least sum of squares, L times those of the second
    differences included. s is where it is greatest, but at least `floor`. For a straight phase the
    determinants become that of the normal equations of the line in units of dx, because det(DD') is
    that of the line over all knots.
    """
    span = max(float(x[-1] - x[0]), LEAST_SPAN)
    count = min(max(math.ceil(span / KNOTS) + 1, 3), max(len(x), 3))
    dx = span / (count - 1)
    at = x[0] + dx * np.arange(count)
    since = (x - x[0]) / dx
    middle, mean = _mean(since), _mean(offset)
    apart = since - middle
    across = float(apart @ apart)
    slope = float(apart @ offset) / across if across > 0 else 0.0
    level = mean - slope * middle
    left_over = float(np.add.reduce((offset - level - slope * since) ** 2))
    half_log_det = 0.5 * math.log(max(len(x) * across, 1e-300))
    evidence = np.empty(len(wanders) + 1)
    evidence[0] = _normal(len(x), left_over, floor) - half_log_det
    phase = level + slope * np.arange(count)
    log_odds = -np.inf
    if len(wanders):
        spread = max(math.sqrt(_mean((offset - mean) ** 2)), floor)
        knots, told = settle(x, offset, count, 1 / (wanders**2 * dx**3), spread, floor)
        for k, (half_log_det, left_over, ratio) in enumerate(told.tolist(), 1):
            evidence[k] = _normal(len(x), left_over, floor) - half_log_det
            evidence[k] += 0.5 * (count - 2) * np.log(ratio)
        log_odds = float(np.logaddexp.reduce(evidence[1:]) - math.log(len(wanders)) - evidence[0])
    best = int(np.argmax(evidence)) if log_odds > 0 else 0
    if best:
        phase = knots[best - 1]
    return Drift(at, phase, float(evidence[best]), log_odds)


def _mean(values: np.ndarray) -> float:
    return float(np.add.reduce(values)) / len(values)  # in a quarter of the time of its method


def _normal(count: int, left_over: float, floor: float) -> float:
    """Logarithm of the density of normal offsets, the line integrated over."""
    variance = max(left_over / count, floor**2)
    return -0.5 * (count - 2) * np.log(2 * np.pi * variance) - left_over / (2 * variance)
