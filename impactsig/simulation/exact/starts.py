"""Initial phases, positions and modes, as arrays over many oscillators."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...oscillators.laws import PUSHER, RIGID, spring_push
from ..basis.columns import (
    AMPLITUDE,
    DAMPER,
    FREQUENCY,
    POSITION,
    SPRING_RATE,
    Columns,
    Forcing,
)
from ..basis.columns import PHASE as OWN_PHASE
from ..basis.events import COUNTERS, FASTEST, LOST, MODE, TURN, Q, V
from ..basis.frame import forcing_of_one, place_of
from .modes import Stack


def first_phases(phase: np.ndarray) -> np.ndarray:
    """Phases of the reference at starts, within a turn.

    Raises
    ------
    InvalidInput
        If one is not a finite number.
    """
    if not np.isfinite(phase).all():
        raise InvalidInput("phase", phase, "finite numbers")
    return np.fmod(phase, TURN) % TURN


def motion_of_base(columns: Columns, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity of the stops' base, at phases of its own motion."""
    if columns.form.base is None or not columns.form.base[2]:
        return np.zeros(phase.shape), np.zeros(phase.shape)
    base = columns.base
    angle = phase + base[OWN_PHASE]
    velocity = -base[FREQUENCY] * base[AMPLITUDE] * np.sin(angle)
    return base[AMPLITUDE] * np.cos(angle), velocity


def places(
    columns: Columns, forcing: Forcing, initial: np.ndarray, phase: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Initial positions and velocities, shape (n, 2), in the engine's coordinates and units.

    Raises
    ------
    InvalidInput
        If one is beyond a rigid stop.
    """
    q, u, depths = _against_stops(columns, forcing, initial, phase)
    for side, depth in depths:
        if np.count_nonzero(depth > 0):
            k = int(np.argmax(depth > 0))
            name = "upper" if side > 0 else "lower"
            raise InvalidInput(
                "initial", f"x = {initial[k, 0]:.9g}",
                f"a start on this side of the {name} rigid stop",
                f"It is {depth[k]:.3g} beyond; move it, or the stop",
            )  # fmt: skip
    return q, u


def allowed(
    columns: Columns, forcing: Forcing, initial: np.ndarray, phase: np.ndarray
) -> np.ndarray:
    """Whether `places` takes each of these starts."""
    with np.errstate(all="ignore"):
        _, _, depths = _against_stops(columns, forcing, initial, phase)
    within = np.isfinite(initial).all(axis=1)
    for _, depth in depths:
        within &= depth == 0
    return within


def _against_stops(
    columns: Columns, forcing: Forcing, initial: np.ndarray, phase: np.ndarray
) -> tuple[np.ndarray, np.ndarray, list[tuple[int, np.ndarray]]]:
    """Positions and velocities as `places` returns them, and their depths in rigid stops.

    Of each rigid stop its side, and how far beyond it each start is; 0 up to rounding.
    """
    at, moving = motion_of_base(columns, forcing.pace * phase)
    x, v = initial.T
    q, u = x - at, (v - moving) / forcing.omega
    depths = []
    for (side, kind), stop in zip(columns.form.stops, columns.stops, strict=True):
        if kind != RIGID:
            continue
        position = stop[POSITION]
        depth = (q - position) * side
        size = np.abs(x) + np.abs(position)
        if columns.form.base is not None:
            size = size + np.abs(columns.base[AMPLITUDE])
        depths.append((side, np.where(depth > 1e-12 * size, depth, 0.0)))
    return q, u, depths


def first_places(
    oscillator: Oscillator, initial: np.ndarray, phase: float
) -> tuple[np.ndarray, np.ndarray]:
    """`places` for many starts of one oscillator at one phase."""
    return places(*forcing_of_one(oscillator), initial, np.full(len(initial), phase))


def first_place(
    columns: Columns, forcing: Forcing, initial: Any, phase: float
) -> tuple[float, float]:
    """Initial position and velocity of one oscillator, in the engine's coordinates and units.

    Raises
    ------
    InvalidInput
        If `initial` is not two finite numbers, or beyond a rigid stop.
    """
    q, u = places(columns, forcing, np.array([place_of(initial)]), np.array([phase]))
    return float(q[0]), float(u[0])


def begun(stack: Stack, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States and counters at the start; the modes follow from the positions.

    The machines of the stack have one start each, or its only machine has all of them.
    """
    columns, plan, tables = stack.columns, stack.layout, stack.problem
    omega = stack.forcing.omega
    n = len(q)
    side, level, lifted = np.zeros((3, n), int)
    for sign, row in ((1, plan.form.upper), (-1, plan.form.lower)):
        pressed: Any = True
        for place, (number, kind) in enumerate(row):
            stop = columns.stops[number]
            depth = sign * (q - stop[POSITION])
            pressed = pressed & (depth > 0)
            if not np.count_nonzero(pressed):
                break
            if kind == RIGID:
                q = np.where(pressed, stop[POSITION], q)
                break
            side, level = np.where(pressed, sign, side), level + pressed
            if kind == PUSHER:
                force = spring_push(stop[SPRING_RATE], stop[DAMPER] * omega, depth, sign * v)
                lifted = np.where(pressed & (force < 0), lifted | 1 << place, lifted)
    mode = _modes(plan.modes, side, level, lifted)
    mode = mode + ((plan.way[mode] != 0) & (v < 0))
    counts = np.zeros((n, COUNTERS), np.int64)
    counts[:, MODE] = mode
    states = np.zeros((n, LOST + 1))
    machine = np.arange(n) if columns.n == n else np.zeros(n, int)
    states[:, Q] = q - tables.origin[machine, mode]
    states[:, V] = v
    # A first touch at next to no speed must not set the scale of chatter.
    weight = np.abs(columns.load) / stack.forcing.inertia
    states[:, FASTEST] = 1e-6 * (tables.force_bound[:, 0] + weight)
    return states, counts


def _modes(
    modes: dict[Any, int], side: np.ndarray, level: np.ndarray, lifted: np.ndarray
) -> np.ndarray:
    """Index of the mode that belongs to each position."""
    if not np.count_nonzero(level):
        return np.full(len(level), modes[0, 0, frozenset()])
    keys, which = np.unique(np.stack([side, level, lifted]), axis=1, return_inverse=True)
    numbers = [
        modes[way, reached, frozenset(m for m in range(reached) if mask >> m & 1)]
        for way, reached, mask in keys.T.tolist()
    ]
    return np.array(numbers)[which.ravel()]
