"""The fitted oscillator as a function of its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..impacts import Impacts
from ..oscillators import Force, KelvinVoigt, Oscillator, Rigid, Stop
from ..oscillators.batch import takes_arrays
from .trains.balance import TURN, Values
from .trains.partition import Train


@dataclass(frozen=True)
class Parameter:
    """A parameter that can be free.

    Attributes
    ----------
    low, high : float
        The box it is sought in unless another is given.
    logarithmic : bool
        Whether it is sought, and its interval is symmetric, on the scale of its logarithm.
    half : float
        On that scale, how far around the beginning the search starts.
    finest : float
        Difference that trains of some thousand impacts cannot resolve.
    """

    low: float
    high: float
    logarithmic: bool
    half: float
    finest: float

    def scale(self, value: float) -> float:
        """Convert a value to the scale of the search."""
        return math.log(value) if self.logarithmic else value

    def value(self, scaled: Any) -> Any:
        """Convert from the scale of the search, for one or several."""
        return np.exp(scaled) if self.logarithmic else scaled


PARAMETERS = {
    "restitution": Parameter(0.0, 1.0, False, 0.15, 1e-3),
    "damping": Parameter(1e-3, 0.5, True, 1.0, 0.01),
    "amplitude": Parameter(0.01, 10.0, True, 0.06, 3e-4),
    "natural_frequency": Parameter(0.0, math.inf, True, 0.02, 1e-4),
}
EXTRA = {
    "stiffness": Parameter(3.0, 3e3, True, 1.0, 0.01),
    "second_gap": Parameter(0.2, 5.0, True, 0.1, 1e-3),
}
"""What only one kind of machine has: the stiffness of its soft stop by the spring's, from 3000 of
which a contact lasts 1 % of a natural period and the stop is as good as rigid; and the distance of
its second stop in gaps."""
KINDS = {"rigid": None, "soft": "stiffness", "two-sided": "second_gap", "echo": None}
"""Of machines with many trains, and which of these each has besides."""
PLACES = {name: place for place, name in enumerate(PARAMETERS)} | dict.fromkeys(EXTRA, 5)
"""In the vectors of joint fits; the phase is between them."""
LEAST_RESTITUTION = 0.02
"""Of a soft stop, whose damping has no bound as its restitution vanishes."""
CHAIN = {
    "jitter": Parameter(1e-4, 0.1, True, 0.7, 0.01),  # forcing periods
    "missed": Parameter(0.0, 0.5, False, 0.02, 5e-4),
    "spurious": Parameter(0.0, 0.5, False, 0.01, 5e-4),
    "strength_noise": Parameter(0.0, 1.0, False, 0.04, 2e-3),
}


def sought_of(
    kind: str, names: tuple[str, ...], limits: dict[str, tuple[float, float]]
) -> tuple[tuple[str, ...], dict[str, tuple[float, float]]]:
    """Free parameters of a kind of machine, and their bounds, from those that all kinds have."""
    extra, limits = KINDS[kind], dict(limits)
    if extra is not None:
        limits[extra] = (EXTRA[extra].low, EXTRA[extra].high)
        names = (*names, extra)
    if kind == "soft" and "restitution" in limits:
        low, high = limits["restitution"]
        limits["restitution"] = max(low, min(LEAST_RESTITUTION, high)), high
    return names, limits


@takes_arrays("forcing_frequency")
def _oscillator(
    restitution: float, damping: float, amplitude: float, natural_frequency: float,
    forcing_frequency: float, stiffness: float | None = None, second_gap: float | None = None,
) -> Oscillator:  # fmt: skip
    law: Rigid | KelvinVoigt = Rigid(restitution)
    if stiffness is not None:
        loss = -np.log(restitution)  # as `KelvinVoigt.equivalent` has it, of arrays
        law = KelvinVoigt(stiffness, 2 * loss / np.hypot(np.pi, loss) * np.sqrt(stiffness))
    stops = [Stop(1.0, law)]
    if second_gap is not None:
        stops.append(Stop(-second_gap, law, "lower"))
    return Oscillator(
        damping=2 * damping,
        forces=(Force(amplitude, forcing_frequency / natural_frequency),),
        stops=tuple(stops),
        time_unit=1 / (TURN * natural_frequency),
        name=f"fitted at {forcing_frequency:g} Hz",
    )


def oscillator(values: dict[str, Any], forcing_frequency: float) -> Any:
    """The dimensionless oscillator, or a batch of them; the unit of length is the gap."""
    own = {name: values[name] for name in (*PARAMETERS, *EXTRA) if name in values}
    return _oscillator(**own, forcing_frequency=forcing_frequency)


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
        and scene.stops[0].law.rigid
        and scene.stops[0].law.function is None
    )
    sign = scene.stops[0].sign if plain else 1
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


def dimensionless(values: dict[str, Any], forcing_frequency: float, phase: Any) -> Values:
    """The parameters in the form of the balance of three impacts."""
    return Values(
        values["restitution"],
        values["damping"],
        values["amplitude"],
        forcing_frequency / values["natural_frequency"],
        phase,
    )


def as_train(impacts: Any, forcing_frequency: float, strength: np.ndarray | None) -> Train:
    """Convert impacts to a train in forcing periods."""
    x = (impacts.time - impacts.start) * forcing_frequency
    return Train(x, strength, ~impacts.interval_spans_gap())


def as_impacts(train: Train, forcing_frequency: float, periods: int) -> Impacts:
    """Convert a train of so many periods to impacts."""
    return Impacts(
        train.x / forcing_frequency,
        approach_velocity=train.strength,
        start=0.0,
        duration=periods / forcing_frequency,
        source="simulated",
    )
