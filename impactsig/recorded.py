"""A displacement as it was recorded: its velocity, sections, and what it loses at its impacts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from ._arguments import number
from .errors import InvalidInput
from .impacts import Impacts
from .recording import Recording, chosen_channel

TURN = 2 * math.pi
ORDER = 3
"""Of the polynomial that a smoothing window is fitted by."""
WIDEST = 4096
"""Samples to either side of the middle of a smoothing window."""
EXCESS = 1.3
"""Times what noise explains, by which two windows differ where the wider one smooths too much."""
HYSTERESIS = 4.0
"""Standard deviations of the noise that a crossing must have come from."""
FOURTH = math.sqrt(70.0)
"""Standard deviation of fourth differences of white noise of standard deviation 1."""
MAD = 0.6744897501960817
"""Median of the absolute value of a normal variable of standard deviation 1."""


class Restitution(NamedTuple):
    """Velocities before and after impacts, and their ratio.

    `value` is ``-sum(u v) / sum(u^2)``, u being `approach` and v `departure`, with its standard
    error; `each` is ``-v / u`` of every impact and `each_error` its standard error. `impacts` are
    the indices of those impacts that have room beside them.
    """

    value: float
    error: float
    each: np.ndarray
    each_error: np.ndarray
    approach: np.ndarray
    departure: np.ndarray
    impacts: np.ndarray


@dataclass(frozen=True, eq=False, repr=False)
class RecordedMotion:
    """Displacement and velocity at the samples of a recording.

    Attributes
    ----------
    time, x, v : ndarray, shape (n,)
        Instants [s], displacement [unit] and velocity [unit/s].
    samples : ndarray, shape (n,)
        The displacement as it was recorded, not smoothed [unit].
    rate : float
        Samples per second [Hz].
    noise, velocity_noise : float
        Standard deviations of the noise of x and v.
    smoothing : float
        Length of the window that x and v were smoothed in [s]; 0 where v was recorded.
    phase : ndarray, shape (n,), or None
        Phase of the forcing [rad], unwrapped: 0 where the forcing is greatest.
    unit, source : str
        Unit of the displacement, and where it comes from.
    """

    time: np.ndarray = field(repr=False)
    x: np.ndarray = field(repr=False)
    v: np.ndarray = field(repr=False)
    samples: np.ndarray = field(repr=False)
    rate: float
    noise: float
    velocity_noise: float
    smoothing: float
    phase: np.ndarray | None = field(repr=False)
    unit: str = ""
    source: str = ""

    def at(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity between the samples, by cubics through both."""
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

        Raises
        ------
        InvalidInput
            If neither a forcing channel nor a frequency was given.
        """
        if self.phase is None:
            raise InvalidInput(
                "phase", phase, "a motion whose forcing is known", "Give `forcing` or `frequency`"
            )
        phase = number("phase", phase)
        first = math.ceil((self.phase[0] - phase) / TURN)
        last = math.floor((self.phase[-1] - phase) / TURN)
        turns = phase + TURN * np.arange(first, last + 1)
        return self.at(np.interp(turns, self.phase, self.time))

    def crossings(self, level: float, direction: Literal["up", "down", "both"] = "up") -> Impacts:
        """Instants at which the displacement crosses a level, with their standard errors.

        One that noise makes is none: the displacement must have been four standard deviations of
        the noise beyond the level before it.
        """
        level = number("level", level)
        if direction not in ("up", "down", "both"):
            raise InvalidInput("direction", direction, '"up", "down" or "both"')
        off = self.x - level
        clear = np.flatnonzero(np.abs(off) > HYSTERESIS * self.noise)
        side = np.sign(off[clear])
        turn = np.flatnonzero(side[1:] != side[:-1])
        wanted = {"up": (1.0,), "down": (-1.0,), "both": (1.0, -1.0)}[direction]
        turn = turn[np.isin(side[turn + 1], wanted)]
        found = np.empty((len(turn), 2))
        for k, n in enumerate(turn):
            first, last = clear[n], clear[n + 1]
            # The last change of sign on the way: where the level is left for good.
            own = off[first : last + 1] * side[n + 1]
            i = first + int(np.flatnonzero(own <= 0)[-1])
            found[k] = self._crossing(i, level)
        return Impacts(
            found[:, 0],
            time_error=found[:, 1],
            start=float(self.time[0]),
            duration=len(self.x) / self.rate,
            threshold=level,
            noise=self.noise,
            unit=self.unit,
            source=self.source,
            settings={"spikes": "crossing", "direction": direction},
        )

    def _crossing(self, i: int, level: float) -> tuple[float, float]:
        low, high = self.time[i], self.time[min(i + 1, len(self.time) - 1)]
        rising = self.x[i] <= level
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = self.at(np.array([middle]))[0][0] <= level
            low, high = (middle, high) if below == rising else (low, middle)
        speed = abs(self.at(np.array([low]))[1][0])
        return low, self.noise / max(speed, self.velocity_noise, 1e-300)

    def restitution(
        self, impacts: Impacts, *, within: float | None = None, stop_velocity: float = 0.0
    ) -> Restitution:
        """The restitution coefficient, from the velocities on both sides of every impact.

        A parabola is fitted to the displacement before and one after, and its slope taken at the
        instants of first and last touch.

        Parameters
        ----------
        impacts : Impacts
            When the impacts were; with contact times, where they last.
        within : float, optional
            Length of the fits [s]; by default a fifth of the median interval, and at most 5 ms.
        stop_velocity : float
            Velocity of the stop [unit/s].

        Raises
        ------
        InvalidInput
            If no impact has room for both fits beside it.
        """
        if within is None:
            intervals = impacts.intervals()
            within = min(5e-3, 0.2 * float(np.median(intervals))) if len(intervals) else 5e-3
        within = number("within", within, positive=True)
        contact = np.zeros(len(impacts)) if impacts.contact_time is None else impacts.contact_time
        rows = []
        for k, (touch, long) in enumerate(zip(impacts.time, contact, strict=True)):
            before = impacts.time[k - 1] + contact[k - 1] if k else self.time[0]
            after = impacts.time[k + 1] if k + 1 < len(impacts) else self.time[-1]
            u = self._slope(max(touch - within, before), touch, touch)
            v = self._slope(touch + long, min(touch + long + within, after), touch + long)
            if u is not None and v is not None:
                rows.append((k, u[0] - stop_velocity, u[1], v[0] - stop_velocity, v[1]))
        if not rows:
            raise InvalidInput(
                "impacts", f"{len(impacts)} impacts", "impacts with room beside them to fit",
                f"Give a greater `within` than {within:g} s, or a faster recording",
            )  # fmt: skip
        which, u, of_u, v, of_v = np.array(rows).T
        each = -v / u
        square = float(u @ u)
        value = -float(u @ v) / square
        variance = float(u**2 @ of_v**2) + float((v + 2 * value * u) ** 2 @ of_u**2)
        scatter = float(u**2 @ (v + value * u) ** 2)
        return Restitution(
            value,
            math.sqrt(max(variance, scatter)) / square,
            each,
            np.hypot(of_v, each * of_u) / np.abs(u),
            u,
            v,
            which.astype(int),
        )

    def _slope(self, start: float, stop: float, at: float) -> tuple[float, float] | None:
        """Slope of a parabola through the raw samples of a span, and its standard error."""
        first = math.ceil((start - self.time[0]) * self.rate + 1e-6)
        last = math.floor((stop - self.time[0]) * self.rate - 1e-6) + 1
        if first < 0 or last > len(self.x) or last - first < 6:
            return None
        t = self.time[first:last] - at
        scale = float(np.abs(t).max())
        powers = np.stack([np.ones(len(t)), t / scale, (t / scale) ** 2], axis=1)
        inverse = np.linalg.inv(powers.T @ powers)
        fitted = inverse @ (powers.T @ self.samples[first:last])
        rest = self.samples[first:last] - powers @ fitted
        deviation = math.sqrt(float(rest @ rest) / (len(t) - 3))
        return float(fitted[1]) / scale, deviation * math.sqrt(inverse[1, 1]) / scale

    def __repr__(self) -> str:
        parts = [f"{len(self.x)} samples", f"{self.rate:g} Hz"]
        if self.phase is not None:
            turns = float(self.phase[-1] - self.phase[0]) / TURN
            parts.append(f"forced at {turns / (len(self.x) - 1) * self.rate:.4g} Hz")
        return f"RecordedMotion({'; '.join(parts)})"


def recorded_motion(
    recording: Recording,
    displacement: str | int | None = None,
    *,
    velocity: str | int | None = None,
    forcing: str | int | None = None,
    frequency: float | None = None,
    smoothing: float | None = None,
) -> RecordedMotion:
    """Read a recorded displacement as a motion.

    Where no velocity was recorded, it is the slope of a cubic fitted in a window around each sample
    [SavitzkyGolay1964]_. The window is the widest whose velocities differ from those of one half as
    wide by no more than noise explains [Lepskii1991]_.

    Parameters
    ----------
    recording : Recording
        With a displacement channel.
    displacement, velocity, forcing : str or int, optional
        Channels. By default the only channel is the displacement.
    frequency : float, optional
        Forcing frequency [Hz], where no channel tells it; phase 0 is then the recording's time 0.
    smoothing : float, optional
        Length of the window [s].

    Returns
    -------
    RecordedMotion

    Raises
    ------
    InvalidInput
        If there are several channels and none is chosen, samples are not finite, the record is too
        short, or both `forcing` and `frequency` are given.
    """
    if not isinstance(recording, Recording):
        raise InvalidInput("recording", recording, "a Recording", "impactsig.read makes one")
    chosen = chosen_channel(recording, displacement, "displacement")
    if forcing is not None and frequency is not None:
        raise InvalidInput("forcing, frequency", f"{forcing!r}, {frequency:g}", "one of the two")
    raw = _finite(chosen.samples, "displacement")
    rate = recording.rate
    noise = _noise(raw)
    if velocity is not None:
        x, v, half = raw, _finite(recording.channel(velocity).samples, "velocity"), 0
        of_x, of_v = noise, _noise(v)
    else:
        half = _half_width(raw, noise, rate, smoothing)
        x, v = _smoothed(raw, half, 0), _smoothed(raw, half, 1) * rate
        of_x, of_v = noise * _gain(half, 0), noise * rate * _gain(half, 1)
    time = recording.time
    phase = None
    if forcing is not None:
        phase = _phase(_finite(recording.channel(forcing).samples, "forcing"))
    elif frequency is not None:
        phase = TURN * number("frequency", frequency, positive=True) * time
    window = (2 * half + 1) / rate if half else 0.0
    return RecordedMotion(
        time, x, v, raw, rate, of_x, of_v, window, phase, chosen.unit, recording.source
    )


def _finite(samples: np.ndarray, name: str) -> np.ndarray:
    values = np.asarray(samples, float)
    if not np.isfinite(values).all():
        where = int(np.argmin(np.isfinite(values)))
        raise InvalidInput(name, f"{values[where]} at sample {where}", "finite samples")
    if len(values) < 16:
        raise InvalidInput(name, f"{len(values)} samples", "16 or more")
    return values


def _noise(values: np.ndarray) -> float:
    """Standard deviation of white noise, from the fourth differences."""
    return float(np.median(np.abs(np.diff(values, 4)))) / (MAD * FOURTH)


def _smoothed(x: np.ndarray, half: int, derivative: int) -> np.ndarray:
    from scipy.signal import savgol_filter

    return np.asarray(savgol_filter(x, 2 * half + 1, ORDER, deriv=derivative))


def _gain(half: int, derivative: int) -> float:
    """Standard deviation that white noise of 1 leaves."""
    from scipy.signal import savgol_coeffs

    return float(np.linalg.norm(savgol_coeffs(2 * half + 1, ORDER, deriv=derivative)))


def _half_width(x: np.ndarray, noise: float, rate: float, smoothing: float | None) -> int:
    most = (len(x) - 1) // 2
    if smoothing is not None:
        half = round(0.5 * number("smoothing", smoothing, positive=True) * rate)
        if not 2 <= half <= most:
            raise InvalidInput(
                "smoothing", smoothing, f"{5 / rate:g} to {(2 * most + 1) / rate:g} s"
            )
        return half
    half = 2
    narrow = _smoothed(x, half, 1)
    while 2 * half <= min(most, WIDEST):
        wide = _smoothed(x, 2 * half, 1)
        differ = float(np.median(np.abs(wide - narrow))) / MAD
        if differ > EXCESS * noise * _gain(half, 1):
            break
        half, narrow = 2 * half, wide
    return half


def _phase(forcing: np.ndarray) -> np.ndarray:
    """Phase of the strongest line and what is within an octave around it, unwrapped."""
    count = len(forcing)
    spectrum = np.fft.fft(forcing - forcing.mean())
    line = int(np.argmax(np.abs(spectrum[1 : count // 2]))) + 1
    k = np.arange(count)
    spectrum[(k < line / np.sqrt(2)) | (k > line * np.sqrt(2))] = 0.0
    phase = np.unwrap(np.angle(np.fft.ifft(spectrum)))
    return np.maximum.accumulate(phase)
