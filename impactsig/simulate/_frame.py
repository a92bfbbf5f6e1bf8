"""From the coordinates and units of an oscillator to those the engines work in."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np

from .._arguments import number
from ..errors import InvalidInput
from ..oscillators import Oscillator, Rigid


def reference_frequency(oscillator: Oscillator) -> float:
    """Angular frequency of the forcing period, the reference; any will do without forcing."""
    return oscillator.angular_forcing_frequency or oscillator.angular_natural_frequency or 1.0


def multiple(oscillator: Oscillator, frequency: float) -> float:
    """A frequency over that of the reference; a whole number where the forcing recurs."""
    ratio = frequency / reference_frequency(oscillator)
    return float(round(ratio)) if oscillator.forcing_recurs else ratio


def swings(oscillator: Oscillator) -> float:
    """Periods of the first force, or else of the base, in one of the reference; 1 without any."""
    frequencies = oscillator.angular_frequencies
    return multiple(oscillator, frequencies[0]) if frequencies else 1.0


def pace(oscillator: Oscillator) -> float:
    """Frequency of the base over that of the reference; 1 where there is no base."""
    base = oscillator.base
    return multiple(oscillator, base.angular_frequency) if base else 1.0


def base_motion(oscillator: Oscillator, phase: Any) -> tuple[Any, Any]:
    """Displacement and velocity of what the stops hang on, at phases of its own forcing."""
    base = oscillator.base
    if base is None or not base.stops:
        return 0.0 * phase, 0.0 * phase
    angle = phase + base.phase
    velocity = -base.angular_frequency * base.amplitude * np.sin(angle)
    return base.amplitude * np.cos(angle), velocity


def first_phase(phase: Any) -> float:
    """The phase of the reference at the start, within a turn.

    Raises
    ------
    InvalidInput
        If it is not a finite number.
    """
    return math.fmod(number("phase", phase), 2 * math.pi) % (2 * math.pi)


def place_of(initial: Any) -> tuple[float, float]:
    """Displacement and velocity of a start.

    Raises
    ------
    InvalidInput
        If it is not two finite numbers.
    """
    try:
        x, v = (float(value) for value in initial)
    except (TypeError, ValueError):
        raise InvalidInput("initial", initial, "two numbers: displacement and velocity") from None
    if not (math.isfinite(x) and math.isfinite(v)):
        raise InvalidInput("initial", initial, "finite displacement and velocity")
    return x, v


def first_place(oscillator: Oscillator, initial: Any, phase: float) -> tuple[float, float]:
    """Position and velocity at the start, in the engine's coordinates and units.

    Raises
    ------
    InvalidInput
        If `initial` is not two finite numbers, or beyond a rigid stop.
    """
    x, v = place_of(initial)
    omega, base = reference_frequency(oscillator), oscillator.base
    at, moving = base_motion(oscillator, pace(oscillator) * phase)
    q, u = x - float(at), (v - float(moving)) / omega
    for stop in oscillator.stops:
        depth = (q - stop.position) * (1 if stop.side == "upper" else -1)
        size = abs(x) + abs(stop.position) + (abs(base.amplitude) if base else 0.0)
        if isinstance(stop.law, Rigid) and depth > 1e-12 * size:
            raise InvalidInput(
                "initial", f"x = {x:.9g}", f"a start on this side of the {stop.side} rigid stop",
                f"It is {depth:.3g} beyond; move it, or the stop",
            )  # fmt: skip
    return q, u


def forcing(oscillator: Oscillator) -> list[tuple[float, complex]]:
    """Frequencies over that of the reference, and complex amplitudes of the force per mass.

    In coordinates in which the stops rest and the reference has frequency 1, which comes first.
    """
    omega = reference_frequency(oscillator)
    mass, base = oscillator.mass, oscillator.base
    inertia = mass * omega**2
    total = {omega: 0j}
    for force in oscillator.forces:
        pull = force.amplitude * cmath.exp(1j * force.phase)
        total[force.angular_frequency] = total.get(force.angular_frequency, 0) + pull
    if base is not None:
        # q = x - base: what hangs on the base pulls no more, and inertia pushes back.
        w = base.angular_frequency
        spring = (base.spring - base.stops) * oscillator.stiffness
        drag = (base.damper - base.stops) * oscillator.damping
        push = (spring + base.stops * mass * w * w) + 1j * w * drag
        total[w] = total.get(w, 0) + push * base.amplitude * cmath.exp(1j * base.phase)
    return [
        (multiple(oscillator, frequency), amplitude / inertia)
        for frequency, amplitude in total.items()
    ]
