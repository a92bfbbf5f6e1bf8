"""One cycle of the conservative motion: its length, its area, and what the forces do along it.

A quarter of the cycle, from the bottom to where the motion turns, is integrated in
``tau = sqrt(turn - distance)``, in which the velocity has no root singularity; where a stop ends it
before, the turn is the one that the force at the stop foretells. The kinetic energy along it is the
work from the end inwards and not a difference of potentials, so that no digits cancel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from ..oscillators import Oscillator
from ._averaging_well import Side, Well, on_arrays

NODES = (24, 48, 96, 192, 384)
IMPACTS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "logarithmic": lambda r: -2 * np.log(r),
    "exact": lambda r: 1 - r**2,
    "linearised": lambda r: 2 * (1 - r),
}
"""What an impact takes of the kinetic energy, over the restitution coefficient."""

AGREED = 1e-11  # relative change of the integrals at which the nodes are not doubled again


@dataclass(frozen=True)
class Cycles:
    """Integrals over a cycle, for each energy [energies in J above the bottom].

    Attributes
    ----------
    area : numpy.ndarray, shape (n,)
        Integral of v dx over the cycle.
    period : numpy.ndarray, shape (n,)
    damped : numpy.ndarray, shape (n,)
        Work of damper, law and friction [J], negative where they take energy.
    lost : numpy.ndarray, shape (n,)
        Energy lost at stops [J].
    turnover : numpy.ndarray, shape (n,)
        Energy that damping gives and takes, and stops take: the sum of their sizes [J].
    error : float
        Greatest relative change of an integral when the nodes were doubled last.
    """

    energy: np.ndarray = field(repr=False)
    area: np.ndarray = field(repr=False)
    period: np.ndarray = field(repr=False)
    damped: np.ndarray = field(repr=False)
    lost: np.ndarray = field(repr=False)
    turnover: np.ndarray = field(repr=False)
    error: float

    @property
    def balance(self) -> np.ndarray:
        """Energy gained in a cycle, noise apart, by its area [N s... of the damper's unit]."""
        return (self.damped - self.lost) / self.area


def cycles(
    oscillator: Oscillator, well: Well, energy: np.ndarray, impact: str, coarse: bool = False
) -> Cycles:
    """The integrals, with nodes doubled until they agree; `coarse` takes the fewest."""
    ends = [_end(well, side, energy) for side in well.sides]
    drag = _drag(oscillator)
    found = _integrals(oscillator, well, drag, ends, NODES[0])
    error = 0.0
    if not coarse:
        open_ones = np.arange(len(energy))
        for nodes in NODES[1:]:
            some = [tuple(part[open_ones] for part in end) for end in ends]
            finer = _integrals(oscillator, well, drag, some, nodes)
            # Gains and losses may cancel; the sum of their sizes has kinks, and is but an estimate.
            scale = np.abs(finer[[0, 1, 3]])
            with np.errstate(invalid="ignore", divide="ignore"):
                change = np.abs(finer - found[:, open_ones])[:3] / scale
            worst = np.nan_to_num(change).max(axis=0)
            found[:, open_ones] = finer
            open_ones = open_ones[worst > AGREED]
            if not open_ones.size:
                break
        error = float(worst.max(initial=0.0))
    area, period, work, gross = found
    span = sum(np.where(np.isfinite(end[0]), end[0], 0) for end in ends)
    rubbed = 2 * oscillator.friction.kinetic * span if oscillator.friction else 0.0
    damping = oscillator.damping * area
    lost = np.zeros(energy.shape)
    for side in well.sides:
        if side.restitution is not None:
            spare = np.maximum(energy - side.top, 0.0)
            r = side.restitution(np.sqrt(2 * spare / oscillator.mass))
            lost += spare * IMPACTS[impact](r)
    return Cycles(
        energy, area, period, work - damping - rubbed, lost, gross + damping + rubbed + lost, error
    )


def _end(well: Well, side: Side, energy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far a motion gets, what is left of its energy there, and how far it is from its turn."""
    distance = well.turn(side, energy) if side.reach else np.zeros(energy.shape)
    spare = np.maximum(energy - side.top, 0.0) if side.restitution else np.zeros(energy.shape)
    ahead = np.zeros(energy.shape)
    hits = spare > 0
    if hits.any() and side.reach:
        slope = float(well.pull(side, np.array([side.reach]))[0])
        # Far from turning the path is covered evenly, as it is where the force is none.
        ahead[hits] = np.minimum(spare[hits] / max(slope, 1e-300), 1e3 * side.reach)
    return distance, spare, ahead


def _integrals(
    oscillator: Oscillator,
    well: Well,
    drag: Callable[[np.ndarray, np.ndarray], np.ndarray] | None,
    ends: list[tuple[np.ndarray, ...]],
    nodes: int,
) -> np.ndarray:
    """Area, period, work of the law, and the sum of the sizes of its parts, of whole cycles."""
    points, weights, cumulative = rule(nodes)
    found = np.zeros((4, len(ends[0][0])))
    for side, (distance, spare, ahead) in zip(well.sides, ends, strict=True):
        if not side.reach:
            continue
        first = np.sqrt(ahead)[:, None]
        width = distance[:, None] / (np.sqrt(distance + ahead)[:, None] + first)
        tau = first + width * points
        inwards = width * points * (2 * first + width * points)
        at = np.maximum(distance[:, None] - inwards, 0.0)
        step = 2 * tau * width
        kinetic = spare[:, None] + (well.pull(side, at) * step) @ cumulative.T
        v = np.sqrt(2 * np.maximum(kinetic, 0.0) / oscillator.mass)
        found[0] += 2 * (v * step) @ weights
        with np.errstate(divide="ignore", invalid="ignore"):
            found[1] += 2 * (step / v) @ weights
        if drag is not None:
            work = drag(well.bottom + side.sign * at, v) * step
            found[2] += work @ weights
            found[3] += np.abs(work) @ weights
    return found


def _drag(oscillator: Oscillator) -> Callable[[np.ndarray, np.ndarray], np.ndarray] | None:
    """The law's force on the way out less that on the way back: what does not, does no work."""
    if oscillator.law is None:
        return None
    law = on_arrays(oscillator.law)
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
