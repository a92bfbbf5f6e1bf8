"""Validate start and forcing of a beam, and express them in its modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._arguments import pair, reals
from ...errors import InvalidInput
from ...oscillators import Cantilever, Force, Stop


def forces_of(beam: Cantilever) -> tuple[np.ndarray, complex]:
    """Complex amplitudes of the modal forces [N], and of the base's own part of the tip [m]."""
    forcing, modes = beam.forcing, beam.modes
    if forcing is None:
        return np.zeros(modes, complex), 0j
    if isinstance(forcing, Force):
        return np.full(modes, forcing.amplitude * np.exp(1j * forcing.phase)), 0j
    moves = forcing.amplitude * np.exp(1j * forcing.phase)
    push = beam.participation(modes) * beam.modal_mass * forcing.angular_frequency**2 * moves
    return push, 0j if forcing.stops else complex(moves)


def check_resonance(rates: np.ndarray, ratios: np.ndarray, forcing: Any) -> None:
    """Refuse undamped forcing at resonance, whose motion has no bound."""
    if forcing is None:
        return
    ratio = rates / forcing.angular_frequency
    near = np.hypot(ratio**2 - 1, 2 * ratios * ratio) < 1e-6
    if near.any():
        mode = int(np.argmax(near))
        raise InvalidInput(
            "damping_ratio", float(ratios[mode]),
            f"a positive damping of mode {mode + 1}, forced at its natural frequency",
            "Undamped, such a motion grows without bound",
        )  # fmt: skip


def initial_state(initial: Any, modes: int) -> tuple[np.ndarray, np.ndarray]:
    """Displacements and velocities of all modes."""
    required = f"modal displacements and velocities, of up to {modes} modes"
    given = pair("initial", initial, required)
    parts = [np.atleast_1d(reals("initial", part, required)) for part in given]
    right = all(part.ndim == 1 and len(part) <= modes for part in parts)
    if not right or not all(np.isfinite(part).all() for part in parts):
        raise InvalidInput("initial", initial, required)
    q, v = (np.pad(part, (0, modes - len(part))) for part in parts)
    return q, v


def regime_at(stop: Stop | None, tip: float) -> int:
    """The regime in which a tip at that place starts."""
    if stop is None:
        return 0
    depth = (tip - stop.position) * stop.sign
    if stop.law.rigid:
        if depth > 1e-12 * (abs(tip) + abs(stop.position)):
            raise InvalidInput(
                "initial", f"a tip at {tip:.9g} m",
                f"a start on this side of the {stop.side} rigid stop",
                f"It is {depth:.3g} m beyond",
            )  # fmt: skip
        return 0
    return int(depth > 0)
