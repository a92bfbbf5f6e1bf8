"""The observables of `impactsig sweep`: a table to which anyone may add a line.

An observable is a name, a description, and a function that takes a `Seen` motion and returns a
number; what only some of them need (the impacts, the period) is computed when first used.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..oscillators import Oscillator

if TYPE_CHECKING:
    import numpy as np

    from ..dynamics.diagrams.periodicity import OrbitPeriod
    from ..simulate.motion import Motion

RETURN = 1e-6
"""What a return may be off by, as a share of the motion's size; a cell's transient is short."""


@dataclass(frozen=True)
class Observable:
    """One line of the table.

    Attributes
    ----------
    description : str
        What it is, as ``--help`` says.
    of : callable
        From what is `Seen` of a motion to a number, NaN where it has none.
    keeps : bool
        Whether the events must be kept for it; counting alone is quicker.
    attributes : mapping
        What labels the figures and the arrays, such as `long_name` and `units`.
    """

    description: str
    of: Callable[[Seen], float]
    keeps: bool = False
    attributes: Mapping[str, Any] = field(default_factory=dict)


class Seen:
    """A motion, with the quantities that several observables share, each computed once."""

    def __init__(self, motion: Motion) -> None:
        self.motion = motion

    @cached_property
    def approach(self) -> np.ndarray:
        """Speeds of approach."""
        impacts = self.motion.impacts
        assert impacts is not None  # all was kept
        assert impacts.approach_velocity is not None
        return abs(impacts.approach_velocity)

    @cached_property
    def period(self) -> OrbitPeriod:
        """Period(m, n)."""
        from ..dynamics.diagrams.periodicity import orbit_period

        return orbit_period(self.motion, tolerance=RETURN)


def _mean_approach(seen: Seen) -> float:
    return float(seen.approach.mean()) if len(seen.approach) else math.nan


def _greatest_approach(seen: Seen) -> float:
    return float(seen.approach.max()) if len(seen.approach) else math.nan


def _sticking_share(seen: Seen) -> float:
    sticks = seen.motion.sticks
    assert sticks is not None
    return float((sticks[:, 1] - sticks[:, 0]).sum() / seen.motion.duration)


def _energy_per_period(seen: Seen) -> float:
    motion = seen.motion
    period = motion.system.forcing_period
    assert period is not None
    return motion.energy_lost / (motion.duration / period)


def _exponent(seen: Seen) -> float:
    """The greatest Lyapunov exponent, from the end of the motion over the same duration."""
    from ..dynamics.tangents.lyapunov import lyapunov_spectrum

    motion = seen.motion
    x, v, phase = motion.final
    spectrum = lyapunov_spectrum(
        motion.system, duration=motion.duration, initial=(x, v), phase=phase
    )
    return float(spectrum.exponents[0])


ENDS = ("complete", "work limit", "diverged", "broken law")
"""What `Motion.status` may be, counted by the observable "status"."""

OBSERVABLES: dict[str, Observable] = {
    "impacts_per_period": Observable(
        "impacts in a forcing period, on average",
        lambda seen: seen.motion.impacts_per_period,
        attributes={"long_name": "impacts per period"},
    ),
    "mean_approach_velocity": Observable(
        "mean speed of approach at the impacts, in the scene's units",
        _mean_approach,
        keeps=True,
        attributes={"long_name": "mean approach velocity"},
    ),
    "greatest_approach_velocity": Observable(
        "greatest speed of approach at the impacts",
        _greatest_approach,
        keeps=True,
        attributes={"long_name": "greatest approach velocity"},
    ),
    "energy_per_period": Observable(
        "energy lost in impacts and friction in a forcing period, on average",
        _energy_per_period,
        attributes={"long_name": "energy lost per period"},
    ),
    "sticking_share": Observable(
        "share of the time at rest, at a stop or held by friction",
        _sticking_share,
        keeps=True,
        attributes={"long_name": "sticking share"},
    ),
    "period_impacts": Observable(
        "m of period(m, n), by return to within 1e-6 of the size; NaN where there is none",
        lambda seen: math.nan if seen.period.impacts is None else seen.period.impacts,
        keeps=True,
        attributes={"long_name": "impacts m of period(m, n)"},
    ),
    "period_periods": Observable(
        "n of period(m, n)",
        lambda seen: seen.period.periods or math.nan,
        keeps=True,
        attributes={"long_name": "forcing periods n of period(m, n)"},
    ),
    "exponent": Observable(
        "greatest Lyapunov exponent, per unit of the scene's time; -inf where sticks end it",
        _exponent,
        attributes={"long_name": "greatest Lyapunov exponent"},
    ),
    "status": Observable(
        "how the simulation ended: 0 complete, else an early end",
        lambda seen: ENDS.index(seen.motion.status),
        attributes={
            "long_name": "status",
            "flag_values": list(range(len(ENDS))),
            "flag_meanings": " ".join(end.replace(" ", "_") for end in ENDS),
        },
    ),
}
USUAL = ("impacts_per_period", "energy_per_period", "status")
"""Those that need no list of impacts."""


@dataclass(frozen=True)
class Observing:
    """A cell of `impactsig sweep`: make the scene, simulate it, return the observables."""

    scene: Callable[..., Oscillator]
    fixed: Mapping[str, Any]
    run: Mapping[str, Any]
    names: tuple[str, ...]

    def __call__(self, **cell: float) -> dict[str, float]:
        """The observables of the scene with these parameters."""
        from ..simulate import simulate

        keep: Any = "all" if any(OBSERVABLES[name].keeps for name in self.names) else "counts"
        motion = simulate(self.scene(**self.fixed, **cell), keep=keep, **self.run)
        seen = Seen(motion)
        return {name: float(OBSERVABLES[name].of(seen)) for name in self.names}
