"""The unknowns of a fit on the scale of the search, and the evaluation of a trial."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import InvalidInput
from .._machine import CHAIN, EXTRA, KINDS, PARAMETERS, Parameter
from ..trains.balance import Courses, courses
from ..trains.echoes import Echoes
from ..trains.moments import FALSE, Moments
from ..trains.partition import Train
from .simulated import Beginnings, simulated

LONGEST = 5000  # impacts in a simulated train; of a longer measured one the scatter is scaled
BLOCKS = 20  # of the measured train, of 50 impacts or more, for a first scale of its moments
FAR = 12.0  # of these scales; greater distances count hardly more


@dataclass(eq=False)
class Problem:
    """The measured train, the known and the free parameters."""

    free: tuple[str, ...]
    known: dict[str, float]
    bounds: dict[str, tuple[float, float]]
    forcing_frequency: float
    train: Train
    rng: np.random.Generator
    evaluations: int = 0
    beginnings: Beginnings = field(init=False)
    floor: float = 0.0  # of the strengths' noise, by their mean
    evidence: dict[str, float] = field(default_factory=dict)  # of kinds, from the orbits
    orbit: Callable[[Train], np.ndarray] | None = None
    heard: Echoes | None = None  # that the train was rid of
    advance: Callable[[int], Any] = lambda trains: None  # is given how many trains were simulated

    def __post_init__(self) -> None:
        self.moments = Moments.of(self.train)
        (measured,) = self.moments(self.train)
        if not np.isfinite(measured).all():
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

    @property
    def machine(self) -> str:
        """The kind of machine that is fitted."""
        if self.heard is not None:
            return "echo"
        return next((kind for kind, own in KINDS.items() if own in self.free), "rigid")

    def kind(self, name: str) -> Parameter:
        """The `Parameter` of a name."""
        return PARAMETERS.get(name) or EXTRA.get(name) or CHAIN[name]

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of all unknowns, on the scale of the search."""
        known = {n: (p.low, p.high) for n, p in CHAIN.items()} | self.bounds
        low, high = ([self.kind(n).scale(known[n][k]) for n in self.names] for k in (0, 1))
        return np.array(low), np.array(high)

    def values(self, psi: np.ndarray) -> dict[str, Any]:
        """All values by name, for one or several vectors of unknowns."""
        last = np.moveaxis(psi, -1, 0)
        found = {n: self.kind(n).value(p) for n, p in zip(self.names, last, strict=False)}
        return {"strength_noise": 0.0, "strength_floor": self.floor} | self.known | found

    def courses(self) -> Courses:
        """Mean courses of the measured impacts."""
        return courses(self.train, self.moments.partition)

    def simulate(self, psi: np.ndarray) -> Train:
        """Simulate measured trains at parameters, shape (n, names)."""
        self.evaluations += len(psi)
        self.advance(len(psi))
        values = {n: np.broadcast_to(v, len(psi)) for n, v in self.values(psi).items()}
        impacts = self.share * len(self.train.x)
        return simulated(
            values, self.forcing_frequency, self.periods, impacts, self.beginnings, self.rng,
            self.heard,
        )  # fmt: skip

    def look(self, psi: np.ndarray) -> np.ndarray:
        """Differences of the moments of simulated trains from the measured ones.

        In units of the moments' scatter, shape (n, moments); nan where impacts are too few, or far
        too many.
        """
        return self._off(self.simulate(psi))

    def tell(self, psi: np.ndarray) -> np.ndarray:
        """Differences of orbits fitted to simulated trains from the one fitted to the measured.

        With the moments that depend on missed and on spurious impacts; shape (n, numbers).
        """
        assert self.orbit is not None
        train = self.simulate(psi)
        told = np.array([self.orbit(one) for one in train.split()])
        return np.hstack((told, self._off(train)[:, -FALSE:]))

    def _off(self, train: Train) -> np.ndarray:
        if self.train.strength is None:
            train = train._replace(strength=None)
        moments = self.moments(train)
        moments[train.counts <= self.moments.partition.length + 1] = np.nan
        return FAR * np.tanh((moments - self.measured) / self.scale / FAR)

    @cached_property
    def scale(self) -> np.ndarray:
        """Rough scatter of the measured moments, from blocks of the train."""
        parts, blocks = self._parts
        scatter = np.std(parts, axis=0) / np.sqrt(blocks)
        return np.where(scatter > 0, scatter, np.inf)

    def refuse_unread(self) -> None:
        """Refuse a train if hardly any of its blocks has moments.

        The search by moments needs them; the fit of several trains does not.
        """
        parts, blocks = self._parts
        if len(parts) < 2:
            raise InvalidInput(
                "impacts",
                f"{len(self.train.x)} impacts, of whose {blocks} parts {len(parts)} can be read",
                "some in most parts that follow each other without a gap, five at a time",
                "A second stop, a soft one, or friction cannot be fitted",
            )

    @cached_property
    def _parts(self) -> tuple[list[np.ndarray], int]:
        """Moments of the blocks that have some, and the number of all."""
        blocks = min(BLOCKS, len(self.train.x) // 50)
        size = len(self.train.x) // blocks
        parts = []
        for start in range(0, blocks * size, size):
            own = slice(start, start + size)
            strength = None if self.train.strength is None else self.train.strength[own]
            joined = self.train.joined[start : start + size - 1]
            (part,) = self.moments(Train(self.train.x[own], strength, joined))
            if np.isfinite(part).all():
                parts.append(part)
        return parts, blocks
