"""The oscillator that is fitted, as a function of its parameters, and trains measured of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..oscillators import Force, Oscillator, Rigid, Stop
from ..simulate import simulate
from ..simulate.measuring import measure
from ._balance import TURN, Values
from ._partition import Train

SETTLING = 60  # periods left out before a simulated train, and up to as many more


@dataclass(frozen=True)
class Parameter:
    """One that can be free.

    Attributes
    ----------
    low, high : float
        The box it is sought in unless another is given.
    logarithmic : bool
        Whether it is sought, and its interval is symmetric, on the scale of its logarithm.
    half : float
        On that scale, how far around the beginning the search starts.
    finest : float
        What trains of some thousand impacts cannot tell apart.
    """

    low: float
    high: float
    logarithmic: bool
    half: float
    finest: float

    def scale(self, value: float) -> float:
        """The value on the scale of the search."""
        return math.log(value) if self.logarithmic else value

    def value(self, scaled: float) -> float:
        """The value of one on the scale of the search."""
        return math.exp(scaled) if self.logarithmic else float(scaled)


PARAMETERS = {
    "restitution": Parameter(0.0, 1.0, False, 0.15, 1e-3),
    "damping": Parameter(1e-3, 0.5, True, 1.0, 0.01),
    "amplitude": Parameter(0.01, 10.0, True, 0.06, 3e-4),
    "natural_frequency": Parameter(0.0, math.inf, True, 0.02, 1e-4),
}
CHAIN = {
    "jitter": Parameter(1e-4, 0.1, True, 0.7, 0.01),  # forcing periods
    "missed": Parameter(0.0, 0.5, False, 0.02, 5e-4),
    "spurious": Parameter(0.0, 0.5, False, 0.01, 5e-4),
    "strength_noise": Parameter(0.0, 1.0, False, 0.04, 2e-3),
}


def oscillator(values: dict[str, float], forcing_frequency: float, length_unit: float = 1.0) -> Any:
    """The dimensionless oscillator; its unit of length is the gap."""
    natural = values["natural_frequency"]
    return Oscillator(
        damping=2 * values["damping"],
        forces=(Force(values["amplitude"], forcing_frequency / natural),),
        stops=(Stop(1.0, Rigid(values["restitution"])),),
        time_unit=1 / (TURN * natural),
        length_unit=length_unit,
        name=f"fitted at {forcing_frequency:g} Hz",
    )


def parameters_of(scene: Oscillator) -> dict[str, float]:
    """The parameters of an oscillator of one mass, one harmonic force and one rigid stop.

    Raises
    ------
    InvalidInput
        If it is of another kind.
    """
    plain = (
        len(scene.stops) == 1
        and len(scene.forces) == 1
        and scene.base is scene.friction is scene.law is scene.noise is None
        and scene.load == 0
        and scene.stiffness > 0
        and isinstance(scene.stops[0].law, Rigid)
        and not callable(scene.stops[0].law.restitution)
    )
    sign = 1 if not scene.stops or scene.stops[0].side == "upper" else -1
    if not plain or sign * scene.stops[0].position <= 0:
        raise InvalidInput(
            "scene",
            scene.name or "an oscillator",
            "a spring, a damper, one harmonic force and one rigid stop, short of it at rest",
        )
    natural = scene.angular_natural_frequency
    gap = abs(scene.stops[0].position)
    law: Any = scene.stops[0].law
    return {
        "restitution": float(law.restitution),
        "damping": scene.damping / (2 * scene.mass * natural),
        "amplitude": abs(scene.forces[0].amplitude) / (scene.stiffness * gap),
        "natural_frequency": natural / scene.time_unit / TURN,
    }


@dataclass(frozen=True)
class Beginnings:
    """States on the motion that was measured, from where simulated ones start."""

    phase: np.ndarray  # of the forcing at an impact [rad]
    approach: np.ndarray  # velocity there


def dimensionless(values: dict[str, float], forcing_frequency: float, phase: float) -> Values:
    """The parameters as the balance of three impacts has them."""
    return Values(
        values["restitution"],
        values["damping"],
        values["amplitude"],
        forcing_frequency / values["natural_frequency"],
        phase,
    )


def simulated(
    values: dict[str, float],
    forcing_frequency: float,
    periods: int,
    beginnings: Beginnings,
    rng: np.random.Generator,
) -> Any:
    """Impacts of the oscillator, as the measuring chain has them, with their strengths.

    Returns
    -------
    Impacts
        Their `approach_velocity` with the noise of the strengths.
    """
    machine = oscillator(values, forcing_frequency)
    which = rng.integers(len(beginnings.phase))
    away = -values["restitution"] * beginnings.approach[which]
    truth = simulate(
        machine,
        periods=periods,
        transient=float(SETTLING + rng.integers(SETTLING)),
        initial=(1.0, min(away, 0.0)),
        phase=float(beginnings.phase[which]),
    ).impacts
    assert truth is not None
    seen = measure(
        truth,
        jitter=values["jitter"] / forcing_frequency,
        missed=values["missed"],
        spurious=values["spurious"],
        seed=rng,
    ).impacts
    speed = seen.approach_velocity
    assert speed is not None
    floor = values["strength_floor"] * speed.mean() if len(speed) else 0.0
    noise = values["strength_noise"] * np.hypot(speed, floor) * rng.standard_normal(len(seen))
    return replace(seen, approach_velocity=np.maximum(speed + noise, 0.0))


def as_train(impacts: Any, forcing_frequency: float, strength: np.ndarray | None) -> Train:
    """A train in forcing periods."""
    x = (impacts.time - impacts.start) * forcing_frequency
    return Train(x, strength, ~impacts.interval_spans_gap())
