"""Fit of the oscillator that several trains share, by an orbit near the instants of each.

The instants of one train hardly determine restitution, damping and forcing separately; trains at
several frequencies do. All parameters, shared ones and those of each train, are moved together by
the Gauss-Newton method, with the orbits eliminated. A train may be in another minimum, where its
orbit leaves out more impacts or is farther off than at a nearby amplitude; such amplitudes are
tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..._running.watched import progress
from ..machine import CONTRADICTED
from ..orbits.followed import BEGUN, Followed, Seen
from ._steps import Layout, covariance_of, disagreement, lay, loss_of, stepped
from ._valleys import elsewhere, turned_trains

ROUNDS, ENDS = 5, 6
MORE = 12  # rounds at most after these, while the parameters still drift
DRIFT = 1.0  # standard errors between the halves of the last rounds, from which on they do
MENDED = 1, 3, 4  # rounds after which other minima are tried
WORST = -math.log(BEGUN.spurious)  # cost of an impact that no course leads to
FARTHEST = 50.0
"""Logarithm of the likelihood below the best of the last rounds, within which all of them count."""


class Joint(NamedTuple):
    """All trains at the parameters found."""

    theta: np.ndarray  # shape (trains, 6)
    seen: list[Seen]
    orbits: list[Followed | None]
    covariance: np.ndarray  # of all that are sought
    score: float  # less the logarithm of the likelihood
    squares: float = 0.0  # chi squared of the trains about what they share
    freedom: int = 0

    @property
    def agreement(self) -> float:
        """Chance that trains of one machine disagree as much on what they share."""
        from scipy.special import chdtrc

        return float(chdtrc(self.freedom, self.squares)) if self.freedom else 1.0

    @property
    def contradicts(self) -> bool:
        """Whether the trains disagree by more than chance does."""
        return self.agreement < CONTRADICTED

    @property
    def widening(self) -> float:
        """Variances, as large as a disagreement shows them to be, by those stated [Birge1932]_."""
        return self.squares / self.freedom if self.contradicts else 1.0


def together(
    layout: Layout,
    theta: np.ndarray,
    seen: list[Seen],
    box: tuple[np.ndarray, np.ndarray],
    rng: np.random.Generator,
    propose: Callable[[int, np.ndarray], list[np.ndarray]],
    enough: float = math.inf,
) -> Joint | None:
    """The parameters at which orbits lie nearest to all trains; None where most have no orbit.

    Parameters
    ----------
    layout : Layout
    theta : ndarray, shape (trains, 6)
        Where to begin; see `_path.course`.
    seen : list of Seen
    box : (ndarray, ndarray)
        Least and greatest of the parameters of each, shape (trains, 6).
    rng : Generator
    propose : callable
        Other parameters of a train, by its number and those it has: where it may lie as well.
    enough : float
        A score from which it ends early, as another kind of machine is far better.
    """
    near: list[Joint] = []
    seeds = rng.integers(2**32, size=len(seen)).tolist()
    with progress(ROUNDS + ENDS, " rounds", leave=False) as advance:
        for number in range(ROUNDS + ENDS + MORE):
            if number >= ROUNDS:  # other states beside the instants, and so other courses
                seeds = rng.integers(2**32, size=len(seen)).tolist()
            found = _round(layout, theta, seen, box, seeds)
            if found is None:
                return None
            theta, seen = found.theta, found.seen
            if number in MENDED:
                theta = elsewhere(layout, theta, seen, box, seeds, propose)
            if number == ROUNDS - 1 and found.score > enough:
                return found
            if number >= ROUNDS:
                near = [*near, found][-ENDS:]
            if 0 < number < ROUNDS + MORE and found.contradicts and seen[0].kind == "two-sided":
                theta, turned = turned_trains(layout, theta, seen, box, rng)
                if turned:
                    near = []
            if number < ROUNDS + ENDS:
                advance(1)
            if len(near) == ENDS and not _drifts(layout, near):
                break
    return _mean(layout, near)


def _drifts(layout: Layout, near: list[Joint]) -> bool:
    """Whether what the trains share still moves from round to round, along the ridge they leave."""
    shared = np.array([one.theta[0, list(layout.shared)] for one in near])
    half = len(near) // 2
    off = np.abs(shared[half:].mean(axis=0) - shared[:half].mean(axis=0))
    error = np.sqrt([np.diag(one.covariance)[: len(layout.shared)] for one in near]).mean(axis=0)
    return bool((off > DRIFT * error).any())


def nearest(
    layout: Layout,
    beginnings: list[np.ndarray],
    seen: list[Seen],
    box: tuple[np.ndarray, np.ndarray],
    rng: np.random.Generator,
) -> Joint | None:
    """The likeliest of what a round makes of each beginning."""
    seeds = rng.integers(2**32, size=len(seen)).tolist()
    found = [_round(layout, np.clip(theta, *box), seen, box, seeds) for theta in beginnings]
    return min((one for one in found if one is not None), key=lambda one: one.score, default=None)


def _round(
    layout: Layout,
    theta: np.ndarray,
    seen: list[Seen],
    box: tuple[np.ndarray, np.ndarray],
    seeds: list[int],
) -> Joint | None:
    """Most likely courses, and the parameters estimated from them."""
    courses = zip(seen, theta, seeds, strict=True)
    orbits = [Followed.of(one, own, seed) for one, own, seed in courses]
    if sum(one is None for one in orbits) > len(orbits) / 2:
        return None
    theta, orbits, laid = stepped(layout, theta, orbits, box)
    seen = [
        one if orbit is None or where is None else one.shown(orbit.jitter(where.jitter))
        for one, orbit, where in zip(seen, orbits, laid, strict=True)
    ]
    score = loss_of(laid) + sum(
        len(own.x) * WORST if one is None else one.score
        for one, own in zip(orbits, seen, strict=True)
    )
    return Joint(
        theta, seen, orbits, covariance_of(layout, laid), score, *disagreement(layout, laid)
    )


def _mean(layout: Layout, near: list[Joint]) -> Joint:
    """The mean of the last rounds, whose scatter is what the choice of courses leaves open.

    Where courses break often, as with two stops, scores differ by hundreds from one draw of states
    to the next, so the likelier half counts in any case.
    """
    best = min(near, key=lambda one: one.score)
    worst = max(best.score + FARTHEST, float(np.median([one.score for one in near])))
    near = [one for one in near if one.score <= worst]
    theta = np.mean([one.theta for one in near], axis=0)
    covariance = np.mean([one.covariance for one in near], axis=0)
    off = np.zeros((len(near), len(layout.kinds)))
    for row, one in zip(off, near, strict=True):
        for k in range(len(theta)):
            row[layout.of(k)] = (one.theta - theta)[k, layout.sought]
    scatter = off.T @ off / max(len(near) - 1, 1)
    squares, freedom = disagreement(layout, lay(best.orbits, theta))
    return best._replace(
        theta=theta, covariance=covariance + scatter, squares=squares, freedom=freedom
    )
