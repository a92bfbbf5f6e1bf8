"""Steps of all parameters of several trains, with fixed courses."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..orbits.followed import Followed, Laid

STEPS = 8
SHARES = (1.0, 0.3, 0.1, 0.03)  # of a step, until one does not raise the loss
AMPLITUDE, PHASE = 2, 4  # places in theta
LONGEST = np.array([0.05, 0.3, 0.05, 0.01, 0.1, 0.2])  # of a step, on the scale of the parameters
WIDEST = np.array([1.0, 2.0, 1.0, 0.3, 2.0, 3.0])  # prior standard deviation of one
GAIN = 0.1  # of the loss, for which another step is made


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


def covariance_of(layout: Layout, laid: list[Laid | None]) -> np.ndarray:
    """Covariance of all parameters sought, in no direction greater than that of the prior.

    The information of a leg about parameters far from its own is not always positive.
    """
    size, vectors = np.linalg.eigh(gathered(layout, laid)[1])
    covariance: np.ndarray = vectors / np.maximum(size, WIDEST.max() ** -2.0) @ vectors.T
    return covariance


def disagreement(layout: Layout, laid: list[Laid | None]) -> tuple[float, int]:
    """How far the trains disagree on what they share: chi squared, and its degrees of freedom.

    Each train alone would move the shared parameters by a step of its own, and if one machine made
    all trains these steps scatter as their covariances say.
    """
    shared, own = np.array(layout.shared, int), np.array(layout.own, int)
    squares, trains = 0.0, 0
    if not layout.shared:
        return squares, trains
    total, information = np.zeros(len(shared)), np.diag(WIDEST[shared] ** -2.0)
    for one in laid:
        if one is None or not math.isfinite(one.loss):
            continue
        across = one.information[np.ix_(shared, own)]
        taken = across @ np.linalg.inv(
            one.information[np.ix_(own, own)] + np.diag(WIDEST[own] ** -2.0)
        )
        pull = one.gradient[shared] - taken @ one.gradient[own]
        told, vectors = np.linalg.eigh(one.information[np.ix_(shared, shared)] - taken @ across.T)
        told = np.maximum(told, 0.0)
        squares += float(((vectors.T @ pull) ** 2 / (told + WIDEST.max() ** -2.0)).sum())
        information += vectors * told @ vectors.T
        total += pull
        trains += 1
    squares -= float(total @ np.linalg.solve(information, total))
    return max(squares, 0.0), len(shared) * max(trains - 1, 0)


def gathered(layout: Layout, laid: list[Laid | None]) -> tuple[np.ndarray, np.ndarray]:
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


def lay(orbits: list[Followed | None], theta: np.ndarray) -> list[Laid | None]:
    """The orbits at other parameters, a row of theta each."""
    return [None if one is None else one.laid(own) for one, own in zip(orbits, theta, strict=True)]


def loss_of(laid: list[Laid | None]) -> float:
    """Half of the objective of all trains."""
    return sum(one.loss for one in laid if one is not None)


def _total(laid: list[Laid | None]) -> float:
    return sum(one.total for one in laid if one is not None)


def stepped(
    layout: Layout,
    theta: np.ndarray,
    orbits: list[Followed | None],
    box: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, list[Followed | None], list[Laid | None]]:
    """Steps by Gauss and Newton, the courses fixed.

    If a whole step increases the loss, for example because the oscillator misses a weak impact
    there, it is shortened. Levenberg's damping would hardly move along the ridge of restitution,
    damping and amplitudes.
    """
    here = lay(orbits, theta)
    for _ in range(STEPS):
        gradient, information = gathered(layout, here)
        loss = _total(here)
        step = -np.linalg.solve(information, gradient)
        step /= max(1.0, float(np.max(np.abs(step) / LONGEST[layout.kinds])))
        for share in SHARES:
            trial = _moved(layout, theta, share * step, box)
            there = lay(orbits, trial)
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
