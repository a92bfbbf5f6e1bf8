"""Starting points of the search for the oscillator of many trains.

For one rigid stop the balance of three impacts gives them (`balance`). It does not hold for a soft
stop, nor if it is unknown which of two stops an impact was on. Then machines are simulated:
restitution coefficient, damping and the parameters of that kind are drawn, amplitudes are tried for
each train, and those are kept whose pairs of successive intervals lie where the measured ones do.
The draws narrow about the best, round by round.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...simulation.batches.trains import Impacting, impacts_of_many
from .._machine import EXTRA, KINDS, LEAST_RESTITUTION, PARAMETERS, PLACES, oscillator
from ..searching.problem import Problem
from ..trains.balance import TURN, Courses, Values, courses, forcings
from ..trains.partition import mean_phases
from ._like_kernels import CAP, distances
from ._steps import AMPLITUDE, PHASE

LED = 6
"""Dampings at which the restitution coefficient that the balance leads to is a beginning."""
LEAST_WORDS, MOST_WORDS, PARTS = 4, 15, 30
"""In a mean course: a share of the impacts, within bounds."""
GRID = 18, 10
"""Restitution coefficients and dampings at which the balance of the mean courses is asked."""
LEAST_DAMPING = 5e-3
FIRST, DRAWN = 128, 48  # machines of the first round, and of another
WIDE, NARROW = 12, 8  # amplitudes of each train, there
FINE, AGAIN = 60, 3  # amplitudes of one train alone, and how many are returned
ROUNDS, KEPT, NARROWER = 4, 6, 0.5
REACH = math.log(4.0)  # of the amplitudes about that at which the forced motion just touches
LEAST = {"restitution": LEAST_RESTITUTION, "damping": LEAST_DAMPING}
SETTLING, LASTING, CROWDED = 15, 30, 10  # periods simulated, and impacts of one
FASTEST = 1.5  # approach velocity at first
PAIRS = 200  # of intervals that are compared
SHIFTS, REPEATED = 64, 4  # phases tried, and runs for it


def balanced(problems: list[Problem]) -> Iterator[np.ndarray]:
    """Where the balance of the mean courses of all trains leads, the nearest first."""
    known, limits = problems[0].known, problems[0].bounds

    def grid(name: str, count: int, least: float) -> np.ndarray:
        if name not in limits:
            return np.array([known[name]])
        low, high = limits[name]
        kind, low = PARAMETERS[name], max(low, min(least, high / 2))
        share = (np.arange(count) + 0.5) / count
        value: np.ndarray = kind.value(
            kind.scale(low) + share * (kind.scale(high) - kind.scale(low))
        )
        return value

    pairs = np.meshgrid(grid("restitution", GRID[0], 0.0), grid("damping", GRID[1], LEAST_DAMPING))
    restitution, damping = (side.ravel() for side in pairs)
    total, found = np.zeros(len(restitution)), []
    for problem in problems:
        ratio = problem.forcing_frequency / known["natural_frequency"]
        values = Values(restitution, damping, None, ratio, None)
        off, amplitude, phase = forcings(values, _courses(problem))
        total += np.log(off)
        found.append((amplitude, phase - TURN * mean_phases(problem.train)[0], ratio))
    for _ in range(LED):
        best = int(np.argmin(total))
        if not np.isfinite(total[best]):
            return
        theta = np.array([
            (restitution[best], math.log(damping[best]), math.log(amplitude[best]),
             -math.log(ratio), phase[best], 0.0)
            for amplitude, phase, ratio in found
        ])  # fmt: skip
        if "amplitude" in known:
            theta[:, AMPLITUDE] = math.log(known["amplitude"])
        yield theta
        total[damping == damping[best]] = np.inf


def _courses(problem: Problem) -> Courses:
    """Of fewer words than of long trains: with little jitter a mean of a few will do."""
    fewest = max(LEAST_WORDS, min(MOST_WORDS, len(problem.train.x) // PARTS))
    return courses(problem.train, problem.moments.partition, fewest)


def simulated_like(
    problems: list[Problem], kind: str, rng: np.random.Generator
) -> list[np.ndarray]:
    """Parameters at which simulated trains are like all measured ones, the nearest first."""
    extra, known = KINDS[kind], problems[0].known
    names = ("restitution", "damping") if extra is None else ("restitution", "damping", extra)
    box = np.array([_box(problems[0], name) for name in names])
    spread = (box[:, 1] - box[:, 0]) / 3
    drawn = box[:, 0] + (box[:, 1] - box[:, 0]) * rng.random((FIRST, len(names)))
    middle = np.array([_touching(problem, drawn[:, 1]) for problem in problems]).T + REACH / 2
    width, count = (0.0, 1) if "amplitude" in known else (REACH, WIDE)
    kept: list[tuple[float, np.ndarray, np.ndarray]] = []
    for _ in range(ROUNDS):
        off, best = np.zeros(len(drawn)), middle.copy()
        for k, problem in enumerate(problems):
            tried = middle[:, k, None] + width * np.linspace(-1, 1, count)
            apart = _apart(problem, names, drawn, tried, rng)
            place = np.argmin(apart, axis=1)
            off += np.take_along_axis(apart, place[:, None], 1)[:, 0]
            best[:, k] = np.take_along_axis(tried, place[:, None], 1)[:, 0]
        kept = sorted([*kept, *zip(off, drawn, best, strict=True)], key=lambda one: one[0])[:KEPT]
        parent = [kept[k] for k in rng.integers(len(kept), size=DRAWN)]
        moved = np.array([one[1] for one in parent])
        drawn = np.clip(moved + spread * rng.standard_normal(moved.shape), *box.T)
        middle = np.array([one[2] for one in parent])
        spread, width = NARROWER * spread, NARROWER * min(width, REACH / 2)
        count = min(count, NARROW)
    found = []
    for _, own, log_amplitude in kept:
        theta = np.zeros((len(problems), max(PLACES.values()) + 1))
        theta[:, [PLACES[name] for name in names]], theta[:, AMPLITUDE] = own, log_amplitude
        for k, problem in enumerate(problems):
            theta[k, 3] = math.log(known["natural_frequency"] / problem.forcing_frequency)
            theta[k, PHASE] = _phase(problem, names, own, log_amplitude[k], rng)
        found.append(theta)
    return found


def amplitudes_like(
    problem: Problem, kind: str, theta: np.ndarray, rng: np.random.Generator
) -> list[np.ndarray]:
    """Other amplitudes of one train, and phases, at which trains simulated are like it."""
    if "amplitude" in problem.known:
        return []
    extra = KINDS[kind]
    names = ("restitution", "damping") if extra is None else ("restitution", "damping", extra)
    own = theta[[PLACES[name] for name in names]]
    middle = _touching(problem, own[None, 1])[0] + REACH / 2
    tried = middle + REACH * np.linspace(-1, 1, FINE)
    apart = _apart(problem, names, own[None], tried[None], rng)[0]
    found = []
    for _ in range(AGAIN):
        best = int(np.argmin(apart))
        one = theta.copy()
        one[AMPLITUDE] = tried[best]
        one[PHASE] = _phase(problem, names, own, tried[best], rng)
        found.append(one)
        apart[max(best - 1, 0) : best + 2] = np.inf
    return found


def _box(problem: Problem, name: str) -> tuple[float, float]:
    """Where a parameter is sought, on the scale of the search."""
    kind = (PARAMETERS | EXTRA)[name]
    low, high = problem.bounds.get(name, (problem.known.get(name, 0.0),) * 2)
    low = max(low, min(LEAST.get(name, 0.0), high))
    return kind.scale(low), kind.scale(high)


def _touching(problem: Problem, log_damping: np.ndarray) -> np.ndarray:
    """Logarithm of the amplitude at which the forced motion just reaches the first stop."""
    if "amplitude" in problem.known:
        return np.full(len(log_damping), math.log(problem.known["amplitude"]) - REACH / 2)
    omega = problem.forcing_frequency / problem.known["natural_frequency"]
    touching: np.ndarray = np.log(np.abs(1 - omega**2 + 2j * omega * np.exp(log_damping)))
    return touching


def _simulated(
    problem: Problem, names: tuple[str, ...], drawn: np.ndarray, tried: np.ndarray,
    rng: np.random.Generator,
) -> Impacting:  # fmt: skip
    """Impacts of each machine drawn, at each amplitude tried of it, of random beginnings."""
    count, n = tried.shape[1], tried.size
    values = {
        name: np.repeat((PARAMETERS | EXTRA)[name].value(one), count)
        for name, one in zip(names, drawn.T, strict=True)
    }
    values["amplitude"] = np.exp(tried.ravel())
    values["natural_frequency"] = np.full(n, problem.known["natural_frequency"])
    away = -values["restitution"] * rng.uniform(0.0, FASTEST, n)
    return impacts_of_many(
        oscillator(values, problem.forcing_frequency), np.column_stack((np.ones(n), away)),
        np.zeros(n), np.full(n, float(SETTLING)), LASTING, CROWDED * LASTING,
    )  # fmt: skip


def _apart(
    problem: Problem, names: tuple[str, ...], drawn: np.ndarray, tried: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:  # fmt: skip
    """How far the intervals of each machine are from the measured ones; shape of `tried`."""
    found = _simulated(problem, names, drawn, tried, rng)
    ends, apart = np.append(found.starts, len(found.x)), np.empty(tried.size)
    distances(_pairs(problem), found.x, ends, apart)
    return apart.reshape(tried.shape)


def _pairs(problem: Problem) -> np.ndarray:
    """Successive intervals that were measured."""
    interval, joined = np.diff(problem.train.x), problem.train.joined
    whole = joined[1:] & joined[:-1]
    return np.column_stack((interval[:-1], interval[1:]))[whole][:PAIRS]


def _phase(
    problem: Problem, names: tuple[str, ...], drawn: np.ndarray, log_amplitude: float,
    rng: np.random.Generator,
) -> float:  # fmt: skip
    """The phase of the forcing at which the impacts of a machine are where the measured are."""
    tried = np.full((1, REPEATED), log_amplitude)
    found = _simulated(problem, names, drawn[None], tried, rng)
    within = np.diff(np.searchsorted(found.starts, np.arange(len(found.x)), side="right")) == 0
    theirs = np.column_stack((found.x[:-1] % 1, np.diff(found.x)))[within]
    ours = np.column_stack((problem.train.x[:-1] % 1, np.diff(problem.train.x)))[:PAIRS]
    if not len(theirs):
        return 0.0
    costs = []
    for shift in np.arange(SHIFTS) / SHIFTS:
        off = ours[:, None, 0] + shift - theirs[None, :, 0]
        square = (off - np.rint(off)) ** 2 + (ours[:, None, 1] - theirs[None, :, 1]) ** 2
        costs.append(np.minimum(square.min(axis=1), CAP**2).sum())
    return TURN * float(np.argmin(costs)) / SHIFTS
