"""Levenberg and Marquardt's method, uphill from several starts."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

GREATEST = 1e8  # damping at which a place counts as a top


def climb(
    starts: Iterable[np.ndarray],
    evaluate: Callable[[np.ndarray], tuple[float, np.ndarray, np.ndarray]],
    limited: Callable[[np.ndarray, np.ndarray], np.ndarray],
    arrived: Callable[[np.ndarray, np.ndarray], bool],
    most: int,
    least: float = 0.0,
) -> tuple[float, np.ndarray]:
    """The greatest value that steps from the starts lead to, and its place.

    `evaluate` returns value, gradient and information at a place, `limited` the place that a step
    leads to within bounds, and `arrived` whether it hardly moved. The information is damped by
    multiples of its diagonal, to which `least` is added.
    """
    found = (_climb(start, evaluate, limited, arrived, most, least) for start in starts)
    return max(found, key=lambda top: top[0])


def _climb(
    place: np.ndarray, evaluate: Callable, limited: Callable, arrived: Callable, most: int,
    least: float,
) -> tuple[float, np.ndarray]:  # fmt: skip
    value, gradient, information = evaluate(place)
    damping = 1e-3
    for _ in range(most):
        held = information + damping * np.diag(np.diag(information) + least)
        new = limited(place, np.linalg.solve(held, gradient))
        better = evaluate(new)
        if better[0] >= value:
            done = arrived(place, new)
            place, (value, gradient, information), damping = new, better, damping / 5
            if done:
                break
        elif damping > GREATEST:
            break
        else:
            damping *= 5
    return value, place
