"""An oscillator under OGY control, period by period, with the derivative of each period.

From one section to the next the state s goes to F(s, p), and p = -gain . (s - s_k) where it is
within the limit, else 0. So differences go by the slope of F by s, less shift gain' where the
parameter is moved, the shift being the slope of F by p.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ...dynamics.tangents.tangent import TangentMap, tangent_map
from ...oscillators import Oscillator
from ...simulation import simulate
from ..ogy import NUDGE, OGY
from ..running.nudged import nudge
from ..schedule import Phase

FINEST = 1e-9  # share of the size of a parameter, below which no side steps keep the events


class Lap(NamedTuple):
    """One forcing period, or the last part of one."""

    here: TangentMap  # with the parameter held
    matrix: np.ndarray
    determinant: float
    grazed: bool  # no difference quotient keeps the events


def laps(
    oscillator: Oscillator, phases: tuple[Phase, ...], length: float, initial: Any,
    **options: Any,
) -> Iterator[Lap]:  # fmt: skip
    """The periods of a motion from t = 0 on, as far as it gets."""
    state = (0.0, 0.0) if initial is None else initial
    starts = [start for start, _ in phases]
    for n in range(math.ceil(length - 1e-12)):
        part = min(1.0, length - n)
        k = int(np.searchsorted(starts, n, "right")) - 1
        how, by, moved = phases[k][1] if k >= 0 else None, 0.0, oscillator
        if isinstance(how, OGY):
            by, gain = nudge(how, np.array(state, float))
            moved = how.nudged(oscillator, by)
        here = tangent_map(moved, periods=part, initial=state, **options)
        matrix, determinant, grazed = here.matrix, _determinant(here), False
        if isinstance(how, OGY) and here.status == "complete" and gain.any():
            shift = _shift(how, oscillator, by, state, here, part, options)
            grazed = shift is None
            if shift is not None:
                matrix = matrix - np.outer(shift, gain)
                (a, b), (c, d) = here.matrix
                determinant -= float(gain @ np.array([[d, -b], [-c, a]]) @ shift)
        yield Lap(here, matrix, determinant, grazed)
        if here.status != "complete":
            return
        state = here.final[:2]


def _determinant(here: TangentMap) -> float:
    """Determinant of the derivative; positive under impacts and damping."""
    if math.isnan(here.log_determinant):
        return float(np.linalg.det(here.matrix))
    return math.exp(here.log_determinant)


def _shift(
    how: OGY, oscillator: Oscillator, by: float, state: Any, here: TangentMap, part: float,
    options: dict[str, Any],
) -> np.ndarray | None:  # fmt: skip
    """Derivative of the state after a period by the parameter; None near a grazing impact.

    The side steps shrink until all of them have the impacts of the motion itself.
    """
    largest = max([abs(force.amplitude) for force in oscillator.forces], default=0.0)
    h = NUDGE * max(largest, how.limit)
    finest = FINEST * max(largest, how.limit)
    while h > finest:
        sides = [
            simulate(
                how.nudged(oscillator, by + k * h), periods=part, initial=state, keep="counts",
                **options,
            )
            for k in (-1.0, -0.5, 0.5, 1.0)
        ]  # fmt: skip
        if all(side.impact_count == here.impacts for side in sides):
            far, near, nearer, farther = (np.array(side.final[:2]) for side in sides)
            return np.asarray((8 * (nearer - near) - (farther - far)) / (6 * h))
        h /= 10
    return None
