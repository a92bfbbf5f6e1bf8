"""Methods of fitting a slope to a curve."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from .._arguments import function, real
from ..errors import InvalidInput, shown

Fit = Callable[[np.ndarray, np.ndarray], float]
FitName = Literal["least squares", "theil-sen"]


def least_squares(x: np.ndarray, y: np.ndarray) -> float:
    """Slope of the least-squares line, with equal weights."""
    centred = x - x.mean()
    return float(centred @ y / (centred @ centred))


def theil_sen(x: np.ndarray, y: np.ndarray) -> float:
    """Median of the slopes between all pairs of points."""
    i, j = np.triu_indices(len(x), 1)
    return float(np.median((y[j] - y[i]) / (x[j] - x[i])))


FITS: dict[str, Fit] = {"least squares": least_squares, "theil-sen": theil_sen}


def fit_of(given: Any) -> Fit:
    """The method of that name, or a checked user's function."""
    if isinstance(given, str) and given in FITS:
        return FITS[given]
    names = ", ".join(f'"{name}"' for name in FITS)
    function("fit", given, f"one of {names}, or a function fit(x, y)", 2)

    def checked(x: np.ndarray, y: np.ndarray) -> float:
        found = given(x, y)
        slope = real(found)
        if not np.isfinite(slope):
            raise InvalidInput(
                "fit",
                f"a function that returns {shown(found)}",
                "a function fit(x, y) that returns the slope, a finite number",
            )
        return slope

    return checked
