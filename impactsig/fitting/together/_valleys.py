"""Other minima in which the parameters of single trains may lie."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..orbits.followed import Followed, Seen
from ._steps import AMPLITUDE, PHASE, Layout, stepped

ELSEWHERE = (-0.12, -0.05, -0.02, 0.02, 0.05, 0.12)
"""Of the logarithm of an amplitude: where other valleys are looked for."""
BETTER = 5.0  # logarithm of the likelihood, by which another minimum must be better
DRAWS = 3  # courses of a train on either side, the best of which are compared
SIDE = 50.0  # logarithm of the likelihood, by which the other side must be better


def elsewhere(
    layout: Layout,
    theta: np.ndarray,
    seen: list[Seen],
    box: tuple[np.ndarray, np.ndarray],
    seeds: list[int],
    propose: Callable[[int, np.ndarray], list[np.ndarray]],
) -> np.ndarray:
    """Try each train at other amplitudes, and move it where the likelihood is better."""
    if AMPLITUDE not in layout.own:
        return theta
    theta, single = theta.copy(), Layout((), layout.own, 1)
    usual = float(np.median([one.chain.jitter for one in seen]))
    for k, one in enumerate(seen):
        # In a wrong minimum the estimated jitter is greater, and all minima would seem equal.
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


def turned_trains(
    layout: Layout,
    theta: np.ndarray,
    seen: list[Seen],
    box: tuple[np.ndarray, np.ndarray],
    rng: np.random.Generator,
) -> tuple[np.ndarray, bool]:
    """Trains of a machine with two stops as seen from the other stop, where that is likelier.

    The instants of alternating impacts do not show which stop each is on: half a forcing period
    later the other side looks the same. A train on the wrong side biases the shared parameters.
    Likelihoods of courses differ by hundreds between draws of their states, so the best of several
    draws is used for each side.
    """
    theta, single, any_turned = theta.copy(), Layout((), layout.own, 1), False
    usual = float(np.median([one.chain.jitter for one in seen]))
    seeds = rng.integers(2**32, size=DRAWS).tolist()
    for k, one in enumerate(seen):
        one = one.shown(min(one.chain.jitter, usual))
        own, turned = (box[0][k], box[1][k]), theta[k].copy()
        turned[PHASE] += math.pi
        here, there = (
            min((_alone(single, side, one, own, seed, np.inf) for seed in seeds), key=_first)
            for side in (theta[k], turned)
        )
        if there[0] < here[0] - SIDE:
            theta[k], any_turned = there[1], True
    return theta, any_turned


def _first(pair: tuple[float, np.ndarray]) -> float:
    return pair[0]


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
    moved, (orbit,), (laid,) = stepped(single, theta[None], [begun], box)
    assert orbit is not None
    assert laid is not None
    return laid.loss + orbit.cost, moved[0]
