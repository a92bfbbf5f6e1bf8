"""A recorded motion: sections, level crossings, and restitution coefficients."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from ._arguments import choice, instance, number
from ._numerics.smoothing import converter_step
from ._numerics.straight_line import fit_line
from ._showing import Shown
from .errors import InvalidInput
from .impacts import Impacts

TURN = 2 * math.pi
HYSTERESIS = 4.0
"""Standard deviations of the noise that a crossing must have come from."""
FEWEST = 8
"""Samples that a velocity beside an impact is fitted to."""
MORE, OUTSTANDING = 4, 3.0
"""Terms that the polynomials may have beyond those of a cubic displacement; standard errors by
which the mean square of a term exceeds the noise if the motion needs it."""


class Restitution(NamedTuple):
    """Velocities before and after impacts, and their ratio.

    `value` is the slope of ``-v`` over u, `departure` over `approach`, by a line through 0 that
    allows for the errors of both, with its standard error; `each` is ``-v / u`` of every impact and
    `each_error` its standard error. `impacts` are the indices of those that have room beside them.
    """

    value: float
    error: float
    each: np.ndarray
    each_error: np.ndarray
    approach: np.ndarray
    departure: np.ndarray
    impacts: np.ndarray


class _End(NamedTuple):
    """Polynomials in orthogonal terms, fitted to one side of an impact."""

    coefficients: np.ndarray
    slope: np.ndarray  # velocity at the impact, by coefficients
    bend: np.ndarray  # acceleration there
    rest: float  # sum of the squares that no term explains
    samples: int
    runs: float  # samples that have one error

    def variance(self, terms: int, step: float) -> float:
        """Variance of a coefficient in a fit of so many terms."""
        rest = self.rest + float(np.sum(self.coefficients[terms:] ** 2))
        freedom = max(self.samples - min(terms, len(self.coefficients)), 1)
        return max(rest / freedom, step**2 / 12.0 * self.runs)

    def velocity(self, terms: int, step: float, late: float) -> tuple[float, float]:
        """Velocity at the impact by so many terms, and its standard error."""
        known = self.coefficients[:terms]
        of_known = math.sqrt(self.variance(terms, step)) * float(np.linalg.norm(self.slope[:terms]))
        return float(self.slope[:terms] @ known), math.hypot(
            of_known, float(self.bend[:terms] @ known) * late
        )


def _terms(ends: list[_End], least: int, step: float) -> int:
    """Terms that the motion beside impacts needs: the last one that stands out of the noise."""
    needed = least
    for terms in range(least + 1, least + 1 + MORE):
        of = [one for one in ends if len(one.coefficients) >= terms]
        noise = sum(one.variance(least + MORE, step) for one in of)
        power = sum(float(one.coefficients[terms - 1]) ** 2 for one in of)
        if power > (1.0 + OUTSTANDING * math.sqrt(2.0 / max(len(of), 1))) * noise:
            needed = terms
    return needed


@dataclass(frozen=True, eq=False, repr=False)
class RecordedMotion(Shown):
    """Displacement and velocity at the samples of a recording.

    Attributes
    ----------
    time, x, v : ndarray, shape (n,)
        Instants [s], displacement [unit] and velocity [unit/s].
    samples : ndarray, shape (n,)
        The recorded samples, not smoothed: the displacement [unit], or else the velocity.
    rate : float
        Samples per second [Hz].
    noise, velocity_noise : float
        Standard deviations of the remaining noise in x and v.
    smoothing, velocity_smoothing : float
        Lengths of the windows for smoothing x and v [s]; 0 without smoothing.
    phase : ndarray, shape (n,), or None
        Phase of the forcing [rad], unwrapped, 0 at the maximum of the forcing.
    unit, source : str
        Unit of the displacement, and where it comes from.

    See Also
    --------
    recorded_motion, results.Motion, plot.phase_portrait

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Recording, recorded_motion
    >>> time = np.arange(2000) / 1000
    >>> swing = Recording(np.sin(2 * np.pi * 3 * time), 1000.0, units="mm")
    >>> motion = recorded_motion(swing, forcing_period=1 / 3.0)
    >>> round(float(motion.v.max() / (2 * np.pi * 3)), 2)
    1.0
    """

    time: np.ndarray = field(repr=False)
    x: np.ndarray = field(repr=False)
    v: np.ndarray = field(repr=False)
    samples: np.ndarray = field(repr=False)
    rate: float
    noise: float
    velocity_noise: float
    smoothing: float
    velocity_smoothing: float
    phase: np.ndarray | None = field(repr=False)
    unit: str = ""
    source: str = ""

    def at(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity at times [s], shape of `time`.

        They are interpolated by cubics that match both at the samples.
        """
        place = (np.asarray(time, float) - self.time[0]) * self.rate
        i = np.clip(place.astype(int), 0, len(self.x) - 2)
        s = place - i
        a, b = self.x[i], self.x[i + 1]
        p, q = self.v[i] / self.rate, self.v[i + 1] / self.rate
        bend, twist = 3 * (b - a) - 2 * p - q, 2 * (a - b) + p + q
        x = a + s * (p + s * (bend + s * twist))
        return x, (p + s * (2 * bend + 3 * s * twist)) * self.rate

    def stroboscopic(self, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity once every forcing period, at a phase of the forcing [rad].

        Both have the shape (k,), for k periods.

        Raises
        ------
        InvalidInput
            If neither a forcing channel nor a forcing period was given.
        """
        if self.phase is None:
            raise InvalidInput(
                "phase",
                phase,
                "a motion whose forcing is known",
                "Give `forcing` or `forcing_period`",
            )
        phase = number("phase", phase)
        first = math.ceil((self.phase[0] - phase) / TURN)
        last = math.floor((self.phase[-1] - phase) / TURN)
        turns = phase + TURN * np.arange(first, last + 1)
        return self.at(np.interp(turns, self.phase, self.time))

    def crossings(self, level: float, direction: Literal["up", "down", "both"] = "up") -> Impacts:
        """Instants at which the displacement crosses a level, with their standard errors.

        Crossings due to noise are excluded: before a crossing, the displacement must have been at
        least four standard deviations of the noise on the other side of the level.
        """
        level = number("level", level)
        choice("direction", direction, ("up", "down", "both"))
        off = self.x - level
        clear = np.flatnonzero(np.abs(off) > HYSTERESIS * self.noise)
        side = np.sign(off[clear])
        turn = np.flatnonzero(side[1:] != side[:-1])
        wanted = {"up": (1.0,), "down": (-1.0,), "both": (1.0, -1.0)}[direction]
        turn = turn[np.isin(side[turn + 1], wanted)]
        # The last change of sign on the way from side to side: where the level is left for good.
        change = np.flatnonzero(np.sign(off[1:]) != np.sign(off[:-1]))
        last = change[np.searchsorted(change, clear[turn + 1]) - 1]
        time, error = self._crossed(last, level, side[turn + 1] > 0)
        return Impacts(
            time,
            time_error=error,
            start=float(self.time[0]),
            duration=len(self.x) / self.rate,
            threshold=level,
            noise=self.noise,
            unit=self.unit,
            source=self.source,
            settings={"spikes": "crossing", "direction": direction},
        )

    def _crossed(
        self, i: np.ndarray, level: float, rising: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Instants of crossings between these samples and the next, by bisection, with errors."""
        low, high = self.time[i], self.time[np.minimum(i + 1, len(self.time) - 1)]
        for _ in range(60):
            middle = 0.5 * (low + high)
            before = (self.at(middle)[0] <= level) == rising
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        speed = np.abs(self.at(low)[1])
        return low, self.noise / np.maximum(speed, max(self.velocity_noise, 1e-300))

    def restitution(
        self, impacts: Impacts, *, within: float | None = None, stop_velocity: float = 0.0
    ) -> Restitution:
        """Restitution coefficient, from the velocities before and after every impact.

        A cubic is fitted to the displacement before and one after, and its slope taken at the
        instants of first and last touch; where the velocity was recorded, a parabola to that. If
        terms of higher degree exceed the noise in all fits together, up to four are added.
        Errors include those of the fits, of quantization, and of the instants, but not faster
        changes within the fits, such as ringing; use a shorter `within` in this case.

        Parameters
        ----------
        impacts : Impacts
            The impacts; with contact times if the contacts are not instantaneous.
        within : float, optional
            Length of the fits [s]; by default a fifth of the median interval, and at most 5 ms.
        stop_velocity : float
            Velocity of the stop [unit/s].

        Raises
        ------
        InvalidInput
            If no impact has enough samples for both fits.
        """
        instance(
            "impacts", impacts, Impacts, "Impacts", "Impacts.from_times makes them from instants"
        )
        if within is None:
            intervals = impacts.intervals()
            within = min(5e-3, 0.2 * float(np.median(intervals))) if len(intervals) else 5e-3
        within = number("within", within, above=0)
        stop_velocity = number("stop_velocity", stop_velocity)
        contact = np.zeros(len(impacts)) if impacts.contact_time is None else impacts.contact_time
        late = np.zeros(len(impacts)) if impacts.time_error is None else impacts.time_error
        fits = []
        for k, (touch, long) in enumerate(zip(impacts.time, contact, strict=True)):
            before = impacts.time[k - 1] + contact[k - 1] if k else self.time[0]
            after = impacts.time[k + 1] if k + 1 < len(impacts) else self.time[-1]
            if not math.isfinite(late[k]):
                continue
            # As near as the instant is certain to be on this side of the impact.
            aside, last = 2.0 * late[k], touch + long
            coming = self._fit(max(touch - within, before), touch - aside, touch)
            leaving = self._fit(last + aside, min(last + within, after), last)
            if coming is not None and leaving is not None:
                fits.append((k, coming, leaving))
        rows = []
        if fits:
            step = converter_step(self.samples)
            ends = [one for _, *both in fits for one in both]
            terms = _terms(ends, self._derivative + 3, step)
            for k, *both in fits:
                (u, of_u), (v, of_v) = (one.velocity(terms, step, late[k]) for one in both)
                if u:
                    rows.append((k, u - stop_velocity, of_u, v - stop_velocity, of_v))
        if not rows:
            raise InvalidInput(
                "impacts", f"{len(impacts)} impacts", "impacts with room beside them to fit",
                f"Give a greater `within` than {within:g} s, or a faster recording",
            )  # fmt: skip
        which, u, of_u, v, of_v = np.array(rows).T
        each = -v / u
        # What is exact has the error of its last digits.
        least = 1e-12 * np.abs(u).max()
        of_u, of_v = np.maximum(of_u, least), np.maximum(of_v, least)
        line = fit_line(u, -v, of_u, of_v, through_zero=True)
        rest = (v + line.slope * u) ** 2 / (of_v**2 + (line.slope * of_u) ** 2)
        # The coefficient may depend on the velocity: then the impacts scatter about the line.
        scatter = float(rest.sum()) / max(len(rows) - 1, 1)
        return Restitution(
            line.slope,
            math.sqrt(line.covariance[0, 0] * max(scatter, 1.0)),
            each,
            np.hypot(of_v, each * of_u) / np.abs(u),
            u,
            v,
            which.astype(int),
        )

    @property
    def _derivative(self) -> int:
        """Derivative that the velocity is of what was recorded."""
        return 1 if self.smoothing else 0

    def _fit(self, start: float, stop: float, at: float) -> _End | None:
        """Fit polynomials to the samples of a span that an impact ends; None if there are few."""
        first = math.ceil((start - self.time[0]) * self.rate + 1e-6)
        last = math.floor((stop - self.time[0]) * self.rate - 1e-6) + 1
        count = last - first
        if first < 0 or last > len(self.x) or count < FEWEST:
            return None
        t, y = self.time[first:last] - at, self.samples[first:last]
        scale = float(np.abs(t).max())
        of = self._derivative
        # Of any degree up to the greatest: a term less leaves the others as they are.
        terms = min(of + 3 + MORE, max(of + 3, count - FEWEST))
        q, r = np.linalg.qr(np.vander(t / scale, terms, increasing=True))
        inverse = np.linalg.inv(r)
        coefficients = q.T @ y
        rest = y - q @ coefficients
        # Within a run of one code errors are alike: runs count, not samples.
        runs = count / (1 + np.count_nonzero(np.diff(y)))
        return _End(
            coefficients, inverse[of] / scale**of, (1 + of) * inverse[1 + of] / scale ** (1 + of),
            float(rest @ rest), count, runs,
        )  # fmt: skip

    def __repr__(self) -> str:
        parts = [f"{len(self.x)} samples", f"{self.rate:g} Hz"]
        if self.phase is not None:
            turns = float(self.phase[-1] - self.phase[0]) / TURN
            parts.append(f"forced at {turns / (len(self.x) - 1) * self.rate:.4g} Hz")
        return f"RecordedMotion({'; '.join(parts)})"
