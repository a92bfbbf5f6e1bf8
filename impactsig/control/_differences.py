"""Derivatives by difference quotients of fourth order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def slope(image: Callable[[float], np.ndarray], h: float) -> np.ndarray:
    """Derivative at 0 of a function of one variable, by Richardson extrapolation."""

    def quotient(h: float) -> np.ndarray:
        return (image(h) - image(-h)) / (2 * h)

    return (4 * quotient(h / 2) - quotient(h)) / 3


def slopes(image: Callable[[np.ndarray], np.ndarray], steps: np.ndarray) -> np.ndarray:
    """The same for a function of a vector, a column for each variable with its own step."""

    def along(k: int) -> np.ndarray:
        unit = np.eye(len(steps))[k]
        return slope(lambda h: image(h * unit), float(steps[k]))

    return np.column_stack([along(k) for k in range(len(steps))])
