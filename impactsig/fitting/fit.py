"""Which oscillator a measured train of impacts comes from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from .._arguments import Seed, number, streams
from ..errors import InvalidInput
from ..impacts import INFERRED, Impacts
from ..intervals import identify_period
from ..oscillators import Oscillator
from ..simulate import simulate
from ._asked import (
    free_parameters,
    known_parameters,
    limits_of,
    refined,
    refuse_periodic,
    strengths_of,
    strengths_used,
)
from ._judging import JUDGED, Judgement, judged
from ._machine import as_impacts, as_train, oscillator
from ._narrow import Estimate, narrow
from ._problem import Problem
from ._refine import refine
from ._search import begin, descend
from .prediction import Posterior
from .result import MISFIT, OscillatorFit

FEWEST = 200
"""Impacts below which no fit is tried: words of four intervals come too seldom."""
CONFIDENCE = 0.95
LEAST_P = 1 / (JUDGED + 1)
"""Where all of these are nearer, the search may have gone astray, and it begins anew."""
APART = 100.0
"""Forcing periods an interval, or intervals a period, beyond which the period is a mistake."""

TRIES = 3
"""Searches before it is the latter that is believed."""
ENOUGH = 2
"""Searches that end hopelessly far, after which no other is begun."""
UNTOLD = {"restitution": 0.5}
"""Half-width of an interval that tells nothing; of parameters sought by their logarithm, log 5."""

Strengths = Literal["auto", "impulse", "peak", "approach_velocity"]


def fit_oscillator(
    impacts: Impacts,
    forcing_period: float,
    free: Sequence[str] = ("restitution", "damping", "amplitude"),
    *,
    natural_frequency: float | None = None,
    scene: Oscillator | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    strengths: Strengths | None = "auto",
    seed: Seed = None,
) -> OscillatorFit:
    """Find the impact oscillator that a measured, irregular train of impacts comes from.

    ``x'' + 2 damping x' + x = amplitude cos(omega t)``, x < 1, ``x' -> -restitution x'`` at the
    stop; x in units of the gap, t in 1 / omega_n.

    With strengths, one orbit of the oscillator is laid beside all impacts, by least squares over
    every instant and velocity at once, and the parameters are those at which it lies nearest: the
    fit of a differential equation to chaotic data [Baake1992]_, with a shot for every flight.
    Flights that contradict their neighbours are left out: an impact was missed or is false. Trains
    simulated at the optimum, and measured as the real one was (jitter, missed and spurious impacts,
    noise of the strengths, all estimated with the rest), tell bias and scatter, which is indirect
    inference [Gourieroux1993]_.

    From instants alone no orbit tells much, as jitter is as wide as the attractor. There simulated
    trains are compared with the measured one by moments of the sequence of intervals and of the
    phases; differential evolution [StornPrice1997]_ leads near the optimum, where the moments are
    regressed on the parameters.

    Of 2000 impacts of chaotic motion, each moved by 1 % of the mean interval, 2 % missed and 1 %
    spurious, the standard errors of restitution coefficient, damping and amplitude are about 0.008,
    0.9 % and 0.2 % where strengths are known to 2 %; 0.014, 3 % and 0.4 % at 5 %; and 0.05, 15 %
    and 2 % from instants alone, which hardly tell the damping. A fit
    takes about 10 seconds where strengths are known, 20 where not, and minutes where it has to
    begin anew.

    Parameters
    ----------
    impacts : Impacts
        200 or more, of a motion that is not periodic. Inferred impacts are left out.
    forcing_period : float
        Period of the forcing [s], right to 0.2 %.
    free : sequence of str
        Which parameters to find: of "restitution", "damping", "amplitude", "natural_frequency".
    natural_frequency : float, optional
        Natural frequency [Hz]; where it is free, about which. By default the scene's.
    scene : Oscillator, optional
        What is known of the machine: an oscillator with one harmonic force and one rigid stop, as
        `scenes.karpodinis`. Its parameters stand for those that are not free.
    bounds : dict of str to (float, float), optional
        Least and greatest value of a free parameter; by default 0 to 1 for the restitution
        coefficient, 0.001 to 0.5 for the damping, 0.01 to 10 for the amplitude, and 10 % about the
        natural frequency.
    strengths : {"auto", "impulse", "peak", "approach_velocity"} or None
        What tells how hard each impact was, in proportion to its approach velocity; "auto" takes
        the first of the impulse, the peak and the approach velocity that is there, None uses the
        instants only.
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same result; a Generator is drawn from and moves on.

    Returns
    -------
    OscillatorFit

    Raises
    ------
    InvalidInput
        If there are too few impacts, they are periodic (a few intervals that recur cannot tell
        several parameters), no search ends at an oscillator with as many impacts, or an argument
        is out of its range.

    See Also
    --------
    fit_soft_stop, identify_resonance, simulate, measure

    Notes
    -----
    The forcing must be harmonic and the stop rigid. A machine with stops on both sides cannot be
    fitted, as its impacts do not show which stop they are on: its trains are refused, or the fit
    reports a `misfit`, as it does of soft stops where strengths are known. From instants alone a
    soft stop passes for a rigid one with less restitution and damping, and the fit warns of it.
    Dead time and echoes are not in the chain.

    Examples
    --------
    >>> from impactsig import fit_oscillator, measure, scenes, simulate
    >>> beam = scenes.karpodinis(20.1)
    >>> motion = simulate(beam, periods=400, transient=300)
    >>> train = measure(motion.impacts, jitter=2e-4, seed=1).impacts
    >>> fit = fit_oscillator(train, 1 / 20.1, ["amplitude"], scene=beam)
    >>> round(fit.values["amplitude"], 3)
    0.25
    """
    if not isinstance(impacts, Impacts):
        raise InvalidInput("impacts", impacts, "Impacts", "Of instants make them by from_times")
    frequency = 1 / number("forcing_period", forcing_period, above=0)
    names = free_parameters(free)
    known = known_parameters(names, natural_frequency, scene)
    limits = limits_of(names, known, bounds)
    rng = streams(seed, 1)[0]
    used = strengths_used(impacts, strengths)
    impacts = impacts[(impacts.flags & INFERRED) == 0]
    count = min(len(impacts), len(impacts.intervals()) + 1)
    if count < FEWEST:
        raise InvalidInput(
            "impacts", f"{count} impacts", f"{FEWEST} or more to fit, not cut apart by gaps",
            "2000 make the errors a third",
        )  # fmt: skip
    mean = float(np.mean(impacts.intervals()))
    if not mean / APART < forcing_period < mean * APART:
        raise InvalidInput(
            "forcing_period", forcing_period, f"seconds: the impacts are {mean:.3g} s apart",
            "Of a frequency in hertz give 1 / frequency",
        )  # fmt: skip
    frequency = refined(impacts, frequency)
    refuse_periodic(impacts, frequency)
    return _fit(impacts, frequency, names, known, limits, used, rng)


def _fit(
    impacts: Impacts,
    frequency: float,
    names: tuple[str, ...],
    known: dict[str, float],
    limits: dict[str, tuple[float, float]],
    used: str | None,
    rng: np.random.Generator,
) -> OscillatorFit:
    strength = None if used is None else strengths_of(impacts, used)
    train = as_train(impacts, frequency, strength)
    problem = Problem(names, known, limits, frequency, train, rng)
    tries = []
    for _ in range(TRIES):
        estimate = _estimate(problem)
        if estimate is None:
            continue
        verdict = judged(problem, estimate.psi)
        if verdict is None:
            continue
        state = (problem.floor, problem.beginnings)  # that it is simulated with
        tries.append((verdict, estimate, state))
        hopeless = [one.hopeless for one, *_ in tries]
        if verdict.p_value > LEAST_P or sum(hopeless) == ENOUGH:
            break
    if not tries:
        raise InvalidInput(
            "impacts", f"{len(impacts)} impacts", "those of an oscillator with one rigid stop",
            f"{TRIES} searches ended at oscillators with too few impacts to compare. Check the "
            "parameters that are not free; a second stop, a soft one, or friction cannot be fitted",
        )  # fmt: skip
    verdict, estimate, state = max(tries, key=lambda one: (one[0].p_value, -one[0].distance))
    problem.floor, problem.beginnings = state
    values = {name: float(value) for name, value in problem.values(estimate.psi).items()}
    count = len(names)
    told = _intervals(problem, estimate.psi, estimate.covariance)
    machine = oscillator(values, frequency)
    untold = tuple(name for name in names if not math.isfinite(told[name][0]))
    settles = _settles(machine)
    if settles or untold:
        told |= dict.fromkeys(names, (-math.inf, math.inf))
    warnings = _warnings(untold, settles, used is not None, verdict)
    train = problem.simulate(estimate.psi[None])
    simulated = as_impacts(train, frequency, problem.periods)
    chain = {name: values[name] for name in problem.names[count:]}
    chain["jitter"] /= frequency
    if used is not None:
        chain["strength_floor"] = problem.floor
    spread = {name: told[name] for name in problem.names[count:]}
    spread["jitter"] = tuple(np.array(spread["jitter"]) / frequency)
    return OscillatorFit(
        {name: values[name] for name in (*known, *names)},
        {name: told[name] for name in names},
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
        Posterior(
            estimate.psi, estimate.covariance, problem.box, problem.names,
            {"strength_noise": 0.0, "strength_floor": problem.floor} | problem.known, frequency,
            problem.periods, problem.share * len(problem.train.x), problem.beginnings,
        ),
    )  # fmt: skip


def _estimate(problem: Problem) -> Estimate | None:
    """By an orbit where strengths are known; else, or where none is near, by moments alone.

    None where the trains simulated at the end of the search have too few impacts.
    """
    # A damping or an amplitude that is known to be 0 has no logarithm, by which an orbit is found.
    known = {"damping": 0.5, "amplitude": 1.0} | problem.known
    followed = 0 < known["damping"] <= 0.99 and known["amplitude"] > 0
    if problem.train.strength is not None and followed:
        problem.floor = 0.0
        refined = refine(problem)
        if refined is not None:
            return refined
        problem.floor = 0.0
    beginning = begin(problem)
    problem.beginnings = beginning.beginnings
    return narrow(problem, *descend(problem, beginning.free))


def _intervals(
    problem: Any, psi: np.ndarray, covariance: np.ndarray
) -> dict[str, tuple[float, float]]:
    from scipy.special import ndtri

    half = ndtri(0.5 + CONFIDENCE / 2) * np.sqrt(np.diag(covariance))
    told = {}
    for name, centre, reach in zip(problem.names, psi, half, strict=True):
        kind = problem.kind(name)
        if reach > UNTOLD.get(name, math.log(5)):
            told[name] = (-math.inf, math.inf)
            continue
        low, high = kind.value(centre - reach), kind.value(centre + reach)
        if not kind.logarithmic:  # shares
            low, high = max(low, 0.0), min(high, 1.0)
        told[name] = (low, high)
    return told


def _warnings(
    untold: tuple[str, ...], settles: bool, strengths: bool, verdict: Judgement
) -> tuple[str, ...]:
    found = []
    if untold:
        # The less of the energy the damping takes, the more the stop must take, and so on.
        named = " and the ".join(name.replace("_", " ") for name in untold)
        found = [
            f"these impacts do not tell the {named}: another value, with others of the parameters "
            "that are free beside it, explains them as well, and no interval is given. Strengths, "
            "or a `scene` with a value measured otherwise, tell more"
        ]
    if settles:
        found = [
            "the oscillator found moves periodically: one period cannot tell its parameters, "
            "and no interval is given"
        ]
    if verdict.failed:
        found.append(
            f"{verdict.failed} of {JUDGED} trains simulated at the optimum have too few impacts to "
            "compare, or far too many; the p-value takes them for unlike the measured one"
        )
    if not strengths:
        found.append(
            "instants alone do not tell a soft stop from a rigid one, for which these values hold: "
            "of a soft one the restitution coefficient can be 0.3 larger, the damping several times"
        )
    if verdict.p_value <= MISFIT:
        found.append(
            "misfit: the measured train is farther from the simulated ones than most of these are "
            "from each other, and the oscillator found does not explain it. A second stop, a soft "
            "one, or friction cannot be fitted; the intervals hold for one rigid stop only"
        )
    return tuple(found)


def _settles(machine: Oscillator) -> bool:
    """Whether the oscillator's impacts recur, without any measuring chain."""
    impacts = simulate(machine, periods=400, transient=600).impacts
    assert impacts is not None
    assert machine.forcing_period is not None
    if len(impacts) < 20:
        return True
    return identify_period(impacts, machine.forcing_period).recurs
