"""`orbit_period`: period(m, n) of a simulated motion, by exact return."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..._arguments import instance, number, whole
from ..._showing import Shown
from ...errors import InvalidInput
from ...simulation import Motion
from ...simulation.basis.frame import reference_frequency
from ..arguments import recurring


@dataclass(frozen=True)
class OrbitPeriod(Shown):
    """The period of a motion, period(m, n): m impacts in n forcing periods.

    Attributes
    ----------
    periods : int or None
        n; None where the motion does not return within the tolerance.
    impacts : int or None
        m, the number of listed impacts; with chatter it depends on where the chatter is cut off.
    sticks : int or None
        Sticks in n periods.
    residual : float
        Greatest distance of the last n returns for the best n, relative to the size of the motion.
    tolerance : float
        Greatest distance of a return, relative to the size of the motion.

    See Also
    --------
    orbit_period, results.PeriodicOrbit

    Examples
    --------
    >>> from impactsig import orbit_period, scenes, simulate
    >>> found = orbit_period(simulate(scenes.karpodinis(22.1), periods=40, transient=1000))
    >>> found.impacts, found.periods
    (1, 1)
    """

    periods: int | None
    impacts: int | None
    sticks: int | None
    residual: float
    tolerance: float

    def __bool__(self) -> bool:
        return self.periods is not None

    def __str__(self) -> str:
        if self.periods is None:
            return "no period"
        return f"period({self.impacts}, {self.periods})"


def orbit_period(
    motion: Motion, *, longest: int = 64, tolerance: float = 1e-9, phase: float = 0.0
) -> OrbitPeriod:
    """Period of a motion: the least n after which the stroboscopic point returns.

    The last n points must coincide with the n points before them within the tolerance, which is
    relative to the maximum of ``hypot(x, v / omega)`` of all points about their mean.

    Parameters
    ----------
    motion : Motion
        From `simulate`, past its transient, over at least 2 n forcing periods.
    longest : int
        Greatest n to try.
    tolerance : float
        Greatest distance of a return. The rest of the transient limits how closely a motion
        returns.
    phase : float
        Phase of the strobe [rad].

    Returns
    -------
    OrbitPeriod
        n (`periods`) and m (`impacts`), None where the motion does not return, and the `residual`.

    Raises
    ------
    InvalidInput
        If the motion is not forced, its forcing is not periodic, or there are fewer than 2 points.

    See Also
    --------
    identify_period, find_periodic_orbit

    Examples
    --------
    >>> from impactsig import orbit_period, scenes, simulate
    >>> found = orbit_period(simulate(scenes.karpodinis(22.1), periods=40, transient=1000))
    >>> print(found)
    period(1, 1)
    """
    instance("motion", motion, Motion)
    phase = number("phase", phase)
    longest = whole("longest", longest, 1)
    tolerance = number("tolerance", tolerance, above=0)
    omega = reference_frequency(recurring("motion", motion.system))
    x, v = motion.stroboscopic(phase)
    if len(x) < 2:
        raise InvalidInput("motion", repr(motion), "a motion of two forcing periods or more")
    points = np.stack([x, v / omega], axis=1)
    # A rest is compared with what the greatest displacement and the stops are.
    places = [abs(stop.position) for stop in motion.system.stops]
    size = max(np.hypot(*(points - points.mean(axis=0)).T).max(), np.abs(points).max())
    size = max(size, 1e-6 * max(places, default=0.0), 1e-300)
    best = math.inf
    for n in range(1, min(longest, len(points) // 2) + 1):
        last, before = points[-n:], points[-2 * n : -n]
        off = float(np.hypot(*(last - before).T).max() / size)
        best = min(best, off)
        if off <= tolerance:
            impacts, sticks = _counts(motion, n)
            return OrbitPeriod(n, impacts, sticks, off, tolerance)
    return OrbitPeriod(None, None, None, best, tolerance)


def _counts(motion: Motion, n: int) -> tuple[int, int]:
    """Numbers of impacts and sticks in the last n periods."""
    assert motion.impacts is not None
    assert motion.sticks is not None
    period = motion.system.forcing_period
    assert period is not None
    # Half-open, with room for rounding: an impact at its very begin is also at its very end.
    end = motion.stop - 1e-9 * period
    start = end - n * period
    counts = []
    for time in (motion.impacts.time, motion.sticks[:, 0]):
        counts.append(int(np.count_nonzero((time > start) & (time <= end))))
    return counts[0], counts[1]
