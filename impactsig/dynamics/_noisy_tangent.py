"""The variational equation along one path of an oscillator under noise.

The noise is a force that does not depend on the state, so neighbours under the same noise differ by
the linear flow along the path. Where a stop is rigid they have no derivative under white noise: a
neighbour that hits later by ds has by then another velocity, off by the order of sqrt(ds).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..simulate import simulate

SMALL = 6e-6  # of the size of a path, to difference a law by: the cube root of rounding
SMOOTH = "an oscillator under noise without stops and friction"
PARTED = (
    "A neighbour that hits later by ds has another velocity by then, off by the root of ds, and no "
    "tangent"
)


def tangent_steps(oscillator: Oscillator, **options: Any) -> tuple[Any, np.ndarray, np.ndarray]:
    """One path, and of each of its steps the matrix that carries differences and its divergence.

    Raises
    ------
    InvalidInput
        If the oscillator has stops or friction.
    """
    if oscillator.stops or oscillator.friction:
        raise InvalidInput("system", oscillator, SMOOTH, PARTED)
    options = {name: value for name, value in options.items() if value is not None}
    start = np.array(options.get("initial", (0.0, 0.0)), float)
    path: Any = simulate(oscillator, **options)
    x = np.concatenate([start[:1], path.x])
    v = np.concatenate([start[1:], path.v])
    time = np.concatenate([[0.0], path.time]) / oscillator.time_unit
    by_x, by_v = _slopes(oscillator, time, x, v)
    a, b = (by_x[1:] + by_x[:-1]) / 2, (by_v[1:] + by_v[:-1]) / 2
    step = path.step / oscillator.time_unit
    return path, _exponentials(a, b, step), b * step


def _slopes(
    oscillator: Oscillator, time: np.ndarray, x: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the acceleration by displacement and by velocity."""
    mass = oscillator.mass
    by_x = np.full(len(x), -oscillator.stiffness / mass)
    by_v = np.full(len(x), -oscillator.damping / mass)
    if oscillator.law is not None and len(x):
        law: Callable[[float, float, float], float] = oscillator.law
        h = SMALL * max(float(np.abs(x).max()), 1e-12)
        k = SMALL * max(float(np.abs(v).max()), 1e-12)
        rows = list(zip(time.tolist(), x.tolist(), v.tolist(), strict=True))
        by_x += [(law(t, q + h, u) - law(t, q - h, u)) / (2 * h * mass) for t, q, u in rows]
        by_v += [(law(t, q, u + k) - law(t, q, u - k)) / (2 * k * mass) for t, q, u in rows]
    return by_x, by_v


def _exponentials(a: np.ndarray, b: np.ndarray, step: float) -> np.ndarray:
    """exp(step [[0, 1], [a, b]]) of each pair, shape (n, 2, 2)."""
    half = b / 2
    root = step * np.sqrt((half**2 + a).astype(complex))
    near = np.abs(root) < 1e-4
    swing = np.where(near, 1 + root**2 / 6, np.sinh(root) / np.where(near, 1.0, root)).real * step
    turn = np.cosh(root).real
    grown = np.exp(half * step)
    return np.array([
        [grown * (turn - half * swing), grown * swing],
        [grown * a * swing, grown * (turn + half * swing)],
    ]).transpose(2, 0, 1)  # fmt: skip


def orthonormal(columns: np.ndarray) -> tuple[np.ndarray, tuple[float, float]]:
    """Two columns made orthonormal, and the logarithms of their lengths."""
    (p, r), (q, s) = columns.tolist()
    first = math.hypot(p, q)
    p, q = p / first, q / first
    along = p * r + q * s
    r, s = r - along * p, s - along * q
    second = math.hypot(r, s)
    lost = math.log(second) if second > 0 else -math.inf
    return np.array([[p, -q], [q, p]]), (math.log(first), lost)
