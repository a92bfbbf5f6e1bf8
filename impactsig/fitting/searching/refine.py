"""From the initial guess to an orbit through all impacts, and the statistics of its fit.

From the balance an orbit is found in five to fifteen steps, even if r is off by 0.3 and the damping
by a factor of five. There may be other minima: the search starts at several dampings, which the
balance does not determine, and the nearest orbit is used.

If the stop may be soft, the fit is started once more from that orbit, with a stop nearly as stiff;
for a soft stop it ends at its stiffness. The likelihoods decide between the two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .._judging import judged
from .._machine import CHAIN, PARAMETERS, sought_of
from ..orbits.orbit import FAINT, QUIET, Approach, Sight, approach, distances, floor_of, follow
from ..orbits.orbit_kernels import OWN, STRENGTH, TURN, Noise
from ..trains.partition import Partition, Sifted, Train
from .narrow import Estimate, beside
from .problem import Problem
from .search import Beginning, begin, chain
from .simulated import Beginnings

PARTS = 2  # of the range of damping, in each of which the search begins
PHASE = 4
PLACES = {name: place for place, name in enumerate(PARAMETERS)} | {"stiffness": OWN}
"""In theta, whose others are the phase and the logarithm of the strength of velocity 1."""
STRENGTH_NOISE = 0.05  # to begin with
STIFF = 1000.0, 100.0
"""By the spring's: where a soft stop is begun, and where again unless a rigid one is likelier."""


@dataclass(frozen=True, eq=False)
class Beside:
    """Statistics of an orbit fitted to a train at fixed parameters, minus those measured.

    By how much the parameters would have to move, the logarithm of both noises, and the share of
    legs that are followed.
    """

    partition: Partition
    theta: np.ndarray
    noise: Noise
    floor: float
    free: np.ndarray
    measured: np.ndarray

    def __call__(self, train: Train) -> np.ndarray:
        """The statistics; NaN if no orbit fits."""
        return self.tell(train) - self.measured

    def tell(self, train: Train) -> np.ndarray:
        """The statistics of a train."""
        sifted = self.partition.sift(train)
        none = np.full(len(self.measured), np.nan)
        if len(sifted.cycle) < len(none):
            return none
        sight = Sight.of(sifted, self.floor)
        orbit = follow(self.theta, self.noise, sight, self.free)
        if not math.isfinite(orbit.loss):
            return none
        # About the mean: phase and scale are not fitted anew.
        strength, off = distances(orbit, sight, math.exp(self.theta[STRENGTH]))
        off[:, 1] /= np.hypot(strength, self.floor)
        noise = np.maximum(off.std(axis=0), QUIET)
        return np.array([*orbit.step[:-2], *np.log(noise), orbit.explained])


def refine(problem: Problem) -> Estimate | None:
    """Estimate from an orbit and from simulated trains; None if no orbit fits."""
    found = orbits(problem)
    if found:
        least = dict.fromkeys(("rigid", "soft"), -math.inf)
        problem.evidence = least | {kind: one.evidence for kind, one in found.items()}
    own = found.get(problem.machine)
    if own is None:
        return None
    best, sight, floor = own
    free = _free(problem.free)
    if floor > FAINT:
        problem.floor = floor
    hard = best.orbit.node[:, 1] > 0
    phase = best.theta[PHASE] + TURN * best.orbit.node[hard, 0]
    problem.beginnings = Beginnings(phase, best.orbit.node[hard, 1])
    told = Beside(
        problem.moments.partition, best.theta, best.noise, floor, free, np.zeros(len(free) + 1)
    )
    told = replace(told, measured=told.tell(problem.train))
    if not np.isfinite(told.measured).all():
        return None
    problem.orbit = told
    centre, covariance = _first(problem, best, len(sight.seen))
    verdict = judged(problem, centre, np.zeros_like(covariance))
    if verdict.compared and verdict.hopeless:  # a misfit, which simulated trains would not change
        return Estimate(centre, covariance, best.orbit.explained)
    estimate = beside(problem, centre, covariance)
    return None if estimate is None else estimate._replace(explained=best.orbit.explained)


class Nearest(NamedTuple):
    """The nearest orbit of a kind of machine."""

    best: Approach
    sight: Sight
    floor: float

    @property
    def evidence(self) -> float:
        """Logarithm of its likelihood, which orbits with other floors can be compared by."""
        return -self.best.orbit.loss - float(np.log(self.sight.seen[:, 2]).sum())


def orbits(problem: Problem) -> dict[str, Nearest]:
    """The nearest orbit of a rigid and of a soft stop; without a kind that has none."""
    sifted = problem.moments.partition.sift(problem.train)
    noise = Noise(math.exp(chain(problem)[0]), STRENGTH_NOISE)
    begun = [(_theta(problem, one), noise) for one in _beginnings(problem)]
    rigid = _nearest(problem, "rigid", sifted, begun)
    if rigid is not None:
        begun = [(rigid.best.theta, rigid.best.noise), *begun]
    soft: Nearest | None = None
    for stiffness in STIFF:
        stiff = [(np.append(theta, math.log(stiffness)), own) for theta, own in begun]
        one = _nearest(problem, "soft", sifted, stiff)
        if one is not None and (soft is None or one.evidence > soft.evidence):
            soft = one
        if soft is not None and rigid is not None and rigid.evidence > soft.evidence:
            break
    if soft is not None and (rigid is None or soft.evidence > rigid.evidence):
        # Of two valleys the rigid orbit may have ended in the farther one.
        again = _nearest(problem, "rigid", sifted, [(soft.best.theta[:OWN], soft.best.noise)])
        if again is not None and (rigid is None or again.evidence > rigid.evidence):
            rigid = again
    found = {"rigid": rigid, "soft": soft}
    return {kind: one for kind, one in found.items() if one is not None}


def _nearest(
    problem: Problem, kind: str, sifted: Sifted, begun: list[tuple[np.ndarray, Noise]]
) -> Nearest | None:
    names = tuple(name for name in problem.free if name in PARAMETERS)
    names, bounds = sought_of(kind, names, {name: problem.bounds[name] for name in names})
    free, box, sight, floor = _free(names), _box(problem, bounds), Sight.of(sifted), FAINT
    found = [approach(np.clip(theta, *box), own, sight, free, box) for theta, own in begun]
    best = min(found, key=lambda one: one.orbit.loss)
    if math.isfinite(best.orbit.loss):
        floor = floor_of(best.orbit, sight, math.exp(best.theta[STRENGTH]))
    if floor > FAINT:
        sight = Sight.of(sifted, floor)
        best = approach(best.theta, best.noise, sight, free, box)
    return Nearest(best, sight, floor) if math.isfinite(best.orbit.loss) else None


def _free(names: tuple[str, ...]) -> np.ndarray:
    return np.array([*(PLACES[name] for name in names), PHASE, STRENGTH])


def _beginnings(problem: Problem) -> list[Beginning]:
    if "damping" not in problem.free:
        return [begin(problem)]
    low, high = (side[problem.free.index("damping")] for side in problem.box)
    edges = np.linspace(low, high, PARTS + 1)
    return [begin(problem, pair) for pair in pairwise(edges)]


def _theta(problem: Problem, beginning: Beginning) -> np.ndarray:
    """The parameters in the form of `orbit`."""
    values = problem.values(beginning.free)
    return np.array([
        values["restitution"],
        math.log(values["damping"]),
        math.log(values["amplitude"]),
        math.log(values["natural_frequency"] / problem.forcing_frequency),
        beginning.phase,
        -math.log(beginning.beginnings.approach.mean()),  # strengths are by their mean
    ])  # fmt: skip


def _box(problem: Problem, bounds: dict[str, tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    size = OWN + ("stiffness" in bounds)
    box = np.full(size, -np.inf), np.full(size, np.inf)
    for name, pair in bounds.items():
        for side, value in zip(box, pair, strict=True):
            side[PLACES[name]] = problem.kind(name).scale(value)
    for side in box:
        side[3] -= math.log(problem.forcing_frequency)
    return box


def _first(problem: Problem, best: Approach, impacts: int) -> tuple[np.ndarray, np.ndarray]:
    """Centre and covariance of the first cloud."""
    count = len(problem.free)
    guess = dict(zip(problem.names[count:], chain(problem), strict=True))
    guess |= {
        "jitter": math.log(best.noise.instant),
        "missed": 1 - best.orbit.explained,
        "strength_noise": best.noise.strength,
    }
    theta = best.theta.copy()
    theta[3] += math.log(problem.forcing_frequency)
    centre = [theta[PLACES[name]] for name in problem.free]
    centre += [guess[name] for name in problem.names[count:]]
    half = np.array([problem.kind(name).half for name in problem.names])
    wide = np.diag(half**2)
    # A difference of large numbers: if hardly determined, it may be negative.
    size, directions = np.linalg.eigh(best.orbit.information)
    information = directions * np.maximum(size, 1e-12 * size[-1]) @ directions.T
    information[:count, :count] += np.diag(half[:count] ** -2.0)
    wide[:count, :count] = np.linalg.inv(information)[:count, :count]
    for place, name in enumerate(CHAIN, count):
        share = max(centre[place], 1 / impacts)
        scatter = {"jitter": 1 / 2, "strength_noise": share**2 / 2}.get(name, share)
        wide[place, place] = min(scatter / impacts, wide[place, place])
    return np.clip(centre, *problem.box), wide
