"""Which oscillator many trains of impacts come from, each at a forcing of its own."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from .._arguments import instance
from ..errors import InvalidInput
from ..impacts import Impacts
from ..intervals import identify_period
from ._asked import observed
from ._balance import TURN, Courses, Values, courses, forcings
from ._followed import Followed, Seen
from ._judging import JUDGED, LEAST_P, Judgement, judged
from ._machine import PARAMETERS, as_train
from ._narrow import Estimate
from ._outcome import outcome
from ._partition import mean_phases
from ._path_kernels import Chain
from ._problem import Problem
from ._simulated import Beginnings
from ._together import AMPLITUDE, PHASE, Joint, Layout, nearest, together
from .machine import MachineFit, machine_of_runs
from .result import OscillatorFit

FEWEST = 100
"""Impacts of a train, below which its words cannot be compared."""
BEGUN = Chain(jitter=0.02, missed=0.02, spurious=0.01)
"""What the measuring chain is taken for at first: wide, so that every orbit begins."""
LED, TRIES = 6, 3
"""Dampings at which the restitution coefficient that the balance leads to is asked how much its
courses leave out, and how many of these are beginnings."""
LEAST_WORDS, MOST_WORDS, PARTS = 4, 15, 30
"""In a mean course: a share of the impacts, within bounds."""
SPEED = 0.3
"""Approach velocity where no orbit tells it."""
GRID = 18, 10
"""Restitution coefficients and dampings at which the balance of the mean courses is asked."""
LEAST_DAMPING = 5e-3


def telling(
    trains: Sequence[Any], periods: Any
) -> tuple[list[Impacts], list[float], tuple[int, ...]]:
    """Impacts and forcing frequencies of the trains that tell, and which do not: periodic ones."""
    trains = [instance("impacts", one, Impacts, "Impacts, one or many") for one in trains]
    if len(trains) < 2:
        raise InvalidInput(
            "impacts", f"{len(trains)} trains", "two or more", "Give a single one by itself"
        )
    if np.shape(periods) != (len(trains),):
        raise InvalidInput(
            "forcing_period", periods, f"a number of seconds for each of {len(trains)} trains"
        )
    kept, frequencies, periodic = [], [], []
    for k, (train, period) in enumerate(zip(trains, periods, strict=True)):
        impacts, frequency = observed(train, period, FEWEST)
        if identify_period(impacts, 1 / frequency).recurs:
            periodic.append(k)
            continue
        kept.append(impacts)
        frequencies.append(frequency)
    if len(kept) < 2:
        raise InvalidInput(
            "impacts", f"{len(trains)} trains, {len(periodic)} of them periodic",
            "two or more that are not",
            "Intervals that recur are too few numbers; measure where the motion is chaotic",
        )  # fmt: skip
    return kept, frequencies, tuple(periodic)


def fit_trains(
    trains: list[Impacts],
    frequencies: list[float],
    periodic: tuple[int, ...],
    names: tuple[str, ...],
    known: dict[str, float],
    limits: dict[str, tuple[float, float]],
    common: bool,
    rng: np.random.Generator,
) -> MachineFit:
    """Fit them together; `common` says that the amplitude is the same in all."""
    if min(known.get("damping", 1.0), known.get("amplitude", 1.0)) <= 0:
        raise InvalidInput("free", names, "a known damping and amplitude above 0, or free ones")
    problems = [
        Problem(names, known, limits, frequency, as_train(impacts, frequency, None), rng)
        for impacts, frequency in zip(trains, frequencies, strict=True)
    ]
    seen = [Seen(one.forcing_frequency, one.train.x, one.train.joined, BEGUN) for one in problems]
    box = _box(problems)
    best: MachineFit | None = None
    for theta in nearest(list(_beginnings(problems)), seen, box, rng)[:TRIES]:
        layout = _layout(names, False, len(trains))
        joint = together(layout, theta, seen, box, rng)
        if common and joint is not None:  # each by itself first: tied, one astray holds all
            layout = _layout(names, True, len(trains))
            theta = joint.theta.copy()
            theta[:, AMPLITUDE] = np.median(theta[:, AMPLITUDE])
            joint = together(layout, theta, joint.seen, box, rng)
        if joint is None:
            continue
        runs = tuple(
            _run(problem, impacts, k, layout, joint)
            for k, (problem, impacts) in enumerate(zip(problems, trains, strict=True))
        )
        found = machine_of_runs(runs, _shared(names, common), joint.covariance, periodic)
        if best is None or found.p_value > best.p_value:
            best = found
        if not best.misfit:
            break
    if best is None:
        raise InvalidInput(
            "impacts", f"{len(trains)} trains", "those of one oscillator with one rigid stop",
            "No orbit follows most of them. Check the forcing periods and the parameters that are "
            "not free; a second stop, a soft one, or friction cannot be fitted",
        )  # fmt: skip
    return best


def _shared(names: tuple[str, ...], common: bool) -> tuple[str, ...]:
    return tuple(name for name in names if common or name != "amplitude")


def _layout(names: tuple[str, ...], common: bool, trains: int) -> Layout:
    places = tuple(PARAMETERS)
    shared = tuple(places.index(name) for name in _shared(names, common))
    own = () if common or "amplitude" not in names else (AMPLITUDE,)
    return Layout(shared, (*own, PHASE), trains)


def _box(problems: list[Problem]) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest of the parameters of each train."""
    low, high = (
        np.full((len(problems), PHASE + 1), -np.inf),
        np.full((len(problems), PHASE + 1), np.inf),
    )
    for place, (name, kind) in enumerate(PARAMETERS.items()):
        if name in problems[0].bounds:
            low[:, place], high[:, place] = (kind.scale(one) for one in problems[0].bounds[name])
    by = np.log([problem.forcing_frequency for problem in problems])
    low[:, PHASE - 1] -= by
    high[:, PHASE - 1] -= by
    return low, high


def _beginnings(problems: list[Problem]) -> Iterator[np.ndarray]:
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
             -math.log(ratio), phase[best])
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


def _run(problem: Problem, impacts: Impacts, k: int, layout: Layout, joint: Joint) -> OscillatorFit:
    """One train beside the oscillator that all share."""
    theta, seen = joint.theta[k], joint.seen[k]
    names, places, count = problem.free, tuple(PARAMETERS), len(seen.x)
    scaled = theta[:PHASE].copy()
    scaled[-1] += math.log(problem.forcing_frequency)
    orbit, jitter = joint.orbits[k], seen.chain.jitter
    missed, spurious = (0.0, 0.0) if orbit is None else orbit.shares
    own = [scaled[places.index(name)] for name in names]
    psi = np.clip([*own, math.log(jitter), missed, spurious], *problem.box)
    place = layout.of(k)[[list(layout.sought).index(places.index(name)) for name in names]]
    variance = [1 / (2 * count), *(max(one, 1 / count) / count for one in (missed, spurious))]
    covariance = np.diag([*np.zeros(len(names)), *variance])
    covariance[: len(names), : len(names)] = joint.covariance[np.ix_(place, place)]
    followed = 0.0 if orbit is None else float(orbit.led.sum() / max(seen.joined.sum(), 1))
    problem.beginnings = _states(orbit, seen, theta)
    verdict = judged(problem, psi)
    if verdict is None:
        verdict = Judgement(math.inf, LEAST_P, np.zeros((3, problem.moments.shares)), JUDGED)
    return outcome(problem, impacts, None, Estimate(psi, covariance, followed), verdict)


def _states(orbit: Followed | None, seen: Seen, theta: np.ndarray) -> Beginnings:
    if orbit is None:
        return Beginnings(theta[PHASE] + TURN * seen.x, np.full(len(seen.x), SPEED))
    hard = orbit.node[:, 1] > 0
    return Beginnings(theta[PHASE] + TURN * orbit.node[hard, 0], orbit.node[hard, 1])
