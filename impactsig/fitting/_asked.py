"""Arguments of a fit: free and known parameters, bounds, strengths."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .._arguments import choice, instance, limits, number, some_of
from ..errors import InvalidInput
from ..impacts import INFERRED, Impacts
from ..intervals import identify_period
from ..intervals.forcing import frequencies_about, gathered, keeps_phase
from ..oscillators import Oscillator
from ._machine import KINDS, PARAMETERS, parameters_of

ALIKE = 1e-3
"""Relative range of the strengths below which they are not informative."""
APART = 100.0
"""Forcing periods an interval, or intervals a period, beyond which the period is a mistake."""
LOCKED = 25.0
"""Squared vector strength times the number of impacts, from which on the frequency is found."""


def free_parameters(free: Sequence[str]) -> tuple[str, ...]:
    """Validate the free parameters; returns them in the order of the search."""
    return some_of("free", free, PARAMETERS)


def kinds_of(kinds: Any, many: bool) -> tuple[str, ...]:
    """Kinds of machine to compare: one train distinguishes soft and rigid, several all kinds."""
    names = some_of("kinds", kinds, KINDS)
    if not many and not set(names) <= {"rigid", "soft"}:
        raise InvalidInput(
            "kinds", kinds, '"rigid" and "soft" only with one train',
            "Give a list of trains, which tell more",
        )  # fmt: skip
    return names


def known_parameters(
    names: tuple[str, ...], natural_frequency: float | None, scene: Oscillator | None
) -> dict[str, float]:
    """Parameters that are fixed; the natural frequency always has a value."""
    known: dict[str, float] = {}
    if scene is not None:
        if not isinstance(scene, Oscillator):
            raise InvalidInput("scene", scene, "an Oscillator, as of impactsig.scenes")
        known = parameters_of(scene)
    if natural_frequency is not None:
        known["natural_frequency"] = number("natural_frequency", natural_frequency, above=0)
    for name in PARAMETERS:
        if name == "natural_frequency" and name not in known:
            raise InvalidInput(
                name, None, "a positive number [Hz]", "Give it, or a scene that has it"
            )
        if name not in names and name not in known:
            raise InvalidInput("free", names, f"{name} among them, or a scene that says what it is")
    return {
        name: value
        for name, value in known.items()
        if name not in names or name == "natural_frequency"
    }


def limits_of(
    names: tuple[str, ...],
    known: dict[str, float],
    bounds: Mapping[str, tuple[float, float]] | None,
) -> dict[str, tuple[float, float]]:
    """Bounds of each free parameter."""
    about = known["natural_frequency"]
    found = {name: (PARAMETERS[name].low, PARAMETERS[name].high) for name in names}
    if "natural_frequency" in found:
        found["natural_frequency"] = (0.9 * about, 1.1 * about)
    required = "a mapping of free parameters to pairs of numbers"
    given = {} if bounds is None else instance("bounds", bounds, Mapping, required)  # type: ignore[type-abstract]
    for name, between in given.items():
        if name not in names:
            raise InvalidInput("bounds", name, f"free parameters only: {', '.join(names)}")
        least = 0.0 if name == "restitution" else 5e-324
        most = {"restitution": 1.0, "damping": 0.99}.get(name, math.inf)
        kind = f"from {'0' if least == 0 else 'above 0'} to {most:g}"
        required = f"two numbers {kind}, the lesser first"
        found[name] = limits(f"bounds[{name!r}]", between, required, least=least, most=most)
    return found


def strengths_used(impacts: Impacts, strengths: Any) -> str | None:
    """Name of the measured quantity that is used as strength."""
    if strengths is None:
        return None
    kinds = ("impulse", "peak", "approach_velocity")
    measured = [kind for kind in kinds if getattr(impacts, kind) is not None]
    if choice("strengths", strengths, ("auto", *kinds)) == "auto":
        return next(iter(measured), None)
    if strengths not in measured:
        raise InvalidInput("strengths", strengths, f"impacts with a measured {strengths}")
    return str(strengths)


def strengths_of(impacts: Impacts, used: str) -> np.ndarray:
    """The strengths, if they vary enough to be informative."""
    strength: np.ndarray = getattr(impacts, used)
    if not np.ptp(strength) > ALIKE * np.abs(strength).mean() or strength.mean() <= 0:
        raise InvalidInput(
            "strengths", f"{used} of {strength.mean():.3g} on average, all alike",
            "positive ones that differ", "strengths=None uses the instants alone",
        )  # fmt: skip
    return strength


def observed(impacts: Impacts, forcing_period: float, fewest: int) -> tuple[Impacts, float]:
    """Those that were measured, and the frequency of the forcing, refined on them."""
    frequency = 1 / number("forcing_period", forcing_period, above=0)
    impacts = impacts[(impacts.flags & INFERRED) == 0]
    intervals = impacts.intervals()
    mean = float(np.mean(intervals)) if len(intervals) else 0.0
    if mean and not mean / APART < forcing_period < mean * APART:
        raise InvalidInput(
            "forcing_period", forcing_period, f"seconds: the impacts are {mean:.3g} s apart",
            "Of a frequency in hertz give 1 / frequency",
        )  # fmt: skip
    count = min(len(impacts), len(intervals) + 1)
    if count < fewest:
        raise InvalidInput(
            "impacts", f"{count} impacts", f"{fewest} or more to fit, not cut apart by gaps",
            "2000 make the errors a third",
        )  # fmt: skip
    return impacts, refined(impacts, frequency)


def refuse_unlocked(impacts: Impacts, frequency: float) -> None:
    """Refuse a forcing of which the impacts keep no phase, nor that of a harmonic."""
    if not keeps_phase(impacts.time, frequency):
        raise InvalidInput(
            "forcing_period", 1 / frequency, "the period that forced these impacts, right to 0.2 %",
            "They come at all of its phases alike, as those of a machine that it forces do not",
        )  # fmt: skip


def refined(impacts: Impacts, frequency: float) -> float:
    """Frequency within 0.2 % at which the phases concentrate most, if they do."""
    from scipy.optimize import minimize_scalar

    time = impacts.time - impacts.time[0]
    step, trials = 0.2 / time[-1], frequencies_about(time, frequency)
    best = trials[np.argmax([gathered(time, trial) for trial in trials])]
    found = minimize_scalar(
        lambda trial: -gathered(time, trial), bounds=(best - step, best + step), method="bounded",
        options={"xatol": 1e-4 * step},
    )  # fmt: skip
    return float(found.x) if -found.fun * len(time) > LOCKED else frequency


def refuse_periodic(impacts: Impacts, frequency: float) -> None:
    """Refuse a periodic train, which cannot determine the parameters."""
    period = identify_period(impacts, 1 / frequency)
    if period.recurs:
        raise InvalidInput(
            "impacts",
            period.describe(),
            "impacts that are not periodic",
            "Recurring intervals determine too little; measure where the motion is chaotic",
        )
