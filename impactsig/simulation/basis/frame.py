"""Conversion from the coordinates and units of an oscillator to those of the engines."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from ..._arguments import number, pair
from ...errors import InvalidInput
from ...oscillators import Oscillator
from .columns import Columns, Forcing, columns_of, components, forcing_of
from .events import TURN


def reference_frequency(oscillator: Oscillator) -> float:
    """Angular frequency of the forcing period, which the engines' unit of time derives from."""
    return oscillator.angular_forcing_frequency or oscillator.angular_natural_frequency or 1.0


def multiple(oscillator: Oscillator, frequency: float) -> float:
    """A frequency over the reference frequency, rounded to a whole number if the forcing recurs."""
    ratio = frequency / reference_frequency(oscillator)
    return float(round(ratio)) if oscillator.forcing_recurs else ratio


def swings(oscillator: Oscillator) -> float:
    """Periods of the first force, or else of the base, in a forcing period; 1 without forcing."""
    frequencies = oscillator.angular_frequencies
    return multiple(oscillator, frequencies[0]) if frequencies else 1.0


def pace(oscillator: Oscillator) -> float:
    """Frequency of the base over the reference frequency; 1 without a base."""
    base = oscillator.base
    return multiple(oscillator, base.angular_frequency) if base else 1.0


def base_motion(oscillator: Oscillator, phase: Any) -> tuple[Any, Any]:
    """Displacement and velocity of the stops' base, at phases of its own motion."""
    base = oscillator.base
    if base is None or not base.stops:
        return 0.0 * phase, 0.0 * phase
    angle = phase + base.phase
    velocity = -base.angular_frequency * base.amplitude * np.sin(angle)
    return base.amplitude * np.cos(angle), velocity


def first_phase(phase: Any) -> float:
    """Validate the initial phase, reduced to a turn.

    Raises
    ------
    InvalidInput
        If it is not a finite number.
    """
    return math.fmod(number("phase", phase), 2 * math.pi) % (2 * math.pi)


def place_of(initial: Any) -> tuple[float, float]:
    """Validate an initial state: displacement and velocity.

    Raises
    ------
    InvalidInput
        If it is not two finite numbers.
    """
    required = "two finite numbers: displacement and velocity"
    x, v = pair("initial", initial, required)
    return number("initial", x, required), number("initial", v, required)


@lru_cache(maxsize=64)
def forcing_of_one(oscillator: Oscillator) -> tuple[Columns, Forcing]:
    """Columns and forcing of one oscillator, whose period may be that of its law; cached."""
    columns = columns_of([oscillator])
    omega, recurs = reference_frequency(oscillator), oscillator.forcing_recurs
    return columns, forcing_of(columns, (np.array([omega]), np.array([recurs])))


def forcing(oscillator: Oscillator) -> list[tuple[float, complex]]:
    """Frequencies over that of the reference, and complex amplitudes of the force per mass.

    In coordinates in which the stops rest and the reference has frequency 1, which comes first.
    """
    parts = components(forcing_of_one(oscillator)[1])
    return [
        (float(w), complex(c, -s)) for w, c, s in zip(*(part[0] for part in parts), strict=True)
    ]


def strobe_times(
    motion: Any, phase: Any, omega: float | None, first: float, last: float
) -> np.ndarray:
    """Times from `first` to `last` at which the forcing of a motion has a phase.

    Raises
    ------
    InvalidInput
        If the phase is not a finite number, or there is no forcing: no `omega`, its angular
        frequency.
    """
    angle = math.fmod(number("phase", phase, "a finite angle [rad]"), TURN) % TURN
    if omega is None:
        raise InvalidInput("motion", repr(motion), "a forced motion: a section is taken by it")
    since = angle - motion._phase
    low, high = ((at * omega - since) / TURN for at in (first, last))
    turns = np.arange(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)
    return np.clip((turns * TURN + since) / omega, first, last)
