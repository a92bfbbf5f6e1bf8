"""The stroboscopic map over n periods, its derivative, and Newton's method on it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from .._arguments import number, whole
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..simulate import simulate
from ..simulate._frame import reference_frequency
from ._arguments import recurring
from .tangent import TangentMap, tangent_map

STEPS = 60  # of Newton's iteration
HALVINGS = 14  # of a step that leads away
LOOK, SETTLE = 3000, 300  # periods looked through for close returns, and before


class Shooting:
    """The map of one oscillator; what wants a state takes and gives displacement and velocity."""

    def __init__(
        self, oscillator: Oscillator, periods: int, phase: float, method: Any, tolerance: float
    ) -> None:
        self.oscillator = recurring("oscillator", oscillator)
        self.omega = reference_frequency(oscillator)
        self.periods = whole("periods", periods, 1)
        self.phase = number("phase", phase)
        self.tolerance = number("tolerance", tolerance, above=0, most=0.1)
        self.options: dict[str, Any] = {"phase": self.phase, "method": method}

    def scale(self, state: np.ndarray) -> np.ndarray:
        """What makes displacement and velocity one, and 1 in size."""
        size = max(math.hypot(state[0], state[1] / self.omega), 1e-12)
        return np.array([1.0, 1 / self.omega]) / size

    def map(self, state: np.ndarray) -> TangentMap:
        """The section map and its derivative."""
        start = (float(state[0]), float(state[1]))
        return tangent_map(self.oscillator, periods=self.periods, initial=start, **self.options)

    def off(self, state: np.ndarray) -> tuple[float, np.ndarray, TangentMap | None]:
        """Residual, how far the return is off, and the map; inf where there is none."""
        try:
            here = self.map(state)
        except InvalidInput as error:
            if error.argument != "initial":
                raise
            return math.inf, state, None
        gap = np.array(here.final[:2]) - state
        if here.status != "complete" or not np.isfinite(gap).all():
            return math.inf, state, None
        return float(np.abs(gap * self.scale(state)).max()), gap, here

    def newton(self, start: np.ndarray) -> tuple[np.ndarray, float, int, str, TangentMap | None]:
        """The state that returns, its residual, the steps that took, a status and its map."""
        state = start
        residual, gap, here = self.off(state)
        status = "not converged" if here is not None else "lost"
        iterations = 0
        while here is not None and residual > 0 and iterations < STEPS:
            iterations += 1
            try:
                step = np.linalg.solve(np.eye(2) - here.matrix, gap)
            except np.linalg.LinAlgError:
                break
            if not np.isfinite(step).all():
                break
            share = 1.0
            for _ in range(HALVINGS):
                better = self.off(state + share * step)
                if better[0] < residual:
                    break
                share /= 2
            else:
                status = "lost"
                break
            state = state + share * step
            residual, gap, here = better
        if here is not None and residual <= self.tolerance:
            status = "found"
        return state, residual, iterations, status, here

    def close_returns(self, count: int, spread: int = 0) -> Iterator[np.ndarray]:
        """Points of a long motion that come back near themselves after n periods, closest first.

        Then, if asked, so many by so many points spread over where it goes and half as far again.
        """
        motion = simulate(
            self.oscillator, periods=LOOK + self.periods, transient=SETTLE, **self.options
        )
        x, v = motion.stroboscopic(self.phase)
        points = np.stack([x, v], axis=1)
        scale = np.array([1.0, 1 / self.omega])
        off = np.hypot(*((points[self.periods :] - points[: -self.periods]) * scale).T)
        extent = np.maximum(np.ptp(points, axis=0), 1e-3 * np.abs(points).max())
        apart = 0.02 * np.hypot(*(np.ptp(points, axis=0) * scale))
        chosen: list[np.ndarray] = []
        for k in np.argsort(off, kind="stable"):
            if len(chosen) == count:
                break
            if all(np.hypot(*((points[k] - other) * scale)) > apart for other in chosen):
                chosen.append(points[k])
                yield points[k]
        middle = points.min(axis=0) + np.ptp(points, axis=0) / 2
        shares = np.linspace(-0.75, 0.75, spread)
        for a, b in product(shares, shares):
            yield middle + extent * (a, b)


def two_numbers(name: str, values: Any) -> np.ndarray:
    required = "two finite numbers: displacement and velocity"
    try:
        given = np.array([float(value) for value in values])
    except (TypeError, ValueError):
        raise InvalidInput(name, values, required) from None
    if given.shape != (2,) or not np.isfinite(given).all():
        raise InvalidInput(name, values, required)
    return given
