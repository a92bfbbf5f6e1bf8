"""The variational equation along one path of an oscillator under noise.

The noise is a force that does not depend on the state, so neighbours under the same noise differ by
the linear flow along the path. At a soft stop that flow has the slopes of its push, and jumps where
its damper begins and ends to act. Where a stop is rigid they have no derivative under white noise:
a neighbour that hits later by ds has by then another velocity, off by the order of sqrt(ds).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...oscillators.laws import HERTZ, PUSHER, spring_push
from ...simulation import simulate
from ...simulation.basis.frame import base_motion, pace

SMALL = 6e-6  # of the size of a path, to difference a law by: the cube root of rounding
SMOOTH = "an oscillator under a random force, without friction, whose stops are soft"
PARTED = (
    "A neighbour that hits later by ds has another velocity by then, off by the root of ds, and no "
    "tangent"
)
UNSEEN = "A path keeps no force of its noise, which the jump at an impact goes by"
UNTOLD = "A path does not keep the stiffness that its noise gave it"
SLIDING = "Differences shrink with the time that a path spends about rest, and its steps miss that"
MEASURED = "Its loss goes by the approach velocity; Hertz(stiffness, damping=...) will do"


class Contact(NamedTuple):
    """A soft stop along a path."""

    by_x: np.ndarray  # mean derivatives of the acceleration over each step
    by_v: np.ndarray
    which: np.ndarray  # steps in which the mass comes to its place or leaves it
    share: np.ndarray  # of each of these, what is before that
    jump: np.ndarray  # of a difference in velocity there, by that in displacement


def tangent_steps(oscillator: Oscillator, **options: Any) -> tuple[Any, np.ndarray, np.ndarray]:
    """One path, with the tangent matrix and the divergence of each step.

    Raises
    ------
    InvalidInput
        If the oscillator has friction, or a stop at which the path has no derivative.
    """
    _check(oscillator)
    options = {name: value for name, value in options.items() if value is not None}
    path: Any = simulate(oscillator, **options)
    start = np.array(options.get("initial", (0.0, 0.0)), float)
    x = np.concatenate([start[:1], path.x])
    v = np.concatenate([start[1:], path.v])
    time = np.concatenate([[0.0], path.time]) / oscillator.time_unit
    by_x, by_v = _slopes(oscillator, time, x, v)
    a, b = (by_x[1:] + by_x[:-1]) / 2, (by_v[1:] + by_v[:-1]) / 2
    step = path.step / oscillator.time_unit
    contacts = list(_contacts(oscillator, path._phase, time, x, v))
    for contact in contacts:
        a, b = a + contact.by_x, b + contact.by_v
    matrices = _exponentials(a, b, step)
    jumps = sorted(jump for own in contacts for jump in zip(*own[2:], strict=True))
    for k, together in groupby(jumps, key=itemgetter(0)):
        matrix, before = np.eye(2), 0.0
        for _, share, jump in together:
            flown = _exponentials(a[k], b[k], (share - before) * step)
            matrix, before = np.array([[1.0, 0.0], [jump, 1.0]]) @ flown @ matrix, share
        matrices[k] = _exponentials(a[k], b[k], (1 - before) * step) @ matrix
    return path, matrices, b * step


def _check(oscillator: Oscillator) -> None:
    """Refuse an oscillator whose paths have no derivative by the initial state.

    Raises
    ------
    InvalidInput
        If there is friction, a rigid stop, or one whose loss depends on the approach velocity.
    """
    why = SLIDING if oscillator.friction else ""
    if oscillator.noise is not None and oscillator.noise.parametric:
        why = UNTOLD
    for stop in oscillator.stops:
        if stop.law.rigid:
            white = oscillator.noise is not None and not oscillator.noise.correlation_time
            why = PARTED if white else UNSEEN
        elif stop.law.by_approach is not None:
            why = MEASURED
    if why:
        raise InvalidInput("system", oscillator, SMOOTH, why)


def _contacts(
    oscillator: Oscillator, phase: float, time: np.ndarray, x: np.ndarray, v: np.ndarray
) -> Iterator[Contact]:
    """Each soft stop along a path."""
    turned = (oscillator.angular_forcing_frequency or 0.0) * time + phase
    at, moving = base_motion(oscillator, pace(oscillator) * turned)
    for stop in oscillator.stops:
        depth, inward = stop.sign * (x - at - stop.position), stop.sign * (v - moving)
        pressed = depth > 0
        crossed = pressed[1:] != pressed[:-1]
        which = np.flatnonzero(crossed)
        share = depth[which] / (depth[which] - depth[which + 1])
        comes = pressed[which + 1]
        kind, stiffness, loss, exponent, _ = stop.law.row(oscillator.mass, oscillator.mass)
        behind = np.maximum(depth, 0.0)
        if kind == HERTZ:
            by_depth = exponent * stiffness * behind ** (exponent - 1) * (1 + loss * inward)
            by_inward = stiffness * behind**exponent * loss
            jump = np.zeros(len(which))
        else:
            pushes = pressed & (
                (kind != PUSHER) | (spring_push(stiffness, loss, depth, inward) > 0)
            )
            by_depth, by_inward = stiffness * pushes, loss * pushes
            jump = np.where(comes, -loss, 0.0 if kind == PUSHER else loss)
        within = np.where(crossed, 1.0, 0.5)  # of what both ends have, one of which is nothing
        within[which] = np.where(comes, 1 - share, share) * (1.0 if kind != HERTZ else 0.5)
        mean_depth = -within * (by_depth[1:] + by_depth[:-1])
        mean_inward = -within * (by_inward[1:] + by_inward[:-1])
        yield Contact(mean_depth, mean_inward, which, share, jump)


def _slopes(
    oscillator: Oscillator, time: np.ndarray, x: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the acceleration by displacement and by velocity."""
    mass = oscillator.mass
    by_x = np.full(len(x), -oscillator.stiffness / mass)
    by_v = np.full(len(x), -oscillator.damping / mass)
    if oscillator.law is not None and len(x):
        law: Callable[[float, float, float], float] = oscillator.law
        h = SMALL * max(float(np.abs(x).max()), 1e-12)
        k = SMALL * max(float(np.abs(v).max()), 1e-12)
        rows = list(zip(time.tolist(), x.tolist(), v.tolist(), strict=True))
        by_x += [(law(t, q + h, u) - law(t, q - h, u)) / (2 * h * mass) for t, q, u in rows]
        by_v += [(law(t, q, u + k) - law(t, q, u - k)) / (2 * k * mass) for t, q, u in rows]
    return by_x, by_v


def _exponentials(a: Any, b: Any, step: float) -> np.ndarray:
    """exp(step [[0, 1], [a, b]]) of each pair, shape (n, 2, 2); of one pair, (2, 2)."""
    half = b / 2
    root = step * np.sqrt(np.asarray(half**2 + a, complex))
    near = np.abs(root) < 1e-4
    swing = np.where(near, 1 + root**2 / 6, np.sinh(root) / np.where(near, 1.0, root)).real * step
    turn = np.cosh(root).real
    grown = np.exp(half * step)
    found = np.array([
        [grown * (turn - half * swing), grown * swing],
        [grown * a * swing, grown * (turn + half * swing)],
    ])  # fmt: skip
    return np.moveaxis(found, (0, 1), (-2, -1))


def orthonormal(columns: np.ndarray) -> tuple[np.ndarray, tuple[float, float]]:
    """Orthonormalise two columns; returns the logarithms of their lengths."""
    (p, r), (q, s) = columns.tolist()
    first = math.hypot(p, q)
    p, q = p / first, q / first
    along = p * r + q * s
    r, s = r - along * p, s - along * q
    second = math.hypot(r, s)
    lost = math.log(second) if second > 0 else -math.inf
    return np.array([[p, -q], [q, p]]), (math.log(first), lost)
