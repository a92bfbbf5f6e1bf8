"""One cycle of the conservative motion: its length, its area, and what the forces do along it.

A quarter of the cycle, from the bottom to where the motion turns, is integrated in
``tau = sqrt(turn - distance)``, in which the velocity has no root singularity; where a stop ends it
before, the turn is the one that the force at the stop foretells. The kinetic energy along it is the
work from the end inwards and not a difference of potentials, so that no digits cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ...oscillators import Oscillator
from ._well import Conservative, Side, Well, on_arrays, well

NODES = (24, 48, 96, 192, 384)
IMPACTS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "logarithmic": lambda r: -2 * np.log(r),
    "exact": lambda r: 1 - r**2,
    "linearised": lambda r: 2 * (1 - r),
}
"""What an impact takes of the kinetic energy, over the restitution coefficient."""

AGREED = 1e-11  # relative change of the integrals at which the nodes are not doubled again


@dataclass(frozen=True)
class Orbits:
    """Integrals over a conservative cycle, for each energy [J above the bottom].

    Attributes
    ----------
    area : numpy.ndarray, shape (n,)
        Integral of v dx.
    period : numpy.ndarray, shape (n,)
    work : numpy.ndarray, shape (n,)
        Work of the law beyond what it does on a mass that stands [J].
    gross : numpy.ndarray, shape (n,)
        The sum of the sizes of what it gives and takes [J].
    span : numpy.ndarray, shape (n,)
        From where to where the mass goes.
    spare : numpy.ndarray, shape (2, n)
        Kinetic energy at the lower and the upper stop [J].
    error : numpy.ndarray, shape (n,)
        Greatest relative change of an integral when the nodes were doubled last.
    """

    energy: np.ndarray = field(repr=False)
    area: np.ndarray = field(repr=False)
    period: np.ndarray = field(repr=False)
    work: np.ndarray = field(repr=False)
    gross: np.ndarray = field(repr=False)
    span: np.ndarray = field(repr=False)
    spare: np.ndarray = field(repr=False)
    error: np.ndarray = field(repr=False)


class Exchange(NamedTuple):
    """What a cycle gains without noise, and the sum of the sizes of all gains and losses [J]."""

    gain: np.ndarray
    turnover: np.ndarray


def exchange(oscillator: Oscillator, along: Orbits, impact: str) -> Exchange:
    """What damping, friction and stops do along orbits."""
    damped = oscillator.damping * along.area
    if oscillator.friction:
        damped = damped + 2 * oscillator.friction.kinetic * along.span
    lost = np.zeros(along.energy.shape)
    for spare, side in zip(along.spare, ("lower", "upper"), strict=True):
        for stop in oscillator.stops_on(side):
            r = _restitution(stop.law, np.sqrt(2 * spare / oscillator.mass), impact)
            lost += spare * IMPACTS[impact](r)
    return Exchange(along.work - damped - lost, along.gross + damped + lost)


def _restitution(law: Any, approach: np.ndarray, impact: str) -> np.ndarray:
    """Restitution coefficients at approach velocities; NaN where a function gives none."""
    if not callable(law.restitution):
        return np.asarray(law.restitution)
    function = np.vectorize(getattr(law.restitution, "py_func", law.restitution), otypes=[float])
    found = function(approach)
    possible = (found > 0 if impact == "logarithmic" else found >= 0) & (found <= 1)
    return np.where(possible, found, np.nan)


def orbits(part: Conservative, energy: np.ndarray, coarse: bool = False) -> Orbits:
    """The integrals, with nodes doubled until they agree; `coarse` takes the fewest."""
    inside = well(part)
    ends = [_end(inside, side, energy) for side in inside.sides]
    drag = _drag(part)
    found = _integrals(part.mass, inside, drag, ends, NODES[0])
    error = np.zeros(energy.shape)
    if not coarse:
        # Near a bottom that is not at 0, forces are known to what rounding leaves of them.
        nearest = np.min(
            [end[0] for end, side in zip(ends, inside.sides, strict=True) if side.reach], axis=0
        )
        rounding = 16 * np.finfo(float).eps * abs(inside.bottom) / nearest
        enough = np.maximum(AGREED, rounding)
        left = np.arange(len(energy))
        for nodes in NODES[1:]:
            some = [tuple(values[left] for values in end) for end in ends]
            finer = _integrals(part.mass, inside, drag, some, nodes)
            # Gains and losses may cancel; the sum of their sizes has kinks, and is but an estimate.
            scale = np.abs(finer[[0, 1, 3]])
            with np.errstate(invalid="ignore", divide="ignore"):
                change = np.abs(finer - found[:, left])[:3] / scale
            error[left] = np.nan_to_num(change).max(axis=0)
            found[:, left] = finer
            left = left[error[left] > enough[left]]
            if not left.size:
                break
    span = ends[0][0] + ends[1][0]
    area, period, work, gross = found
    spare = np.array([ends[0][1], ends[1][1]])
    return Orbits(energy, area, period, work, gross, span, spare, error)


def _end(inside: Well, side: Side, energy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far a motion gets, what is left of its energy there, and how far it is from its turn."""
    distance = inside.turn(side, energy) if side.reach else np.zeros(energy.shape)
    spare = np.maximum(energy - side.top, 0.0) if side.stop else np.zeros(energy.shape)
    ahead = np.zeros(energy.shape)
    hits = spare > 0
    if hits.any() and side.reach:
        slope = float(inside.pull(side, np.array([side.reach]))[0])
        # Far from turning the path is covered evenly, as it is where the force is none.
        ahead[hits] = np.minimum(spare[hits] / max(slope, 1e-300), 1e3 * side.reach)
    return distance, spare, ahead


def _integrals(
    mass: float,
    inside: Well,
    drag: Callable[[np.ndarray, np.ndarray], np.ndarray] | None,
    ends: Sequence[tuple[np.ndarray, ...]],
    nodes: int,
) -> np.ndarray:
    """Area, period, work of the law, and the sum of the sizes of its parts, of whole cycles."""
    points, weights, cumulative = rule(nodes)
    found = np.zeros((4, len(ends[0][0])))
    for side, (distance, spare, ahead) in zip(inside.sides, ends, strict=True):
        if not side.reach:
            continue
        first = np.sqrt(ahead)[:, None]
        width = distance[:, None] / (np.sqrt(distance + ahead)[:, None] + first)
        tau = first + width * points
        inwards = width * points * (2 * first + width * points)
        at = np.maximum(distance[:, None] - inwards, 0.0)
        step = 2 * tau * width
        kinetic = spare[:, None] + (inside.pull(side, at) * step) @ cumulative.T
        v = np.sqrt(2 * np.maximum(kinetic, 0.0) / mass)
        found[0] += 2 * (v * step) @ weights
        with np.errstate(divide="ignore", invalid="ignore"):
            found[1] += 2 * (step / v) @ weights
        if drag is not None:
            work = drag(inside.bottom + side.sign * at, v) * step
            found[2] += work @ weights
            found[3] += np.abs(work) @ weights
    return found


def _drag(part: Conservative) -> Callable[[np.ndarray, np.ndarray], np.ndarray] | None:
    """The law's force on the way out less that on the way back: what does not, does no work."""
    if part.law is None:
        return None
    law = on_arrays(part.law)
    return lambda x, v: law(0.0, x, v) - law(0.0, x, -v)


@lru_cache(maxsize=8)
def rule(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss and Legendre's points and weights on (0, 1), and integrals from 0 to each point."""
    points, weights = np.polynomial.legendre.leggauss(nodes)
    # Through the values at the points goes sum_k c_k P_k, c_k = (k + 1/2) sum_j w_j P_k(x_j) f_j.
    legendre = np.polynomial.legendre.legvander(points, nodes)
    order = np.arange(nodes)
    coefficients = (order[:, None] + 0.5) * legendre[:, :nodes].T * weights
    integral = np.empty((nodes, nodes))
    integral[:, 0] = points + 1
    k = order[1:]
    integral[:, 1:] = (legendre[:, 2:] - legendre[:, : nodes - 1]) / (2 * k + 1)
    return (points + 1) / 2, weights / 2, integral @ coefficients / 2
