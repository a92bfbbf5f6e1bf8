"""Simulation of groups of paths by any of the methods."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from ..._arguments import Seed, choice, seed_sequence
from ...errors import InvalidInput
from ...oscillators import Oscillator
from .posing import filtered_deviation, functions, pose, transition

Method = Literal["splitting", "runge-kutta", "zhuravlev", "gaussian"]
METHODS = ("splitting", "runge-kutta", "zhuravlev", "gaussian")
LANES = 32  # paths that are moved together
NO_EVENTS = np.empty((0, 3))


def key_of(seed: Seed) -> np.ndarray:
    """Key of the random numbers: the same for the same seed.

    Raises
    ------
    InvalidInput
        If the seed is not of a kind that NumPy knows.
    """
    return seed_sequence(seed).generate_state(2, np.uint32)


def check_method(oscillator: Oscillator, method: Method) -> None:
    """Refuse a method that cannot simulate this oscillator.

    Raises
    ------
    InvalidInput
        If it cannot, or there is none of that name.
    """
    choice("method", method, METHODS)
    rigid = [stop for stop in oscillator.stops if stop.law.rigid]
    filtered = oscillator.noise is not None and oscillator.noise.correlation_time > 0
    remedy = 'Use method="splitting"'
    noise = oscillator.noise
    if (
        method != "splitting"
        and noise is not None
        and (noise.parametric or noise.angular_frequency)
    ):
        kind = "parametric noise" if noise.parametric else "noise in a band"
        required = f"noise that is a force, white or of angular frequency 0 (here: {kind})"
        raise InvalidInput("method", method, required, remedy)
    if method == "gaussian":
        hindered = {
            "a law": oscillator.law is not None,
            "friction": oscillator.friction is not None,
            "soft stops": len(rigid) < len(oscillator.stops),
            "filtered noise": filtered,
        }
        found = " and ".join(name for name, there in hindered.items() if there)
        if found:
            required = f"a linear oscillator, rigid stops and white noise (here: {found})"
            raise InvalidInput("method", method, required, remedy)
    if method == "zhuravlev" and len(rigid) != 1:
        required = f"one rigid stop to unfold the motion about (here: {len(rigid)})"
        raise InvalidInput("method", method, required, remedy)
    if method in ("runge-kutta", "zhuravlev") and filtered and oscillator.friction:
        required = "no friction under filtered noise, where the mass sticks"
        raise InvalidInput("method", method, required, remedy)


class Mover:
    """A method with an oscillator and a step: simulates groups of paths.

    Parameters
    ----------
    oscillator : Oscillator
        The system.
    step : float
        Step, in the oscillator's unit of time.
    method : str
        One of `METHODS`, checked.
    phase : float
        Phase of the forcing at t = 0 [rad].
    key : numpy.ndarray of uint32, shape (2,)
        Key of the generator.
    """

    def __init__(
        self, oscillator: Oscillator, step: float, method: Method, phase: float, key: np.ndarray
    ) -> None:
        self.key = key
        self.problem = pose(oscillator, step, phase, unfold=method == "zhuravlev")
        self.functions = functions(oscillator)
        self._method = method
        self._deviation = filtered_deviation(oscillator)
        self._extra: tuple[Any, ...] = ()
        if method == "gaussian":
            self._extra = (transition(self.problem),)

    def start(self, q: np.ndarray, v: np.ndarray, paths: np.ndarray) -> Group:
        """A group of paths at t = 0, with positions and velocities relative to the stops."""
        from ._random import START, draw_pair, room
        from .equation import ACROSS, APPROACH, F, Q, V

        state = np.zeros((APPROACH + len(self.problem.soft), len(paths)))
        state[Q], state[V] = q, v
        if self._deviation:
            pair = np.empty(2)
            for lane, path in enumerate(paths):
                draw_pair(room(2), self.key, path, 0, START, pair)
                state[F, lane], state[ACROSS, lane] = self._deviation * pair
        group = Group(self, state, np.asarray(paths, np.uint32))
        self._kernels().begin(
            self.problem, self.functions, self.key, group.paths, group.scratch, state,
            group.count, NO_EVENTS,
        )  # fmt: skip
        return group

    def scratch(self, lanes: int) -> Any:
        """Work arrays of the method's kernels for so many paths."""
        return self._kernels().scratch(lanes)

    def _kernels(self) -> Any:
        if self._method == "splitting":
            from . import _splitting as kernels
        elif self._method == "gaussian":
            from . import _gaussian as kernels  # type: ignore[no-redef]
        else:
            from . import _stages as kernels  # type: ignore[no-redef]
        return kernels

    def move(self, *arguments: Any) -> None:
        """The method's kernel."""
        self._kernels().move(self.problem, *self._extra, self.functions, self.key, *arguments)


class Group:
    """A group of paths and the step it has reached."""

    def __init__(self, mover: Mover, state: np.ndarray, paths: np.ndarray) -> None:
        self.mover, self.state, self.paths = mover, state, paths
        self.count = np.zeros(len(paths), np.int64)
        self.step = 0
        self.scratch = mover.scratch(len(paths))

    def move(
        self,
        steps: int,
        every: int = 1,
        looks: int = 0,
        events: np.ndarray = NO_EVENTS,
    ) -> np.ndarray:
        """Advance by so many steps; returns samples at multiples of `every`."""
        seen = np.empty((len(self.paths), looks, 2))
        last = self.step + steps
        self.mover.move(
            self.paths,
            self.scratch,
            self.state,
            self.count,
            self.step,
            last,
            every,
            seen,
            events,
        )
        self.step = last
        return seen
