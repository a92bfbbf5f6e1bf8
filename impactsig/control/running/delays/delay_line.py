"""Evaluate a delay line: states, control force, effort, and peaks of contacts."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ....simulation.basis.events import LENGTH, ROW_APPROACH, ROW_STOP
from ....simulation.basis.tableau import DEGREE
from ....simulation.stepping.runge_kutta import SteppingEngine

if TYPE_CHECKING:
    from ....simulation.basis.delay import Line


class DelayLine:
    """The motion stored in a delay line; implements `Engine` and `Effort`."""

    def __init__(self, engine: SteppingEngine, line: Line) -> None:
        self.engine = engine
        self.line = line
        self.omega = engine.omega
        self._inertia = engine._problem.inertia

    def place(self, mode: Any, q: Any) -> Any:
        """As of the engine that made it."""
        return self.engine.place(mode, q)

    def course(self, which: int, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Evaluate a coordinate at instants, in the engine's units."""
        from .line import sample

        out = np.empty(len(turns))
        if len(self.line.laps) == 0:
            return np.zeros(len(turns))
        sample(
            self.line, len(self.line.laps), np.ascontiguousarray(turns, float),
            np.ascontiguousarray(phase, float), which, out,
        )  # fmt: skip
        return out

    def sample(
        self, rows: np.ndarray, where: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at instants."""
        from ....simulation.basis.delay import DISPLACEMENT, VELOCITY

        return self.course(DISPLACEMENT, turns, phase), self.course(VELOCITY, turns, phase)

    def _basis(self, share: np.ndarray) -> np.ndarray:
        """Values of the basis polynomials of a row, at shares of it."""
        if self.line.powers is None:
            return basis(share)
        return np.vander(share, self.line.course.shape[2], increasing=True)

    def force(self, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Control force at instants."""
        from ....simulation.basis.delay import FORCE

        return self.course(FORCE, turns, phase) * self._inertia

    def squared(self, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Integrals of the square of the control force between instants, over the phase."""
        from ....simulation.basis.delay import FORCE
        from .line import locate, since

        line = self.line
        number = len(line.laps)
        nodes, weights = np.polynomial.legendre.leggauss(line.course.shape[2])
        nodes, weights = (nodes + 1) / 2, weights / 2
        values = line.course[:, FORCE] @ self._basis(nodes).T
        whole = values**2 @ weights * line.when[:, LENGTH]

        def share(j: int, turn: float, angle: float) -> float:
            return min(max(since(line, j, turn, angle) / line.when[j, LENGTH], 0.0), 1.0)

        def part(j: int, low: float, high: float) -> float:
            values = self._basis(low + nodes * (high - low)) @ line.course[j, FORCE]
            return float(values**2 @ weights * line.when[j, LENGTH] * (high - low))

        # Window by window, as the difference of long integrals would be noise.
        edges = list(zip(turns, phase, strict=True))
        rows = [locate(line, number, *edge) for edge in edges]
        shares = [share(j, *edge) for j, edge in zip(rows, edges, strict=True)]
        out = np.empty(len(edges) - 1)
        for n, ((a, low), (b, high)) in enumerate(pairwise(zip(rows, shares, strict=True))):
            if a == b:
                out[n] = part(a, low, high)
            else:
                out[n] = part(a, low, 1.0) + whole[a + 1 : b].sum() + part(b, 0.0, high)
        return out * self._inertia**2

    def peaks(
        self, rows: np.ndarray, first: np.ndarray, last: np.ndarray, end: tuple[float, float]
    ) -> np.ndarray:
        """Greatest force of contacts, from the TOUCH in row `first` to row `last` or the end."""
        from ....simulation.basis.delay import DISPLACEMENT, VELOCITY
        from .line import locate

        problem = self.engine._problem
        shares = np.linspace(0.0, 1.0, 65)
        at = self._basis(shares)
        ends = np.concatenate([rows[:, :2], [end]])
        out = np.empty(len(first))
        approach = np.zeros(len(problem.stops))
        for n, (a, b) in enumerate(zip(first, last, strict=True)):
            k = int(rows[a, ROW_STOP])
            approach[k] = rows[a, ROW_APPROACH]
            low, high = (locate(self.line, len(self.line.laps), *ends[i]) for i in (a, b))
            course = self.line.course[low : high + 1]
            x, v = course[:, DISPLACEMENT] @ at.T, course[:, VELOCITY] @ at.T
            out[n] = _greatest(_push(problem, k, approach[k], x, v))
        return out * self._inertia


def _push(problem: Any, k: int, approach: float, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Force per mass of a soft stop; 0 if it is not touched."""
    from ....oscillators.laws import HERTZ, approach_loss, hertz_push, spring_push

    place, side, law, stiffness, loss, exponent, by_approach, _ = problem.stops[k]
    depth, inward = np.maximum(side * (x - place), 0.0), side * v
    if law != HERTZ:
        return np.where(depth > 0, spring_push(stiffness, loss, depth, inward), 0.0)
    if by_approach >= 0:
        loss = approach_loss(by_approach, approach)
    return np.asarray(hertz_push(stiffness, exponent, loss, depth, np.sqrt(depth), inward))


def _greatest(values: np.ndarray) -> float:
    """Greatest value, refined by the parabola through three samples."""
    row, i = np.unravel_index(int(values.argmax()), values.shape)
    top = float(values[row, i])
    if 0 < i < values.shape[1] - 1:
        left, right = values[row, i - 1], values[row, i + 1]
        bend = left - 2 * top + right
        return float(top - (right - left) ** 2 / (8 * bend)) if bend < 0 else top
    return top


def basis(share: np.ndarray) -> np.ndarray:
    """Bernstein polynomials of degree 7 at shares of a step, shape (n, 8)."""
    k = np.arange(DEGREE + 1)
    binomial = np.array([math.comb(DEGREE, n) for n in k], float)
    share = np.asarray(share, float)[:, None]
    return binomial * share**k * (1 - share) ** (DEGREE - k)
