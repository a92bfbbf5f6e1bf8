"""Arguments shared by ensembles and single paths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arguments import GREATEST, instance, number, one_of_them, reals
from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..simulation.basis.frame import reference_frequency
from ..simulation.exact.starts import first_places
from ..simulation.run import span
from ._scales import Survey, survey
from .paths.running import Method, check_method

TURN = 2 * math.pi
SHORTEST = 1e-300
"""Of a run that can be cut into steps, in the oscillator's unit of time."""


@dataclass(frozen=True)
class Course:
    """Duration, start and step of a simulation under noise.

    Attributes
    ----------
    q, v : numpy.ndarray, shape (paths,)
        Positions and velocities at t = 0, relative to the stops.
    phase : float
        Phase of the forcing at t = 0 [rad].
    step : float
        In the oscillator's unit of time.
    every : int
        Steps from one look to the next.
    before, looks : int
        Steps that are not looked at, and how often is looked after them.
    survey : Survey
        What the step was chosen by.
    """

    q: np.ndarray
    v: np.ndarray
    phase: float
    step: float
    every: int
    before: int
    looks: int
    survey: Survey


def course(
    oscillator: Oscillator,
    paths: int,
    *,
    periods: float | None,
    duration: float | None,
    transient: float,
    initial: Any,
    phase: float,
    method: Method,
    step: float | None,
    every: float | None,
    look: int,
) -> Course:
    """Validate the arguments of `simulate_ensemble` and of a single path.

    Raises
    ------
    InvalidInput
        If one is out of its range.
    """
    instance(
        "oscillator", oscillator, Oscillator, "an Oscillator with noise",
        "Only an Oscillator takes noise=Noise(intensity); cantilevers, flows and what is "
        "controlled move without",
    )  # fmt: skip
    if oscillator.noise is None:
        raise InvalidInput(
            "oscillator", repr(oscillator), "an oscillator with noise",
            "Give it noise=Noise(intensity), or use simulate() without noise",
        )  # fmt: skip
    check_method(oscillator, method)
    omega = oscillator.angular_forcing_frequency
    length, before = span(periods, duration, transient, omega is not None)
    # Of both, in the oscillator's unit of time.
    unit = TURN / omega if omega is not None and duration is None else 1 / oscillator.time_unit
    length, before = length * unit, before * unit
    if length < SHORTEST:
        name, given = one_of_them(periods=periods, duration=duration)
        raise InvalidInput(name, given, f"a longer time, {SHORTEST:g} of the unit of time or more")
    phase = number("phase", phase) % TURN
    q, v = starts(oscillator, paths, initial, phase)
    found = survey(oscillator, before + length, q, v, phase)
    if step is None:
        size = found.default
    else:
        found.check(number("step", step, above=0), oscillator.time_unit)
        size = step / oscillator.time_unit
        _refuse_more_steps_than_count("step", step, before + length, size)
    if every is None:
        size = min(size, length)
        stride = min(look, max(int(length / size * (1 + 1e-9)), 1))
    else:
        apart = number("every", every, above=0) / oscillator.time_unit
        if apart > length * (1 + 1e-9):
            raise InvalidInput("every", every, "no longer than the sampled span")
        _refuse_more_steps_than_count("every", every, before + length, apart)
        stride = math.ceil(apart / size * (1 - 1e-9))
        size = apart / stride
    looks = int(length / (stride * size) * (1 + 1e-9))
    before_steps = math.ceil(before / (stride * size) * (1 - 1e-9)) * stride
    return Course(q, v, phase, size, stride, before_steps, looks, found)


def _refuse_more_steps_than_count(name: str, given: float, length: float, step: float) -> None:
    if not step or not length / step < GREATEST:
        raise InvalidInput(name, given, f"a time of which fewer than {GREATEST:g} make the run")


def starts(
    oscillator: Oscillator, paths: int, initial: Any, phase: float
) -> tuple[np.ndarray, np.ndarray]:
    """Initial positions and velocities, relative to the stops.

    Raises
    ------
    InvalidInput
        If there is not one for all paths or one for each, or one is beyond a rigid stop.
    """
    required = f"displacement and velocity, shape (2,) or ({paths}, 2)"
    given = reals("initial", initial, required)
    if given.shape not in ((2,), (paths, 2)):
        raise InvalidInput("initial", initial, required)
    omega = reference_frequency(oscillator)
    if not np.isfinite(given).all():
        raise InvalidInput("initial", initial, "finite displacements and velocities")
    q, v = first_places(oscillator, given.reshape(-1, 2), phase)
    return np.broadcast_to(q, paths).copy(), np.broadcast_to(v * omega, paths).copy()
