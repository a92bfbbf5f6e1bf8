"""From the coordinates and units of an oscillator to those the engines work in."""

from __future__ import annotations

import cmath
from typing import Any

import numpy as np

from ..oscillators import Oscillator


def reference_frequency(oscillator: Oscillator) -> float:
    """Angular frequency that time is counted by; any will do where there is no forcing."""
    return oscillator.forcing_frequency or oscillator.natural_frequency or 1.0


def base_motion(oscillator: Oscillator, phase: Any) -> tuple[Any, Any]:
    """Displacement and velocity of what the stops hang on, at phases of its own forcing."""
    base = oscillator.base
    if base is None or not base.stops:
        return 0.0 * phase, 0.0 * phase
    angle = phase + base.phase
    velocity = -base.frequency * base.amplitude * np.sin(angle)
    return base.amplitude * np.cos(angle), velocity


def forcing(oscillator: Oscillator) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies over that of the reference, and complex amplitudes of the force per mass.

    In coordinates in which the stops rest and the reference has frequency 1, which comes first.
    """
    omega = reference_frequency(oscillator)
    mass, base = oscillator.mass, oscillator.base
    total: dict[float, complex] = {}
    for force in oscillator.forces:
        total.setdefault(force.frequency, 0)
        total[force.frequency] += force.amplitude * cmath.exp(1j * force.phase)
    if base is not None:
        # q = x - base: what hangs on the base pulls no more, and inertia pushes back.
        w = base.frequency
        pull = (base.spring - base.stops) * oscillator.stiffness
        drag = (base.damper - base.stops) * oscillator.damping
        push = (pull + base.stops * mass * w * w) + 1j * w * drag
        total.setdefault(w, 0)
        total[w] += push * base.amplitude * cmath.exp(1j * base.phase)
    if not total:
        total[omega] = 0
    frequencies = sorted(total, key=lambda frequency: frequency != omega)
    amplitudes = np.array([total[frequency] for frequency in frequencies])
    return np.array(frequencies) / omega, amplitudes / (mass * omega**2)
