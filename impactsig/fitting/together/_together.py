"""The oscillator that many trains share, by orbits beside the instants of each.

One train of instants hardly tells restitution, damping and forcing apart; trains at several
frequencies do. All parameters, those that are shared and those of each train, move together by
Gauss and Newton, the orbits eliminated. A train may lie in another valley: there its orbit leaves
out more, or lies farther off, than at an amplitude nearby, which is looked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..._running.watched import progress
from ..orbits.followed import BEGUN, Followed, Laid, Seen

ROUNDS, ENDS, STEPS = 5, 6, 8
MORE = 12  # rounds at most after these, while the parameters still drift
DRIFT = 1.0  # standard errors between the halves of the last rounds, from which on they do
SHARES = (1.0, 0.3, 0.1, 0.03)  # of a step, until one does not raise the loss
AMPLITUDE, PHASE = 2, 4  # places in theta
LONGEST = np.array([0.05, 0.3, 0.05, 0.01, 0.1, 0.2])  # of a step, on the scale of the parameters
WIDEST = np.array([1.0, 2.0, 1.0, 0.3, 2.0, 3.0])  # what is known of one before the impacts tell
GAIN = 0.1  # of the loss, for which another step is made
ELSEWHERE = (-0.12, -0.05, -0.02, 0.02, 0.05, 0.12)
"""Of the logarithm of an amplitude: where other valleys are looked for."""
BETTER = 5.0  # logarithm of the likelihood, by which another valley is believed
MENDED = 1, 3, 4  # rounds after which other valleys are looked for
WORST = -math.log(BEGUN.spurious)  # cost of an impact that no course leads to
FARTHEST = 50.0  # logarithm of the likelihood below the best of the last rounds: gone astray


class Layout(NamedTuple):
    """Which parameters are sought: places in the theta of a train."""

    shared: tuple[int, ...]
    own: tuple[int, ...]
    trains: int

    @property
    def sought(self) -> np.ndarray:
        """Those of a train."""
        return np.array(self.shared + self.own)

    @property
    def kinds(self) -> np.ndarray:
        """Which of a train's each of all that are sought is."""
        return np.array(self.shared + self.trains * self.own)

    def of(self, train: int) -> np.ndarray:
        """Where those of a train are among all that are sought."""
        first, count = len(self.shared), len(self.own)
        return np.concatenate((np.arange(first), first + train * count + np.arange(count)))


class Joint(NamedTuple):
    """All trains at the parameters found."""

    theta: np.ndarray  # shape (trains, 6)
    seen: list[Seen]
    orbits: list[Followed | None]
    covariance: np.ndarray  # of all that are sought
    score: float  # less the logarithm of the likelihood


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
                theta = _elsewhere(layout, theta, seen, box, seeds, propose)
            if number == ROUNDS - 1 and found.score > enough:
                return found
            if number >= ROUNDS:
                near = [*near, found][-ENDS:]
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
    """Likeliest courses, and the parameters that these tell."""
    courses = zip(seen, theta, seeds, strict=True)
    orbits = [Followed.of(one, own, seed) for one, own, seed in courses]
    if sum(one is None for one in orbits) > len(orbits) / 2:
        return None
    theta, orbits, laid = _stepped(layout, theta, orbits, box)
    seen = [
        one if orbit is None or where is None else one.shown(orbit.jitter(where.jitter))
        for one, orbit, where in zip(seen, orbits, laid, strict=True)
    ]
    score = _loss(laid) + sum(
        len(own.x) * WORST if one is None else one.score
        for one, own in zip(orbits, seen, strict=True)
    )
    return Joint(theta, seen, orbits, covariance_of(layout, laid), score)


def covariance_of(layout: Layout, laid: list[Laid | None]) -> np.ndarray:
    """What is not told of all that are sought, in no direction more than is known beforehand.

    The information of a leg about parameters far from its own is not always positive.
    """
    size, vectors = np.linalg.eigh(_gathered(layout, laid)[1])
    covariance: np.ndarray = vectors / np.maximum(size, WIDEST.max() ** -2.0) @ vectors.T
    return covariance


def _mean(layout: Layout, near: list[Joint]) -> Joint:
    """The mean of the last rounds, whose scatter is what the choice of courses leaves open."""
    best = min(near, key=lambda one: one.score)
    near = [one for one in near if one.score < best.score + FARTHEST]
    theta = np.mean([one.theta for one in near], axis=0)
    covariance = np.mean([one.covariance for one in near], axis=0)
    off = np.zeros((len(near), len(layout.kinds)))
    for row, one in zip(off, near, strict=True):
        for k in range(len(theta)):
            row[layout.of(k)] = (one.theta - theta)[k, layout.sought]
    scatter = off.T @ off / max(len(near) - 1, 1)
    return best._replace(theta=theta, covariance=covariance + scatter)


def _gathered(layout: Layout, laid: list[Laid | None]) -> tuple[np.ndarray, np.ndarray]:
    """Gradient and information of all that are sought, with what is known beforehand."""
    gradient, total = np.zeros(len(layout.kinds)), np.diag(WIDEST[layout.kinds] ** -2.0)
    for k, one in enumerate(laid):
        if one is not None and math.isfinite(one.loss):  # else it has no information
            place = layout.of(k)
            gradient[place] += one.gradient[layout.sought]
            total[np.ix_(place, place)] += one.information[np.ix_(layout.sought, layout.sought)]
    return gradient, total


def _moved(
    layout: Layout, theta: np.ndarray, step: np.ndarray, box: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    theta = theta.copy()
    for k in range(len(theta)):
        theta[k, layout.sought] += step[layout.of(k)]
    moved: np.ndarray = np.clip(theta, *box)
    return moved


def _lay(orbits: list[Followed | None], theta: np.ndarray) -> list[Laid | None]:
    return [None if one is None else one.laid(own) for one, own in zip(orbits, theta, strict=True)]


def _loss(laid: list[Laid | None]) -> float:
    return sum(one.loss for one in laid if one is not None)


def _total(laid: list[Laid | None]) -> float:
    return sum(one.total for one in laid if one is not None)


def _stepped(
    layout: Layout,
    theta: np.ndarray,
    orbits: list[Followed | None],
    box: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, list[Followed | None], list[Laid | None]]:
    """Steps by Gauss and Newton, the courses fixed.

    Where a whole step raises the loss, as of a single leg whose weak impact the oscillator misses
    there, less of it is taken: Levenberg's damping hardly moves along the ridge that joins
    restitution, damping and amplitudes.
    """
    here = _lay(orbits, theta)
    for _ in range(STEPS):
        gradient, information = _gathered(layout, here)
        loss = _total(here)
        step = -np.linalg.solve(information, gradient)
        step /= max(1.0, float(np.max(np.abs(step) / LONGEST[layout.kinds])))
        for share in SHARES:
            trial = _moved(layout, theta, share * step, box)
            there = _lay(orbits, trial)
            if _total(there) < loss:
                break
        else:
            break
        gained = loss - _total(there)
        theta = trial
        orbits = [None if where is None else where.orbit for where in there]
        here = there
        if gained < GAIN:
            break
    return theta, orbits, here


def _elsewhere(
    layout: Layout,
    theta: np.ndarray,
    seen: list[Seen],
    box: tuple[np.ndarray, np.ndarray],
    seeds: list[int],
    propose: Callable[[int, np.ndarray], list[np.ndarray]],
) -> np.ndarray:
    """Each train at other amplitudes: where one suits it better, it is moved there."""
    if AMPLITUDE not in layout.own:
        return theta
    theta, single = theta.copy(), Layout((), layout.own, 1)
    usual = float(np.median([one.chain.jitter for one in seen]))
    for k, one in enumerate(seen):
        # A train that is astray seems to jitter more than the others, and all valleys look alike.
        one = one.shown(min(one.chain.jitter, usual))
        own, chosen = (box[0][k], box[1][k]), theta[k]
        least = _alone(single, theta[k], one, own, seeds[k], np.inf)[0] - BETTER
        trials = np.tile(theta[k], (len(ELSEWHERE), 1))
        trials[:, AMPLITUDE] += ELSEWHERE
        for trial in (*trials, *propose(k, theta[k])):
            there = _alone(single, np.clip(trial, *own), one, own, seeds[k], least)
            if there[0] < least:
                least, chosen = there
        theta[k] = chosen
    return theta


def _alone(
    single: Layout,
    theta: np.ndarray,
    one: Seen,
    box: tuple[np.ndarray, np.ndarray],
    seed: int,
    least: float,
) -> tuple[float, np.ndarray]:
    """What a train costs where its own parameters suit it best, near a beginning.

    Infinite where what is left out there costs more than `least` already.
    """
    begun = Followed.of(one, theta, seed)
    if begun is None or begun.cost > least:
        return np.inf, theta
    moved, (orbit,), (laid,) = _stepped(single, theta[None], [begun], box)
    assert orbit is not None
    assert laid is not None
    return laid.loss + orbit.cost, moved[0]
