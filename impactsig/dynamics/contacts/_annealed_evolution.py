"""Differential evolution with self-adapting members and Metropolis acceptance.

A trial that is worse by D replaces its parent with probability ``exp(-D / T)``; the temperature T
falls from the spread of the first generation by a constant factor a generation. So the population
leaves a hollow early and settles late. The best point met is kept beside the population.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

REDRAWN = 0.1  # share of the members that draw a new step and crossover a generation
COOLING = 0.5
MEMBERS = 5  # for each parameter


@dataclass(frozen=True)
class Minimum:
    """The best point found, and the cost of finding it."""

    x: np.ndarray
    value: float
    course: np.ndarray  # value of the best so far, after each generation
    evaluations: int
    converged: bool


def minimise(
    objective: Callable[[np.ndarray], float],
    low: np.ndarray,
    high: np.ndarray,
    rng: np.random.Generator,
    tolerance: float,
    most: int,
) -> Minimum:
    """Minimise over a box, until all members agree in value to a relative tolerance."""
    size, count = len(low), MEMBERS * len(low)
    members = low + (high - low) * rng.random((count, size))
    values = np.array([objective(x) for x in members])
    winner, course = members[values.argmin()].copy(), [float(values.min())]
    steps, crossovers = np.full(count, 0.5), np.full(count, 0.9)
    evaluations, heat, converged = count, float(np.std(values)), False
    while evaluations + count <= most and not converged:
        trial_steps = np.where(rng.random(count) < REDRAWN, rng.uniform(0.1, 1, count), steps)
        trial_crossovers = np.where(rng.random(count) < REDRAWN, rng.random(count), crossovers)
        luck, best = rng.random(count), course[-1]
        for i in range(count):
            others = rng.choice(count - 1, 2, replace=False)
            one, other = members[others + (others >= i)]
            step = trial_steps[i] * (winner - members[i] + one - other)
            mixed = rng.random(size) < trial_crossovers[i]
            mixed[rng.integers(size)] = True
            # Beyond the box means its edge, so that an optimum there is found too.
            trial = np.clip(members[i] + np.where(mixed, step, 0.0), low, high)
            value = objective(trial)
            worse = value - values[i]
            if worse <= 0 or luck[i] < np.exp(-worse / max(heat, 1e-300)):
                members[i], values[i] = trial, value
                steps[i], crossovers[i] = trial_steps[i], trial_crossovers[i]
            if value < best:
                winner, best = trial, value
        evaluations += count
        heat *= COOLING
        converged = bool(np.ptp(values) <= tolerance * abs(best))
        course.append(best)
    return Minimum(winner, course[-1], np.array(course), evaluations, converged)
