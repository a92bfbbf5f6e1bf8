"""Quadratures over velocities and displacements, between the energies of an averaged density."""

from __future__ import annotations

import numpy as np

from ._curve import Curve
from ._panels import POINTS, WEIGHTS
from ._well import Well


def speeds(density: Curve, mass: float) -> tuple[np.ndarray, np.ndarray]:
    """Kinetic energies and weights of a quadrature over positive velocities."""
    v, weights = _gauss(np.sqrt(2 * density.even / mass))
    return mass * v**2 / 2, weights


def places(density: Curve, inside: Well) -> tuple[np.ndarray, np.ndarray]:
    """Potentials and weights of a quadrature over displacements."""
    parts = []
    for side in inside.sides:
        if side.reach:
            distance = np.unique(inside.turn(side, density.even[1:]))
            d, weights = _gauss(np.concatenate([[0.0], distance]))
            parts.append((inside.potential(inside.bottom + side.sign * d), weights))
    potential, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
    return potential, weights


def _gauss(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights of Gauss and Legendre's quadrature between all edges."""
    width = np.diff(edges)[:, None]
    return (edges[:-1, None] + width * (POINTS + 1) / 2).ravel(), (width * WEIGHTS / 2).ravel()
