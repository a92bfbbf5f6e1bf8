"""Feedback of the intervals between impacts: what a microphone or a load cell gives."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

import numpy as np

from .._arguments import choice, number, whole
from ..dynamics.periodic.orbits import PeriodicOrbit
from ..errors import InvalidInput
from ..oscillators import Oscillator
from .ogy import moved
from .stability.impact_map import ImpactMap, impact_map_of

GAINS, MEMORIES = np.linspace(-2.0, 2.0, 17), np.linspace(-0.75, 1.5, 10)  # of the first look
REFINED = 3  # of its best


@dataclass(frozen=True)
class IntervalFeedback:
    """Moves a parameter at each impact by what the last intervals between impacts tell.

    After the k-th impact the parameter is moved, until the next one, by

        p_k = memory p_(k-1) + gain (I_k - reference),

    I_k being the interval that ends with the impact, in forcing periods; by nothing where that is
    more than `limit` either way, or where too few intervals have been seen. The reference is the
    interval on the orbit that is to be held, or the interval `delay` impacts ago. Neither a
    displacement nor a velocity is used, nor the phase of the forcing.

    Parameters
    ----------
    gain : float
        Change of the parameter by an interval that is off by one forcing period.
    limit : float
        Greatest change of the parameter, in the oscillator's unit of force.
    target : float, optional
        Interval on the orbit [forcing periods]; by default the reference is an earlier interval.
    delay : int
        How many impacts ago that interval was.
    memory : float
        Share of the last change that is kept; of any size.
    parameter : {"amplitude", "load"}
        Amplitude of the first of the oscillator's forces, or a constant force.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    Notes
    -----
    On an orbit of one impact with an unstable multiplier L < -1 a gain alone suffices, with a
    target or with a delay, if L is not far below -1. For L > 1 no gain does: an interval does not
    tell where in the forcing's period the impacts are, so that at a multiplier of 1 the feedback
    vanishes, and the number of multipliers above 1 stays odd. A memory above 1, an unstable
    controller, takes this limit away [Pyragas2001]_. `fastest` chooses gain and memory: these two
    and the last interval take the place of the state that the method of Ott, Grebogi and Yorke
    has to see.

    See Also
    --------
    DelayedFeedback, OGY, orbit_stability

    Examples
    --------
    >>> from impactsig import Controlled, IntervalFeedback, find_periodic_orbit, scenes, simulate
    >>> beam = scenes.karpodinis(20.3355)
    >>> orbit = find_periodic_orbit(beam, 1, impacts=1)
    >>> feedback = IntervalFeedback.fastest(orbit, limit=0.02)
    >>> motion = simulate(Controlled(beam, feedback), periods=500)
    >>> bool(motion.impacts.intervals()[-5:].std() < 1e-9)
    True
    """

    gain: float
    limit: float
    target: float | None = None
    delay: int = 1
    memory: float = 0.0
    parameter: Literal["amplitude", "load"] = "amplitude"

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", number("gain", self.gain))
        object.__setattr__(self, "limit", number("limit", self.limit, above=0))
        if self.target is not None:
            object.__setattr__(self, "target", number("target", self.target, above=0))
        object.__setattr__(self, "delay", whole("delay", self.delay, 1))
        object.__setattr__(self, "memory", number("memory", self.memory))
        choice("parameter", self.parameter, ("amplitude", "load"))

    @classmethod
    def fastest(
        cls,
        orbit: PeriodicOrbit,
        limit: float,
        *,
        delay: int | None = None,
        parameter: Literal["amplitude", "load"] = "amplitude",
    ) -> IntervalFeedback:
        """The feedback under which an orbit is come to fastest, as far as it is linear.

        Gain and memory make the greatest multiplier as small as they can.

        Parameters
        ----------
        orbit : PeriodicOrbit
            Of one impact, at a rigid stop.
        limit : float
            As of `IntervalFeedback`.
        delay : int, optional
            Reference to an earlier interval; by default to that of the orbit.
        parameter : {"amplitude", "load"}
            As of `IntervalFeedback`.

        Raises
        ------
        InvalidInput
            If the orbit has not one impact at a rigid stop, an argument is out of its range, or
            the parameter does not move the impacts.
        """
        from scipy.optimize import minimize

        choice("parameter", parameter, ("amplitude", "load"))
        linear = impact_map_of(orbit, parameter)
        scale = float(linear.shift[0])
        if not abs(scale) > 0:
            raise InvalidInput("parameter", parameter, "one that moves the impacts")
        target = float(orbit.periods) if delay is None else None

        def made(values: Any) -> IntervalFeedback:
            return cls(values[0] / scale, limit, target, delay or 1, values[1], parameter)

        def growth(values: Any) -> float:
            return float(np.abs(np.linalg.eigvals(made(values).closed_loop(linear))).max())

        options = {"xatol": 1e-6, "fatol": 1e-9, "maxiter": 400}
        found = [
            minimize(growth, start, method="Nelder-Mead", options=options)
            for start in sorted(product(GAINS, MEMORIES), key=growth)[:REFINED]
        ]
        return made(min(found, key=lambda one: one.fun).x)

    def nudged(self, oscillator: Oscillator, by: float) -> Oscillator:
        """The oscillator with the parameter moved."""
        return moved(oscillator, self.parameter, by)

    def move(self, intervals: list[float], before: float) -> float:
        """How far to move the parameter after these intervals, the last one last."""
        needed = 1 if self.target is not None else self.delay + 1
        if len(intervals) < needed:
            return 0.0
        reference = intervals[-1 - self.delay] if self.target is None else self.target
        by = self.memory * before + self.gain * (intervals[-1] - reference)
        return by if abs(by) <= self.limit else 0.0

    def closed_loop(self, linear: ImpactMap) -> np.ndarray:
        """Map of (instant and velocity, earlier instants, last change) from impact to impact."""
        back = 1 if self.target is not None else self.delay + 1  # earlier instants that count
        size = 2 + back + 1
        interval = np.zeros(size)
        interval[0], interval[2] = 1.0, -1.0
        if self.target is None:
            interval[1 + self.delay] -= 1.0 if self.delay > 1 else 0.0
            interval[2] -= 1.0 if self.delay == 1 else 0.0
            interval[2 + self.delay] += 1.0
        change = self.gain * interval
        change[-1] = self.memory
        loop = np.zeros((size, size))
        loop[:2, :2] = linear.matrix
        loop[:2] += np.outer(linear.shift, change)
        loop[2, 0] = 1.0
        for k in range(3, 2 + back):
            loop[k, k - 1] = 1.0
        loop[-1] = change
        return loop
