"""What is sought, on the scale of the search, and how a trial is judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ._balance import Courses, courses
from ._machine import CHAIN, PARAMETERS, Beginnings, Parameter, as_train, simulated
from ._moments import FALSE, Moments
from ._partition import Train

LONGEST = 5000  # impacts in a simulated train; of a longer measured one the scatter is scaled
BLOCKS = 20  # of the measured train, of 50 impacts or more, for a first scale of its moments
FAR = 12.0  # of these scales; what is farther counts hardly more


@dataclass(eq=False)
class Problem:
    """The measured train, what is known, and what is free."""

    free: tuple[str, ...]
    known: dict[str, float]
    bounds: dict[str, tuple[float, float]]
    forcing_frequency: float
    train: Train
    rng: np.random.Generator
    evaluations: int = 0
    beginnings: Beginnings = field(init=False)
    floor: float = 0.0  # of the strengths' noise, by their mean
    orbit: Callable[[Train], np.ndarray] | None = None

    def __post_init__(self) -> None:
        self.moments = Moments.of(self.train)
        measured = self.moments(self.train)
        if measured is None:
            raise InvalidInput(
                "impacts",
                f"{len(self.train.x)} impacts",
                "some that follow each other without a gap, five at a time",
            )
        self.measured = measured
        self.names = self.free + tuple(CHAIN)[: 3 if self.train.strength is None else 4]
        self.share = min(1.0, LONGEST / len(self.train.x))
        whole = np.diff(self.train.x)[self.train.joined].sum()
        self.periods = int(np.ceil(whole * self.share))
        self.scale = self._scale()

    def kind(self, name: str) -> Parameter:
        """How a parameter is sought."""
        return PARAMETERS.get(name) or CHAIN[name]

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest of everything that is sought, on the scale of the search."""
        known = {n: (p.low, p.high) for n, p in CHAIN.items()} | self.bounds
        low, high = ([self.kind(n).scale(known[n][k]) for n in self.names] for k in (0, 1))
        return np.array(low), np.array(high)

    def values(self, psi: np.ndarray) -> dict[str, float]:
        """Everything by its name."""
        found = {n: self.kind(n).value(p) for n, p in zip(self.names, psi, strict=False)}
        return {"strength_noise": 0.0} | self.known | found

    def courses(self) -> Courses:
        """Mean courses of the measured impacts."""
        return courses(self.train, self.moments.partition)

    def simulate(self, psi: np.ndarray) -> Any:
        """Impacts measured at parameters."""
        self.evaluations += 1
        return simulated(
            self.values(psi) | {"strength_floor": self.floor},
            self.forcing_frequency,
            self.periods,
            self.beginnings,
            self.rng,
        )

    def look(self, psi: np.ndarray) -> np.ndarray:
        """How far a simulated train is from the measured one, moment by moment.

        In units of the moments' scatter; nan where there are too few impacts.
        """
        return self._off(self._simulated(psi))

    def tell(self, psi: np.ndarray) -> np.ndarray:
        """How far an orbit beside a simulated train is from the one beside the measured.

        With what moments tell of missed and of spurious impacts.
        """
        assert self.orbit is not None
        train = self._simulated(psi)
        return np.concatenate((self.orbit(train), self._off(train)[-FALSE:]))

    def _simulated(self, psi: np.ndarray) -> Train:
        impacts = self.simulate(psi)
        strength = None if self.train.strength is None else impacts.approach_velocity
        return as_train(impacts, self.forcing_frequency, strength)

    def _off(self, train: Train) -> np.ndarray:
        moments = None
        if len(train.x) > self.moments.partition.length + 1:
            moments = self.moments(train)
        if moments is None:
            return np.full(len(self.measured), np.nan)
        return FAR * np.tanh((moments - self.measured) / self.scale / FAR)

    def _scale(self) -> np.ndarray:
        """Scatter of the measured moments, roughly: from blocks of the train."""
        blocks = min(BLOCKS, len(self.train.x) // 50)
        size = len(self.train.x) // blocks
        parts = []
        for start in range(0, blocks * size, size):
            own = slice(start, start + size)
            strength = None if self.train.strength is None else self.train.strength[own]
            joined = self.train.joined[start : start + size - 1]
            part = self.moments(Train(self.train.x[own], strength, joined))
            if part is not None:
                parts.append(part)
        scatter = np.std(parts, axis=0) / np.sqrt(blocks)
        return np.where(scatter > 0, scatter, np.inf)
