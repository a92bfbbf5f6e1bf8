"""Stochastic averaging of the energy envelope: densities of a noisy oscillator by quadrature."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..._arguments import whole
from ..._showing import Shown
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ._curve import Curve, curve
from ._cycles import Orbits, exchange, orbits
from ._marginals import places, speeds
from ._panels import evaluate
from ._scope import check, check_well, highest, span
from ._well import Well, conservative, well
from .shapes import DensityShape

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

Impact = Literal["logarithmic", "exact", "linearised"]
MOST_EXCHANGED = {"logarithmic": 0.5, "exact": 0.1, "linearised": 0.1}  # by which it holds


@dataclass(frozen=True)
class AveragedDensity(Shown):
    """Stationary densities of an oscillator under white noise, by averaging over its orbits.

    Energies are measured from the bottom of the well; every number is in the oscillator's own
    units.

    Attributes
    ----------
    oscillator : Oscillator
    impact : str
        The impact term.
    bottom : float
        Displacement of the bottom of the well.
    mean, sd : float
        Of the energy.
    greatest : float
        Energy beyond which the density is taken to be 0; it is e^-50 of its greatest there.
    exchange : float
        How far the orbits are from conservative ones, from 0 to 1: the mean, over the density, of
        the energy that damping, friction and stops give and take in a cycle by that which the
        oscillator has, where this is below 1, and else 1. See `holds`.
    accuracy : float
        Relative change of the integrals over a cycle when the nodes were doubled last, the
        greatest of all orbits; where the energy is below the mean, times the share it is of that.

    See Also
    --------
    averaged_density, results.Ensemble, p_bifurcation

    Examples
    --------
    >>> from impactsig import Noise, Oscillator, averaged_density
    >>> density = averaged_density(Oscillator(damping=0.02, noise=Noise(0.02)))
    >>> round(density.mean, 6)  # of white noise: intensity / damping
    1.0
    >>> round(density.sd, 6)
    1.0
    """

    oscillator: Oscillator
    impact: Impact
    bottom: float
    mean: float
    sd: float
    greatest: float
    exchange: float
    accuracy: float
    _well: Well = field(repr=False)
    _curve: Curve = field(repr=False)

    @property
    def holds(self) -> bool:
        """Whether averaging may be relied on, to about 1 % of the mean energy.

        That is taken to be so where `exchange` is at most 0.5, or with one of the other impact
        terms 0.1.

        Of the Van der Pol-Duffing scene with restitution 0.99, 0.95, 0.9, 0.8 and 0.5 the exchange
        is 0.06, 0.37, 0.59, 0.86 and 1. With the logarithmic impact term its mean energy is 0.0,
        0.3, 0.7, 0.9 and 12 % below that of simulated motions (standard errors 0.3, 0.7, 0.5, 0.3
        and 0.2 %); with the exact one it is 1, 8, 12, 22 and 48 % above, with the linearised one
        0.5, 4, 5, 10 and 16 %. The condition is not necessary: with a linear damper, and no loss
        elsewhere, averaging is exact however strong the damper is.
        """
        return self.exchange <= MOST_EXCHANGED[self.impact]

    def describe(self) -> str:
        """In a sentence: the energy, the shape, and whether averaging holds."""
        share = f"A cycle exchanges {self.exchange:.1%} of the energy"
        verdict = (
            "averaging holds" if self.holds else "too much to rely on; simulate an ensemble as well"
        )
        return (
            f"Energy {self.mean:.6g} with standard deviation {self.sd:.6g}; "
            f"joint density: {self.shape.name}. {share}: {verdict}."
        )

    @cached_property
    def shape(self) -> DensityShape:
        """Extrema of the joint density: where a cycle gains from damping what impacts take.

        They are roots of the energy balance of a cycle without noise, so they do not depend on
        its intensity.
        """
        energy, maximum = self._curve.extrema()
        lower, upper = (s.top if s.stop else math.inf for s in self._well.sides)
        return DensityShape(energy, maximum, self._curve.joint(energy), lower, upper)

    def energy_density(self, energy: Any) -> np.ndarray:
        """p(H); infinite at H = 0 where the well is flatter than a parabola."""
        return _over(self._curve.density, _reals("energy", energy))

    def cumulative(self, energy: Any) -> np.ndarray:
        """Probability of an energy up to H."""
        return _over(self._curve.cumulative, _reals("energy", energy))

    def moment(self, order: int) -> float:
        """Mean of H**order.

        Raises
        ------
        InvalidInput
            If the order is not a whole number from 1 on.
        """
        order = whole("order", order, 1)
        energy = self._curve.grid.energy
        return self._curve.mean(lambda panel, u: energy(panel, u) ** order)

    def joint_density(self, x: Any, v: Any) -> np.ndarray:
        """p(x, v), the arrays broadcast against each other; 0 beyond the stops."""
        kinetic = self.oscillator.mass * _reals("v", v) ** 2 / 2
        return self._curve.joint(self.potential(x) + kinetic)

    def displacement_density(self, x: Any) -> np.ndarray:
        """The marginal p(x); 0 beyond the stops."""
        kinetic, weights = self._speeds
        return _over(
            lambda place: np.array(
                [
                    2 * (self._curve.joint(u + kinetic) @ weights)
                    for u in self._well.potential(place)
                ]
            ),
            _reals("x", x),
        )

    def velocity_density(self, v: Any) -> np.ndarray:
        """The marginal p(v)."""
        potential, weights = self._places
        half = self.oscillator.mass / 2
        return _over(
            lambda speed: np.array(
                [self._curve.joint(half * each**2 + potential) @ weights for each in speed]
            ),
            _reals("v", v),
        )

    def potential(self, x: Any) -> np.ndarray:
        """Potential above the bottom of the well; infinite beyond the stops."""
        return _over(self._well.potential, _reals("x", x))

    def reach(self, energy: float) -> tuple[float, float]:
        """Between which displacements a motion of that energy stays.

        Raises
        ------
        InvalidInput
            If the energy is not positive, or more than the well holds.
        """
        given = self._held(energy).ravel()[:1]
        low, high = (
            self.bottom + side.sign * float(self._well.turn(side, given)[0]) if side.reach
            else self.bottom
            for side in self._well.sides
        )  # fmt: skip
        return low, high

    def period(self, energy: Any) -> np.ndarray:
        """T(H) of the conservative motion; where it hits one stop, from impact to impact.

        Raises
        ------
        InvalidInput
            If an energy is not positive, or more than the well holds; `drift` and `diffusion`
            likewise.
        """
        return self._along(energy, lambda along: along.period)

    def drift(self, energy: Any) -> np.ndarray:
        """U(H), the rate at which the mean of the energy changes."""
        spread = self._intensity / self.oscillator.mass
        return self._along(
            energy,
            lambda along: (
                spread + exchange(self.oscillator, along, self.impact).gain / along.period
            ),
        )

    def diffusion(self, energy: Any) -> np.ndarray:
        """V(H)^2, the rate at which the variance of the energy grows."""
        return self._along(energy, lambda along: 2 * self._intensity * along.area / along.period)

    def plot(self, figure: Figure | SubFigure | None = None) -> np.ndarray:
        """Draw the density of the energy and the joint density; see `plot.averaged_density`."""
        from ...plot import averaged_density as draw

        return draw(self, figure)

    @property
    def _intensity(self) -> float:
        assert self.oscillator.noise is not None
        return self.oscillator.noise.intensity

    def _along(self, energy: Any, what: Callable[[Orbits], np.ndarray]) -> np.ndarray:
        part = conservative(self.oscillator)
        return _over(lambda each: what(orbits(part, each)), self._held(energy))

    def _held(self, energy: Any) -> np.ndarray:
        given = _reals("energy", energy)
        if np.any(given <= 0) or np.any(given >= highest(self._well)):
            raise InvalidInput("energy", energy, "energies above 0 that the well holds")
        return given

    @cached_property
    def _speeds(self) -> tuple[np.ndarray, np.ndarray]:
        return speeds(self._curve, self.oscillator.mass)

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        return places(self._curve, self._well)


def averaged_density(oscillator: Oscillator, *, impact: Impact = "logarithmic") -> AveragedDensity:
    """Stationary densities of an oscillator under white noise, by averaging over its orbits.

    With the energy ``H = m v^2 / 2 + G(x)``, and with damping, friction, impacts and noise so weak
    that an orbit hardly changes in a cycle, H is a diffusion [Stratonovich1963]_,
    [RobertsSpanos1986]_ with drift and diffusion

    ``U = I / m + (D - L) / T``,  ``V^2 = 2 I A / T``,

    where over a cycle A is the integral of v dx, D the work of all that depends on the velocity, L
    the loss at the stops, and I the noise's intensity. As ``dA/dH = T / m``, its stationary
    density is

    ``p(H) = N (T / m) exp Psi(H)``,  ``dPsi/dH = (D - L) / (I A)``,  ``p(x, v) = N exp Psi(H)``.

    The potential G holds the spring, the load and ``law(0, x, 0)``; D what the law does beyond that
    and the damper and the friction, which is the kinetic one. A force that is even in v does no
    work in a cycle, and falls out.

    Parameters
    ----------
    oscillator : Oscillator
        One mass in one well, with white noise, without forcing, with stops anywhere: the springs of
        soft ones are part of the potential, and what their dampers take is part of D, along the
        orbit of the conservative motion.
    impact : {"logarithmic", "exact", "linearised"}
        What an impact with a rigid stop takes of the kinetic energy E, as a rate over the cycle
        before it. The papers' linearised ``2 (1 - r) E`` treats it as a weak force in Zhuravlev's
        coordinate [Zhuravlev1976]_. What it takes exactly is ``(1 - r^2) E``; but E is the energy before the
        impact, which is more than the mean over the cycle. ``-2 ln(r) E`` is the rate under which
        the energy falls to r^2 of itself in a cycle, and thus right to second order.

    Returns
    -------
    AveragedDensity
        With how far averaging holds.

    Raises
    ------
    InvalidInput
        If the oscillator is forced, its noise is none or filtered, its law depends on time, it has
        no well or several, or no stationary density: it leaves the well, or gains more than it
        loses at all energies.

    See Also
    --------
    simulate_ensemble, p_bifurcation

    Examples
    --------
    >>> from impactsig import averaged_density, scenes
    >>> density = averaged_density(scenes.van_der_pol_duffing(0.99), impact="linearised")
    >>> round(density.mean, 4), round(density.sd, 4)
    (9.8676, 3.1942)
    """
    check(oscillator, impact)
    part = conservative(oscillator)
    inside = well(part)
    check_well(part, inside)
    density = curve(oscillator, *span(oscillator, part, impact), impact)
    energy = density.grid.energy
    mean = density.mean(energy)
    variance = density.mean(lambda panel, u: (energy(panel, u) - mean) ** 2)
    exchange = density.mean(
        lambda panel, u: np.clip(evaluate(density.turnover, panel, u), 0.0, 1.0)
    )
    at, error = density.error
    return AveragedDensity(
        oscillator=oscillator,
        impact=impact,
        bottom=inside.bottom,
        mean=mean,
        sd=math.sqrt(variance),
        greatest=density.greatest,
        exchange=exchange,
        accuracy=float((error * np.minimum(at / mean, 1.0)).max()),
        _well=inside,
        _curve=density,
    )


def _reals(name: str, given: Any) -> np.ndarray:
    """Finite numbers as an array.

    Raises
    ------
    InvalidInput
        If they are none.
    """
    try:
        found = np.asarray(given, float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if not np.all(np.isfinite(found)):
        raise InvalidInput(name, given, "finite numbers")
    return found


def _over(function: Callable[[np.ndarray], np.ndarray], values: np.ndarray) -> np.ndarray:
    """A function of a row of numbers, for arrays of any shape."""
    return np.asarray(function(values.ravel())).reshape(values.shape)
