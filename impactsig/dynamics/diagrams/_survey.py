"""Attractors of many starts of one oscillator, and the radius within which each is certain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._arguments import number, thread_count, whole
from ..._running.threads import in_threads
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...simulation.basis.columns import form_of
from ...simulation.basis.events import LOW, PHASE, STROBE, STROBE_IMPACTS
from ...simulation.batches.moving import takes
from ...simulation.exact.exact import ExactEngine
from ...simulation.exact.starts import begun
from ...simulation.run import Run
from ..arguments import recurring
from .settling.cells import LEGS, NOTHING_KNOWN
from .settling.closing import LONGEST
from .settling.settling import ground

TILE = 512  # starts that are followed in one call
TILE_OF_GPU = 2**16
STROBES = 2**25  # that are kept there, in all
SCOUTS = 128  # starts that are followed first, to learn of attractors
ALIKE = 1e3  # orbits whose strobes are closer than so many tolerances are one
AROUND = 16  # directions in which a point's surroundings are tried
GROWTH = 2**0.25  # from one ring of starts around a point to the next
OPEN = -1  # the label of starts whose motion has not closed


@dataclass
class Found:
    """Outcome of each start: status and label, and the closed orbit if it has one."""

    status: np.ndarray
    label: np.ndarray
    orbits: dict[int, np.ndarray]


class Survey:
    """Follows starts of one oscillator; positions and velocities in the engine's units."""

    def __init__(
        self, oscillator: Oscillator, phase: Any, periods: Any, closed: Any, workers: Any,
        gpu: bool = False,
    ) -> None:  # fmt: skip
        self.run = Run(oscillator, periods=1, phase=phase)
        recurring("system", oscillator)
        if not isinstance(self.run.engine, ExactEngine):
            raise InvalidInput(
                "oscillator", oscillator, "one that is linear between events",
                "Hertz contacts and laws of your own are stepped; simulate their starts one by one",
            )  # fmt: skip
        self.engine = self.run.engine
        self.phase = self.run.phase
        self.periods = whole("periods", periods, 1)
        self.closed = number("closed", closed, above=0, most=1e-2)
        self.workers = 1 if gpu else thread_count(workers)
        self.gpu = gpu
        if gpu:
            takes(form_of(oscillator))
        self.orbits: list[np.ndarray] = []
        self.radii: list[float] = []

    def starts(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Convert starts to the engine's coordinates, shape (n, 2).

        Raises
        ------
        InvalidInput
            If one is beyond a rigid stop.
        """
        origin, unit = ground(self.run.oscillator, self.phase)
        places = (np.stack([x, v], axis=1) - origin) / unit
        beyond = np.flatnonzero(~self.possible(places, slack=1e-12))
        if len(beyond):
            first = beyond[0]
            Run(self.run.oscillator, periods=1, phase=self.phase, initial=(x[first], v[first]))
        return places

    def possible(self, places: np.ndarray, slack: float = 0.0) -> np.ndarray:
        """Mask of positions that are not beyond a rigid stop."""
        good = np.ones(len(places), bool)
        for stop in self.run.oscillator.stops:
            if stop.law.rigid:
                depth = (places[:, 0] - stop.position) * stop.sign
                good &= depth <= slack * (np.abs(places[:, 0]) + abs(stop.position))
        return good

    def discover(self, places: np.ndarray, catch: bool) -> tuple[np.ndarray, Found]:
        """Find attractors from some starts, and the radius within which they catch.

        Returns which starts these are, and their outcomes without being caught.
        """
        chosen = np.random.default_rng(0).permutation(len(places))[:SCOUTS]
        scouted = self.follow(places[chosen], False)
        if catch:
            for k in range(len(self.orbits)):
                self.radii[k] = self._radius(k)
            if len(places) > SCOUTS:
                grown = [self._grown(k) for k in range(len(self.orbits))]
                self.radii[: len(grown)] = grown  # a ring may have met attractors beyond these
        return chosen, scouted

    def _radius(self, k: int) -> float:
        """Half the distance from which motions all around an attractor return to it."""
        for halvings in range(20):
            radius = 0.1 * self._size() * 0.5**halvings
            if self._comes_back(k, radius, 0.0, False):
                return radius / 2
        return 0.0

    def _grown(self, k: int) -> float:
        """Three quarters of the distance up to which motions on ever wider rings come back.

        These end where they are caught within the radii that are known already, so that a ring
        takes a tenth of the time that following it to the end does.
        """
        radius = 2 * self.radii[k]
        for ring in range(40):
            wider = GROWTH * radius
            if not 0 < wider <= self._size() or not self._comes_back(k, wider, ring % 2 / 2, True):
                break
            radius = wider
        return max(self.radii[k], 0.75 * radius if ring else 0.0)

    def _size(self) -> float:
        """Greatest displacement or velocity of all attractors at the strobe."""
        return max(float(np.abs(orbit[:, :2]).max()) for orbit in self.orbits)

    def _comes_back(self, k: int, radius: float, shift: float, catch: bool) -> bool:
        """Whether motions from rings around all points of an attractor return to it."""
        count = 2 * AROUND if catch else AROUND
        ways = (np.arange(count) + shift) * 2 * math.pi / count
        rim = np.stack([np.cos(ways), np.sin(ways)], axis=1)
        around = (self.orbits[k][:, None, :2] + radius * rim).reshape(-1, 2)
        return bool(np.all(self.follow(around[self.possible(around)], catch).label == k))

    def follow(self, places: np.ndarray, catch: bool) -> Found:
        """Follow starts to their attractors, adding new attractors."""
        known = NOTHING_KNOWN
        if catch and self.orbits:
            known = (
                np.concatenate([orbit[:, :2] for orbit in self.orbits]),
                np.repeat(np.arange(len(self.orbits)), [len(orbit) for orbit in self.orbits]),
                np.array(self.radii),
            )
        size = max(1, min(TILE_OF_GPU, STROBES // self.periods)) if self.gpu else TILE
        tiles = [slice(at, at + size) for at in range(0, len(places), size)]
        parts = in_threads(
            lambda tile: self._tile(places[tile], known), tiles, self.workers, " tiles"
        )
        found = Found(
            np.concatenate([status for status, _, _ in parts]),
            np.concatenate([label for _, label, _ in parts]),
            {t * size + k: orbit for t, part in enumerate(parts) for k, orbit in part[2].items()},
        )
        for k, orbit in found.orbits.items():  # in the order of the starts, whatever the threads
            found.label[k] = self._match(orbit)
        return found

    def _tile(
        self, places: np.ndarray, known: Any
    ) -> tuple[np.ndarray, np.ndarray, dict[int, np.ndarray]]:
        """Status and attractor of each start, and orbits that closed without being caught."""
        from .settling.strobing import CAUGHT, CLOSED, FOUND, STATUS_OF, follow_starts

        engine = Run(self.run.oscillator, periods=1, phase=self.phase).engine  # its own scratch
        assert isinstance(engine, ExactEngine)
        states, counts = begun(engine.stack, *np.ascontiguousarray(places.T))
        clocks = np.zeros((len(places), LOW + 1))
        clocks[:, PHASE] = self.phase
        found = np.zeros((len(places), FOUND), np.int64)
        orbits = np.empty((len(places), LONGEST, 3))
        rule = self.closed, LONGEST, True, LEGS
        if self.gpu:
            from .settling.gpu import follow_starts_of

            follow_starts_of(
                engine.stack.problem, clocks, states, counts, self.periods, rule, known, found,
                orbits,
            )  # fmt: skip
        else:
            follow_starts(
                engine.problem, engine.scratch, *engine.laws, clocks, states, counts,
                np.empty((self.periods + 1, STROBE)), rule, known, found, orbits,
            )  # fmt: skip
        closed = {
            k: orbits[k, : found[k, CLOSED]] for k in np.flatnonzero(found[:, CLOSED]).tolist()
        }
        return found[:, STATUS_OF], found[:, CAUGHT] - 1, closed

    def _match(self, orbit: np.ndarray) -> int:
        """Index of the attractor that a closed orbit is, added if new."""
        near = ALIKE * self.closed * float(np.abs(orbit[:, :2]).max())
        for k, other in enumerate(self.orbits):
            if (
                len(other) != len(orbit)
                or other[:, STROBE_IMPACTS].sum() != orbit[:, STROBE_IMPACTS].sum()
            ):
                continue
            for shift in range(len(orbit)):
                if np.abs(np.roll(orbit, shift, axis=0)[:, :2] - other[:, :2]).max() <= near:
                    return k
        self.orbits.append(orbit.copy())
        self.radii.append(0.0)
        return len(self.orbits) - 1
