"""Stochastic averaging of the energy envelope: densities of a noisy oscillator by quadrature."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ..._arguments import reals, whole
from ..._showing import Shown, drawn_on_figure_by
from ...errors import InvalidInput
from ...oscillators import Noise, Oscillator
from ._branches import Branches, branches
from ._curve import grazings
from ._cycles import Orbits, exchange, orbits
from ._feeding import band_of, fed, fed_slope
from ._marginals import displacement, places, speeds, velocity
from ._scope import check, check_rest
from ._well import conservative
from .shapes import DensityShape

Impact = Literal["logarithmic", "exact", "linearised"]
MOST_EXCHANGED = {"logarithmic": 0.5, "exact": 0.1, "linearised": 0.1}  # by which it holds
MOST_REMEMBERED = 0.02


@dataclass(frozen=True)
class AveragedDensity(Shown):
    """Stationary densities of an oscillator under noise, by averaging over its orbits.

    Energies are measured from the bottom of the well (the lowest of several). All quantities are in
    the units of the oscillator.

    Attributes
    ----------
    oscillator : Oscillator
    impact : str
        The impact term.
    bottom : float
        Displacement of the bottom of the well.
    mean, sd : float
        Mean and standard deviation of the energy.
    greatest : float
        Energy above which the density, less than e^-50 of its maximum, is set to 0.
    exchange : float
        Energy exchanged per cycle with damping, friction and stops, relative to the energy of the
        oscillator (for a stop, relative to the energy at the impact), averaged over the exchanged
        energy. It measures the deviation of the orbits from conservative ones. See `holds`.
    memory : float
        The same within the correlation time of the noise; 0 for white noise.
    accuracy : float
        Relative change of the integrals over a cycle in the last doubling of the nodes, the
        greatest of all orbits; weighted by the ratio of energy to mean energy for energies below
        the mean.
    wells : numpy.ndarray, shape (n,)
        Displacements of the bottoms of the wells, ascending.
    within : numpy.ndarray, shape (n,)
        Probability of each well below the adjacent saddles; 1 for a single well.

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
    memory: float
    accuracy: float
    wells: np.ndarray = field(repr=False)
    within: np.ndarray = field(repr=False)
    _density: Branches = field(repr=False)

    @property
    def holds(self) -> bool:
        """Whether averaging is accurate, to about 1 % of the mean energy.

        True if `exchange` is at most 0.5 (0.1 with one of the other impact terms) and `memory` at
        most 0.02: the relative error of the mean energy is about half of `memory`.

        For the Van der Pol-Duffing scene with restitution 0.99, 0.95, 0.9, 0.8 and 0.5 the exchange
        is 0.06, 0.24, 0.42, 0.75 and 1.9. With the logarithmic impact term the mean energy is 0.0,
        0.3, 0.7, 0.9 and 12 % below that of simulated motions (standard errors 0.3, 0.7, 0.5, 0.3
        and 0.2 %); with the exact one it is 1, 8, 12, 22 and 48 % above, with the linearised one
        0.5, 4, 5, 10 and 16 %. At rigid, Kelvin-Voigt and Hertz stops near the bottom the mean is
        0.2 to 0.6 % too low at exchanges of 0.2 to 0.5, 0.8 to 1.6 % at 0.6, and 2.3 to 5 % from
        0.8 on; for a Hertz stop with a restitution coefficient it is 1 % too high at 0.2 to 0.3.
        The condition is not necessary: with smooth damping, in one or two wells, the mean is within
        0.5 % up to an exchange of 1.2, and with a linear damper and no other loss averaging is
        exact.
        """
        most = MOST_EXCHANGED[self.impact]
        return self.exchange <= most and self.memory <= MOST_REMEMBERED

    def describe(self) -> str:
        """In a sentence: the energy, the shape, and whether averaging holds."""
        share = f"A cycle exchanges {self.exchange:.1%} of the energy"
        if self.memory:
            share += f", a correlation time of the noise {self.memory:.1%}"
        verdict = (
            "averaging holds" if self.holds else "too much to rely on; simulate an ensemble as well"
        )
        if len(self.wells) == 1:
            form = self.shape.name
        else:
            shares = (
                f"{p:.3g} in that at {x:.4g}" for x, p in zip(self.wells, self.within, strict=True)
            )
            form = f"{len(self.wells)} wells, {', '.join(shares)}"
        return (
            f"Energy {self.mean:.6g} with standard deviation {self.sd:.6g}; "
            f"joint density: {form}. {share}: {verdict}."
        )

    @cached_property
    def shape(self) -> DensityShape:
        """Shape of the joint density, from its extrema.

        They are roots of the energy balance of a cycle without noise, so they do not depend on
        its intensity.

        Raises
        ------
        InvalidInput
            If there are several wells: each has extrema of its own, and orbits over all of them
            have others.
        """
        if len(self.wells) > 1:
            raise InvalidInput(
                "oscillator", f"{len(self.wells)} wells, at {self.wells.tolist()}",
                "one well, for its density to be of one class",
                "joint_density and within are there for several",
            )  # fmt: skip
        (own,), (inside,) = self._density.curves, self._density.root.wells
        energy, maximum = own.extrema()
        lower, upper = (s.top if s.stop else math.inf for s in inside.sides)
        return DensityShape(energy, maximum, own.joint(energy), lower, upper)

    def energy_density(self, energy: Any) -> np.ndarray:
        """Density p(H), shape of `energy`; infinite at H = 0 in a well flatter than a parabola."""
        return _over(self._density.density, _reals("energy", energy))

    def cumulative(self, energy: Any) -> np.ndarray:
        """Probability of an energy up to H, shape of `energy`."""
        return _over(self._density.cumulative, _reals("energy", energy))

    def moment(self, order: int) -> float:
        """Mean of H**order.

        Raises
        ------
        InvalidInput
            If the order is not a whole number from 1 on.
        """
        order = whole("order", order, 1)
        return self._density.mean(lambda energy: energy**order)

    def joint_density(self, x: Any, v: Any) -> np.ndarray:
        """Joint density p(x, v), of the shape to which x and v broadcast; 0 beyond the stops."""
        kinetic = self.oscillator.mass * _reals("v", v) ** 2 / 2
        return self._density.joint(_reals("x", x), kinetic)

    def displacement_density(self, x: Any) -> np.ndarray:
        """Marginal density p(x), shape of `x`; 0 beyond the stops."""
        mass, given = self.oscillator.mass, _reals("x", x)
        if len(self.wells) > 1:
            return _over(lambda place: displacement(self._density, mass, place), given)
        kinetic, weights = self._speeds
        (own,) = self._density.curves
        return _over(
            lambda place: np.array(
                [2 * (own.joint(u + kinetic) @ weights) for u in self._density.potential(place)]
            ),
            given,
        )

    def velocity_density(self, v: Any) -> np.ndarray:
        """Marginal density p(v), shape of `v`."""
        mass, given = self.oscillator.mass, _reals("v", v)
        if len(self.wells) > 1:
            return _over(lambda speed: velocity(self._density, mass, speed), given)
        potential, weights = self._places
        (own,) = self._density.curves
        return _over(
            lambda speed: np.array(
                [own.joint(mass / 2 * each**2 + potential) @ weights for each in speed]
            ),
            given,
        )

    def potential(self, x: Any) -> np.ndarray:
        """Potential energy above its minimum, shape of `x`; infinite beyond the stops."""
        return _over(self._density.potential, _reals("x", x))

    def reach(self, energy: float) -> tuple[float, float]:
        """Least and greatest displacement of a motion of a given energy, in the oscillator's units.

        Raises
        ------
        InvalidInput
            If the energy is not positive, or more than the well holds.
        """
        given = _reals("energy", energy).ravel()[:1]
        root = self._density.root
        self._check_held(given, 0.0)
        ends = []
        for inside, ground in zip(root.wells, root.grounds, strict=True):
            above = given - ground
            if above[0] >= 0:
                ends += [
                    inside.bottom + side.sign * float(inside.turn(side, above)[0]) if side.reach
                    else inside.bottom
                    for side in inside.sides
                ]  # fmt: skip
        return min(ends), max(ends)

    def period(self, energy: Any) -> np.ndarray:
        """Period T(H) of the conservative motion, in the unit of time of the oscillator.

        It has the shape of `energy`. Where the motion hits one stop, it is from impact to impact.

        Raises
        ------
        InvalidInput
            If an energy is not positive, or more than the well holds, or, where there are several,
            below the highest saddle, where each has its own; `drift` and `diffusion` likewise.
        """
        return self._along(energy, lambda along: along.period)

    def drift(self, energy: Any) -> np.ndarray:
        """U(H), the rate at which the mean of the energy changes, shape of `energy`."""
        part, family, noise = conservative(self.oscillator), self._density.root, self._noise
        band, breaks = band_of(noise), grazings(part, family)

        def rate(along: Orbits) -> np.ndarray:
            if band.coloured:
                slope = fed_slope(part, family, band, along.energy, breaks)
            else:
                slope = along.period / part.mass
            gain = exchange(self.oscillator, along, self.impact).gain
            return (noise.intensity * slope + gain) / along.period

        return self._along(energy, rate)

    def diffusion(self, energy: Any) -> np.ndarray:
        """V(H)^2, the rate at which the variance of the energy grows, shape of `energy`."""
        part, family, noise = conservative(self.oscillator), self._density.root, self._noise

        def rate(along: Orbits) -> np.ndarray:
            area = fed(part, family, band_of(noise), along.energy, along.area)
            return 2 * noise.intensity * area / along.period

        return self._along(energy, rate)

    plot = drawn_on_figure_by("averaged_density", "the density of the energy and the joint density")

    @property
    def _noise(self) -> Noise:
        assert self.oscillator.noise is not None
        return self.oscillator.noise

    def _along(self, energy: Any, what: Callable[[Orbits], np.ndarray]) -> np.ndarray:
        part = conservative(self.oscillator)
        given = _reals("energy", energy)
        self._check_held(given, self._density.root.foot)
        return _over(lambda each: what(orbits(part, each)), given)

    def _check_held(self, energy: np.ndarray, least: float) -> None:
        if np.any(energy <= least) or np.any(energy >= self._density.root.edge):
            what = "energies above 0" if least == 0 else f"energies above the saddle, {least:.6g},"
            raise InvalidInput("energy", energy, f"{what} that the well holds")

    @cached_property
    def _speeds(self) -> tuple[np.ndarray, np.ndarray]:
        return speeds(self._density.curves[0], self.oscillator.mass)

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        return places(self._density.curves[0], self._density.root.wells[0])


def averaged_density(oscillator: Oscillator, *, impact: Impact = "logarithmic") -> AveragedDensity:
    """Stationary densities of an oscillator under noise, by averaging over its orbits.

    If damping, friction, impacts and noise are so weak that an orbit hardly changes in a cycle, the
    energy ``H = m v^2 / 2 + G(x)`` is a diffusion process [Stratonovich1963]_, [RobertsSpanos1986]_
    with drift and diffusion

    ``U = I / m + (D - L) / T``,  ``V^2 = 2 I A / T``,

    where A is the integral of v dx over a cycle, D the work of the velocity-dependent forces, L the
    loss at the stops, and I the intensity of the noise. Since ``dA/dH = T / m``, its stationary
    density is

    ``p(H) = N (T / m) exp Psi(H)``,  ``dPsi/dH = (D - L) / (I A)``,  ``p(x, v) = N exp Psi(H)``.

    Filtered noise and noise in a band supply energy at the multiples of the frequency of the orbit
    [Zhu1988]_, [ZhuHuangSuzuki2001]_. A is then replaced, except in ``dA/dH``, by the sum

    ``B = (T / 2) sum_n F_n^2 S(2 pi n / T) / (2 I)``,  ``U = (I dB/dH + D - L) / T``,

    with S the spectral density of `Noise` and F_n the coefficients of the sine series of the
    velocity, starting at a turning point; for parametric noise they are those of ``x v``. The
    correlation time of the noise must be shorter than the time in which the energy changes.

    The potential G includes the spring, the load and ``law(0, x, 0)``; D includes the rest of the
    law, the damper and kinetic friction. Forces that are even in v do no work over a cycle. With
    several wells, each has its own orbits below the adjacent saddles, and orbits above a saddle
    pass through several wells; since there is no probability flow along any of these families, Psi
    is continuous where they meet.

    Parameters
    ----------
    oscillator : Oscillator
        An oscillator with noise and without forcing, in one or several wells, with stops at any
        position. Springs of soft stops are part of the potential, and the work of their dampers
        along the conservative orbit is part of D.
    impact : {"logarithmic", "exact", "linearised"}
        Loss of kinetic energy E in an impact with a rigid stop, as a rate over the preceding cycle.
        "linearised", ``2 (1 - r) E``, used in the papers, treats the impact as a weak force in
        Zhuravlev's coordinate [Zhuravlev1976]_. "exact", ``(1 - r^2) E``, is the loss of one
        impact, but E is the energy before the impact, which exceeds the mean over the cycle.
        "logarithmic", ``-2 ln(r) E``, is the rate at which the energy decreases to r^2 of its value
        in a cycle, and correct to second order.

    Returns
    -------
    AveragedDensity
        The densities, with measures of the accuracy of averaging.

    Raises
    ------
    InvalidInput
        If the oscillator is forced, has no noise, has a law that depends on time, has no well, or
        no stationary density: it leaves the well, gains more energy than it loses at all energies,
        or rests where parametric noise exerts no force.

    See Also
    --------
    simulate_ensemble, p_bifurcation

    Examples
    --------
    >>> from impactsig import averaged_density, scenes
    >>> density = averaged_density(scenes.van_der_pol_duffing(0.99), impact="linearised")
    >>> round(density.mean, 4), round(density.sd, 4)
    (9.8676, 3.1942)

    A filter that passes half of the power at the frequency of the machine:

    >>> from impactsig import Noise, Oscillator
    >>> shaken = Oscillator(damping=0.01, noise=Noise(0.01, correlation_time=1.0))
    >>> round(averaged_density(shaken).mean, 6)
    0.5
    """
    check(oscillator, impact)
    check_rest(oscillator)
    density = branches(oscillator, impact)
    mean = density.mean(lambda energy: energy)
    variance = density.mean(lambda energy: (energy - mean) ** 2)
    leaves = density.leaves
    grounds = density.root.grounds
    return AveragedDensity(
        oscillator=oscillator,
        impact=impact,
        bottom=density.root.wells[grounds.index(min(grounds))].bottom,
        mean=mean,
        sd=math.sqrt(variance),
        greatest=density.greatest,
        exchange=density.exchange,
        memory=density.memory,
        accuracy=density.accuracy(mean),
        wells=np.array([well.bottom for well in density.root.wells]),
        within=np.array([own.below + float(own.share.sum()) for _, own in leaves]),
        _density=density,
    )


def _reals(name: str, given: Any) -> np.ndarray:
    """Finite numbers as an array.

    Raises
    ------
    InvalidInput
        If they are none.
    """
    found = reals(name, given, "finite numbers")
    if not np.all(np.isfinite(found)):
        raise InvalidInput(name, given, "finite numbers")
    return found


def _over(function: Callable[[np.ndarray], np.ndarray], values: np.ndarray) -> np.ndarray:
    """Apply a function of a one-dimensional array to arrays of any shape."""
    return np.asarray(function(values.ravel())).reshape(values.shape)
