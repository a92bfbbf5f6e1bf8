"""States of a flow at given instants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arguments import number
from ..errors import InvalidInput
from ..oscillators.flows import Flow
from ._course import Running, coordinate_of


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States of a flow.

    Parameters
    ----------
    flow : Flow
        What flows.
    time : ndarray, shape (n,)
        Instants, from t = 0 at the initial state.
    state : ndarray, shape (n, d)
        State at each.
    reason : str
        Why there are fewer than asked for, where there are fewer.
    """

    flow: Flow
    time: np.ndarray
    state: np.ndarray
    reason: str = ""

    def __getitem__(self, coordinate: str | int) -> np.ndarray:
        """A coordinate by its name or number, shape (n,)."""
        return self.state[:, coordinate_of(self.flow, coordinate)]

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        span = f", t = {self.time[0]:g} to {self.time[-1]:g}" if len(self) else ""
        told = f"; {self.reason}" if self.reason else ""
        return f"Trajectory({self.flow!r}, {len(self)} states{span}{told})"


def trajectory(
    flow: Flow,
    times: Any = None,
    *,
    interval: float | None = None,
    count: int | None = None,
    transient: float = 0.0,
    initial: Sequence[float] | None = None,
) -> Trajectory:
    """States of a flow at any times, from the interpolant of steps as long as a tolerance allows.

    Dormand and Prince's method of order 8 at a tolerance of 1e-13; steps do not depend on the times
    asked for. See `integrate_and_fire` for what accuracy means in a chaotic flow.

    Parameters
    ----------
    flow : Flow
        See `impactsig.flows`.
    times : array_like, shape (n,), optional
        Instants, ascending, 0 or greater. Or instead:
    interval, count : float, int
        Time between samples, and how many.
    transient : float
        How long to let it flow before the first of these.
    initial : sequence of float, optional
        State at t = 0, if not that of the flow.

    Raises
    ------
    InvalidInput
        If an argument is out of range, or numba cannot compile the flow.

    Examples
    --------
    >>> x = trajectory(flows.lorenz(), interval=0.04, count=20_000, transient=50)["x"]
    """
    if (times is None) == (interval is None or count is None):
        raise InvalidInput(
            "times", times, "either times, or interval and count", "Give one or the other"
        )
    if times is None:
        wanted = number("count", count, least=1, most=2**40)
        if wanted != int(wanted):
            raise InvalidInput("count", count, "a whole number, 1 or greater")
        step = number("interval", interval, above=0)
        instants = number("transient", transient, least=0) + step * np.arange(int(wanted))
    else:
        instants = _ascending(times)
    state, reason = Running(flow, None, initial).sample(instants)
    return Trajectory(flow, instants[: len(state)], state, reason)


def _ascending(times: Any) -> np.ndarray:
    required = "finite numbers, ascending from 0 or greater"
    try:
        instants = np.array(times, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidInput("times", times, required) from None
    if instants.ndim != 1 or not np.all(np.isfinite(instants)):
        raise InvalidInput("times", times, required)
    if len(instants) and (instants[0] < 0 or np.any(np.diff(instants) < 0)):
        raise InvalidInput("times", times, required, "Sort them first")
    return instants
