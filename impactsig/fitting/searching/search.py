"""Global search by differential evolution [StornPrice1997]_, in two stages.

The balance of three impacts asks for no simulation and leads near; it knows nothing of what happens
between impacts, nor of how often an interval comes. Then trains are simulated, and their moments
compared with the measured ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._machine import dimensionless
from ..trains.balance import TURN, Values, badness, imbalance
from .problem import FAR, Problem
from .simulated import Beginnings

MEMBERS, GENERATIONS = 40, 14
RESTARTS = 2
NEAR = 2.5  # mean square of the moments' distances, by their scatter: where the search may end
HOPELESS, GAIN = 10.0, 0.9  # beyond the first it ends as well, where a restart has not gained
ELSEWHERE = 8  # members that begin anywhere along the box, in case the balance has misled


class Beginning(NamedTuple):
    """An initial guess from the balance of three impacts."""

    free: np.ndarray  # free parameters, on the scale of the search
    phase: float  # of the forcing at the mean phase of the impacts
    beginnings: Beginnings


def begin(problem: Problem, damping: tuple[float, float] | None = None) -> Beginning:
    """Free parameters at which the mean sequences of impacts are in balance.

    The balance hardly determines the damping; `damping` limits it, on the scale of the search.
    """
    from scipy.optimize import differential_evolution

    course = problem.courses()
    box = [list(pair) for pair in zip(*problem.box, strict=True)][: len(problem.free)]
    if damping is not None:
        box[problem.free.index("damping")] = list(damping)

    def values(point: np.ndarray) -> Values:
        named = problem.values(point[..., :-1])
        return dimensionless(named, problem.forcing_frequency, point[..., -1])

    found = differential_evolution(
        lambda points: badness(values(points.T), course),
        [*box, (-np.pi, np.pi)],
        seed=problem.rng,
        popsize=12,
        maxiter=150,
        tol=1e-4,
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    best = values(found.x)
    approach = imbalance(best, course.instant)[1].ravel()
    phase = best.phase + TURN * course.instant[:, 1:-1].ravel()
    good = np.isfinite(approach) & (approach > 0)
    if not good.any():
        good, approach = np.ones(len(phase), bool), np.full(len(phase), 0.3)
    return Beginning(found.x[:-1], best.phase, Beginnings(phase[good], approach[good]))


def descend(problem: Problem, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Minimise the distance of simulated trains from the measured one.

    Returns
    -------
    psi : ndarray, shape (trains, names)
        Where trains were simulated.
    y : ndarray, shape (trains, moments)
        How far they were, as `Problem.look` has it.
    """
    from scipy.optimize import differential_evolution

    low, high = problem.box
    half = np.array([problem.kind(name).half for name in problem.names])
    centre = np.array([*start, *chain(problem)])
    count = len(problem.free)
    seen: list[tuple[np.ndarray, np.ndarray]] = []

    def distance(members: np.ndarray) -> np.ndarray:
        y = problem.look(members.T)
        seen.append((members.T.copy(), y))
        square: np.ndarray = np.mean(np.nan_to_num(y, nan=FAR) ** 2, axis=1)
        return square

    best, before = np.empty((0, len(half))), np.inf
    for _ in range(1 + RESTARTS):
        members = centre + half * problem.rng.uniform(-1, 1, (MEMBERS, len(half)))
        wide = problem.rng.uniform(-1, 1, (ELSEWHERE, count))
        members[:ELSEWHERE, :count] = centre[:count] + 3 * half[:count] * wide
        found = differential_evolution(
            distance,
            list(zip(low, high, strict=True)),
            init=np.clip(np.vstack((best, members)), low, high),
            seed=problem.rng,
            maxiter=GENERATIONS,
            polish=False,
            tol=0,
            vectorized=True,
            updating="deferred",
        )
        if found.fun < NEAR or found.fun > max(HOPELESS, GAIN * before):
            break
        best, before = found.x[None], found.fun
    psi, y = zip(*seen, strict=True)
    return np.vstack(psi), np.vstack(y)


def chain(problem: Problem) -> list[float]:
    """Initial guess of the parameters of the measuring chain."""
    sifted = problem.moments.partition.sift(problem.train)
    outside = max(1 - problem.moments.partition.window.mean(), 0.1)
    guess = {
        "jitter": 0.5 * float(sifted.phase.std()),
        "missed": 0.02,
        "spurious": float(sifted.off[0]) / outside,
        "strength_noise": 0.05,
    }
    names = problem.names[len(problem.free) :]
    return [problem.kind(n).scale(max(guess[n], problem.kind(n).low)) for n in names]
