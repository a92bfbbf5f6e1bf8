"""Periodic orbits of a cantilever before its stop, by Newton's method on all its modes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from .._arguments import number, whole
from ..errors import InvalidInput
from ..oscillators import Cantilever
from ..simulate import simulate
from ..simulate._beam_arguments import initial_state
from .tangent import TangentMap, tangent_map

STEPS, HALVINGS = 40, 12  # of Newton's iteration, and of a step that leads away
LOOK, SETTLE = 300, 300  # periods looked through for close returns, and before
GUESSES = 12


class BeamShooting:
    """The map of one beam over n forcing periods; states are modal displacements and velocities."""

    def __init__(
        self, beam: Cantilever, periods: int, phase: float, method: Any, tolerance: float
    ) -> None:
        if beam.forcing is None:
            raise InvalidInput("system", beam, "a Cantilever with forcing, to count its periods")
        if method is not None:
            raise InvalidInput("method", method, "no method for a Cantilever, which moves exactly")
        self.beam, self.m = beam, beam.modes
        self.periods = whole("periods", periods, 1)
        self.phase = number("phase", phase)
        self.tolerance = number("tolerance", tolerance, above=0, most=0.1)
        omega = 2 * math.pi * beam.frequencies(self.m)
        self.unit = np.concatenate([np.ones(self.m), 1 / omega])

    def parts(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacements and velocities, as `simulate` takes them."""
        return state[: self.m], state[self.m :]

    def given(self, guess: Any) -> np.ndarray:
        """A guess as a state.

        Raises
        ------
        InvalidInput
            If it is none.
        """
        try:
            flat = np.asarray(guess, float)
            parts = self.parts(flat) if flat.shape == (2 * self.m,) and self.m > 1 else guess
        except (TypeError, ValueError):
            parts = guess
        try:
            return np.concatenate(initial_state(parts, self.m))
        except InvalidInput as error:
            raise InvalidInput("guess", guess, error.required) from None

    def off(self, state: np.ndarray) -> tuple[float, np.ndarray, TangentMap | None]:
        """Residual, how far the return is off, and the map; inf where there is none."""
        try:
            here = tangent_map(
                self.beam, periods=self.periods, initial=self.parts(state), phase=self.phase
            )
        except InvalidInput as error:
            if error.argument != "initial":
                raise
            return math.inf, state, None
        gap = np.concatenate(here.final[:2]) - state
        if here.status != "complete" or not np.isfinite(gap).all():
            return math.inf, state, None
        size = max(float(np.abs(state * self.unit).max()), 1e-12)
        return float(np.abs(gap * self.unit).max()) / size, gap, here

    def newton(self, start: np.ndarray) -> tuple[np.ndarray, float, int, str, TangentMap | None]:
        """The state that returns, its residual, the steps that took, a status and its map."""
        state, iterations = start, 0
        residual, gap, here = self.off(state)
        status = "not converged" if here is not None else "lost"
        while here is not None and residual > 0 and iterations < STEPS:
            iterations += 1
            scaled = self.unit[:, None] * here.matrix / self.unit
            step, *_ = np.linalg.lstsq(np.eye(len(state)) - scaled, gap * self.unit, rcond=None)
            for share in 0.5 ** np.arange(HALVINGS):
                tried = state + share * step / self.unit
                better = self.off(tried)
                if better[0] < residual:
                    break
            else:
                break  # to rounding, or not any nearer
            state, (residual, gap, here) = tried, better
        if residual <= self.tolerance:
            status = "found"
        return state, residual, iterations, status, here

    def close_returns(self) -> Iterator[np.ndarray]:
        """Points of a long motion that come back near themselves, the closest first."""
        period = self.beam.forcing_period
        assert period is not None
        motion = simulate(
            self.beam, periods=LOOK + self.periods, transient=SETTLE, phase=self.phase
        )
        times = motion.start + period * np.arange(LOOK + self.periods + 1)
        q, v = motion.modal(np.minimum(times, motion.stop))
        points = np.concatenate([q, v], axis=1)
        off = np.abs((points[self.periods :] - points[: -self.periods]) * self.unit).max(axis=1)
        size = float(np.abs(points * self.unit).max()) or 1.0
        chosen: list[np.ndarray] = []
        for k in np.argsort(off, kind="stable"):
            if len(chosen) == GUESSES:
                return
            if all(np.abs((points[k] - own) * self.unit).max() > 0.02 * size for own in chosen):
                chosen.append(points[k])
                yield points[k]
