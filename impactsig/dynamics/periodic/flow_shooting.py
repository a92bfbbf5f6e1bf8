"""State of a flow after some time, and its derivative, by collocation."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...oscillators.flows import Flow
from ...simulation.flows.course import Running
from .collocation import chebyshev, solve

SMALL = 6e-6  # of a coordinate, to difference by: the cube root of rounding
GOLDEN = (math.sqrt(5) - 1) / 2
SAME = 1e-9  # of the greatest rate: what rates one period apart may differ by
PARTS, MOST_PARTS = 8, 256  # of a course, in which the tangent map is worked out
ROUNDED = 1e-9  # of the tangent map, between so many parts and twice as many
LOOKS, SPAN = 128, 32  # instants at which rates are compared, over so many periods


def depends_on_time(flow: Flow, period: float) -> bool:
    """Whether the rates depend on time, judged by samples.

    At the initial state and beside it, where no coordinate is 0, at instants that no force of
    another period meets at one phase only.
    """
    times = SPAN * period * np.append(0.0, np.arange(1, LOOKS) * GOLDEN % 1.0)
    for beside in _places(flow):
        rates = [rate_at(flow, t, beside) for t in times]
        if not all(np.array_equal(own, rates[0], equal_nan=True) for own in rates[1:]):
            return True
    return False


def recurs(flow: Flow, period: float) -> bool:
    """Whether the rates have the period, judged by samples."""
    times = SPAN * period * (np.arange(1, LOOKS) * GOLDEN % 1.0)
    for beside in _places(flow):
        now = np.array([rate_at(flow, t, beside) for t in times])
        later = np.array([rate_at(flow, t + period, beside) for t in times])
        if not np.allclose(now, later, rtol=0, atol=SAME * np.nanmax(np.abs(now)), equal_nan=True):
            return False
    return True


def _places(flow: Flow) -> list[np.ndarray]:
    """The initial state and two beside it."""
    y = np.array(flow.initial)
    aside = (1 + np.abs(y)) * np.sqrt(np.arange(1, len(y) + 1))
    return [y + share * aside for share in (0.0, GOLDEN, -(GOLDEN**3))]


def rate_at(flow: Flow, t: float, y: np.ndarray) -> np.ndarray:
    """Rates of the coordinates, shape (d,); NaN where the function raises."""
    try:
        return np.array(flow.function(t, y, *flow.parameters), float)
    except (ArithmeticError, ValueError):
        return np.full(flow.dimension, np.nan)


def tangent_pieces(
    flow: Flow, state: np.ndarray, period: float, parts: int
) -> Iterator[tuple[float, np.ndarray, np.ndarray, np.ndarray]]:
    """Length of each piece, and times, states and Jacobians at its nodes."""
    nodes, _ = chebyshev()
    h = period / parts
    times = h * (np.arange(parts)[:, None] + nodes)
    times[:, -1] = h * np.arange(1, parts + 1)
    times[-1, -1] = period
    flat, back = np.unique(times, return_inverse=True)
    states, _ = Running(flow, None, state.tolist()).sample(flat)
    if len(states) < len(flat):
        lost = np.full((len(flat) - len(states), flow.dimension), np.nan)
        states = np.concatenate([states, lost])
    states = states[back.ravel()].reshape(*times.shape, flow.dimension)
    sizes = np.maximum(np.abs(states).max(axis=(0, 1)), 1e-12)
    for k in range(parts):
        jacobians = [jacobian(flow, t, y, sizes) for t, y in zip(times[k], states[k], strict=True)]
        yield h, times[k], states[k], np.array(jacobians)


def jacobian(flow: Flow, t: float, y: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Jacobian by central differences, exact up to rounding for quadratic rates."""
    columns = []
    for n, h in enumerate(SMALL * sizes):
        high, low = y.copy(), y.copy()
        high[n], low[n] = y[n] + h, y[n] - h
        columns.append((rate_at(flow, t, high) - rate_at(flow, t, low)) / (high[n] - low[n]))
    return np.stack(columns, axis=1)


def shoot(
    flow: Flow, state: np.ndarray, period: float, parts: int
) -> tuple[np.ndarray, np.ndarray]:
    """State after a period, and its derivative."""
    tangent = np.eye(flow.dimension)
    end = state
    for h, _, states, jacobians in tangent_pieces(flow, state, period, parts):
        if not np.isfinite(jacobians).all():
            return np.full(flow.dimension, np.nan), tangent
        by_start, _ = solve(h, jacobians, np.zeros(flow.dimension))
        tangent = by_start[-1] @ tangent
        end = states[-1]
    return end, tangent


def converged(
    flow: Flow, state: np.ndarray, period: float
) -> tuple[np.ndarray, np.ndarray, int, bool]:
    """State after a period and its derivative, with enough parts for rounding accuracy."""
    parts, settled = PARTS, False
    end, tangent = shoot(flow, state, period, parts)
    while parts < MOST_PARTS and np.isfinite(end).all():
        parts *= 2
        end, finer = shoot(flow, state, period, parts)
        if not np.isfinite(end).all():
            break
        change, tangent = float(np.abs(finer - tangent).max()), finer
        settled = change <= ROUNDED * float(np.abs(finer).max())
        if settled:
            break
    return end, tangent, parts, settled
