"""Monte Carlo test, on the moments, of whether an oscillator explains the measured train.

The statistic is the mean squared distance of a train's moments from the mean of the simulated
ones. Each moment is scaled by its variance, half of which comes from the simulated trains and half
from blocks of the measured one (1, as `Problem.look` has it). So a moment that hardly varies in the
simulated trains, as all do where these are periodic, does not count without limit.

The p-value is a rank among all trains that were simulated. A train with too few impacts to have
moments, or with ten times as many as the measured one, is unlike the measured one: it counts as
nearer. Whichever rank such trains are given in advance, the measured train and the simulated ones
remain exchangeable, and the test has its size; with this rank an oscillator that seldom gives a fit
number of impacts can be rejected, which it could not be if such trains were left out or counted as
farther.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._problem import Problem

JUDGED = 40
"""Trains simulated at an optimum, which tell whether the measured one is of their kind."""
LEAST_P = 1 / (JUDGED + 1)
"""Where all of these are nearer, the search may have gone astray, and it begins anew."""
HOPELESS = 10.0
"""Distance beyond which no chance or bias, but only another oscillator, explains the train."""


class Judgement(NamedTuple):
    """Comparison of the measured train with trains simulated at an optimum."""

    distance: float  # of the measured train, by that of the median simulated one
    p_value: float
    shares: np.ndarray  # of the words: measured, mean and deviation of the simulated, (3, words)
    failed: int  # simulated trains without moments

    @property
    def hopeless(self) -> bool:
        """Whether continuing the search from here is pointless."""
        return self.distance > HOPELESS and self.p_value <= LEAST_P


def judged(problem: Problem, psi: np.ndarray) -> Judgement | None:
    """Compare the measured train with trains simulated at parameters."""
    return judge(problem, problem.look(np.tile(psi, (JUDGED, 1))))


def judge(problem: Problem, looks: np.ndarray) -> Judgement | None:
    """Compare the measured train with simulated ones.

    Parameters
    ----------
    problem : Problem
        What is measured.
    looks : ndarray, shape (trains, moments)
        `Problem.look` of each simulated train.

    Returns
    -------
    Judgement or None
        None where fewer than two of the trains have moments: there is no scatter to judge by.
    """
    whole = looks[np.isfinite(looks).all(axis=1)]
    if len(whole) < 2:
        return None
    centre, scatter = whole.mean(axis=0), whole.std(axis=0)
    variance = (scatter**2 + 1) / 2
    # A longer train scatters less, but for the error of the mean that it is compared with.
    share = problem.share + 1 / len(whole)
    measured = float(np.mean(centre**2 / variance)) / share
    simulated = _from_others(whole - centre)
    # 1 is what the measured train itself scatters by: periodic trains may hardly scatter at all.
    distance = measured / max(float(np.median(simulated)), 1.0)
    return Judgement(
        distance,
        p_value(measured, simulated, len(looks)),
        _word_shares(problem, centre, scatter),
        len(looks) - len(whole),
    )


def p_value(measured: float, simulated: np.ndarray, trains: int) -> float:
    """Share of all trains, including the measured one, that deviate at least as much as it."""
    return (1 + int(np.sum(simulated >= measured))) / (1 + trains)


def _from_others(off: np.ndarray) -> np.ndarray:
    """Distance of each train from all others.

    Were each among those that it is compared with, it would seem nearer than the measured one.
    """
    others = len(off) - 1
    mean = -off / others  # of the others, as the mean of all is 0
    square = (np.sum(off**2, axis=0) - off**2) / others
    variance = (np.maximum(square - mean**2, 0.0) + 1) / 2
    distance: np.ndarray = np.mean((off - mean) ** 2 / variance, axis=1) / (1 + 1 / others)
    return distance


def _word_shares(problem: Problem, centre: np.ndarray, scatter: np.ndarray) -> np.ndarray:
    words = problem.moments.shares
    measured, scale = problem.measured[:words], problem.scale[:words]
    scale = np.where(np.isfinite(scale), scale, 0.0)
    return np.array([measured, measured + scale * centre[:words], scale * scatter[:words]])
