"""Return map of a cantilever over n forcing periods, in all its modes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..._arguments import refuse
from ...errors import InvalidInput
from ...oscillators import Cantilever
from ...simulation.beam.beam_arguments import initial_state
from .shooting import Shooting, distinct


class BeamShooting(Shooting):
    """The return map of a cantilever; states are modal displacements and velocities."""

    steps, halvings = 40, 12
    look = 300
    tries = (12,)

    def __init__(
        self, beam: Cantilever, periods: int, phase: float, method: Any, tolerance: float
    ) -> None:
        if beam.forcing is None:
            raise InvalidInput("system", beam, "a Cantilever with forcing, to count its periods")
        refuse("for a Cantilever, which is computed exactly", "", method=method)
        super().__init__(beam, periods, phase, tolerance)
        self.m = beam.modes
        self.omega = beam.forcing.angular_frequency
        omega = 2 * math.pi * beam.frequencies(self.m)
        self.scales = np.concatenate([np.ones(self.m), omega])
        self.unit = np.concatenate([np.ones(self.m), 1 / omega])

    def parts(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return state[: self.m], state[self.m :]

    def states(self, motion: Any, time: Any) -> np.ndarray:
        return np.concatenate(motion.modal(time), axis=-1)

    def error(self, gap: np.ndarray, state: np.ndarray) -> float:
        size = max(float(np.abs(state * self.unit).max()), 1e-12)
        return float(np.abs(gap * self.unit).max()) / size

    def step(self, matrix: np.ndarray, gap: np.ndarray) -> np.ndarray:
        scaled = self.unit[:, None] * matrix / self.unit
        step, *_ = np.linalg.lstsq(np.eye(len(gap)) - scaled, gap * self.unit, rcond=None)
        return np.asarray(step / self.unit)

    def given(self, guess: Any) -> np.ndarray:
        """Validate a guess.

        Raises
        ------
        InvalidInput
            If it is none.
        """
        try:
            flat = np.asarray(guess, float)
            parts = self.parts(flat) if flat.shape == (2 * self.m,) and self.m > 1 else guess
        except Exception:
            parts = guess
        try:
            return np.concatenate(initial_state(parts, self.m))
        except InvalidInput as error:
            raise InvalidInput("guess", guess, error.required) from None

    def close_returns(self, count: int) -> Iterator[np.ndarray]:
        """Points of a long motion that nearly return, the closest first."""
        points = self.strobed()
        off = np.abs((points[self.periods :] - points[: -self.periods]) * self.unit).max(axis=1)
        size = float(np.abs(points * self.unit).max()) or 1.0
        yield from distinct(
            points, off, count, lambda d: np.abs(d * self.unit).max(axis=1), 0.02 * size
        )
