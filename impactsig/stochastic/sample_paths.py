"""One path of an oscillator under a random force."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from .._arguments import Seed, whole
from ..impacts import Impacts, exact
from ..oscillators import Oscillator
from ._arguments import course
from ._running import Method, Mover, key_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BATCH = 4096  # looks between two visits of the kernel
ROOM = 1 << 16  # impacts that a visit has room for


@dataclass(frozen=True, eq=False, repr=False)
class SamplePath:
    """One path, as it was seen at equal intervals.

    Attributes
    ----------
    oscillator : Oscillator
        What moved.
    time : numpy.ndarray, shape (n,)
        Instants since the start of the simulation, transient included [s].
    x, v : numpy.ndarray, shape (n,)
        Displacement and velocity against the ground, in the oscillator's units.
    impacts : Impacts
        Impacts and touches in the time looked at, with their approach velocities.
    step : float
        Step [s].
    status : str
        "complete" or "diverged"; what was computed until then is kept.
    """

    oscillator: Oscillator
    time: np.ndarray = field(repr=False)
    x: np.ndarray = field(repr=False)
    v: np.ndarray = field(repr=False)
    impacts: Impacts
    step: float
    status: str

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw displacement over time with the impacts; see `impactsig.plot.sample_path`."""
        from ..plot import sample_path

        return sample_path(self, ax=ax)

    def __repr__(self) -> str:
        unit = " s" if self.oscillator.in_seconds else ""
        return (
            f"SamplePath({len(self.time)} instants over {np.ptp(self.time):g}{unit}, step "
            f"{self.step:.3g}{unit}, {len(self.impacts.time)} impacts; {self.status})"
        )


def sample_path(
    oscillator: Oscillator,
    *,
    path: int = 0,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
    seed: Seed = None,
    method: Method = "splitting",
    step: float | None = None,
    every: float | None = None,
) -> SamplePath:
    """One path of an oscillator under its noise, step by step.

    With the same seed, steps and method it is the path of that number of `simulate_ensemble`, to
    the last bit; to rounding only, where numba has Intel's SVML and the law takes sines.

    Parameters
    ----------
    oscillator : Oscillator
        What moves, with its noise.
    path : int
        Its number.
    periods, duration, transient, initial, phase, seed, method, step
        As for `simulate_ensemble`.
    every : float, optional
        Time from one instant to the next [s]; a step by default.

    Returns
    -------
    SamplePath

    Raises
    ------
    InvalidInput
        As `simulate_ensemble` does.
    """
    from ._equation import SPEED, WHICH

    path = whole("path", path, 0)
    found = course(
        oscillator, 1, periods=periods, duration=duration, transient=transient, initial=initial,
        phase=phase, method=method, step=step, every=every, look=1,
    )  # fmt: skip
    mover = Mover(oscillator, found.step, method, found.phase, key_of(seed))
    group = mover.start(found.q, found.v, np.array([path]))
    group.move(found.before)
    seen, hits = [np.empty((1, 0, 2))], [np.empty((0, 3))]
    done, batch = 0, max(BATCH // found.every, 1)
    while done < found.looks:
        some = min(batch, found.looks - done)
        events = np.empty((ROOM, 3))
        group.count[:] = 0
        seen.append(group.move(some * found.every, found.every, some, events))
        hits.append(events[: min(group.count[0], ROOM)])
        done += some
    x, v = np.concatenate(seen, axis=1)[0].T
    finite = np.isfinite(x) & np.isfinite(v)
    good = len(x) if finite.all() else int(np.argmin(finite))
    unit = oscillator.time_unit
    start = found.before * found.step * unit
    span = good * found.every * found.step * unit
    hit = np.concatenate(hits)
    hit = hit[(hit[:, 0] * unit >= start) & (hit[:, 0] * unit <= start + span)]
    hit = hit[np.argsort(hit[:, 0], kind="stable")]
    return SamplePath(
        oscillator=oscillator,
        time=start + unit * found.step * found.every * np.arange(1, good + 1),
        x=x[:good].copy(),
        v=v[:good].copy(),
        impacts=Impacts(
            hit[:, 0] * unit,
            approach_velocity=hit[:, SPEED],
            stop_index=hit[:, WHICH],
            **exact(len(hit)),
            start=start,
            duration=span,
            source=oscillator.name,
        ),
        step=found.step * unit,
        status="complete" if good == len(x) else "diverged",
    )
