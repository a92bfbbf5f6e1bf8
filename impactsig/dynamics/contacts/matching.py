"""Agreement of two families of oscillators over a plane of two parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from ..._arguments import function, instance, number, reals, whole
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...simulation import simulate_many
from ..arguments import parameter_names, parameter_values

TOGETHER = 256  # motions that are kept at a time
RETURNS = "a function of both parameters that makes an Oscillator"


def strobe_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Mean distance between two stroboscopic sets, each sorted by displacement: e_c.

    The definition is our own, because the available text of the paper does not contain its
    definition [Tian]_. Orbits that pass through the same points at different phases of a common
    period have distance 0.

    Parameters
    ----------
    first, second : array_like, shape (n, 2)
        Displacement and velocity, ``np.column_stack(motion.stroboscopic())``; the same number of
        points in both.

    Returns
    -------
    float
        e_c, the mean of sqrt((x_1 - x_2)^2 + (v_1 - v_2)^2) over the points so sorted, in the units
        of the sets.

    Raises
    ------
    InvalidInput
        If a set has another shape, or a value is not finite.

    See Also
    --------
    match_rate

    Examples
    --------
    >>> from impactsig import strobe_distance
    >>> strobe_distance([[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.5], [0.0, 0.5]])
    0.5
    """
    sets = []
    for name, given in (("first", first), ("second", second)):
        points = reals(name, given, "an array of shape (n, 2)")
        if points.ndim != 2 or points.shape[1] != 2 or not len(points):
            raise InvalidInput(name, given, "an array of shape (n, 2)")
        if not np.all(np.isfinite(points)):
            raise InvalidInput(name, given, "finite numbers")
        sets.append(points)
    if len(sets[0]) != len(sets[1]):
        raise InvalidInput("second", f"{len(sets[1])} points", f"as many as first: {len(sets[0])}")
    return _distance(*sets)


def _distance(first: np.ndarray, second: np.ndarray) -> float:
    one, other = (points[np.lexsort(points.T[::-1])] for points in (first, second))
    return float(np.mean(np.hypot(*(one - other).T)))


@dataclass(frozen=True)
class MatchRate(Shown):
    """Share of a parameter plane in which two families of oscillators agree.

    Attributes
    ----------
    rate : float
        Share of the cells with a distance below `below`.
    distance : numpy.ndarray
        e_c of every cell, shape (len(y), len(x)); NaN where a motion ended early.
    x, y : numpy.ndarray
        The values of both parameters.
    below : float
        Greatest distance of a match.
    failed : int
        Cells in which a motion ended early; they count as no match.
    names : (str, str)
        Names of the parameters, as in the first family.

    See Also
    --------
    match_rate, strobe_distance, plot.match_rate

    Examples
    --------
    >>> from impactsig import match_rate, scenes
    >>> def hard(omega, amplitude):
    ...     return scenes.tian(omega, amplitude, "hard")
    >>> found = match_rate(hard, hard, [1.5], [0.5, 1.0], workers=1)
    >>> found.rate
    1.0
    """

    rate: float
    distance: np.ndarray = field(repr=False)
    x: np.ndarray = field(repr=False)
    y: np.ndarray = field(repr=False)
    below: float
    failed: int
    names: tuple[str, ...] = field(default=("parameter", "second parameter"), repr=False)

    plot = drawn_by("match_rate", "the distance over the plane")


def match_rate(
    first: Callable[[float, float], Oscillator],
    second: Callable[[float, float], Oscillator],
    x: Any,
    y: Any,
    *,
    periods: int = 100,
    transient: int = 200,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
    below: float = 0.1,
    workers: int | None = None,
) -> MatchRate:
    """Share of a parameter plane in which two families of oscillators agree [Tian]_.

    Both are simulated from the same start in every cell, and their stroboscopic sets after the
    transient are compared by `strobe_distance`.

    Parameters
    ----------
    first, second : callable
        The oscillator for a pair of parameters, such as ``lambda omega, amplitude:
        scenes.tian(omega, amplitude, "hard")``.
    x, y : array_like
        Values of the first and of the second parameter.
    periods, transient : int
        Numbers of forcing periods that are compared, and that are discarded before.
    initial : (float, float)
        Displacement and velocity at the start.
    phase : float
        Phase of the forcing at the start, as for `simulate`.
    below : float
        Cells with a smaller distance match; 0.1 in the paper.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    MatchRate
        `rate`, the share of the cells that match, and the `distance` e_c of each, shape (len(y),
        len(x)).

    Raises
    ------
    InvalidInput
        If an argument is out of range.

    See Also
    --------
    strobe_distance, fit_soft_stop, plot.match_rate

    Examples
    --------
    >>> from impactsig import match_rate, scenes
    >>> def hard(omega, amplitude):
    ...     return scenes.tian(omega, amplitude, "hard")
    >>> match_rate(hard, hard, [1.5], [0.5, 1.0], workers=1).rate
    1.0
    """
    for name, scene in (("first", first), ("second", second)):
        function(name, scene, RETURNS, 2)
    axes = parameter_values("x", x), parameter_values("y", y)
    run = {
        "periods": whole("periods", periods, 1),
        "transient": whole("transient", transient, 0),
        "initial": initial,
        "phase": phase,
        "workers": workers,
    }
    below = number("below", below, above=0)
    cells = np.full((len(axes[1]), len(axes[0])), np.nan)
    pairs = zip(_sets("first", first, axes, run), _sets("second", second, axes, run), strict=True)
    for n, (one, other) in enumerate(pairs):
        if one is not None and other is not None:
            cells.flat[n] = _distance(one, other)
    matched, failed = np.count_nonzero(cells < below), np.count_nonzero(np.isnan(cells))
    names = parameter_names(first, 2)
    return MatchRate(float(matched / cells.size), cells, *axes, below, int(failed), names)


def _sets(
    name: str,
    family: Callable[[float, float], Oscillator],
    axes: tuple[np.ndarray, ...],
    run: dict[str, Any],
) -> Iterator[np.ndarray | None]:
    """Stroboscopic set of every cell in order, a few motions at a time; None for a failed one."""
    cells = list(product(axes[1], axes[0]))
    for start in range(0, len(cells), TOGETHER):
        some = cells[start : start + TOGETHER]
        made = [instance(name, family(x, y), Oscillator, RETURNS) for y, x in some]
        for motion in simulate_many(made, **run):
            done = motion.status == "complete"
            yield np.column_stack(motion.stroboscopic(run["phase"])) if done else None
