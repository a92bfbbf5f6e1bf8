"""Feedback of interspike intervals, which a microphone or a load cell can measure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from .._arguments import choice, number, whole
from ..dynamics.periodic.flow_orbits import FlowOrbit
from ..dynamics.periodic.orbits import PeriodicOrbit
from ..errors import InvalidInput
from ..oscillators.flows import Flow
from ..oscillators.parts import numbers
from .ogy import moved
from .stability.crossing_map import crossing_maps_of
from .stability.fastest import fastest
from .stability.impact_map import SpikeMap, impact_maps_of
from .stability.strength import offset_of


@dataclass(frozen=True)
class IntervalFeedback:
    """Feedback of interspike intervals: at each spike a parameter is set from the last intervals.

    Spikes are the impacts of an oscillator, or the crossings of a level by a coordinate of a flow.
    After the k-th spike, until the next one, the parameter is changed by

        p_k = offset + q_k,   q_k = memory q_(k-1) + gain (I_k - reference),

    where I_k is the interval that ends with the spike, in forcing periods or in the unit of time of
    the flow. q_k is 0 if its modulus would exceed `limit`, or if too few intervals have been
    measured. The reference is the interval on the target orbit, or the interval `delay` spikes ago.
    Displacement, velocity and phase of the forcing are not used.

    Parameters
    ----------
    gain : float
        Change of the parameter per unit of the deviation of the interval.
    limit : float
        Greatest change of the parameter besides the offset, in its unit.
    target : float, optional
        Interval on the orbit; by default the reference is an earlier interval.
    delay : int
        Number of spikes between that interval and the current one.
    memory : float
        Factor by which the last change is retained; may exceed 1.
    parameter : {"amplitude", "load"} or int
        Amplitude of the first force of the oscillator, or a constant force; for a flow, the index
        of a parameter.
    signal : str or int
        Name or number of the coordinate of a flow whose crossings are its spikes.
    level : float, optional
        Level that the coordinate crosses upwards; required for a flow.
    offset : float
        Constant change of the parameter, as set by `fastest` for a given strength of the impacts.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    Notes
    -----
    For an orbit with one impact and an unstable multiplier L < -1, a gain suffices, with a target
    or a delay, if L is not far below -1. For an oscillator with L > 1 no gain suffices: intervals
    do not determine the phase of the impacts, so that the feedback vanishes at a multiplier of 1,
    and the number of multipliers above 1 stays odd. A memory above 1, that is an unstable
    controller, removes this limitation [Pyragas2001]_. For an autonomous flow, intervals determine
    the position on the section, and a target has no such limitation. `fastest` chooses gain and
    memory; these and the last interval replace the state that the method of Ott, Grebogi and Yorke
    requires. If the orbit has m spikes, the feedback vanishes on it if the delay is a multiple of
    m.

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

    Rössler's flow, of which nothing is seen but when x passes 0 upwards:

    >>> from impactsig import flows
    >>> orbit = find_periodic_orbit(flows.rossler(), period=5.88)
    >>> feedback = IntervalFeedback.fastest(orbit, limit=0.3, parameter=2, signal="x", level=0.0)
    >>> course = simulate(Controlled(orbit.system, feedback), duration=600)
    >>> bool(course.spikes.intervals()[-5:].std() < 1e-6)
    True
    """

    gain: float
    limit: float
    target: float | None = None
    delay: int = 1
    memory: float = 0.0
    parameter: Literal["amplitude", "load"] | int = "amplitude"
    signal: str | int = 0
    level: float | None = None
    offset: float = 0.0

    def __post_init__(self) -> None:
        numbers(self, "gain", "memory", "offset")
        numbers(self, "limit", *(["target"] if self.target is not None else []), above=0)
        object.__setattr__(self, "delay", whole("delay", self.delay, 1))
        object.__setattr__(self, "parameter", _parameter(self.parameter))
        if not isinstance(self.signal, str):
            object.__setattr__(self, "signal", whole("signal", self.signal, 0))
        if self.level is not None:
            numbers(self, "level")

    @classmethod
    def fastest(
        cls,
        orbit: PeriodicOrbit | FlowOrbit,
        limit: float,
        *,
        delay: int | None = None,
        parameter: Literal["amplitude", "load"] | int = "amplitude",
        signal: str | int = 0,
        level: float | None = None,
        strength: float | None = None,
    ) -> IntervalFeedback:
        """The feedback with the fastest convergence to an orbit, by its linearised map.

        Gain and memory minimise the largest modulus of the multipliers. At the minimum three
        multipliers have the same modulus, two of them being equal, so that small deviations
        decrease as the number of laps times a power of the multiplier, not as a single exponential.
        If a strength is given, the parameter is shifted to the value at which the impacts of the
        orbit have it, and the orbit at this value is stabilised. The strength of the impacts is
        thus controlled by their instants alone.

        Parameters
        ----------
        orbit : PeriodicOrbit or FlowOrbit
            The orbit to stabilise, with one spike unless there is a delay.
        limit : float
            As in `IntervalFeedback`.
        delay : int, optional
            Use an earlier interval as the reference, from a multiple of the orbit's number of
            spikes ago; by default the interval on the orbit is used.
        parameter, signal, level
            As in `IntervalFeedback`.
        strength : float, optional
            Desired approach velocity of the impacts, in the units of the oscillator, for an orbit
            with one impact; by default that on the orbit.

        Raises
        ------
        InvalidInput
            If the orbit has more spikes than the feedback can distinguish, the parameter does not
            affect them, or there is no orbit with impacts of that strength.
        """
        own = cls(0.0, limit, None, delay or 1, 0.0, parameter, signal, level)
        if strength is not None:
            strength = number("strength", strength, above=0)
            if isinstance(orbit, FlowOrbit):
                raise InvalidInput("strength", strength, "None for a flow, which has no impacts")
            orbit, offset = offset_of(orbit, own.nudged, strength)
            own = replace(own, offset=offset)
        maps, intervals = own.maps(orbit)
        if delay is None:
            own = replace(own, target=float(np.mean(intervals)))
        own.check(intervals)
        gain, memory = fastest(maps, lambda gain, memory: own._growth(maps, gain, memory))
        return replace(own, gain=gain, memory=memory)

    def nudged(self, system: Any, by: float) -> Any:
        """The oscillator or flow with the parameter changed."""
        if isinstance(system, Flow):
            values = list(system.parameters)
            values[int(self.parameter)] += by
            return replace(system, parameters=tuple(values))
        return moved(system, str(self.parameter), by)

    def move(self, intervals: list[float], before: float) -> float:
        """Change of the parameter, besides the offset, after these intervals (last one last)."""
        needed = 1 if self.target is not None else self.delay + 1
        if len(intervals) < needed:
            return 0.0
        reference = intervals[-1 - self.delay] if self.target is None else self.target
        by = self.memory * before + self.gain * (intervals[-1] - reference)
        return by if abs(by) <= self.limit else 0.0

    def maps(self, orbit: PeriodicOrbit | FlowOrbit) -> tuple[list[SpikeMap], np.ndarray]:
        """Linearised map of each spike of an orbit, and the intervals they end with, shape (m,)."""
        if isinstance(orbit, FlowOrbit):
            return crossing_maps_of(orbit, self.parameter, self.signal, self.level)
        return impact_maps_of(orbit, self.parameter)

    def check(self, intervals: np.ndarray) -> None:
        """Raise an error if the feedback does not vanish on an orbit.

        Raises
        ------
        InvalidInput
            If an interval differs from the target, or the delay is not a multiple of the number of
            spikes.
        """
        many = len(intervals)
        if self.target is None and self.delay % many:
            raise InvalidInput(
                "delay", self.delay, f"a multiple of {many}, the spikes of the orbit",
                "On others the feedback does not vanish",
            )  # fmt: skip
        if self.target is not None and abs(intervals - self.target).max() > 1e-6 * self.target:
            told = ", ".join(f"{one:.9g}" for one in intervals)
            raise InvalidInput(
                "target", self.target, f"the interval of the orbit, which has {told}",
                f"delay={many} refers each interval to the one before it in its place"
                if many > 1 else "",
            )  # fmt: skip

    def lap(self, maps: list[SpikeMap]) -> np.ndarray:
        """Map of (state, earlier intervals, last change) over a period, shape (n, n)."""
        whole_lap = self._spike(maps[0])
        for one in maps[1:]:
            whole_lap = self._spike(one) @ whole_lap
        return whole_lap

    def _spike(self, linear: SpikeMap) -> np.ndarray:
        """The same from one spike to the next."""
        d, back = len(linear.shift), 1 if self.target is not None else self.delay + 1
        change = np.zeros(d + back + 1)
        change[d] += self.gain
        change[-1] = self.memory
        if self.target is None:
            change[d + self.delay] -= self.gain
        loop = np.zeros((len(change), len(change)))
        loop[:d, :d], loop[d, :d] = linear.matrix, linear.interval
        loop[:d] += np.outer(linear.shift, change)
        loop[d] += linear.stretch * change
        loop[np.arange(d + 1, d + back), np.arange(d, d + back - 1)] = 1.0
        loop[-1] = change
        return loop

    def _growth(self, maps: list[SpikeMap], gain: float, memory: float) -> float:
        own = replace(self, gain=gain, memory=memory)
        return float(np.abs(np.linalg.eigvals(own.lap(maps))).max())


def _parameter(given: Any) -> Any:
    if isinstance(given, str):
        return choice("parameter", given, ("amplitude", "load"))
    return whole("parameter", given, 0)
