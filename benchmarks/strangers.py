"""Pulses that no contact law makes, and that the family of detection does not contain.

What a change gains on the shapes of `recordings.PULSES` or on contact laws (`laws.py`) must not be
lost here. The family was not chosen on them; triangle, u (1 - u)^2 and soft trapezoid are among the
37 shapes that tell how far off touches are where samples are few.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Shape = Callable[[np.ndarray], np.ndarray]


def _to_one(shape: Shape) -> Shape:
    """The shape on (0, 1), over its greatest value."""
    greatest = shape(np.linspace(0, 1, 4001)).max()
    return lambda u: np.where((u > 0) & (u < 1), shape(np.clip(u, 0, 1)) / greatest, 0.0)


def _eased(v: np.ndarray) -> np.ndarray:
    v = np.clip(v, 0, 1)
    return v * v * (3 - 2 * v)


STRANGERS: dict[str, Shape] = {
    "triangle": _to_one(lambda u: np.minimum(u, 1 - u)),
    "Gaussian": _to_one(lambda u: np.exp(-(((u - 0.5) / 0.17) ** 2))),
    "exponential": _to_one(lambda u: np.exp(-4 * u)),
    "two exponentials": _to_one(lambda u: np.exp(-4 * u) - np.exp(-40 * u)),
    "u exp(-6 u)": _to_one(lambda u: u * np.exp(-6 * u)),
    "u (1 - u)^2": _to_one(lambda u: u * (1 - u) ** 2),
    "soft trapezoid": _to_one(lambda u: _eased(np.minimum(u / 0.45, (1 - u) / 0.2))),
    "two humps": _to_one(lambda u: np.sin(np.pi * u) * (1 + 0.25 * np.cos(4 * np.pi * u))),
    "ringing": _to_one(
        lambda u: np.exp(-2 * u) * np.sin(np.pi * u) * (1 + 0.2 * np.sin(4.6 * np.pi * u))
    ),
}
