"""What an oscillator does over a plane of two parameters: period(m, n) of every cell."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import flag, function, number, thread_count, whole
from .._showing import Shown
from ..oscillators import Oscillator
from ..simulate._events import STROBE_IMPACTS
from ..simulate._run import without_noise
from ._arguments import parameter_names, parameter_values
from ._settling import settle_all
from ._whole_motions import SYSTEMS, checked_whole, whole_motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TOGETHER = 64  # cells that one call of the kernel follows
STROBES = 200_000  # and how many strobes they may take, which are kept until it is done
SILENT, IMPACTING, HIGHER, FAILED = 0, 1, 2, -1


@dataclass(frozen=True)
class PeriodicityChart(Shown):
    """period(m, n) over a plane of two parameters.

    Attributes
    ----------
    periods : numpy.ndarray, shape (len(y), len(x))
        Forcing periods n of the orbit; 0 where it has not closed, as where the forcing does not
        recur (`Oscillator.forcing_recurs`).
    impacts : numpy.ndarray of int
        Impacts m in as many periods, likewise; -1 where it has not closed.
    followed : numpy.ndarray of int
        Forcing periods that were followed.
    failed : numpy.ndarray of bool
        Where a motion ended early.
    x, y : numpy.ndarray
        Values of the parameters.
    names : (str, str)
        What they are called: what the scene calls them.

    See Also
    --------
    periodicity_chart, plot.periodicity_chart

    Examples
    --------
    >>> from impactsig import periodicity_chart, scenes
    >>> def beam(frequency, amplitude):
    ...     return scenes.karpodinis(frequency, amplitude=amplitude)
    >>> found = periodicity_chart(beam, [22.0, 22.1], [0.25], workers=1)
    >>> found.impacts, found.periods
    (array([[1, 1]]), array([[1, 1]]))
    """

    periods: np.ndarray = field(repr=False)
    impacts: np.ndarray = field(repr=False)
    followed: np.ndarray = field(repr=False)
    failed: np.ndarray = field(repr=False)
    x: np.ndarray = field(repr=False)
    y: np.ndarray = field(repr=False)
    names: tuple[str, ...] = field(default=("parameter", "second parameter"), repr=False)

    @property
    def classes(self) -> np.ndarray:
        """The classes of [BegleyVirgin1998]_, shape (len(y), len(x)).

        0: period-1 without impact; 1: period-1 with impacts; 2: higher, or not closed (chaos, or
        a transient that lasts); -1: the motion ended early.
        """
        found = np.where(self.impacts > 0, IMPACTING, SILENT)
        found = np.where(self.periods == 1, found, HIGHER)
        return np.where(self.failed, FAILED, found)

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the chart; see `impactsig.plot.periodicity_chart`."""
        from ..plot import periodicity_chart

        return periodicity_chart(self, ax=ax, **options)


def periodicity_chart(
    scene: Callable[[float, float], Any],
    x: Any,
    y: Any,
    *,
    periods: int = 200,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
    closed: float = 1e-6,
    skip: bool = True,
    workers: int | None = None,
) -> PeriodicityChart:
    """period(m, n) over a plane of two parameters, each cell from the same start.

    A cell is strobed once a forcing period; its orbit has closed after n periods when it is back
    with what is left of the transient, as it shrinks, below `closed`, after as many impacts. Where
    that takes longer than the cell has, its orbit is the one that Newton's method finds beside it,
    if that is stable and the motion comes nearer to it as its multipliers say.

    Parameters
    ----------
    scene : callable
        The `Oscillator`, `Cantilever` or `Controlled` oscillator for a pair of parameters, such as
        ``lambda gamma, friction: scenes.begley_virgin(gamma, 1.5, friction)``. Cantilevers and
        controlled oscillators run for all `periods`, and have closed where the last strobes have
        returned within `closed`, after at most a quarter of these.
    x, y : array_like
        Values of the first and of the second parameter.
    periods : int
        Forcing periods that a cell is followed for.
    initial : (float, float)
        Displacement and velocity at the start.
    phase : float
        Phase of the forcing at start and strobes [rad].
    closed : float
        Tolerance as a share of the size of displacement and velocity.
    skip : bool
        Whether a cell ends as soon as its orbit has closed; the orbit is the same without it.
    workers : int, optional
        Threads; as many as there are cores unless given. The result does not depend on it.

    Returns
    -------
    PeriodicityChart

    Raises
    ------
    InvalidInput
        If an argument is out of range, or the scene makes no oscillator.

    See Also
    --------
    bifurcation_diagram, basins_of_attraction, plot.periodicity_chart

    Examples
    --------
    >>> from impactsig import periodicity_chart, scenes
    >>> def beam(frequency, amplitude):
    ...     return scenes.karpodinis(frequency, amplitude=amplitude)
    >>> periodicity_chart(beam, [22.0, 22.1], [0.25], workers=1).impacts
    array([[1, 1]])
    """
    axes = parameter_values("x", x), parameter_values("y", y)
    periods = whole("periods", periods, 1)
    closed = number("closed", closed, above=0, most=1e-2)
    function("scene", scene, f"a function of both parameters that makes {SYSTEMS}")
    flag("skip", skip)
    threads = thread_count(workers)
    pairs = [(a, b) for b in axes[1].tolist() for a in axes[0].tolist()]

    together = max(1, min(TOGETHER, STROBES // periods))

    def some(first: int) -> list[tuple[int, int, int, bool]]:
        machines = [scene(a, b) for a, b in pairs[first : first + together]]
        if not all(isinstance(machine, Oscillator) for machine in machines):
            return [_whole_cell(machine, periods, closed, initial, phase) for machine in machines]
        for machine in machines:
            without_noise(machine)
        motions = settle_all(
            machines, periods, tolerance=closed, ends=skip, initial=initial, phase=phase
        )
        found = []
        for settled in motions:
            orbit = settled.closing()
            n = orbit.closed
            impacts = int(orbit.strobes[-n:, STROBE_IMPACTS].sum()) if n else -1
            failed = settled.status != "complete"
            found.append((n, impacts, len(settled.strobes) - 1, failed))
        return found

    with ThreadPoolExecutor(threads) as pool:
        cells = [cell for part in pool.map(some, range(0, len(pairs), together)) for cell in part]
    n, impacts, followed, failed = (
        np.array(column).reshape(len(axes[1]), len(axes[0])) for column in zip(*cells, strict=True)
    )
    return PeriodicityChart(n, impacts, followed, failed, *axes, parameter_names(scene, 2))


def _whole_cell(
    system: Any, periods: int, closed: float, initial: Any, phase: float
) -> tuple[int, int, int, bool]:
    """A cell of a system that is simulated whole: n, m, periods followed, whether it failed."""
    look = max(periods // 2, 1)
    found = whole_motion(checked_whole(system), look, periods - look, initial, phase)
    if isinstance(found, str):
        return 0, -1, 0, True
    n = found.closed(closed)
    start = found.motion.stop - n * system.forcing_period * (1 + 1e-12)
    return n, len(found.motion.impacts.between(start)) if n else -1, periods, False
