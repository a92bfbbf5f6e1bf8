"""The observables of `impactsig sweep`: a table to which anyone may add a line.

An observable is a name, a description, and a function that takes a `Seen` motion and returns a
number; what only some of them need (the impacts, the period) is computed when first used. One that
follows from the numbers of motions has a function of many too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..oscillators import Oscillator

if TYPE_CHECKING:
    import numpy as np

    from ..dynamics.diagrams.periodicity import OrbitPeriod
    from ..oscillators.batch import OscillatorBatch
    from ..simulation.batches.motions import Motions
    from ..simulation.motion import Motion

RETURN = 1e-6
"""What a return may be off by, as a share of the motion's size; a cell's transient is short."""
TOGETHER = 1024
"""Cells that are moved by one call, at most."""
KEPT = 50_000
"""Forcing periods whose events are kept at a time, over all of those cells."""


@dataclass(frozen=True)
class Observable:
    """One line of the table.

    Attributes
    ----------
    description : str
        What it is, as ``--help`` says.
    of : callable
        From what is `Seen` of a motion to a number, NaN where it has none.
    of_many : callable, optional
        From motions to an array of it, with the same bits.
    keeps : bool
        Whether the events must be kept for it; counting alone is quicker.
    attributes : mapping
        What labels the figures and the arrays, such as `long_name` and `units`.
    """

    description: str
    of: Callable[[Seen], float]
    of_many: Callable[[Motions], np.ndarray] | None = None
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


def _ends(motions: Motions) -> np.ndarray:
    import numpy as np

    return np.array([ENDS.index(status) for status in motions.status.tolist()], float)


OBSERVABLES: dict[str, Observable] = {
    "impacts_per_period": Observable(
        "impacts in a forcing period, on average",
        lambda seen: seen.motion.impacts_per_period,
        lambda motions: motions.impacts_per_period,
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
        lambda motions: motions.energy_lost / (motions.duration / motions._forcing_period),
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
        _ends,
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
    """Cells of `impactsig sweep`: make the scenes, simulate them, return the observables.

    What is linear between events is moved by one compiled call for many cells, all else one by one;
    the bits are those of `simulate`.
    """

    scene: Callable[..., Oscillator]
    fixed: Mapping[str, Any]
    run: Mapping[str, Any]
    names: tuple[str, ...]

    def __call__(self, **cells: np.ndarray) -> dict[str, np.ndarray]:
        """The observables of the scenes with these parameters, an array each."""
        import numpy as np

        count = len(next(iter(cells.values())))
        keep: Any = "all" if any(OBSERVABLES[name].keeps for name in self.names) else "counts"
        together = TOGETHER
        if keep == "all":
            together = int(min(max(KEPT // (self.run.get("periods") or KEPT), 1), TOGETHER))
        parts = []
        for first in range(0, count, together):
            some = {name: values[first : first + together] for name, values in cells.items()}
            parts.append(self._seen(some, keep))
        return {name: np.concatenate([part[name] for part in parts]) for name in self.names}

    def _seen(self, cells: dict[str, np.ndarray], keep: Any) -> dict[str, np.ndarray]:
        """The observables of some cells that are moved together."""
        import numpy as np

        from ..simulation import simulate
        from ..simulation.batches.many import simulate_many

        batch = self._batch(cells)
        motions: Any = None
        if batch is not None:
            motions = simulate_many(batch, keep=keep, workers=1, **self.run)
        names = {name: OBSERVABLES[name] for name in self.names}
        many = {name: one.of_many for name, one in names.items() if motions and one.of_many}
        found = {name: np.asarray(of_many(motions), float) for name, of_many in many.items()}
        single: dict[str, list[float]] = {name: [] for name in names if name not in found}
        if single:
            for motion in motions or (
                simulate(self.scene(**self.fixed, **cell), keep=keep, **self.run)
                for cell in _each(cells)
            ):
                seen = Seen(motion)
                for name, values in single.items():
                    values.append(float(names[name].of(seen)))
        return found | {name: np.array(values) for name, values in single.items()}

    def _batch(self, cells: dict[str, np.ndarray]) -> OscillatorBatch | None:
        """The oscillators as a batch; None if the scene takes numbers only."""
        from ..dynamics.arguments import made_of_arrays

        def scene(*values: np.ndarray) -> Any:
            return self.scene(**self.fixed, **dict(zip(cells, values, strict=True)))

        return made_of_arrays(scene, *cells.values())


def _each(cells: dict[str, np.ndarray]) -> Iterator[dict[str, float]]:
    """The parameters of each cell."""
    for values in zip(*(column.tolist() for column in cells.values()), strict=True):
        yield dict(zip(cells, values, strict=True))
