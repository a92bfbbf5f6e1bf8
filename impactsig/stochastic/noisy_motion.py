"""One simulated path of an oscillator under noise."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._arguments import Seed, reals, whole
from .._showing import drawn_by
from ..errors import InvalidInput
from ..impacts import Impacts, exact
from ..oscillators import Oscillator
from ..simulation.basis.frame import strobe_times
from ..simulation.moved import Moved
from ._arguments import TURN, course
from .paths.running import Method, Mover, key_of

BATCH = 1 << 15  # steps in a call of the kernel, so that a run can be interrupted
ROOM = 2 * BATCH  # impacts that a call has room for at first


@dataclass(frozen=True, eq=False, repr=False)
class NoisyMotion(Moved):
    """One simulated path of an oscillator under noise, sampled at equal intervals.

    Attributes
    ----------
    system : Oscillator
        The simulated system.
    start, duration : float
        The span after the transient [s].
    time : numpy.ndarray, shape (n,)
        Stored instants, since the start of the simulation [s].
    x, v : numpy.ndarray, shape (n,)
        Displacement and velocity at these instants, relative to the ground, in the units of the
        oscillator.
    impacts : Impacts
        Impacts and touches in the span, with their approach velocities.
    step : float
        Step [s].
    final : tuple of float
        Displacement, velocity and phase of the forcing at the end.
    status : str
        "complete" or "diverged"; what was computed until then is kept.

    See Also
    --------
    simulate, results.Ensemble, plot.noisy_motion

    Examples
    --------
    >>> from impactsig import scenes, simulate
    >>> motion = simulate(scenes.van_der_pol_duffing(0.99), duration=50, seed=1)
    >>> motion.status, bool((motion.x >= 0).all())  # the stop is at 0
    ('complete', True)
    """

    system: Oscillator
    start: float
    duration: float
    time: np.ndarray = field(repr=False)
    x: np.ndarray = field(repr=False)
    v: np.ndarray = field(repr=False)
    impacts: Impacts
    step: float
    final: tuple[float, float, float]
    status: str
    _phase: float = field(repr=False)

    def sample(self, time: Any) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity at the sampled instants.

        Between these instants the path is not determined, so that other times raise an error.

        Parameters
        ----------
        time : array_like
            Times [s].

        Returns
        -------
        x, v : ndarray, shape of `time`

        Raises
        ------
        InvalidInput
            If a time is not a stored instant, within a millionth of the interval between two.
        """
        asked = reals("time", time, "instants at which the path was looked at")
        apart = self.time[1] - self.time[0] if len(self.time) > 1 else self.step
        first = self.time[0] if len(self.time) else math.nan
        with np.errstate(invalid="ignore"):
            which = np.round((asked - first) / apart)
            near = np.abs(first + which * apart - asked) <= 1e-6 * apart
            inside = (which >= 0) & (which < len(self.time))
        if not (near & inside).all():
            raise InvalidInput(
                "time", time, f"instants among {first:.9g} + n {apart:.9g} s, n below "
                f"{len(self.time)}", "simulate(..., every=) chooses their distance",
            )  # fmt: skip
        return self.x[which.astype(int)], self.v[which.astype(int)]

    def stroboscopic(self, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity once every forcing period, at a phase of the forcing [rad].

        Both have the shape (k,), for k periods.

        Raises
        ------
        InvalidInput
            If there is no forcing, or the path was not stored at that phase: the period, and the
            time to that phase, must be integer multiples of `every` of `simulate`.
        """
        period = self.system.forcing_period
        omega = None if period is None else TURN / period
        first, last = self.time[[0, -1]] if len(self.time) else (self.start, self.start)
        return self.sample(strobe_times(self, phase, omega, first, last)[: len(self.time)])

    plot = drawn_by("noisy_motion", "displacement over time with the impacts")

    def __repr__(self) -> str:
        unit = " s" if self.system.in_seconds else ""
        return (
            f"NoisyMotion({len(self.time)} instants over {np.ptp(self.time):g}{unit}, step "
            f"{self.step:.3g}{unit}, {len(self.impacts.time)} impacts; {self.status})"
        )


def move(
    oscillator: Oscillator,
    *,
    path: int = 0,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
    seed: Seed = None,
    method: Method = "splitting",
    step: float | None = None,
    every: float | None = None,
) -> NoisyMotion:
    """Simulate one path of an oscillator under noise, step by step."""
    from .paths.equation import SPEED, WHICH

    path = whole("path", path, 0)
    found = course(
        oscillator, 1, periods=periods, duration=duration, transient=transient, initial=initial,
        phase=phase, method=method, step=step, every=every, look=1,
    )  # fmt: skip
    mover = Mover(oscillator, found.step, method, found.phase, key_of(seed))
    group = mover.start(found.q, found.v, np.array([path]))
    group.move(found.before)
    seen, hits = [np.empty((1, 0, 2))], [np.empty((0, 3))]
    events, done, steps = np.empty((ROOM, 3)), 0, found.looks * found.every
    while done < steps:
        until = min(done + BATCH, steps)
        looks = until // found.every - done // found.every
        before, step = group.state.copy(), group.step
        group.count[:] = 0
        part = group.move(until - done, found.every, looks, events)
        hit_count = int(group.count.item())
        if hit_count > len(events):  # again with room for all: the noise goes with the step
            events = np.empty((2 * hit_count, 3))
            group.state[:], group.step = before, step
            continue
        seen.append(part)
        hits.append(events[:hit_count].copy())
        done = until
    x, v = np.concatenate(seen, axis=1)[0].T
    finite = np.isfinite(x) & np.isfinite(v)
    good = len(x) if finite.all() else int(np.argmin(finite))
    unit = oscillator.time_unit
    start = found.before * found.step * unit
    span = good * found.every * found.step * unit
    hit = np.concatenate(hits)
    hit = hit[(hit[:, 0] * unit >= start) & (hit[:, 0] * unit <= start + span)]
    hit = hit[np.argsort(hit[:, 0], kind="stable")]
    last = found.phase + (start + span) / unit * (oscillator.angular_forcing_frequency or 0.0)
    end = (math.nan, math.nan) if not good else (float(x[good - 1]), float(v[good - 1]))
    return NoisyMotion(
        system=oscillator,
        start=start,
        duration=span,
        time=start + unit * found.step * found.every * np.arange(1, good + 1),
        x=x[:good].copy(),
        v=v[:good].copy(),
        impacts=Impacts(
            hit[:, 0] * unit,
            approach_velocity=hit[:, SPEED],
            stop_index=hit[:, WHICH],
            **exact(len(hit)),
            start=start,
            duration=span,
            source=oscillator.name,
        ),
        step=found.step * unit,
        final=(*end, last % TURN),
        status="complete" if good == len(x) else "diverged",
        _phase=found.phase,
    )
