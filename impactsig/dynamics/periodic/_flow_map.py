"""Return map of a flow for continuation, with the period as an unknown."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...oscillators.flows import Flow
from .flow_orbits import FlowOrbit
from .flow_shooting import rate_at, shoot


class Return(NamedTuple):
    """Derivative of the state after the period, and the rates at both ends."""

    matrix: np.ndarray
    rates: np.ndarray
    impacts: int = 0


def size_of(orbit: FlowOrbit) -> np.ndarray:
    """Range of each coordinate along an orbit."""
    around = orbit.sample(np.linspace(0, 1, 64, endpoint=False) * orbit.period)
    return np.maximum(np.ptp(around, axis=0), 1e-9 * max(float(np.abs(around).max()), 1.0))


class FlowMap:
    """The return map; states are coordinates and, for an autonomous flow, the period.

    As a state may lie anywhere along the orbit, it is sought across the flow at a state nearby.
    """

    side_by_side = False  # many starts go one by one

    def __init__(self, flow: Flow, start: FlowOrbit, scale: np.ndarray, anchor: np.ndarray) -> None:
        self.system, self.start = flow, start
        self.scale = scale
        d = flow.dimension
        self.anchor = anchor[:d]
        across = rate_at(start.system, 0.0, self.anchor) / self.scale**2
        self.across = across / max(float(np.linalg.norm(across)), 1e-300)
        self.scales = self.scale if start.forced else np.append(self.scale, start.period)

    def off(self, state: np.ndarray) -> tuple[float, np.ndarray, Return | None]:
        """Residual, difference of return and state, and the derivative; inf if it fails."""
        d = self.system.dimension
        y = state[:d]
        period = self.start.period if self.start.forced else float(state[d])
        if not period > 0:
            return math.inf, state, None
        end, tangent = shoot(self.system, y, period, self.start._parts)
        if not np.isfinite(end).all():
            return math.inf, state, None
        gap = end - y
        residual = float((np.abs(gap) / self.scale).max())
        if not self.start.forced:
            gap = np.append(gap, self.across @ (y - self.anchor))
        return residual, gap, Return(tangent, rate_at(self.system, period, end))

    def slopes(self, here: Return, unit: np.ndarray) -> np.ndarray:
        """Derivative of the difference by the state, both in these units."""
        d = self.system.dimension
        own = here.matrix - np.eye(d)
        if self.start.forced:
            return own * unit[None, :] / unit[:, None]
        bordered = np.zeros((d + 1, d + 1))
        bordered[:d, :d], bordered[:d, d], bordered[d, :d] = own, here.rates, self.across
        return bordered * unit[None, :] / unit[:, None]

    def orbit(self, state: np.ndarray, residual: float, steps: int, here: Any) -> FlowOrbit:
        """The orbit through a fixed point of the map."""
        values = np.linalg.eigvals(here.matrix).astype(complex)
        values = values[np.argsort(-np.abs(values), kind="stable")]
        d, forced = self.system.dimension, self.start.forced
        return FlowOrbit(
            self.system, state[:d], self.start.period if forced else float(state[d]), values,
            forced, residual, steps, "found", self.start._parts,
        )  # fmt: skip
