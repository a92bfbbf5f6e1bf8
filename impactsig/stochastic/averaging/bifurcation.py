"""P-bifurcation: changes of the shape of an averaged joint density with a parameter."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..._arguments import function, number, reals
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...oscillators import Oscillator
from .averaging import Impact, averaged_density
from .shapes import DensityShape

MOST = 64  # transitions between two neighbouring values


@dataclass(frozen=True)
class Transition:
    """A parameter value at which the class of the density changes.

    Attributes
    ----------
    value : float
        Value of the parameter.
    before, after : str
        Classes at lesser and at greater values; see `DensityShape.name`.
    """

    value: float
    before: str
    after: str


@dataclass(frozen=True)
class PBifurcation(Shown):
    """The shape of an averaged joint density over one parameter.

    Attributes
    ----------
    values : numpy.ndarray, shape (n,)
        Values of the parameter, ascending.
    shapes : tuple of DensityShape
        Extrema of the joint density at each value, without peaks below `least`.
    transitions : tuple of Transition
        Changes of the class.
    least : float
        Fraction of the highest peak below which a peak is not counted.
    parameter : str
        Name of the parameter, as in the scene.

    See Also
    --------
    p_bifurcation, results.DensityShape, plot.p_bifurcation

    Examples
    --------
    >>> from impactsig import p_bifurcation, scenes
    >>> found = p_bifurcation(scenes.van_der_pol_duffing, [0.9, 0.99])
    >>> found.parameter, found.values
    ('restitution', array([0.9 , 0.99]))
    """

    values: np.ndarray = field(repr=False)
    shapes: tuple[DensityShape, ...] = field(repr=False)
    transitions: tuple[Transition, ...]
    least: float
    parameter: str

    @property
    def classes(self) -> tuple[str, ...]:
        """The class at each value; see `DensityShape.name`."""
        return tuple(shape.name for shape in self.shapes)

    @property
    def peaks(self) -> np.ndarray:
        """Peaks along the velocity at each value, shape (n,): the papers' "one", "two", "three"."""
        return np.array([shape.peaks() for shape in self.shapes])

    plot = drawn_by("p_bifurcation", "the energies of the extrema")


def p_bifurcation(
    scene: Callable[[float], Oscillator],
    values: Any,
    *,
    impact: Impact = "logarithmic",
    least: float = 0.0,
    tolerance: float = 1e-10,
) -> PBifurcation:
    """P-bifurcations: changes in the shape of an averaged joint density [Arnold1998]_.

    The joint density p(x, v) is a function of the energy whose extrema are the bottom of the well
    and the orbits on which the energy gained by damping in a cycle equals the loss at the stops
    (`DensityShape`). Its class changes where two of these orbits appear or vanish together, or
    where one emerges from the bottom. This does not depend on the intensity of the noise, which
    changes height and width of the peaks but not their positions. p(H), which may have a pole at
    the bottom, is not used.

    Papers that count "one", "two" and "three peaks" refer to a cut along the velocity
    (`DensityShape.peaks`). For the Van der Pol-Duffing scene the peak at the bottom, which is due
    to friction, never vanishes with friction: over restitution coefficients from 0.95 to 0.99 the
    classes are one peak and, from 0.970 on, three. The papers count two where the central peak is
    too low to be visible: at 0.99 it has 0.6 % of the height of the ridge. With ``least=0.02`` the
    sequences of the papers are reproduced: over restitution one, three, two, and over friction 0,
    2, 2.5, 3 two, three, three, one.

    Parameters
    ----------
    scene : callable
        The oscillator for a value of the parameter.
    values : array_like
        Values of the parameter, rising.
    impact : {"logarithmic", "exact", "linearised"}
        As in `averaged_density`.
    least : float
        Fraction of the highest peak below which a peak is not counted. If it is not 0, transitions
        depend on the intensity of the noise.
    tolerance : float
        Accuracy of a transition, as a fraction of the distance of neighbouring values.

    Returns
    -------
    PBifurcation

    Raises
    ------
    InvalidInput
        If an argument is out of range, the scene makes no oscillator, or one that cannot be
        averaged.

    See Also
    --------
    averaged_density, plot.p_bifurcation

    Examples
    --------
    >>> from impactsig import p_bifurcation, scenes
    >>> found = p_bifurcation(lambda r: scenes.van_der_pol_duffing(r), [0.9, 0.99])
    >>> found.values, found.parameter
    (array([0.9 , 0.99]), 'r')
    """
    function("scene", scene, "a function of the parameter that makes an Oscillator", 1)
    chosen = _rising(values)
    least = number("least", least, least=0.0, most=1.0)
    tolerance = number("tolerance", tolerance, above=0, most=0.1)

    def shape(value: float) -> DensityShape:
        oscillator = scene(value)
        if not isinstance(oscillator, Oscillator):
            raise InvalidInput("scene", oscillator, "a function that makes an Oscillator")
        return averaged_density(oscillator, impact=impact).shape.visible(least)

    shapes = tuple(map(shape, chosen.tolist()))
    found: list[Transition] = []
    for k in range(len(chosen) - 1):
        low, high = float(chosen[k]), float(chosen[k + 1])
        resolved = tolerance * (high - low)
        here, there = shapes[k].name, shapes[k + 1].name
        for _ in range(MOST):
            if here == there:
                break
            low, beyond, after = _change(lambda value: shape(value).name, low, high, here, resolved)
            found.append(Transition(low, here, after or there))
            low, here = beyond, after or there
    return PBifurcation(chosen, shapes, tuple(found), least, _name(scene))


def _change(
    kind: Callable[[float], str], low: float, high: float, here: str, resolved: float
) -> tuple[float, float, str]:
    """Bracket the parameter at which the class changes; returns the next class too."""
    after = ""
    while high - low > resolved and low < (middle := (low + high) / 2) < high:
        seen = kind(middle)
        if seen == here:
            low = middle
        else:
            high, after = middle, seen
    return (low + high) / 2, high, after


def _rising(values: Any) -> np.ndarray:
    required = "a sequence of finite numbers, at least one"
    found = reals("values", values, required)
    if found.ndim != 1 or not found.size or not np.all(np.isfinite(found)):
        raise InvalidInput("values", values, required)
    if np.any(np.diff(found) <= 0):
        raise InvalidInput("values", values, "rising values")
    return found


def _name(scene: Callable[..., Any]) -> str:
    try:
        return next(iter(inspect.signature(scene).parameters), "parameter")
    except (TypeError, ValueError):
        return "parameter"
