"""The course of an oscillator through a measured train, found without a good initial guess.

If only instants are known, an orbit cannot be fitted to them from an arbitrary start: velocities
are unknown, and from wrong ones the fit ends in another minimum. `likeliest` determines which
states of the oscillator the instants are, which instants are false and where impacts were missed,
so that `smooth` starts near its solution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...simulation.batches.trains import impacts_of_many
from .._machine import KINDS, PARAMETERS, oscillator
from ..trains.balance import TURN, Values, imbalance
from ._path_kernels import AHEAD, BEGINS, FALSE, Chain, likeliest

ORBITS, STEPS = 60, 8  # simulated, and the states of each
SETTLE = 3  # impacts by which it falls on the attractor, or along what leads there
SETTLE_FROM_ANYWHERE = 12
FEWEST = 15  # orbits: an oscillator with fewer hardly reaches the stop
FASTEST = 3.0  # approach velocity of a beginning


@dataclass(frozen=True, eq=False)
class Path:
    """What an oscillator makes of a train.

    Attributes
    ----------
    real : ndarray of bool, shape (n,)
        Which impacts are not false.
    joined : ndarray of bool, shape (real - 1,)
        From which of these to the next one orbit leads.
    node : ndarray, shape (real, 2)
        Instants and approach velocities of the orbit, roughly; negative at a second stop.
    missed : int
        Impacts that were missed.
    broken : int
        Where the course breaks off.
    """

    real: np.ndarray
    joined: np.ndarray
    node: np.ndarray
    missed: int
    broken: int


def course(
    theta: np.ndarray,
    kind: str,
    frequency: float,
    x: np.ndarray,
    joined: np.ndarray,
    chain: Chain,
    seed: int,
) -> Path | None:
    """The likeliest course; None where the oscillator has too few impacts.

    Parameters
    ----------
    theta : ndarray
        Restitution; logarithms of damping, amplitude, natural frequency by that of the forcing;
        phase; what only its kind has.
    kind : str
        Of machine.
    frequency : float
        Of the forcing.
    x, joined
        The train.
    chain : Chain
    seed : int
        Of the states that it is made of.
    """
    states = _states(theta, kind, frequency, x, seed)
    if states is None:
        return None
    node, step = np.zeros((len(x), 2)), np.zeros(len(x), np.int64)
    likeliest(*states, x, joined, chain, node, step)
    real = step != FALSE
    step = step[real]
    missed = int(step[(step > 0) & (step < BEGINS)].sum())
    broken = int((step[1:] == BEGINS).sum() - (~joined).sum())
    return Path(real, step[1:] == 0, node[real], missed, max(broken, 0))


def _states(
    theta: np.ndarray, kind: str, frequency: float, x: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """Instants and approach velocities along short orbits that begin at measured impacts."""
    values = {
        name: np.full(ORBITS, own.value(one))
        for (name, own), one in zip(PARAMETERS.items(), theta[:4], strict=True)
    }
    values["natural_frequency"] *= frequency
    extra = KINDS[kind]
    if extra is not None:
        values[extra] = np.full(ORBITS, math.exp(theta[5]))
    rng = np.random.default_rng(seed)
    single = Values(theta[0], math.exp(theta[1]), math.exp(theta[2]), math.exp(-theta[3]), theta[4])
    speed = imbalance(single, x[None])[1].ravel()
    which = rng.integers(len(speed), size=ORBITS)
    first = x[1:-1][which] % 1.0
    settle, speed = SETTLE, np.clip(np.nan_to_num(speed[which]), 0.0, FASTEST)
    if kind == "two-sided":  # which stop they are on is not known, so neither is their velocity
        settle, speed = SETTLE_FROM_ANYWHERE, rng.uniform(0.0, FASTEST / 2, ORBITS)
    away = -theta[0] * speed
    needed = settle + STEPS + AHEAD
    mean = (x[-1] - x[0]) / (len(x) - 1)
    found = impacts_of_many(
        oscillator(values, frequency), np.column_stack((np.ones(ORBITS), away)),
        TURN * first + theta[4], np.zeros(ORBITS), math.ceil(1.6 * mean * needed), 10 * needed,
    )  # fmt: skip
    whole = np.diff(found.starts, append=len(found.x)) >= needed
    if whole.sum() < FEWEST:
        return None
    at = found.starts[whole][:, None] + settle + np.arange(STEPS + AHEAD)
    side = np.where(found.stop[at] == 0, 1.0, -1.0)
    return found.x[at] + first[whole][:, None], side * found.approach[at]
