"""Bifurcation diagrams over one parameter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._arguments import Seed, flag, function, number, streams, thread_count, whole
from ..._showing import Shown, drawn_by
from ..arguments import parameter_names, parameter_values
from ._cells import Look, carried
from ._flow_sections import checked_section
from ._whole_motions import SYSTEMS


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationDiagram(Shown):
    """Bifurcation diagram: section points and impacts over one parameter, after the transient.

    Attributes
    ----------
    values : numpy.ndarray, shape (n,)
        Values of the parameter.
    strobe : tuple of numpy.ndarray
        For each value, displacement and velocity once per forcing period, shape (k, 2), or the
        states of a flow on the section, shape (k, d). For an orbit that has closed, each of its
        points once.
    velocity : tuple of numpy.ndarray
        For each value, the approach velocities of the impacts in the same span; for a flow, the
        rates of change of the coordinate at its crossings.
    periods, impacts : numpy.ndarray of int, shape (n,)
        n and m of period(m, n), m impacts in n forcing periods; 0 and -1 if the orbit did not
        close. For a flow both count returns to the section, and (1, 0) is rest.
    impacts_per_period : numpy.ndarray, shape (n,)
        Mean number of impacts per forcing period, a_i.
    energy_per_period : numpy.ndarray, shape (n,)
        Energy lost at stops, relative to them, and by friction, per forcing period; NaN for a
        cantilever with a soft stop, for a flow, under control and under noise.
    kinetic_energy_per_period : numpy.ndarray, shape (n,)
        Change of the kinetic energy of the body, relative to the ground, in impacts, per forcing
        period (`Motion.kinetic_energy_gained`): a_e of [Okolewski2021]_. NaN for a cantilever, for
        a flow, under control and under noise.
    sticking : numpy.ndarray, shape (n,)
        Fraction of the time at rest at a stop or under friction; NaN for a flow and under noise.
    exponents : numpy.ndarray, shape (n, d), or None
        Lyapunov exponents per unit of time of the oscillator, if requested: from the multipliers of
        an orbit that has closed, otherwise over the span. -inf for a direction that collapses.
    status : tuple of str
        As in `Motion`, for each value; "no return" for a flow that neither crosses its section nor
        comes to rest. Unknown quantities of a motion that ended early are NaN.
    parameter : str
        Name of the parameter, as in the scene.

    See Also
    --------
    bifurcation_diagram, plot.bifurcation_diagram

    Examples
    --------
    >>> from impactsig import bifurcation_diagram, scenes
    >>> found = bifurcation_diagram(scenes.karpodinis, [22.0, 22.1])
    >>> found.parameter, found.impacts, found.periods
    ('frequency', array([1, 1]), array([1, 1]))
    """

    values: np.ndarray
    strobe: tuple[np.ndarray, ...]
    velocity: tuple[np.ndarray, ...]
    periods: np.ndarray
    impacts: np.ndarray
    impacts_per_period: np.ndarray
    energy_per_period: np.ndarray
    kinetic_energy_per_period: np.ndarray
    sticking: np.ndarray
    exponents: np.ndarray | None
    status: tuple[str, ...]
    parameter: str = "parameter"

    def __repr__(self) -> str:
        closed = np.count_nonzero(self.periods)
        failed = sum(status != "complete" for status in self.status)
        told = f"{len(self.values)} values, {closed} of them on closed orbits"
        return f"BifurcationDiagram({told}{f', {failed} failed' if failed else ''})"

    plot = drawn_by("bifurcation_diagram", "one quantity over the parameter")


def bifurcation_diagram(
    scene: Callable[[float], Any],
    values: Any,
    *,
    periods: int = 100,
    transient: int = 400,
    initial: Any = None,
    phase: float = 0.0,
    section: tuple[str | int, float] | None = None,
    carry: bool = False,
    exponents: bool = False,
    closed: float = 1e-9,
    skip: bool = True,
    seed: Seed = None,
    workers: int | None = None,
) -> BifurcationDiagram:
    """Bifurcation diagram of a system over one parameter.

    The simulation of an oscillator ends as soon as its orbit has closed. Cantilevers and controlled
    oscillators are simulated for the full time, and their orbit is determined from the stroboscopic
    points (of a cantilever in all its modes). A flow is sampled at a section, and its returns count
    as periods. Under noise no orbit closes, and the stroboscopic points are those of one path.

    Parameters
    ----------
    scene : callable
        The `Oscillator`, `Cantilever`, `Flow` or `Controlled` oscillator for a value of the
        parameter, such as ``scenes.karpodinis``.
    values : array_like
        Values of the parameter; with `carry`, in the order of the continuation.
    periods, transient : int
        Numbers of forcing periods, or of returns of a flow, that are evaluated, and that are
        discarded before.
    initial : optional
        State at the start, as for `simulate`; by default at rest, or the initial state of the flow.
    phase : float
        Phase of the forcing at starts and strobes [rad]. Not for flows.
    section : (str or int, float), optional
        Of flows: name or number of a coordinate, and the level that it crosses upwards.
    carry : bool
        Whether to start each value at the final state of the previous one instead of at `initial`,
        with the displacement relative to the stops and the velocity scaled by the forcing
        frequency. The values are then computed one after another. Only for oscillators.
    exponents : bool
        Whether to compute the Lyapunov exponents. Not under control or noise.
    closed : float
        Tolerance of the return of an orbit, relative to the size of displacement and velocity. If
        the transient is too short for it, the orbit is found as in `periodicity_chart`.
    skip : bool
        Whether a simulation ends as soon as its orbit has closed, since the rest follows from it.
    seed : int, SeedSequence or Generator, optional
        Seed of the noise, which differs between values. The same seed gives the same result; a
        Generator is advanced.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    BifurcationDiagram

    Raises
    ------
    InvalidInput
        If an argument is out of range, or the scene does not return a system.

    See Also
    --------
    periodicity_chart, continue_orbit, plot.bifurcation_diagram

    Examples
    --------
    >>> from impactsig import bifurcation_diagram, scenes
    >>> found = bifurcation_diagram(scenes.karpodinis, [22.0, 22.1])
    >>> found.impacts_per_period
    array([1., 1.])
    """
    chosen = parameter_values("values", values)
    options = {"initial": initial, "phase": phase}
    look = Look(
        whole("periods", periods, 1),
        whole("transient", transient, 1),
        number("closed", closed, above=0, most=1e-2),
        flag("skip", skip),
        flag("exponents", exponents),
        checked_section(section),
    )
    seeds = streams(seed, len(chosen))
    function("scene", scene, f"a function of the parameter that makes {SYSTEMS}", 1)
    threads = thread_count(workers)
    if flag("carry", carry):
        cells = list(carried(scene, chosen, look, options))
    else:
        machines = [scene(float(at)) for at in chosen]
        cells = look.cells(machines, seeds, threads, **options)

    def column(name: str) -> np.ndarray:
        return np.array([getattr(cell, name) for cell in cells])

    return BifurcationDiagram(
        values=chosen,
        strobe=tuple(cell.strobe for cell in cells),
        velocity=tuple(cell.velocity for cell in cells),
        periods=column("periods"),
        impacts=column("impacts"),
        impacts_per_period=column("impacts_per_period"),
        energy_per_period=column("energy_per_period"),
        kinetic_energy_per_period=column("kinetic_energy_per_period"),
        sticking=column("sticking"),
        exponents=column("exponents") if exponents else None,
        status=tuple(cell.status for cell in cells),
        parameter=parameter_names(scene, 1)[0],
    )
