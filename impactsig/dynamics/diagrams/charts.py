"""Periodicity charts: period(m, n) of every cell of a plane of two parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..._arguments import flag, function, number, thread_count, whole
from ..._running.threads import in_threads
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...simulation.basis.columns import Columns, chosen, columns_of, form_of, spread
from ...simulation.basis.events import DONE, STROBE_IMPACTS
from ...simulation.basis.frame import first_phase, place_of
from ...simulation.batches.moving import takes
from ...simulation.exact.exact import piecewise_linear
from ...simulation.run import span
from ...studies.device import Executor, on_gpu
from ..arguments import made_of_arrays, parameter_names, parameter_values
from ._flow_sections import Section, checked_section
from ._whole_motions import SYSTEMS, checked_whole, whole_motion
from .settling.cells import follow_cells
from .settling.settling import settle

TOGETHER = 4096  # cells that one call of the kernel follows
STROBES = 1_000_000  # and how many strobes they may take, which are kept until it is done
AT_REST = (0.0, 0.0)
FOR_GPU = "for a GPU, a function that makes oscillators that are linear between events"
SILENT, IMPACTING, HIGHER, FAILED = 0, 1, 2, -1


@dataclass(frozen=True)
class PeriodicityChart(Shown):
    """Chart of period(m, n) over a plane of two parameters.

    Attributes
    ----------
    periods : numpy.ndarray, shape (len(y), len(x))
        Number n of forcing periods of the orbit; 0 if it did not close, for example because the
        forcing is not periodic (`Oscillator.forcing_recurs`).
    impacts : numpy.ndarray of int
        Impacts m in as many periods, -1 where it has not closed.
    followed : numpy.ndarray of int
        Number of forcing periods that were simulated.
    failed : numpy.ndarray of bool
        Where a motion ended early.
    x, y : numpy.ndarray
        Values of the parameters.
    names : (str, str)
        Their names, as in the scene.

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

    plot = drawn_by("periodicity_chart", "the chart")


def periodicity_chart(
    scene: Callable[[float, float], Any],
    x: Any,
    y: Any,
    *,
    periods: int = 200,
    initial: Any = None,
    phase: float = 0.0,
    section: tuple[str | int, float] | None = None,
    closed: float = 1e-6,
    skip: bool = True,
    executor: Executor = "threads",
    workers: int | None = None,
) -> PeriodicityChart:
    """Chart of period(m, n) over a plane of two parameters, every cell from the same start.

    The motion of a cell is sampled once per forcing period. Its orbit has closed after n periods if
    it returns, after the same number of impacts, and the estimated rest of the transient is below
    `closed`. If that takes long, the orbit is found by Newton's method, and accepted if it is
    stable and the motion approaches it at the rate of its multipliers.

    Parameters
    ----------
    scene : callable
        The `Oscillator`, `Cantilever`, `Flow` or `Controlled` oscillator for a pair of parameters,
        such as ``lambda gamma, friction: scenes.begley_virgin(gamma, 1.5, friction)``. Systems
        other than oscillators are simulated for all `periods`; their orbit has closed if the last
        stroboscopic points return within `closed`, after at most a quarter of the periods. For a
        flow both n and m count returns to the section, and (1, 0) is rest.
    x, y : array_like
        Values of the first and of the second parameter.
    periods : int
        Greatest number of forcing periods, or of returns of a flow, for each cell.
    initial : optional
        State at the start, as for `simulate`; by default at rest, or the initial state of the flow.
    phase : float
        Phase of the forcing at start and strobes [rad]. Not for flows.
    section : (str or int, float), optional
        Of flows: name or number of a coordinate, and the level that it crosses upwards.
    closed : float
        Tolerance as a share of the size of displacement and velocity.
    skip : bool
        Whether a cell ends as soon as its orbit has closed or been found by Newton's method, which
        is tried after 24, 48, 96, ... periods. The orbit is the same without it.
    executor : {"threads", "gpu"}
        Where the oscillators are computed, as for `simulate_many`; a GPU takes no other systems.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    PeriodicityChart

    Raises
    ------
    InvalidInput
        If an argument is out of range, or the scene does not return a system.

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
    function("scene", scene, f"a function of both parameters that makes {SYSTEMS}", 2)
    flag("skip", skip)
    cut = checked_section(section)
    gpu = on_gpu(executor, workers)
    threads = 1 if gpu else thread_count(workers)
    first, second = (grid.ravel() for grid in np.meshgrid(*axes))
    batch = made_of_arrays(scene, first, second)
    most = (2**16, 2**25) if gpu else (TOGETHER, STROBES)
    together = max(1, min(most[0], most[1] // periods))
    parts = -(-len(first) // together)
    if threads > 1:  # every so many cells, as work differs from one part of a chart to another
        parts = min(max(parts, threads), len(first))
    found = np.empty((4, len(first)), int)

    def some(at: int) -> None:
        found[:, at::parts] = cells_of(slice(at, None, parts))

    def cells_of(which: slice) -> np.ndarray:
        if batch is not None:
            return _exact_cells(chosen(columns, which), periods, closed, skip, start, phase, gpu)
        machines = [scene(a, b) for a, b in zip(first[which], second[which], strict=True)]
        return _cells(machines, periods, closed, skip, initial, phase, cut, gpu)

    if batch is not None:
        columns, start = spread(batch.columns, len(first)), AT_REST if initial is None else initial
    in_threads(some, range(parts), threads)
    n, impacts, followed, failed = (column.reshape(len(axes[1]), len(axes[0])) for column in found)
    names = parameter_names(scene, 2)
    return PeriodicityChart(n, impacts, followed, failed.astype(bool), *axes, names)


def _cells(
    machines: list[Any], periods: int, closed: float, skip: bool, initial: Any, phase: float,
    section: Section | None, gpu: bool,
) -> np.ndarray:  # fmt: skip
    """Cells of systems of any kind, as rows: n, m, periods followed, whether they failed."""
    found = np.zeros((4, len(machines)), int)
    forms: dict[Any, list[int]] = {}
    start = AT_REST if initial is None else initial
    for k, machine in enumerate(machines):
        exact = isinstance(machine, Oscillator) and piecewise_linear(machine)
        if gpu and (not exact or machine.noise is not None):
            raise InvalidInput("scene", machine, FOR_GPU, 'Else take executor="threads"')
        if not isinstance(machine, Oscillator) or machine.noise is not None:
            found[:, k] = _whole_cell(machine, periods, closed, initial, phase, section)
        elif exact:
            forms.setdefault(form_of(machine), []).append(k)
        else:
            found[:, k] = _stepped_cell(machine, periods, closed, skip, start, phase)
    for which in forms.values():
        columns = columns_of(machines[k] for k in which)
        found[:, which] = _exact_cells(columns, periods, closed, skip, start, phase, gpu)
    return found


def _exact_cells(
    columns: Columns, periods: int, closed: float, skip: bool, initial: Any, phase: float,
    gpu: bool,
) -> np.ndarray:  # fmt: skip
    """Cells of piecewise linear oscillators, as rows."""
    if gpu:
        takes(columns.form)
    span(periods, None, 0.0, columns.form.forces > 0 or columns.form.base is not None)
    n = columns.n
    places = np.broadcast_to(np.array(place_of(initial)), (n, 2))
    phases = np.full(n, first_phase(phase))
    cells = follow_cells(columns, periods, places, phases, closed, skip, gpu)
    return np.stack([cells.periods, cells.impacts, cells.followed, cells.status != DONE])


def _stepped_cell(
    machine: Oscillator, periods: int, closed: float, skip: bool, initial: Any, phase: float
) -> tuple[int, int, int, bool]:
    """The cell of an oscillator that is stepped."""
    settled = settle(machine, periods, tolerance=closed, ends=skip, initial=initial, phase=phase)
    orbit = settled.closing()
    n = orbit.closed
    impacts = int(orbit.strobes[-n:, STROBE_IMPACTS].sum()) if n else -1
    return n, impacts, len(settled.strobes) - 1, settled.status != "complete"


def _whole_cell(
    system: Any, periods: int, closed: float, initial: Any, phase: float, section: Section | None
) -> tuple[int, int, int, bool]:
    """The cell of a system that is simulated as a whole."""
    look = max(periods // 2, 1)
    checked_whole(system, section)
    found = whole_motion(system, look, periods - look, initial, phase, section)
    if isinstance(found, str):
        return 0, -1, 0, True
    n = found.closed(closed)
    return n, len(found.speeds_since(found.since(n))) if n else -1, periods, False
