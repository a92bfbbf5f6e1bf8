"""Result of an estimate: intervals, warnings, and a train simulated with it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..impacts import Impacts
from ..intervals import identify_period
from ..oscillators import Oscillator
from ..simulation import simulate
from ._judging import JUDGED, Judgement
from ._machine import Parameter, as_impacts, oscillator
from .prediction import Posterior
from .result import DECIDED, MISFIT, OscillatorFit
from .searching.narrow import Estimate
from .searching.problem import Problem

CONFIDENCE = 0.95
UNTOLD = {"restitution": 0.5}
"""Half-width of an uninformative interval; of parameters sought by their logarithm, log 5."""
ALONE = (
    "instants alone do not tell a soft stop from a rigid one, for which these values hold: "
    "of a soft one the restitution coefficient can be 0.3 larger, the damping several times"
)


def outcome(
    problem: Problem, impacts: Impacts, used: str | None, estimate: Estimate, verdict: Judgement
) -> OscillatorFit:
    """The fit of a train.

    Parameters
    ----------
    problem : Problem
    impacts : Impacts
        The train that was measured.
    used : str or None
        Its strengths.
    estimate : Estimate
    verdict : Judgement
        On trains simulated there.
    """
    frequency = problem.forcing_frequency
    values = {name: float(value) for name, value in problem.values(estimate.psi).items()}
    names, count = problem.free, len(problem.free)
    intervals = intervals_of(problem, estimate.psi, estimate.covariance)
    machine = oscillator(values, frequency)
    likeliest = max(problem.evidence.values(), default=0.0)
    odds = {kind: one - likeliest for kind, one in problem.evidence.items()}
    undetermined = tuple(name for name in names if not math.isfinite(intervals[name][0]))
    periodic = settles(machine)
    if periodic or undetermined:
        intervals |= dict.fromkeys(names, (-math.inf, math.inf))
    told = used is not None or "stiffness" in names  # whether the stop is rigid
    warnings = warnings_of(undetermined, periodic, told, verdict)
    warnings += warnings_of_stop(problem.machine, odds)
    train = problem.simulate(estimate.psi[None])
    simulated = as_impacts(train, frequency, problem.periods)
    chain = {name: values[name] for name in problem.names[count:]}
    chain["jitter"] /= frequency
    if used is not None:
        chain["strength_floor"] = problem.floor
    spread = {name: intervals[name] for name in problem.names[count:]}
    spread["jitter"] = tuple(np.array(spread["jitter"]) / frequency)
    return OscillatorFit(
        {name: values[name] for name in (*problem.known, *names)},
        {name: intervals[name] for name in names},
        names,
        estimate.covariance[:count, :count],
        tuple(problem.kind(name).logarithmic for name in names),
        chain,
        spread,
        1 / frequency,
        machine,
        used,
        estimate.explained,
        verdict.distance,
        verdict.p_value,
        verdict.shares,
        impacts,
        simulated,
        problem.evaluations,
        warnings,
        problem.machine,
        odds,
        Posterior(
            estimate.psi, estimate.covariance, problem.box, problem.names,
            {"strength_noise": 0.0, "strength_floor": problem.floor} | problem.known, frequency,
            problem.periods, problem.share * len(problem.train.x), problem.beginnings,
            problem.heard,
        ),
    )  # fmt: skip


def intervals_of(
    problem: Any, psi: np.ndarray, covariance: np.ndarray
) -> dict[str, tuple[float, float]]:
    """Those of everything that is sought; from -inf to inf where it is not determined."""
    deviations = np.sqrt(np.diag(covariance))
    return {
        name: interval_of(name, problem.kind(name), float(centre), float(deviation))
        for name, centre, deviation in zip(problem.names, psi, deviations, strict=True)
    }


def interval_of(name: str, kind: Parameter, centre: float, deviation: float) -> tuple[float, float]:
    """That of one parameter, whose centre and deviation are on the scale of the search."""
    from scipy.special import ndtri

    reach = float(ndtri(0.5 + CONFIDENCE / 2)) * deviation
    if reach > UNTOLD.get(name, math.log(5)):
        return -math.inf, math.inf
    low, high = (float(kind.value(centre + off)) for off in (-reach, reach))
    if not kind.logarithmic:  # shares
        low, high = max(low, 0.0), min(high, 1.0)
    return low, high


def warnings_of(
    undetermined: tuple[str, ...], settles: bool, told: bool, verdict: Judgement
) -> tuple[str, ...]:
    """What to know before the numbers are used."""
    found = []
    if undetermined:
        found = [not_determined(undetermined)]
    if settles:
        found = [
            "the oscillator found moves periodically: one period cannot tell its parameters, "
            "and no interval is given"
        ]
    if verdict.failed:
        found.append(
            f"{verdict.failed} of {JUDGED} simulated trains have too few impacts to compare, or "
            "far too many; the p-value takes them for unlike the measured one"
        )
    if not told:
        found.append(ALONE)
    if verdict.p_value <= MISFIT:
        found.append(
            "misfit: the measured train is farther from the simulated ones than most of these are "
            "from each other, and the oscillator found does not explain it. A second stop, "
            "friction or a wrong known value is likelier, and the intervals need not hold"
        )
    return tuple(found)


def warnings_of_stop(kind: str, log_odds: dict[str, float]) -> tuple[str, ...]:
    """What the orbits say of the stop, if they do not say that it is of the kind fitted."""
    for other, odds in log_odds.items():
        ahead = odds - log_odds[kind]
        if other != kind and ahead >= DECIDED:
            return (
                f"misfit: an oscillator with a {other} stop explains these impacts far better (log "
                f"odds {ahead:.0f}), and the intervals need not hold. Name both kinds, as "
                'kinds=("rigid", "soft"), and the likelier one is fitted',
            )
        if other != kind and ahead > -DECIDED:
            return (
                f"the stop is not told: an oscillator with a {other} one explains these impacts as "
                f"well (log odds {ahead:.0f}), with other values",
            )
    return ()


def not_determined(names: tuple[str, ...]) -> str:
    """The warning where parameters are not determined."""
    # The less of the energy the damping takes, the more the stop must take, and so on.
    named = " and the ".join(name.replace("_", " ") for name in names)
    return (
        f"these impacts do not tell the {named}: another value, with others of the parameters "
        "that are free beside it, explains them as well, and no interval is given. Strengths, "
        "or a `scene` with a value measured otherwise, tell more"
    )


def settles(machine: Oscillator) -> bool:
    """Whether the oscillator's impacts recur, without any measuring chain."""
    impacts = simulate(machine, periods=400, transient=600).impacts
    assert impacts is not None
    assert machine.forcing_period is not None
    if len(impacts) < 20:
        return True
    return identify_period(impacts, machine.forcing_period).recurs
