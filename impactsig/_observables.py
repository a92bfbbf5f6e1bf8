"""What `impactsig sweep` can tell of a motion: a table to which anyone may add a line.

An observable is a name, what it is in words, and a function of a `Motion` that returns a number;
what only some observables need (the impacts, their period) is worked out only if one is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from .oscillators import Oscillator

if TYPE_CHECKING:
    from .simulate.motion import Motion


@dataclass(frozen=True)
class Observable:
    """One line of the table.

    Attributes
    ----------
    told : str
        What it is, as ``--help`` says.
    of : callable
        From a motion to a number, NaN where it has none.
    keeps : bool
        Whether the events must be kept for it; counting alone is quicker.
    attributes : mapping
        What labels the figures and the arrays, such as `long_name` and `units`.
    """

    told: str
    of: Callable[[Motion], float]
    keeps: bool = False
    attributes: Mapping[str, Any] = field(default_factory=dict)


def _mean_approach(motion: Motion) -> float:
    speed = _approach(motion)
    return float(speed.mean()) if len(speed) else math.nan


def _greatest_approach(motion: Motion) -> float:
    speed = _approach(motion)
    return float(speed.max()) if len(speed) else math.nan


def _approach(motion: Motion) -> Any:
    assert motion.impacts is not None
    assert motion.impacts.approach_velocity is not None
    return abs(motion.impacts.approach_velocity)


def _sticking_share(motion: Motion) -> float:
    assert motion.sticks is not None
    return float((motion.sticks[:, 1] - motion.sticks[:, 0]).sum() / motion.duration)


def _energy_per_period(motion: Motion) -> float:
    period = motion.oscillator.forcing_period
    assert period is not None
    return motion.energy_lost / (motion.duration / period)


def _period(motion: Motion) -> tuple[float, float]:
    """M and n of period(m, n)."""
    from .intervals import identify_period

    assert motion.impacts is not None
    found = identify_period(motion.impacts, motion.oscillator.forcing_period)
    return (found.impacts or math.nan, found.periods or math.nan)


def _exponent(motion: Motion) -> float:
    """The greatest Lyapunov exponent from where the motion ends, over as long again."""
    from .dynamics.lyapunov import lyapunov_spectrum

    x, v, phase = motion.final
    spectrum = lyapunov_spectrum(
        motion.oscillator, duration=motion.duration, initial=(x, v), phase=phase
    )
    return float(spectrum.exponents[0])


ENDS = ("complete", "work limit", "diverged", "broken law")
"""What `Motion.status` may be, counted by the observable "status"."""

OBSERVABLES: dict[str, Observable] = {
    "impacts_per_period": Observable(
        "impacts in a forcing period, on average",
        lambda motion: motion.impacts_per_period,
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
        "m of period(m, n), as the impacts tell it; NaN if they do not recur",
        lambda motion: _period(motion)[0],
        keeps=True,
        attributes={"long_name": "impacts m of period(m, n)"},
    ),
    "period_periods": Observable(
        "n of period(m, n)",
        lambda motion: _period(motion)[1],
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
        lambda motion: ENDS.index(motion.status),
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
    """A cell of `impactsig sweep`: make the scene, let it move, say what was asked."""

    scene: Callable[..., Oscillator]
    fixed: Mapping[str, Any]
    run: Mapping[str, Any]
    names: tuple[str, ...]

    def __call__(self, **cell: float) -> dict[str, float]:
        """The observables of the scene with these parameters."""
        from .simulate import simulate

        keep: Any = "all" if any(OBSERVABLES[name].keeps for name in self.names) else "counts"
        motion = simulate(self.scene(**self.fixed, **cell), keep=keep, **self.run)
        return {name: float(OBSERVABLES[name].of(motion)) for name in self.names}
