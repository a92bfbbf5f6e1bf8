"""Fit of one orbit to all impacts, and of the parameters.

Where strengths are known besides instants, they determine where on the attractor an impact is, and
only one oscillator has an orbit within the noise of thousands of impacts: this is the fit of an
ordinary differential equation to chaotic data by many short shots [Baake1992]_, in the limit of one
shot per flight. At given parameters the orbit is found by `smooth`, with a slack that is lowered
step by step; a leg that contradicts its neighbours (an impact was missed there, or one is false) is
left out. The parameters follow by Levenberg's method, the orbit eliminated.

The noise is estimated with the rest, so the loss is the logarithm of its sizes, plus what a leg
left out has cost.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..trains.partition import Sifted
from ._contact_kernels import EXTRA, NONE, contacts
from ._laying_kernels import CUT, lay
from .orbit_kernels import OWN, STRENGTH, Machine, Noise, project

SLACKS = (0.03, 0.01, 0.003, 3e-4, 3e-5)
"""In gaps. The last is far below what the noise moves a velocity by: a slack that is not biases the
parameters, as noise in what one regresses on does. The first lets every orbit begin."""
QUIET = 1e-4  # periods, and a share: a simulated train without noise would divide by none
FAINT = 0.05  # of the mean strength: a floor that hardly changes any impact
FLOORS = (FAINT, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
CERTAIN = 5.0  # logarithm of the likelihood, from which another floor is believed
STEPS, TRIALS = 40, 6
LONGEST = (0.1, 0.4, 0.05, 0.02, 0.2, 0.2, 0.4)  # of a step, on the scale of the parameters
SETTLED = 0.05  # standard deviations that a last step goes
LOST = 0.5  # fraction of legs left out from which no orbit is followed any more


class Sight(NamedTuple):
    """The measured train as `smooth` takes it."""

    seen: np.ndarray  # instants in forcing periods, strengths by their mean, noise by its share, 1
    joined: np.ndarray  # where no gap lies between two impacts

    @classmethod
    def of(cls, sifted: Sifted, floor: float = FAINT) -> Sight:
        """From impacts with strengths, whose noise is bounded below by a floor."""
        strength = sifted.strength
        assert strength is not None
        x = sifted.cycle + sifted.phase
        seen = np.column_stack((x, strength, np.hypot(strength, floor), np.ones(len(x))))
        return cls(seen, sifted.joined)


class Orbit(NamedTuple):
    """The best-fitting orbit at some parameters."""

    node: np.ndarray  # instants in forcing periods, approach velocities; shape (n, 2)
    joined: np.ndarray  # legs that are followed
    explained: float  # their share
    noise: Noise  # as the distances tell
    loss: float
    step: np.ndarray  # to better parameters, by Gauss and Newton; shape (free + 2,)
    information: np.ndarray  # about these


def machine_of(theta: np.ndarray, kind: str = "rigid") -> Machine:
    """The oscillator of a parameter vector: restitution, three logarithms, phase.

    Of other kinds also the logarithm of what only these have, at `EXTRA`.
    """
    far = math.exp(theta[EXTRA]) if kind == "two-sided" else 1.0
    contact = contacts(theta) if kind == "soft" else NONE
    r, zeta, omega = float(theta[0]), math.exp(theta[1]), math.exp(-theta[3])
    dynamic = 1 - omega**2 + 2j * zeta * omega
    response = math.exp(theta[2]) / dynamic
    return Machine(
        r, zeta, math.sqrt(1 - zeta**2), omega, float(theta[4]), response,
        -response * 2j * omega / dynamic, response * (2 * omega - 2j * zeta) / dynamic,
        far, contact,
    )  # fmt: skip


def follow(theta: np.ndarray, noise: Noise, sight: Sight, free: np.ndarray) -> Orbit:
    """Fit an orbit to the impacts.

    Parameters
    ----------
    theta : ndarray, shape (OWN,) or (OWN + 1,)
        As `machine_of` has them, and the logarithm of the strength of an impact of velocity 1; of
        a soft stop that of its stiffness besides.
    noise : Noise
    sight : Sight
    free : ndarray of int
        Which parameters the step is by.
    """
    kind = "soft" if len(theta) > OWN else "rigid"
    machine, scale = machine_of(np.delete(theta, STRENGTH), kind), math.exp(theta[STRENGTH])
    node = np.ascontiguousarray(sight.seen[:, :2] / [1.0, scale])
    joined = sight.joined.copy()
    found = lay(machine, scale, noise, SLACKS, sight.seen, joined, node)
    with np.errstate(all="ignore"):
        sizes = np.maximum(np.sqrt(found.squares / found.freedom), QUIET)
        loss = len(node) * float(np.log(sizes).sum()) + CUT / 2 * np.sum(sight.joined & ~joined)
    explained = float(joined.sum() / max(sight.joined.sum(), 1))
    gradient, information = project(machine, scale, noise, SLACKS[-1], sight.seen, joined, node)
    gradient, information = gradient[free], information[np.ix_(free, free)]
    step = np.zeros(len(free))
    if not np.isfinite(loss) or explained < 1 - LOST or not np.isfinite(information).all():
        loss = math.inf
    else:
        step -= np.linalg.lstsq(information, gradient, rcond=None)[0]
    return Orbit(node, joined, explained, Noise(*sizes), loss, step, information)


def distances(orbit: Orbit, sight: Sight, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Strengths of the fitted orbit, and residuals of instants and strengths."""
    followed = np.zeros(len(orbit.node), bool)
    followed[:-1] |= orbit.joined
    followed[1:] |= orbit.joined
    expected = orbit.node[followed] * [1, scale]
    return expected[:, 1], sight.seen[followed, :2] - expected


def floor_of(orbit: Orbit, sight: Sight, scale: float) -> float:
    """Relative strength below which the noise of the strengths is constant.

    The likeliest of a few: `FAINT` for noise in proportion to the strength, the greatest for noise
    that is the same in all.
    """
    strength, off = distances(orbit, sight, scale)
    losses = []
    for floor in FLOORS:
        size = np.hypot(strength, floor)
        losses.append(
            len(off) * np.log(max(float(np.std(off[:, 1] / size)), QUIET)) + np.log(size).sum()
        )
    if min(losses) > losses[0] - CERTAIN:
        return FAINT
    return FLOORS[int(np.argmin(losses))]


class Approach(NamedTuple):
    """Result of minimising the loss over the parameters."""

    theta: np.ndarray
    noise: Noise
    orbit: Orbit


def approach(
    theta: np.ndarray,
    noise: Noise,
    sight: Sight,
    free: np.ndarray,
    box: tuple[np.ndarray, np.ndarray],
) -> Approach:
    """Minimise the loss over the parameters, from an initial guess.

    Parameters
    ----------
    theta, noise, sight, free
        As in `follow`; where to begin.
    box : (ndarray, ndarray)
        Least and greatest of all parameters, shape (PARAMETERS,).
    """
    here = follow(theta, noise, sight, free)
    if not math.isfinite(here.loss):
        return Approach(theta, noise, here)
    damping = 1e-3
    longest = np.array(LONGEST)[free]
    for _ in range(STEPS):
        information = here.information
        gradient = -information @ here.step
        for _ in range(TRIALS):
            raised = information + damping * np.diag(np.diag(information))
            step = -np.linalg.lstsq(raised, gradient, rcond=None)[0]
            size = math.sqrt(max(step @ information @ step, 0.0))
            step /= max(1.0, float(np.max(np.abs(step) / longest)))
            trial = theta.copy()
            trial[free] += step
            trial = np.clip(trial, *box)
            there = follow(trial, here.noise, sight, free)
            if there.loss < here.loss + 0.1:  # legs come and go
                break
            damping = max(10 * damping, 1e-2)
        else:
            break
        # If steps reach the stiffest stop twice, the orbit is that of a rigid stop.
        rigid = len(theta) > OWN and min(theta[OWN], trial[OWN]) >= box[1][OWN]
        theta, noise, here = trial, here.noise, there
        damping *= 0.1
        if size < SETTLED or rigid:
            break
    return Approach(theta, noise, here)
