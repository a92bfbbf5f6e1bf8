"""Tangent map of a cantilever's motion: flow between events, and saltation at them.

In a regime of the beam (`simulate._beam_regimes`) ``y' = A (y - y_p) + y_p'``, y_p the response to
the forcing. So differences grow by ``exp(A tau) = Re(V exp(lambda tau) W)``, V and W the
eigenvectors that the simulation uses. At an event with the gap g = n' y + w(t) and the reset R they
jump by the saltation matrix [Muller1995]_, of any dimension,

    S = R_y + (f+ - R_y f- - R_t) n' / (n' f- + g_t),    f = y' before and after.

A tip that sticks after its chatter is an impact without rebound into the regime in which it is
held; what the rebounds before it change is of the order of their velocity, where chatter is cut
off.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...simulation.basis.events import (
    BEAM_APPROACH,
    HEAD,
    IMPACT,
    PART,
    PHASE,
    ROW_KIND,
    ROW_REGIME,
    STICK,
    TOUCH,
    TURN,
    TURNS,
)
from ...simulation.beam.beam import CONTACT, FREE

if TYPE_CHECKING:
    from ...simulation.beam.beam_flow import Beam
    from ...simulation.beam.beam_motion import BeamMotion

SLOW = 1e-12  # share of the modes' velocities: an event that comes more slowly has no derivative


class Step(NamedTuple):
    """The tangent map from one event to the next."""

    turns: float  # of the forcing, since the start of the run
    phase: float
    matrix: np.ndarray  # (2 modes, 2 modes)
    collapsed: bool  # whether the tip came to rest at the stop
    grazed: bool  # whether the event had no derivative


def steps(motion: BeamMotion, times: np.ndarray) -> Iterator[tuple[int, Step]]:
    """The tangent map, leg by leg, also divided at given times.

    In the unit of time of the reference, for displacements and velocities of the modes.
    """
    table, rows = motion._regimes, motion._rows
    angles = rows[:, TURNS] * TURN + rows[:, PHASE]
    turns, phase = motion._angle(times)
    cuts = turns * TURN + phase
    at, passed, k = angles[0], 0, 0
    while passed < len(cuts):
        last = k + 1 == len(rows) or angles[k + 1] > cuts[passed]
        to = cuts[passed] if last else angles[k + 1]
        matrix = flow(table, int(rows[k, ROW_REGIME]), max(to - at, 0.0))
        collapsed = grazed = False
        at = to
        if last:
            passed += 1
        else:
            held = (
                k + 2 < len(rows)
                and (rows[k + 1, ROW_KIND], rows[k + 2, ROW_KIND]) == (IMPACT, STICK)
                and angles[k + 1] == angles[k + 2]
            )
            jump, grazed = saltation(table, rows[k], rows[k + 1], bool(held))
            matrix = jump @ matrix
            k += 2 if held else 1
            collapsed = rows[k, ROW_KIND] == STICK
        yield passed, Step(float(at // TURN), float(at % TURN), matrix, bool(collapsed), grazed)


def flow(table: Beam, regime: int, tau: float) -> np.ndarray:
    """exp(A tau) in a regime, shape (2 modes, 2 modes)."""
    count = table.sizes[regime]
    grown = table.vectors[regime][:, :count] * np.exp(table.rates[regime][:count] * tau)
    return (grown @ table.inverse[regime][:count]).real


def rate(table: Beam, regime: int, state: np.ndarray, phase: float) -> np.ndarray:
    """Rate of the state in a regime, shape (2 modes,)."""
    count, turned = table.sizes[regime], np.exp(1j * phase)
    off = state - table.rest[regime] - (table.forced[regime] * turned).real
    vectors = table.vectors[regime][:, :count] * table.rates[regime][:count]
    free = (vectors @ (table.inverse[regime][:count] @ off)).real
    return free + (1j * table.forced[regime] * turned).real


def saltation(
    table: Beam, before: np.ndarray, row: np.ndarray, held: bool
) -> tuple[np.ndarray, bool]:
    """Saltation matrix of the event of a row, and whether it has no derivative.

    `held`: whether the impact ends a chatter, after which the stop holds the tip.
    """
    m, phase, kind = table.modes, row[PHASE], row[ROW_KIND]
    after = row[HEAD:].copy()
    identity, normal = np.eye(2 * m), table.signal[FREE]
    if kind not in (IMPACT, TOUCH, PART, STICK):
        return identity, False  # the force that holds the tip is 0: nothing jumps
    along = normal[:m]
    carried = (1j * table.wave[FREE] * np.exp(1j * phase)).real  # rate of the gap by the base
    if kind == STICK:  # without an impact: tip and stop are one
        return _held(table), True
    reset, by_time = identity.copy(), np.zeros(2 * m)
    state, come = after.copy(), float(along @ after[m:]) + carried
    if kind == IMPACT:
        restitution = 0.0 if held else table.restitution
        change = table.side * (1 + restitution) / m
        come = -row[BEAM_APPROACH]
        state[m:] -= table.side * (1 + table.restitution) * come / m
        reset[m:, m:] += change * along
        by_time[m:] = -change * (table.wave[FREE] * np.exp(1j * phase)).real
        after = state.copy()
        after[m:] += change * come
    if abs(come) <= SLOW * np.abs(state[m:]).sum():
        return reset, True
    regime = CONTACT if held else int(row[ROW_REGIME])
    gone = rate(table, regime, after, phase)
    came = rate(table, int(before[ROW_REGIME]), state, phase)
    return reset + np.outer(gone - reset @ came - by_time, normal) / come, False


def _held(table: Beam) -> np.ndarray:
    """Projection that removes differences in position and velocity of the tip."""
    m = table.modes
    part = np.eye(m) - np.ones((m, m)) / m
    return np.block([[part, np.zeros((m, m))], [np.zeros((m, m)), part]])
