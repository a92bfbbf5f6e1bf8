"""An oscillator whose force is swept through frequencies or amplitudes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from .._arguments import instance, reals
from ..errors import InvalidInput
from .oscillator import Oscillator
from .parts import numbers


@dataclass(frozen=True)
class Swept:
    """An oscillator whose harmonic force is swept in frequency or amplitude.

    With t in seconds since the start of the simulation, s = max(t - start, 0) and the oscillator's
    force ``A cos(2 pi f t + phase)``, the force is::

        (A + amplitude_rate s) cos(2 pi (f t + frequency_rate s^2 / 2) + phase)

    so its phase is continuous, and its frequency is ``f + frequency_rate s`` at each instant.

    Parameters
    ----------
    oscillator : Oscillator
        The oscillator, with a single force, which is swept.
    frequency_rate : float
        Rate of change of the frequency [Hz/s]; negative for a downward sweep.
    amplitude_rate : float
        Rate of change of the amplitude [N/s], or in the unit of force of the oscillator per second.
    start : float
        Start of the sweep [s]; frequency and amplitude are constant before.

    Raises
    ------
    InvalidInput
        If a value is out of its range, or the oscillator has other excitation than a single force.

    See Also
    --------
    simulate, Force, Rig

    Notes
    -----
    The motion is integrated numerically (`RungeKutta`), since there is no closed form. It has no
    forcing period, so `simulate` needs a `duration`, and functions that count forcing periods raise
    an error. For an oscillator without a unit of time, Hz means 1 / unit and s means unit.

    Examples
    --------
    >>> from impactsig import Swept, scenes, simulate
    >>> up = Swept(scenes.karpodinis(20.0), frequency_rate=0.5, start=2.0)
    >>> motion = simulate(up, duration=4.0, transient=2.0)
    >>> round(up.frequency(motion.stop), 6)
    22.0
    """

    oscillator: Oscillator
    frequency_rate: float = 0.0
    amplitude_rate: float = 0.0
    start: float = 0.0

    moved_by: ClassVar[str] = "impactsig.simulation.sweeping"

    def __post_init__(self) -> None:
        own = self.oscillator
        instance("oscillator", own, Oscillator, "an Oscillator, as impactsig.scenes makes")
        moved_otherwise = own.base is not None or own.law is not None or own.noise is not None
        if len(own.forces) != 1 or moved_otherwise:
            raise InvalidInput(
                "oscillator", own, "an oscillator with one force, and no base, law or noise",
                "A law(t, x, v) can hold any force that changes with time",
            )  # fmt: skip
        numbers(self, "frequency_rate", "amplitude_rate")
        numbers(self, "start", least=0.0)

    def frequency(self, time: Any) -> Any:
        """Frequency of the force [Hz] at times [s]; a float or an array, like `time`.

        Raises
        ------
        InvalidInput
            If a time is not finite.
        """
        return self._at(time, lambda t, s: self._first + self.frequency_rate * s)

    def phase(self, time: Any) -> Any:
        """Phase of the force [rad] at times [s], 0 at t = 0; a float or an array, like `time`.

        Raises
        ------
        InvalidInput
            If a time is not finite.
        """
        return self._at(
            time, lambda t, s: math.tau * (self._first * t + self.frequency_rate * s * s / 2)
        )

    @property
    def time_unit(self) -> float:
        """Seconds in the oscillator's unit of time."""
        return self.oscillator.time_unit

    @property
    def in_seconds(self) -> bool:
        """Whether times are in seconds."""
        return self.oscillator.in_seconds

    @property
    def forcing_period(self) -> None:
        """None: a swept force is not periodic."""

    @property
    def _first(self) -> float:
        """Frequency before the sweep [Hz]."""
        return self.oscillator.forces[0].angular_frequency / (math.tau * self.time_unit)

    def _at(self, time: Any, value: Any) -> Any:
        t = reals("time", time, "times [s]")
        if not np.isfinite(t).all():
            raise InvalidInput("time", time, "finite times [s]")
        found = value(t, np.maximum(t - self.start, 0.0))
        return float(found) if found.ndim == 0 else found

    def times_of(self, phase: Any) -> np.ndarray:
        """Times [s] of phases [rad], the inverse of `phase`; shape of `phase`.

        The frequency must be above 0 there.
        """
        turns = np.asarray(phase) / math.tau
        after = np.maximum(turns - self._first * self.start, 0.0)
        root = np.sqrt(self._first**2 + 2 * self.frequency_rate * after)
        return np.where(
            after > 0, self.start + 2 * after / (self._first + root), turns / self._first
        )

    def as_law(self, phase: float) -> Oscillator:
        """The oscillator with the swept force, of that phase at t = 0, for its `law`."""
        force, unit = self.oscillator.forces[0], self.time_unit
        law = _law(
            float(force.amplitude),
            self.amplitude_rate * unit,
            float(force.angular_frequency),
            math.pi * self.frequency_rate * unit**2,
            float(force.phase) + phase,
            self.start / unit,
        )
        return replace(self.oscillator, forces=(), law=law)


@lru_cache(maxsize=256)  # to compile it once
def _law(
    amplitude: float, growth: float, omega: float, bend: float, angle: float, start: float
) -> Callable[[float, float, float], float]:
    """A swept force, in the oscillator's units."""

    def swept_force(t: float, x: float, v: float) -> float:
        s = max(t - start, 0.0)
        return (amplitude + growth * s) * math.cos(omega * t + bend * s * s + angle)

    return swept_force
