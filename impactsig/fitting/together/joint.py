"""Fit of one oscillator to several trains of impacts, each with its own forcing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..._arguments import entries, instance
from ...errors import InvalidInput
from ...impacts import Impacts
from ...intervals import identify_period
from ...intervals.forcing import keeps_phase
from .._asked import observed, refuse_unlocked
from .._judging import judged
from .._machine import EXTRA, KINDS, PARAMETERS, PLACES, as_train, sought_of
from .._outcome import outcome
from ..machine import Aside, MachineFit, machine_of_runs
from ..orbits.followed import BEGUN, Followed, Seen
from ..result import OscillatorFit
from ..searching.narrow import Estimate
from ..searching.problem import Problem
from ..searching.simulated import Beginnings
from ..trains.balance import TURN
from ..trains.echoes import Echoes, echoes, without
from ..trains.partition import Train
from ._beginnings import amplitudes_like, balanced, simulated_like
from ._steps import AMPLITUDE, PHASE, WIDEST, Layout
from ._together import Joint, nearest, together

FEWEST = 100
"""Impacts of a train, below which its words cannot be compared."""
NEAR = 0.1
"""Logarithm of the evidence by the number of impacts, within which another kind is tried again,
and beyond which it is given up before its last rounds, beyond twice as much after the first."""
NESTED = {"rigid", "soft"}  # one of which is a limit of the other
LEAST_SECOND = 0.02  # share of the impacts on a second stop, below which it has none
AGAIN = 2  # times that the search restarts if the trains contradict each other
COUNTED = 10
"""Simulated trains in which impacts mistaken for echoes are counted."""
SPEED = 0.3
"""Approach velocity if no orbit determines it."""


class Candidate(NamedTuple):
    """A kind of machine, at the parameters found for it."""

    kind: str
    problems: list[Problem]
    layout: Layout
    joint: Joint
    evidence: float  # logarithm
    first: float  # score of the first round


def telling(trains: Sequence[Any], periods: Any) -> tuple[list[Impacts], list[float], Aside]:
    """Impacts and forcing frequencies of the usable trains, and which were set aside."""
    required = "Impacts, one or many"
    given = entries("impacts", trains, required)
    trains = [instance("impacts", one, Impacts, required) for one in given]
    if len(trains) < 2:
        raise InvalidInput(
            "impacts", f"{len(trains)} trains", "two or more", "Give a single one by itself"
        )
    if np.shape(periods) != (len(trains),):
        raise InvalidInput(
            "forcing_period", periods, f"a number of seconds for each of {len(trains)} trains"
        )
    kept, frequencies, periodic, unlocked = [], [], [], []
    for k, (train, period) in enumerate(zip(trains, periods, strict=True)):
        impacts, frequency = observed(train, period, FEWEST)
        if identify_period(impacts, 1 / frequency).recurs:
            periodic.append(k)
            continue
        if not keeps_phase(impacts.time, 1 / float(period)):
            unlocked.append(k)
            continue
        kept.append(impacts)
        frequencies.append(frequency)
    if len(kept) < 2:
        for k in unlocked:
            refuse_unlocked(trains[k], 1 / float(periods[k]))
        raise InvalidInput(
            "impacts", f"{len(trains)} trains, {len(periodic)} of them periodic",
            "two or more that are not",
            "Recurring intervals determine too little; measure where the motion is chaotic",
        )  # fmt: skip
    return kept, frequencies, Aside(tuple(periodic), tuple(unlocked))


class Asked(NamedTuple):
    """What is to be fitted, and how."""

    names: tuple[str, ...]  # free parameters
    known: dict[str, float]
    limits: dict[str, tuple[float, float]]
    common: bool  # whether the amplitude is the same in all
    kinds: tuple[str, ...]
    rng: dict[str, np.random.Generator]  # of each kind, so that none changes another


def fit_trains(
    trains: list[Impacts], frequencies: list[float], aside: Aside, asked: Asked
) -> MachineFit:
    """Fit each kind of machine to all trains, and describe the likeliest."""
    if min(asked.known.get("damping", 1.0), asked.known.get("amplitude", 1.0)) <= 0:
        raise InvalidInput(
            "free", asked.names, "a known damping and amplitude above 0, or free ones"
        )
    measured = [
        as_train(one, frequency, None) for one, frequency in zip(trains, frequencies, strict=True)
    ]
    heard = echoes(measured, frequencies) if "echo" in asked.kinds else None
    found: dict[str, Candidate] = {}
    for kind in asked.kinds:
        if kind == "echo" and heard is None:
            continue
        better = _likeliest(found) if found else None
        try:
            mine = _candidate(kind, measured, frequencies, asked, heard, None, better)
        except InvalidInput:  # what one kind leaves of a train cannot be read: it is not that one
            if len(asked.kinds) == 1:
                raise
            continue
        if mine is not None:
            found[kind] = mine
    if not found:
        raise InvalidInput(
            "impacts", f"{len(trains)} trains",
            f"those of one oscillator: {', '.join(asked.kinds)}",
            "No orbit follows most of them. Check the forcing periods and the parameters that are "
            "not free; name other `kinds`; friction cannot be fitted",
        )  # fmt: skip
    best = _likeliest(found)
    near = NEAR * sum(len(train.x) for train in measured)
    for kind, one in list(found.items()):  # where it is close, both begin where one ended
        if {kind, best.kind} == NESTED and best.evidence - one.evidence < near:
            mine = _candidate(kind, measured, frequencies, asked, heard, best, None)
            if mine is not None and mine.evidence > one.evidence:
                found[kind] = mine
    best = _likeliest(found)
    for _ in range(AGAIN):
        if not best.joint.contradicts:
            break
        mine = _candidate(best.kind, measured, frequencies, asked, heard, None, None)
        if mine is not None and (not mine.joint.contradicts or mine.evidence > best.evidence):
            found[best.kind] = best = mine
    joint = best.joint
    if best.kind == "echo":
        assert heard is not None
        trains = [one[~echo] for one, echo in zip(trains, heard.which, strict=True)]
    else:
        heard = None
    runs = tuple(
        _run(problem, impacts, k, best.layout, joint, heard)
        for k, (problem, impacts) in enumerate(zip(best.problems, trains, strict=True))
    )
    odds = {
        kind: found[kind].evidence - best.evidence if kind in found else -math.inf
        for kind in asked.kinds
    }
    return machine_of_runs(
        runs, _shared(best.problems[0].free, asked.common), joint.widening * joint.covariance,
        aside, best.kind, odds, heard, joint.agreement,
    )  # fmt: skip


def _likeliest(found: dict[str, Candidate]) -> Candidate:
    return max(found.values(), key=lambda one: one.evidence)


def _candidate(
    kind: str,
    trains: list[Train],
    frequencies: list[float],
    asked: Asked,
    heard: Echoes | None,
    close: Candidate | None,
    better: Candidate | None,
) -> Candidate | None:
    """A kind of machine fitted to all trains; None where no orbit of it follows most of them.

    Parameters
    ----------
    heard : Echoes or None
        Those that the kind "echo" is without.
    close : Candidate or None
        Of another kind, where this one begins; unless given it is sought anywhere.
    better : Candidate or None
        Of another kind: what is far worse is not refined.
    """
    extra, rng = KINDS[kind], asked.rng[kind]
    names, limits = sought_of(kind, asked.names, asked.limits)
    default = PARAMETERS["amplitude"]
    if limits.get("amplitude") == (default.low, default.high):  # well above resonance it takes more
        ratio = max(frequencies) / asked.known["natural_frequency"]
        limits["amplitude"] = default.low, default.high * max(1.0, ratio**2)
    apart = 0.0  # score of the instants that its orbits have not to follow
    if kind == "echo" and heard is not None:
        trains = [without(train, echo) for train, echo in zip(trains, heard.which, strict=True)]
        apart = sum(heard.cost(k, frequency) for k, frequency in enumerate(frequencies))
    problems = [
        Problem(names, asked.known, limits, frequency, train, rng)
        for train, frequency in zip(trains, frequencies, strict=True)
    ]
    seen = [
        Seen(one.forcing_frequency, one.train.x, one.train.joined, kind, BEGUN) for one in problems
    ]
    box, count = _box(problems), len(trains)
    if close is not None:
        begun = [close.joint.theta.copy()]
        if extra is not None and KINDS[close.kind] != extra:
            begun[0][:, PLACES[extra]] = math.log(EXTRA[extra].high)
    else:
        begun = simulated_like(problems, kind, rng)
        if extra is None:
            begun += balanced(problems)
    layout = _layout(names, False, count)

    def propose(k: int, theta: np.ndarray) -> list[np.ndarray]:
        return amplitudes_like(problems[k], kind, theta, rng)

    first = nearest(layout, begun, seen, box, rng)
    if first is None:
        return None
    near = NEAR * sum(len(train.x) for train in trains)
    if kind == "soft":  # comes into its own in the last rounds only
        better = None
    begin = first.score + apart
    if better is not None and begin > better.first + 2 * near:
        return Candidate(kind, problems, layout, first, -math.inf, begin)
    enough = near - apart - (-math.inf if better is None else better.evidence)
    joint = together(layout, first.theta, seen, box, rng, propose, enough)
    # Each by itself first: tied, one in a wrong minimum holds back all.
    if asked.common and joint is not None:
        layout = _layout(names, True, count)
        theta = joint.theta.copy()
        theta[:, AMPLITUDE] = np.median(theta[:, AMPLITUDE])
        joint = together(layout, theta, joint.seen, box, rng, propose, enough)
    if joint is None or (kind == "two-sided" and _second(joint) < LEAST_SECOND):
        return None
    if kind == "two-sided" and "amplitude" in names:
        joint = mirrored(layout, joint)
    score = joint.score + apart
    spread = np.linalg.slogdet(joint.covariance)[1] - 2 * np.log(WIDEST[layout.kinds]).sum()
    return Candidate(kind, problems, layout, joint, spread / 2 - score, begin)


def _second(joint: Joint) -> float:
    """Fraction of the impacts on the second stop, or on the first if these are fewer."""
    sides = np.concatenate([one.side for one in joint.orbits if one is not None])
    share = float(np.mean(sides < 0))
    return min(share, 1 - share)


def mirrored(layout: Layout, joint: Joint) -> Joint:
    """The same machine seen from its nearer stop, whose distance is the unit of length."""
    place = PLACES["second_gap"]
    by = float(joint.theta[0, place])
    if by >= 0:
        return joint
    theta = joint.theta.copy()
    theta[:, place] = -by
    theta[:, AMPLITUDE] -= by
    theta[:, PHASE] += math.pi
    kinds = layout.kinds
    turned = np.eye(len(kinds))
    gap = int(np.flatnonzero(kinds == place)[0])
    turned[kinds == AMPLITUDE, gap] = turned[gap, gap] = -1
    orbits = [
        None if one is None else replace(one, side=-one.side, node=one.node * [1.0, math.exp(-by)])
        for one in joint.orbits
    ]
    covariance = turned @ joint.covariance @ turned.T
    return joint._replace(theta=theta, orbits=orbits, covariance=covariance)


def _shared(names: tuple[str, ...], common: bool) -> tuple[str, ...]:
    return tuple(name for name in names if common or name != "amplitude")


def _layout(names: tuple[str, ...], common: bool, trains: int) -> Layout:
    shared = tuple(PLACES[name] for name in _shared(names, common))
    own = () if common or "amplitude" not in names else (AMPLITUDE,)
    return Layout(shared, (*own, PHASE), trains)


def _box(problems: list[Problem]) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest of the parameters of each train."""
    shape = len(problems), max(PLACES.values()) + 1
    low, high = np.full(shape, -np.inf), np.full(shape, np.inf)
    for name, bounds in problems[0].bounds.items():
        kind, place = problems[0].kind(name), PLACES[name]
        low[:, place], high[:, place] = (kind.scale(one) for one in bounds)
    by = np.log([problem.forcing_frequency for problem in problems])
    low[:, PHASE - 1] -= by
    high[:, PHASE - 1] -= by
    return low, high


def _run(
    problem: Problem, impacts: Impacts, k: int, layout: Layout, joint: Joint, heard: Echoes | None
) -> OscillatorFit:
    """One train beside the oscillator that all share."""
    theta, seen = joint.theta[k], joint.seen[k]
    names, count = problem.free, len(seen.x)
    scaled = theta.copy()
    scaled[PHASE - 1] += math.log(problem.forcing_frequency)
    orbit, jitter = joint.orbits[k], seen.chain.jitter
    missed, spurious = (0.0, 0.0) if orbit is None else orbit.shares
    problem.beginnings = _states(orbit, seen, theta)
    own = [scaled[PLACES[name]] for name in names]
    psi = np.clip([*own, math.log(jitter), missed, spurious], *problem.box)
    if heard is not None:
        psi[-2:] = missed, spurious = _without_echoes(problem, heard, psi)
        problem.heard = heard
    place = layout.of(k)[[list(layout.sought).index(PLACES[name]) for name in names]]
    variance = [1 / (2 * count), *(max(one, 1 / count) / count for one in (missed, spurious))]
    covariance = np.diag([*np.zeros(len(names)), *variance])
    covariance[: len(names), : len(names)] = joint.covariance[np.ix_(place, place)]
    followed = 0.0 if orbit is None else float(orbit.led.sum() / max(seen.joined.sum(), 1))
    verdict = judged(problem, psi, covariance)
    covariance[: len(names), : len(names)] *= joint.widening
    return outcome(problem, impacts, None, Estimate(psi, covariance, followed), verdict)


def _without_echoes(problem: Problem, heard: Echoes, psi: np.ndarray) -> tuple[float, float]:
    """Shares of missed and of false impacts, less those that taking echoes out has made.

    An impact at an echo's distance from another is taken out too, and an echo is left whose own
    impact was missed. The fraction of false ones is that of all instants, including echoes.
    """
    missed, spurious = psi[-2:]
    train = problem.simulate(np.tile(psi, (COUNTED, 1)))
    left = heard.taken_out(train, problem.forcing_frequency)
    taken = 1 - len(left.x) / max(len(train.x), 1)
    missed = max(missed - (1 - heard.share) * taken, 0.0)
    return missed, max(spurious - heard.share * missed, 0.0) / (1 + heard.share)


def _states(orbit: Followed | None, seen: Seen, theta: np.ndarray) -> Beginnings:
    if orbit is None:
        return Beginnings(theta[PHASE] + TURN * seen.x, np.full(len(seen.x), SPEED))
    hard = (orbit.node[:, 1] > 0) & (orbit.side > 0)
    return Beginnings(theta[PHASE] + TURN * orbit.node[hard, 0], orbit.node[hard, 1])
