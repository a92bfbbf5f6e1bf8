"""Stroboscopic map of a system over n forcing periods, and Newton's method on it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator, Sequence
from itertools import islice, product
from typing import Any, NamedTuple

import numpy as np

from ..._arguments import number, reals, whole
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...simulation import simulate
from ...simulation.basis.frame import reference_frequency
from ...simulation.exact.exact import piecewise_linear
from ..arguments import recurring
from ..tangents.batches.tangent_maps import tangent_maps
from ..tangents.tangent import TangentMap, tangent_map

Off = tuple[float, np.ndarray, TangentMap | None]
"""Residual, difference of return and state, and the map there; inf and None if it fails."""


class Found(NamedTuple):
    """Where Newton's method has led."""

    state: np.ndarray
    residual: float
    iterations: int
    status: str
    here: TangentMap | None


class Shooting(ABC):
    """The map of a system over n forcing periods; states are arrays of shape (d,).

    Attributes
    ----------
    system : Oscillator, Cantilever or Controlled
        Whose orbits are looked for.
    moves : Oscillator, Cantilever or Controlled
        What moves on them.
    omega : float
        Angular frequency of the forcing.
    scales : ndarray, shape (d,)
        What a state is divided by to make all of it displacements.
    options : dict
        Phase, and method of an oscillator, as `simulate` takes them.
    """

    steps = 60  # of Newton's iteration
    halvings = 14  # of a step that leads away
    look, settle = 3000, 300  # periods looked through for close returns, and before
    tries: tuple[int, ...] = (24, 10)  # close returns, and a square of other starts
    anchored = False  # whether the section must stay at its phase

    def __init__(self, system: Any, periods: int, phase: float, tolerance: float) -> None:
        self.system: Any = system
        self.moves: Any = system
        self.periods = whole("periods", periods, 1)
        self.phase = number("phase", phase)
        self.tolerance = number("tolerance", tolerance, above=0, most=0.1)
        self.options: dict[str, Any] = {"phase": self.phase}
        self.omega, self.scales = 1.0, np.empty(0)

    @abstractmethod
    def parts(self, state: np.ndarray) -> tuple[Any, Any]:
        """Displacement and velocity, as `simulate` takes them."""

    @abstractmethod
    def states(self, motion: Any, time: Any) -> np.ndarray:
        """States at times of a motion, shape of `time` and (d,)."""

    @abstractmethod
    def error(self, gap: np.ndarray, state: np.ndarray) -> float:
        """Difference of return and state, relative to the state's size."""

    @abstractmethod
    def step(self, matrix: np.ndarray, gap: np.ndarray) -> np.ndarray:
        """A Newton step; LinAlgError if the matrix is singular."""

    @property
    def side_by_side(self) -> bool:
        """Whether many starts are moved by one compiled call."""
        return (
            isinstance(self.moves, Oscillator)
            and self.options.get("method") is None
            and piecewise_linear(self.moves)
        )

    def off(self, state: np.ndarray) -> Off:
        """Residual, difference of return and state, and the map; inf if it fails."""
        try:
            here = tangent_map(
                self.moves, periods=self.periods, initial=self.parts(state), **self.options
            )
        except InvalidInput as error:
            if error.argument != "initial":
                raise
            return math.inf, state, None
        return self.off_by(state, here)

    def off_by(self, state: np.ndarray, here: TangentMap | None) -> Off:
        """As `off`, of a tangent map, or None where the state is no start."""
        if here is None:
            return math.inf, state, None
        gap = np.concatenate([np.atleast_1d(part) for part in here.final[:2]]) - state
        if here.status != "complete" or not np.isfinite(gap).all():
            return math.inf, state, None
        return self.error(gap, state), gap, here

    def multipliers(self, here: TangentMap, state: np.ndarray) -> np.ndarray:
        """Floquet multipliers of the orbit through a fixed point."""
        return here.multipliers

    def slopes(self, here: TangentMap, unit: np.ndarray) -> np.ndarray:
        """Derivative of the difference by the state, both in these units."""
        return here.matrix * unit[None, :] / unit[:, None] - np.eye(len(unit))

    def newton(self, *starts: np.ndarray) -> list[Found]:
        """Where Newton's method leads from each start; all go side by side."""
        searches = dict(enumerate(map(self._search, starts)))
        asked = {k: next(search) for k, search in searches.items()}
        found: dict[int, Found] = {}
        while asked:
            answers = off_each([self] * len(asked), list(asked.values()))
            for k, answer in zip(tuple(asked), answers, strict=True):
                try:
                    asked[k] = searches[k].send(answer)
                except StopIteration as end:
                    found[k] = end.value
                    del asked[k]
        return [found[k] for k in range(len(starts))]

    def newton_from(self, starts: Iterator[np.ndarray]) -> Iterator[Found]:
        """Where Newton's method leads from each start; more and more of them side by side.

        The first mostly leads to an orbit.
        """
        together = 1
        while some := list(islice(starts, together)):
            yield from self.newton(*some)
            together *= 4 if self.side_by_side else 1

    def _search(self, start: np.ndarray) -> Generator[np.ndarray, Off, Found]:
        """Newton's method from a start; yields the states whose return it must know."""
        state, iterations = start, 0
        residual, gap, here = yield state
        status = "not converged" if here is not None else "lost"
        while here is not None and residual > 0 and iterations < self.steps:
            iterations += 1
            try:
                step = self.step(here.matrix, gap)
            except np.linalg.LinAlgError:
                break
            if not np.isfinite(step).all():
                break
            share = 1.0
            for _ in range(self.halvings):
                better = yield state + share * step
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
        return Found(state, residual, iterations, status, here)

    def strobed(self) -> np.ndarray:
        """States of a long motion once a period, shape (k, d)."""
        motion = simulate(
            self.moves, periods=self.look + self.periods, transient=self.settle, **self.options
        )
        period = self.system.forcing_period
        times = motion.start + period * np.arange(self.look + self.periods + 1)
        return self.states(motion, np.minimum(times, motion.stop))


def off_each(maps: Sequence[Any], states: Sequence[np.ndarray]) -> list[Any]:
    """`off` of each map at its state; by one compiled call where the exact engine moves them.

    All maps are over the same periods from the same phase.
    """
    first = maps[0]
    if len(maps) == 1 or not all(one.side_by_side for one in maps):
        return [one.off(state) for one, state in zip(maps, states, strict=True)]
    alike = all(one.moves is first.moves for one in maps)
    moved = [one.moves for one in (maps[:1] if alike else maps)]
    found = tangent_maps(moved, np.array(states), first.phase, first.periods)
    return [one.off_by(state, here) for one, state, here in zip(maps, states, found, strict=True)]


class OscillatorShooting(Shooting):
    """The map of an oscillator; states are displacement and velocity."""

    def __init__(
        self, oscillator: Any, periods: int, phase: float, method: Any, tolerance: float
    ) -> None:
        super().__init__(recurring("oscillator", oscillator), periods, phase, tolerance)
        self.omega = reference_frequency(oscillator)
        self.scales = np.array([1.0, self.omega])
        self.options["method"] = method

    def parts(self, state: np.ndarray) -> tuple[float, float]:
        """Displacement and velocity."""
        return float(state[0]), float(state[1])

    def states(self, motion: Any, time: Any) -> np.ndarray:
        """Displacements and velocities at times of a motion."""
        return np.stack(motion.sample(time), axis=-1)

    def scale(self, state: np.ndarray) -> np.ndarray:
        """Units that make displacement and velocity comparable and of size 1."""
        size = max(math.hypot(state[0], state[1] / self.omega), 1e-12)
        return np.array([1.0, 1 / self.omega]) / size

    def error(self, gap: np.ndarray, state: np.ndarray) -> float:
        """Difference of return and state, relative to the state."""
        return float(np.abs(gap * self.scale(state)).max())

    def step(self, matrix: np.ndarray, gap: np.ndarray) -> np.ndarray:
        """The step of Newton's method."""
        return np.linalg.solve(np.eye(2) - matrix, gap)

    def strobed(self) -> np.ndarray:
        """States of a long motion once a period, shape (k, 2)."""
        motion = simulate(
            self.moves, periods=self.look + self.periods, transient=self.settle, **self.options
        )
        return np.stack(motion.stroboscopic(self.phase), axis=1)

    def given(self, guess: Any) -> np.ndarray:
        """The start that a user gives.

        Raises
        ------
        InvalidInput
            If it is not two finite numbers.
        """
        required = "two finite numbers: displacement and velocity"
        given = reals("guess", guess, required)
        if given.shape != (2,) or not np.isfinite(given).all():
            raise InvalidInput("guess", guess, required)
        return given

    def close_returns(self, count: int, spread: int = 0) -> Iterator[np.ndarray]:
        """Points of a long motion that nearly return after n periods, the closest first.

        Then, if asked, so many by so many points spread over where it goes and half as far again.

        Raises
        ------
        InvalidInput
            If the motion ends before it can return.
        """
        points = self.strobed()
        if len(points) <= self.periods:
            raise InvalidInput(
                "system", self.system, "a motion that is long enough to find returns",
                "Its motion ended early, as the status of simulate() says; find_periodic_orbit "
                "takes guess=",
            )  # fmt: skip
        scale = np.array([1.0, 1 / self.omega])
        off = np.hypot(*((points[self.periods :] - points[: -self.periods]) * scale).T)
        extent = np.maximum(np.ptp(points, axis=0), 1e-3 * np.abs(points).max())
        apart = 0.02 * np.hypot(*(np.ptp(points, axis=0) * scale))
        yield from distinct(points, off, count, lambda d: np.hypot(*(d * scale).T), apart)
        middle = points.min(axis=0) + np.ptp(points, axis=0) / 2
        shares = np.linspace(-0.75, 0.75, spread)
        for a, b in product(shares, shares):
            yield middle + extent * (a, b)


def distinct(
    points: np.ndarray,
    off: np.ndarray,
    count: int,
    size: Callable[[np.ndarray], np.ndarray],
    apart: float,
) -> Iterator[np.ndarray]:
    """The points with the least differences, none near another."""
    chosen: list[np.ndarray] = []
    for k in np.argsort(off, kind="stable"):
        if len(chosen) == count:
            return
        if not chosen or (size(points[k] - np.array(chosen)) > apart).all():
            chosen.append(points[k])
            yield points[k]
