"""Continuation of a periodic orbit in a parameter, with its bifurcations."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..._arguments import entries, function, number, whole
from ...errors import InvalidInput
from ...oscillators import Cantilever, Oscillator
from ...oscillators.flows import Flow
from ...simulation import FixedStep, RungeKutta
from ..arguments import recurring
from ._arclength import Continuation
from .branches import Branch
from .orbits import find_periodic_orbit

BOUNDS = "two numbers: where to begin, and where to end"


def continue_orbit(
    scene_of_parameter: Callable[[float], Oscillator | Cantilever | Flow],
    values: Sequence[float],
    periods: int = 1,
    *,
    period: float | None = None,
    guess: Sequence[float] | None = None,
    impacts: int | None = None,
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    tolerance: float = 1e-10,
    most: int = 2000,
) -> Branch:
    """Continue a periodic orbit in a parameter, around folds, until it grazes.

    Pseudo-arclength continuation of the fixed point of the stroboscopic map [Keller1977]_, with its
    derivative from `tangent_map`; of a flow, of state and period of the orbit. Folds and period
    doublings are located on the branch by bisection. At grazing, where an approach velocity becomes
    zero or another stop is touched, the derivative of the map is unbounded [Nordmark1991]_. The
    branch of period(m, n) ends there, and the parameter at which its least approach velocity or its
    clearance vanishes is located.

    Parameters
    ----------
    scene_of_parameter : callable
        Returns the oscillator, cantilever, flow or controlled oscillator for a value of the
        parameter.
    values : (float, float)
        First and last value of the parameter. The branch also ends if it leaves this range after a
        fold.
    periods, period, guess, impacts, phase, method, tolerance
        The first orbit, as for `find_periodic_orbit`.
    most : int
        Greatest number of points.

    Returns
    -------
    Branch

    Raises
    ------
    InvalidInput
        If an argument is out of its range, the forcing is not periodic
        (`Oscillator.forcing_recurs`) at some value of the parameter, or no first orbit is found.

    See Also
    --------
    find_periodic_orbit, bifurcation_diagram, plot.branch

    Examples
    --------
    >>> from impactsig import continue_orbit, scenes
    >>> branch = continue_orbit(scenes.karpodinis, (22.1, 21.9))
    >>> branch.status, branch.special
    ('end of range', ())
    """
    function("scene_of_parameter", scene_of_parameter, "a function of a number", 1)
    ends = entries("values", values, BOUNDS)
    if len(ends) != 2:
        raise InvalidInput("values", values, BOUNDS)
    first, last = (number("values", value) for value in ends)
    if first == last:
        raise InvalidInput("values", values, "two different numbers")
    whole("most", most, 2)
    machine = scene_of_parameter(first)
    if isinstance(machine, Oscillator) or not hasattr(machine, "moved_by"):
        recurring("scene_of_parameter", machine)
    start = find_periodic_orbit(
        machine, periods, period=period, guess=guess, impacts=impacts, phase=phase, method=method,
        tolerance=tolerance,
    )  # fmt: skip
    if not start.found:
        raise InvalidInput(
            "guess", guess, f"a start from which an orbit is found at {first:g}",
            f"The iteration ended {start.status}, {start.residual:.1g} off",
        )  # fmt: skip
    options = {"phase": phase, "method": method, "tolerance": tolerance}
    return Continuation(scene_of_parameter, first, last, start, options).follow(most)
