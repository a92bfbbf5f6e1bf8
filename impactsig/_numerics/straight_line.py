"""A straight line through points of which both values have errors."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

ROUNDS = 50
"""Of weights; those of a line as good as a calibration's settle in a few."""


class Line(NamedTuple):
    """``y = slope x + offset``, and the covariance of the two, shape (2, 2)."""

    slope: float
    offset: float
    covariance: np.ndarray


def fit_line(
    x: np.ndarray,
    y: np.ndarray,
    of_x: np.ndarray,
    of_y: np.ndarray,
    through_zero: bool,
    shared: tuple[np.ndarray, np.ndarray] | None = None,
) -> Line:
    """By maximum likelihood [York2004]_; no point may be exact in both values.

    Errors that are `shared`, of x and of y, move all points at once. The covariance counts them;
    the line is that of errors that are independent.
    """
    slope = float(x @ y / (x @ x)) if through_zero else float(np.polyfit(x, y, 1)[0])
    for _ in range(ROUNDS):
        weight = 1.0 / (of_y**2 + (slope * of_x) ** 2)
        middle_x, middle_y = (0.0, 0.0) if through_zero else np.average([x, y], 1, weight)
        u, v = x - middle_x, y - middle_y
        true = weight * (u * of_y**2 + slope * v * of_x**2)  # adjusted x, off the middle
        before, slope = slope, float(weight * true @ v / (weight * true @ u))
        if math.isclose(before, slope, rel_tol=1e-15):
            break
    offset = 0.0 if through_zero else float(middle_y - slope * middle_x)
    at = middle_x + true
    mean = 0.0 if through_zero else np.average(at, weights=weight)
    of_slope = 1.0 / float(weight @ (at - mean) ** 2)
    covariance = np.zeros((2, 2))
    covariance[0, 0] = of_slope
    if not through_zero:
        covariance[0, 1] = covariance[1, 0] = -mean * of_slope
        covariance[1, 1] = 1.0 / weight.sum() + mean**2 * of_slope
    for moved in (slope * shared[0], shared[1]) if shared else ():
        by_slope = of_slope * float(weight * (at - mean) @ moved)
        level = 0.0 if through_zero else float(np.average(moved, weights=weight)) - mean * by_slope
        covariance += np.outer((by_slope, level), (by_slope, level))
    return Line(slope, offset, covariance)
