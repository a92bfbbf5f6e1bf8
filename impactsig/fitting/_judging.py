"""Monte Carlo test of a fit, in which measured and simulated trains are exchangeable.

Trains are simulated at parameters drawn from what the fit leaves open, and the measured train is
put among them. What all are compared by, the frequent phases, the classes of intervals and the
means that moments are taken from, is chosen from all of them together, and each is compared with
the mean and the scatter of all. So if the fit is right the measured train is exchangeable with the
others, and its rank has the distribution that a p-value must have. Had the measured train alone
chosen the moments, it would lie nearer to them than any other: hardly any of its impacts lies
outside phases that were chosen as those of its impacts.

A train with too few impacts to have moments, or with ten times as many as the measured one, is
unlike the measured one: it counts as nearer. Whichever rank such trains are given in advance, the
measured train and the simulated ones remain exchangeable, and the test has its size; with this rank
an oscillator that seldom gives a fit number of impacts can be rejected, which it could not be if
such trains were left out or counted as farther.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .searching.problem import Problem
from .trains.moments import Moments
from .trains.partition import Train

JUDGED = 40
"""Trains simulated at an optimum, with which the measured one is compared."""
LEAST_P = 1 / (JUDGED + 1)
"""If all of these are nearer, the search may be in a wrong minimum, and restarts."""
HOPELESS = 10.0
"""Distance beyond which no chance or bias, but only another oscillator, explains the train."""
FEWEST = 20  # impacts of all trains by their number, from which on they can be compared


class Judgement(NamedTuple):
    """Comparison of the measured train with simulated ones."""

    distance: float  # of the measured train, by that of the median simulated one
    p_value: float
    shares: np.ndarray  # of the words: measured, mean and deviation of the simulated, (3, words)
    failed: int  # simulated trains without moments

    @property
    def hopeless(self) -> bool:
        """Whether continuing the search from here is pointless."""
        return self.distance > HOPELESS and self.p_value <= LEAST_P

    @property
    def compared(self) -> bool:
        """Whether there were enough impacts to compare the trains by."""
        return bool(np.isfinite(self.distance))


def judged(problem: Problem, psi: np.ndarray, covariance: np.ndarray) -> Judgement:
    """Compare the measured train with trains drawn from the posterior.

    Parameters
    ----------
    problem : Problem
    psi : ndarray, shape (names,)
        The parameters found, on the scale of the search.
    covariance : ndarray, shape (names, names)
    """
    vectors, squares = np.linalg.svd(covariance, hermitian=True)[:2]
    normal = problem.rng.standard_normal((JUDGED, len(psi)))
    drawn = np.clip(psi + normal * np.sqrt(squares) @ vectors.T, *problem.box)
    return compared(_first(problem), problem.simulate(drawn))


def compared(measured: Train, simulated: Train) -> Judgement:
    """The rank of a measured train among simulated ones, by strengths too if it has them."""
    trains = len(simulated.starts)
    strength = None
    if measured.strength is not None and simulated.strength is not None:
        strength = np.concatenate((measured.strength, simulated.strength))
    every = Train(
        np.concatenate((measured.x, simulated.x)),
        strength,
        np.concatenate((measured.joined, [False], simulated.joined)),
        np.concatenate(([0], len(measured.x) + simulated.starts)),
    )
    nothing = Judgement(np.inf, LEAST_P, np.zeros((3, 0)), trains)
    if len(simulated.x) < FEWEST * trains:
        return nothing
    moments = Moments.of(every)
    found = moments(every)
    found[every.counts <= moments.partition.length + 1] = np.nan
    whole = np.isfinite(found).all(axis=1)
    if not whole[0] or whole.sum() < 3:
        return nothing
    fit = found[whole]
    centre, scatter = fit.mean(axis=0), fit.std(axis=0)
    distance = np.mean(((fit - centre) / np.where(scatter > 0, scatter, np.inf)) ** 2, axis=1)
    words = moments.shares
    return Judgement(
        float(distance[0] / max(float(np.median(distance[1:])), 1e-300)),
        p_value(float(distance[0]), distance[1:], trains),
        np.array([fit[0, :words], fit[1:, :words].mean(axis=0), fit[1:, :words].std(axis=0)]),
        int(np.sum(~whole)),
    )


def p_value(measured: float, simulated: np.ndarray, trains: int) -> float:
    """Fraction of all trains, including the measured one, that deviate at least as much."""
    return (1 + int(np.sum(simulated >= measured))) / (1 + trains)


def _first(problem: Problem) -> Train:
    """As many impacts of the measured train as the simulated ones have."""
    train = problem.train
    count = int(np.ceil(problem.share * len(train.x)))
    strength = None if train.strength is None else train.strength[:count]
    return Train(train.x[:count], strength, train.joined[: count - 1])
