"""Marginal densities by quadrature over velocity or displacement."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._branches import Branches
from ._curve import Curve
from ._panels import POINTS, WEIGHTS
from ._well import Well

CROWD = 4.0 ** -np.arange(12)  # shares of a piece at which it is cut towards a saddle's energy


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


def displacement(density: Branches, mass: float, place: np.ndarray) -> np.ndarray:
    """The marginal p(x) for several wells, with a break at the energy of each saddle."""
    found = np.zeros(place.shape)
    for k, ground in enumerate(density.potential(place)):
        if ground < density.greatest:
            v, weights = _gauss(np.sqrt(2 * _energies(density, float(ground)) / mass))
            found[k] = 2 * (density.joint(place[k], mass * v**2 / 2) @ weights)
    return found


def velocity(density: Branches, mass: float, speed: np.ndarray) -> np.ndarray:
    """The marginal p(v) for several wells."""
    found = np.zeros(speed.shape)
    root = density.root
    for k, kinetic in enumerate(mass * speed**2 / 2):
        if kinetic >= density.greatest:
            continue
        levels = _energies(density, float(kinetic))
        for inside, ground in zip(root.wells, root.grounds, strict=True):
            local = levels[levels > ground] - ground
            for side in inside.sides:
                if side.reach:
                    turns = inside.turn(side, local)
                    starts = [part.start for part in side.parts]
                    d, weights = _gauss(np.unique(np.concatenate([starts, turns])))
                    at = inside.bottom + side.sign * d
                    found[k] += density.joint(at, np.full(1, kinetic)) @ weights
    return found


def _energies(density: Branches, less: float) -> np.ndarray:
    """Energies between which the joint density varies little, minus an energy, from 0 on."""
    finest = [
        own.grid.edges[own.grid.edges <= own.greatest] + family.ground - less
        for family, own in zip(density.families, density.curves, strict=True)
    ]
    high = density.greatest - less
    width = min(own.widest for own in density.curves if len(own.ends))
    even = np.linspace(0, high, max(int(np.ceil(high / width)), 1) + 1)
    near: list[Any] = [even, *finest]
    for saddle in density.saddles:
        near += [[saddle - less], saddle - less - width * CROWD, saddle - less + width * CROWD]
    near.append(high * CROWD)
    cuts = np.unique(np.concatenate(near))
    return cuts[(cuts >= 0) & (cuts <= high)]


def _gauss(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre points and weights between all edges."""
    width = np.diff(edges)[:, None]
    return (edges[:-1, None] + width * (POINTS + 1) / 2).ravel(), (width * WEIGHTS / 2).ravel()
