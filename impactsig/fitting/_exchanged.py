"""Monte Carlo test of a joint fit, in which the measured train is one of many that are alike.

Trains are simulated at parameters drawn from what the fit leaves open, and the measured train is
put among them. What all are compared by, the frequent phases, the classes of intervals and the
means that moments are taken from, is chosen from all of them together, and each is compared with
the mean and the scatter of all. So if the fit is right the measured train is exchangeable with the
others, and its rank has the distribution that a p-value must have. Had the measured train alone
chosen the moments, it would lie nearer to them than any other: hardly an impact of its own comes
outside of phases that were chosen as those of its impacts.
"""

from __future__ import annotations

import numpy as np

from ._judging import JUDGED, LEAST_P, Judgement, p_value
from ._moments import Moments
from ._partition import Train
from ._problem import Problem

FEWEST = 20  # impacts of all trains by their number, from which on they can be compared


def exchanged(problem: Problem, psi: np.ndarray, covariance: np.ndarray) -> Judgement:
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
    """The rank of a measured train among simulated ones."""
    trains = len(simulated.starts)
    every = Train(
        np.concatenate((measured.x, simulated.x)),
        None,
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
        float(distance[0] / np.median(distance[1:])),
        p_value(float(distance[0]), distance[1:], trains),
        np.array([fit[0, :words], fit[1:, :words].mean(axis=0), fit[1:, :words].std(axis=0)]),
        int(np.sum(~whole)),
    )


def _first(problem: Problem) -> Train:
    """As many impacts of the measured train as the simulated ones have."""
    count = int(np.ceil(problem.share * len(problem.train.x)))
    return Train(problem.train.x[:count], None, problem.train.joined[: count - 1])
