"""`fit_oscillator`: fit an impact oscillator to a measured train."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, cast, overload

from .._arguments import Seed, flag, instance, streams
from .._running.watched import progress
from ..errors import InvalidInput
from ..impacts import Impacts
from ..oscillators import Oscillator
from ._asked import (
    free_parameters,
    kinds_of,
    known_parameters,
    limits_of,
    observed,
    refuse_periodic,
    refuse_unlocked,
    strengths_of,
    strengths_used,
)
from ._judging import LEAST_P, judged
from ._machine import KINDS, as_train, sought_of
from ._outcome import outcome
from .machine import MachineFit
from .result import OscillatorFit
from .searching.narrow import Estimate, narrow
from .searching.problem import Problem
from .searching.refine import orbits, refine
from .searching.search import begin, descend
from .together.joint import Asked, fit_trains, telling

FEWEST = 200
"""Impacts below which no fit is tried: words of four intervals come too seldom."""
TRIES = 3
"""Searches before it is the latter that is believed."""
ENOUGH = 2
"""Searches that end hopelessly far, after which no other is begun."""

Strengths = Literal["auto", "impulse", "peak", "approach_velocity"]


@overload
def fit_oscillator(
    impacts: Impacts, forcing_period: float, free: Sequence[str] = ..., *,
    natural_frequency: float | None = ..., scene: Oscillator | None = ...,
    bounds: Mapping[str, tuple[float, float]] | None = ..., strengths: Strengths | None = ...,
    same_amplitude: bool = ..., kinds: Sequence[str] = ..., seed: Seed = ...,
) -> OscillatorFit: ...  # fmt: skip
@overload
def fit_oscillator(
    impacts: Sequence[Impacts], forcing_period: Sequence[float], free: Sequence[str] = ..., *,
    natural_frequency: float | None = ..., scene: Oscillator | None = ...,
    bounds: Mapping[str, tuple[float, float]] | None = ..., strengths: Strengths | None = ...,
    same_amplitude: bool = ..., kinds: Sequence[str] = ..., seed: Seed = ...,
) -> MachineFit: ...  # fmt: skip
def fit_oscillator(
    impacts: Impacts | Sequence[Impacts],
    forcing_period: float | Sequence[float],
    free: Sequence[str] = ("restitution", "damping", "amplitude"),
    *,
    natural_frequency: float | None = None,
    scene: Oscillator | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    strengths: Strengths | None = "auto",
    same_amplitude: bool = False,
    kinds: Sequence[str] = ("rigid",),
    seed: Seed = None,
) -> OscillatorFit | MachineFit:
    """Fit an impact oscillator to measured, irregular trains of impacts.

    ``x'' + 2 damping x' + x = amplitude cos(omega t)``, x < 1, ``x' -> -restitution x'`` at the
    stop; x in units of the gap, t in 1 / omega_n.

    With strengths, one orbit of the oscillator is fitted to all impacts, by least squares over all
    instants and velocities, together with the parameters: a multiple-shooting fit of a differential
    equation to chaotic data [Baake1992]_, with one shot per flight. Flights that contradict their
    neighbours are excluded, since an impact was missed or is false. Bias and scatter are estimated
    from trains that are simulated at the optimum and measured like the real one (jitter, missed and
    spurious impacts and noise of the strengths are estimated as well): indirect inference
    [Gourieroux1993]_.

    From instants alone an orbit is poorly determined, since jitter is as large as the attractor is
    wide. Simulated trains are then compared with the measured one by moments of the sequence of
    intervals and of the phases. Differential evolution [StornPrice1997]_ finds the neighbourhood of
    the optimum, where the moments are regressed on the parameters.

    Several trains of one machine, each at a different forcing, are fitted together: restitution
    coefficient, damping and natural frequency are common to all, amplitude and phase are specific
    to each train. Instants suffice, 100 per train. The most likely sequence of states through a
    train, among states of simulated orbits [Rabiner1989]_, identifies the state at each impact,
    false impacts and missed ones; orbits fitted to all trains then determine the parameters. This
    is repeated for each of `kinds`, and the result is the most likely kind, with the odds of the
    others. If the trains contradict each other by more than their errors, the search is repeated,
    up to twice, and errors are multiplied by the remaining sqrt(chi^2 / degrees of freedom)
    [Birge1932]_.

    For 2000 impacts of a chaotic motion, with a jitter of 1 % of the mean interval, 2 % missed and
    1 % spurious, the standard errors of restitution coefficient, damping and amplitude are about
    0.008, 0.9 % and 0.2 % if strengths are known to 2 %; 0.014, 3 % and 0.4 % at 5 %; and 0.05, 15
    % and 2 % from instants alone, which hardly determine the damping. A fit takes about 10 seconds
    with strengths, 20 without, and minutes if it has to be restarted. For eight trains of 500
    instants each, with a jitter of 0.5 % of the mean interval, those of restitution coefficient and
    damping are about 0.02 and 8 % (0.009 and 4 % with 0.5 % of the forcing period, which is
    shorter); this takes 12 seconds, or 15 to 40 if all `kinds` are compared.

    Parameters
    ----------
    impacts : Impacts, or list of Impacts
        At least 200 impacts of a motion that is not periodic; at least 100 per train if there are
        several, where periodic trains, and trains that are not locked to the forcing, are excluded.
        Inferred impacts are omitted.
    forcing_period : float, or list of float
        Period of the forcing [s], accurate to 0.2 %; one for each train.
    free : sequence of str
        Parameters to estimate: of "restitution", "damping", "amplitude", "natural_frequency".
    natural_frequency : float, optional
        Natural frequency [Hz], or its approximate value if it is free. By default that of the
        scene.
    scene : Oscillator, optional
        Known properties of the machine: an oscillator with one harmonic force and one rigid stop,
        such as `scenes.karpodinis`, whose parameters are used for those that are not free.
    bounds : dict of str to (float, float), optional
        Bounds of a free parameter; by default 0 to 1 for the restitution coefficient, 0.001 to 0.5
        for the damping, 0.01 to 10 for the amplitude, and 10 % about the natural frequency.
    strengths : {"auto", "impulse", "peak", "approach_velocity"} or None
        The quantity that is proportional to the approach velocity of each impact. "auto" takes the
        first available one of impulse, peak and approach velocity; None uses only the instants. For
        several trains only the instants are used.
    same_amplitude : bool
        Whether the amplitude of the forcing is the same in all of several trains; the parameters
        are then better determined.
    kinds : sequence of str
        Kinds of machine to compare with several trains, by their evidence: of "rigid", "soft" (a
        stop with spring and damper, `KelvinVoigt`), "two-sided" (two rigid stops of the same
        restitution coefficient on either side) and "echo" (a rigid stop, whose impacts are followed
        by another instant at a delay that all trains share). Of a single train with strengths
        "rigid" and "soft".
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same result; a Generator is advanced.

    Returns
    -------
    OscillatorFit, or MachineFit of many trains

    Raises
    ------
    InvalidInput
        If there are too few impacts, they are periodic (a few recurring intervals cannot determine
        several parameters), no search ends at an oscillator with as many impacts, or an argument is
        out of its range.

    See Also
    --------
    fit_soft_stop, identify_resonance, simulate, measure

    Notes
    -----
    The forcing must be harmonic. A machine with stops on both sides cannot be fitted to one train,
    since its impacts do not show which stop was hit: an error is raised, or the fit reports a
    `misfit`. With strengths, an orbit is fitted with a rigid and with a soft stop, whichever kind
    is fitted; if the other kind is far more likely, the fit is a misfit as well. From the instants
    of one train a soft stop cannot be distinguished from a rigid one with lower restitution and
    damping, and the fit warns of it; several trains distinguish them, if `kinds` includes both.
    Dead time is not part of the model of the instrument.

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
    names = free_parameters(free)
    known = known_parameters(names, natural_frequency, scene)
    limits = limits_of(names, known, bounds)
    rng = dict(zip(KINDS, streams(seed, len(KINDS)), strict=True))
    common = flag("same_amplitude", same_amplitude)
    compared = kinds_of(kinds, isinstance(impacts, (list, tuple)))
    if isinstance(impacts, (list, tuple)):
        if not (strengths is None or strengths == "auto"):
            raise InvalidInput(
                "strengths", strengths, '"auto" or None with many trains',
                "Many trains are fitted by their instants alone",
            )  # fmt: skip
        trains, frequencies, aside = telling(impacts, forcing_period)
        asked = Asked(names, known, limits, common, compared, rng)
        return fit_trains(trains, frequencies, aside, asked)
    if common:
        raise InvalidInput("same_amplitude", True, "False with one train", "Give a list of trains")
    remedy = "Impacts.from_times makes them from instants"
    impacts = instance("impacts", impacts, Impacts, remedy=remedy)
    used = strengths_used(impacts, strengths)
    impacts, frequency = observed(impacts, cast(float, forcing_period), FEWEST)
    refuse_unlocked(impacts, 1 / float(cast(float, forcing_period)))
    refuse_periodic(impacts, frequency)
    strength = None if used is None else strengths_of(impacts, used)
    train = as_train(impacts, frequency, strength)
    with progress(None, " trains", leave=False) as advance:
        problems = {}
        for kind in compared:
            sought = sought_of(kind, names, limits)
            problems[kind] = Problem(
                sought[0], known, sought[1], frequency, train, rng[kind], advance=advance
            )
            problems[kind].refuse_unread()
        return _fit(_likeliest(problems), impacts, used)


def _likeliest(problems: dict[str, Problem]) -> Problem:
    """That of the kind of stop whose orbit lies nearest to the impacts."""
    kind, first = next(iter(problems.items()))
    if "soft" in problems and not _has_orbit(first):
        raise InvalidInput(
            "kinds", tuple(problems),
            '("rigid",) for instants without strengths, or where a known '
            "damping or amplitude is 0", "Strengths, or many trains, tell a soft stop",
        )  # fmt: skip
    if len(problems) > 1:
        found = orbits(first)
        kind = max(found, key=lambda kind: found[kind].evidence, default=kind)
    return problems[kind]


def _fit(problem: Problem, impacts: Impacts, used: str | None) -> OscillatorFit:
    tries = []
    for _ in range(TRIES):
        estimate = _estimate(problem)
        if estimate is None:
            continue
        verdict = judged(problem, estimate.psi, estimate.covariance)
        if not verdict.compared:
            continue
        state = (problem.floor, problem.beginnings, problem.evidence)  # that it is simulated with
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
    problem.floor, problem.beginnings, problem.evidence = state
    return outcome(problem, impacts, used, estimate, verdict)


def _estimate(problem: Problem) -> Estimate | None:
    """Estimate by an orbit if strengths are known and one fits, else by moments.

    None where the trains simulated at the end of the search have too few impacts.
    """
    if _has_orbit(problem):
        problem.floor = 0.0
        refined = refine(problem)
        if refined is not None:
            return refined
        problem.floor = 0.0
    beginning = begin(problem)
    problem.beginnings = beginning.beginnings
    return narrow(problem, *descend(problem, beginning.free))


def _has_orbit(problem: Problem) -> bool:
    """Whether an orbit can be found beside the impacts, which takes their strengths.

    A damping or an amplitude that is known to be 0 has no logarithm, by which it is found.
    """
    known = {"damping": 0.5, "amplitude": 1.0} | problem.known
    followed = 0 < known["damping"] <= 0.99 and known["amplitude"] > 0
    return problem.train.strength is not None and followed
