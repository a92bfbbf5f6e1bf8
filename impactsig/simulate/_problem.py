"""An oscillator as the numbers the engine works with, in the time of its reference forcing."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..oscillators import KelvinVoigt, Oscillator, Rigid

if TYPE_CHECKING:
    from ._engine import Problem


def reference_frequency(oscillator: Oscillator) -> float:
    """Angular frequency that the engine counts time by; any will do where there is no forcing."""
    return oscillator.forcing_frequency or oscillator.natural_frequency or 1.0


def pose(oscillator: Oscillator, chatter: float, skip: bool) -> Problem:
    """The engine's problem, in coordinates in which the stops rest."""
    from ._engine import Problem

    omega = reference_frequency(oscillator)
    mass, damping, stiffness = oscillator.mass, oscillator.damping, oscillator.stiffness
    base = oscillator.base
    moved: dict[float, complex] = {}
    for force in oscillator.forces:
        moved.setdefault(force.frequency, 0)
        moved[force.frequency] += force.amplitude * cmath.exp(1j * force.phase)
    if base is not None:
        # q = x - base: what hangs on the base pulls no more, and inertia pushes back.
        w = base.frequency
        pull = (base.spring - base.stops) * stiffness
        drag = (base.damper - base.stops) * damping
        push = (pull + base.stops * mass * w * w) + 1j * w * drag
        moved.setdefault(w, 0)
        moved[w] += push * base.amplitude * cmath.exp(1j * base.phase)
    if not moved:
        moved[omega] = 0
    # The reference comes first: its phase is the clock.
    frequencies = sorted(moved, key=lambda frequency: frequency != omega)
    forcing = np.array([moved[frequency] for frequency in frequencies]) / (mass * omega**2)
    ratio = np.array([frequency / omega for frequency in frequencies])

    stops = [
        next(iter(oscillator.stops_on("upper")), None),
        next(iter(oscillator.stops_on("lower")), None),
    ]
    laws: list[Any] = [stop.law if stop else None for stop in stops]
    position = [
        stop.position if stop else far
        for stop, far in zip(stops, (math.inf, -math.inf), strict=True)
    ]
    soft = [law if isinstance(law, KelvinVoigt) else KelvinVoigt(1.0) for law in laws]
    touched = [isinstance(law, KelvinVoigt) for law in laws]
    origin = [0.0, *(at if own else 0.0 for at, own in zip(position, touched, strict=True))]
    more_k = [0.0, soft[0].stiffness, soft[1].stiffness]
    more_c = [0.0, soft[0].damping, soft[1].damping]
    kappa = np.array([(stiffness + k) / (mass * omega**2) for k in more_k])
    delta = np.array([(damping + c) / (2 * mass * omega) for c in more_c])
    constant = (oscillator.load - stiffness * np.array(origin)) / (mass * omega**2)
    # (sqrt kappa - delta)(sqrt kappa + delta) keeps the digits that kappa - delta^2 would lose.
    difference = (np.sqrt(kappa) - delta) * (np.sqrt(kappa) + delta)
    impedance = kappa[:, None] - ratio**2 + 2j * delta[:, None] * ratio
    # Without forcing the clock may well run at the natural frequency.
    response = np.divide(forcing, impedance, out=0 * impedance, where=forcing != 0)
    root = np.sqrt(np.abs(difference))
    return Problem(
        kappa=kappa,
        delta=delta,
        root=root,
        sort=np.sign(difference),
        constant=constant,
        rest=np.divide(constant, kappa, out=np.zeros(3), where=kappa > 0),
        drift=np.where(kappa > 0, 0.0, constant),
        cosine=np.ascontiguousarray(response.real),
        sine=np.ascontiguousarray(-response.imag),
        reach=np.stack([np.abs(response) @ ratio**n for n in range(5)], axis=1),
        rate=np.maximum(ratio.max(), delta + root),
        ratio=ratio,
        force_cos=np.ascontiguousarray(forcing.real),
        force_sin=np.ascontiguousarray(-forcing.imag),
        force_bound=np.array([np.abs(forcing) @ ratio**n for n in range(4)]),
        stop=np.array(position),
        restitution=np.array([law.restitution if isinstance(law, Rigid) else -1.0 for law in laws]),
        chatter=chatter,
        skip=skip,
    )


def base_motion(oscillator: Oscillator, phase: Any) -> tuple[Any, Any]:
    """Displacement and velocity of what the stops hang on, at phases of its own forcing."""
    base = oscillator.base
    if base is None or not base.stops:
        return 0.0 * phase, 0.0 * phase
    angle = phase + base.phase
    velocity = -base.frequency * base.amplitude * np.sin(angle)
    return base.amplitude * np.cos(angle), velocity
