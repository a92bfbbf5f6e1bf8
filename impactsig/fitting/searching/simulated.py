"""Simulate trains at many parameters in one call, with the measuring chain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...simulation.batches.trains import Impacting, impacts_of_many
from .._machine import oscillator
from ..trains.echoes import Echoes
from ..trains.partition import Train

SETTLING = 60  # periods left out before a simulated train, and up to as many more
CROWDED = 10  # times the impacts of the measured train: more work is not done for one
LEAST_WORK = 1000


@dataclass(frozen=True)
class Beginnings:
    """Initial states on the measured motion."""

    phase: np.ndarray  # of the forcing at an impact [rad]
    approach: np.ndarray  # velocity there


def simulated(
    values: dict[str, Any],
    forcing_frequency: float,
    periods: int,
    impacts: float,
    beginnings: Beginnings,
    rng: np.random.Generator,
    heard: Echoes | None = None,
) -> Train:
    """Trains of oscillators after the measuring chain, with noisy strengths.

    Parameters
    ----------
    values : dict of str to ndarray, shape (n,)
        Parameters of the oscillators and of the chain.
    forcing_frequency : float
    periods : int
    impacts : float
        How many the measured train has in as many periods. An oscillator with so many more that
        no chain could have left so few has an empty train.
    beginnings : Beginnings
    rng : Generator
    heard : Echoes, optional
        Impacts have such ones, and what passes for one is taken out of the train again.
    """
    n = len(values["restitution"])
    which = rng.integers(len(beginnings.phase), size=n)
    away = np.minimum(-values["restitution"] * beginnings.approach[which], 0.0)
    truth = impacts_of_many(
        oscillator(values, forcing_frequency),
        np.column_stack((np.ones(n), away)),
        beginnings.phase[which],
        SETTLING + rng.integers(SETTLING, size=n).astype(float),
        periods,
        int(LEAST_WORK + CROWDED * impacts),
    )
    if heard is None:
        return chained(truth, periods, values, rng)
    train = chained(heard.again(truth, forcing_frequency, rng), periods, values, rng)
    return heard.taken_out(train, forcing_frequency)


def chained(
    truth: Impacting, periods: int, values: dict[str, Any], rng: np.random.Generator
) -> Train:
    """Apply the measuring chain of `impactsig.measure` to trains of so many periods.

    Some impacts are missed, the others moved by the jitter, and spurious ones are added, as strong
    as an impact chosen at random; then the strengths get their noise.
    """
    n = len(truth.starts)
    before = np.diff(truth.starts, append=len(truth.x))
    owner = np.repeat(np.arange(n), before)
    seen = rng.random(len(owner)) >= values["missed"][owner]
    moved = truth.x + values["jitter"][owner] * rng.standard_normal(len(owner))
    false = np.repeat(np.arange(n), rng.poisson(values["spurious"] * before))
    like = truth.starts[false] + (rng.random(len(false)) * before[false]).astype(np.intp)

    x = np.clip(np.concatenate((moved[seen], periods * rng.random(len(false)))), 0, periods)
    owner = np.concatenate((owner[seen], false))
    speed = np.concatenate((truth.approach[seen], truth.approach[like]))
    order = np.argsort(2 * periods * owner + x, kind="stable")
    x, owner, speed = x[order], owner[order], speed[order]

    counts = np.bincount(owner, minlength=n)
    mean = np.bincount(owner, speed, minlength=n) / np.maximum(counts, 1)
    size = np.hypot(speed, (values["strength_floor"] * mean)[owner])
    noise = values["strength_noise"][owner] * size * rng.standard_normal(len(x))
    return Train(
        x, np.maximum(speed + noise, 0.0), owner[1:] == owner[:-1], np.cumsum(counts) - counts
    )
