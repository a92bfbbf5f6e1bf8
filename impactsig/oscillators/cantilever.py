"""A uniform cantilever beam: what its drawings say of its modes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import number, whole
from ..errors import InvalidInput
from .parts import numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Cantilever:
    """A slender beam of rectangular section, clamped at x = 0 and free at its tip, x = length.

    Euler and Bernoulli's beam ``rho A w_tt + E I w_xxxx = 0`` [Rao2017]_, I = width thickness^3/12,
    has the modes

        psi_n(x) = phi_n(x) / phi_n(L),    phi_n = cosh y - cos y - sigma_n (sinh y - sin y),

    with y = beta_n x, ``cos(beta_n L) cosh(beta_n L) = -1`` and the angular frequencies
    ``beta_n^2 sqrt(E I / (rho A))``. They are 1 at the tip, so that a modal coordinate is what its
    mode adds to the deflection of the tip; then every mode has the same modal mass, a quarter of
    the beam's.

    Parameters
    ----------
    length : float
        Free length [m], from the clamp to the tip.
    width : float
        Width [m], across the plane in which the beam vibrates.
    thickness : float
        Thickness [m], in that plane.
    modulus : float
        Young's modulus [Pa].
    density : float
        Density [kg/m^3].

    Raises
    ------
    InvalidInput
        If a value is not positive, or the beam is thicker than a fifth of its length: shear and
        rotary inertia, which are left out, would matter.

    Examples
    --------
    >>> Cantilever(0.2, 0.025, 0.001, 210e9, 7850).frequencies(2).round(2)
    array([ 20.89, 130.9 ])
    """

    length: float
    width: float
    thickness: float
    modulus: float
    density: float

    def __post_init__(self) -> None:
        numbers(self, "length", "width", "thickness", "modulus", "density", above=0.0)
        if self.thickness > self.length / 5:
            raise InvalidInput(
                "thickness",
                self.thickness,
                f"at most a fifth of the length, {self.length / 5:g} m",
                "A stouter beam shears; in metres, is each number what it should be?",
            )

    @property
    def mass(self) -> float:
        """Mass of the free length [kg]."""
        return self.density * self.width * self.thickness * self.length

    @property
    def modal_mass(self) -> float:
        """Modal mass of every mode [kg]: a quarter of the mass, as the modes are 1 at the tip."""
        return self.mass / 4

    @property
    def bending_stiffness(self) -> float:
        """E I [N m^2]."""
        return self.modulus * self.width * self.thickness**3 / 12

    @property
    def stiffness(self) -> float:
        """Force at the tip by the deflection there, at rest: 3 E I / L^3 [N/m].

        Its inverse is the sum of 1 / `modal_stiffness` over all modes.
        """
        return 3 * self.bending_stiffness / self.length**3

    def wavenumbers(self, count: int = 4) -> np.ndarray:
        """beta_n L of the first modes, shape (count,)."""
        return _roots(whole("count", count, 1))[0]

    def frequencies(self, count: int = 4) -> np.ndarray:
        """Natural frequencies of the first modes, undamped [Hz], shape (count,)."""
        scale = math.sqrt(self.bending_stiffness / (self.mass / self.length)) / self.length**2
        return self.wavenumbers(count) ** 2 * (scale / (2 * math.pi))

    def modal_stiffness(self, count: int = 4) -> np.ndarray:
        """Stiffness of the first modes [N/m], shape (count,)."""
        return self.wavenumbers(count) ** 4 * (self.bending_stiffness / (4 * self.length**3))

    def participation(self, count: int = 4) -> np.ndarray:
        """Share of a shaken base's motion that excites each mode, shape (count,).

        ``integral(psi_n) / integral(psi_n^2)``: relative to a base that moves as b(t),
        ``q_n'' + omega_n^2 q_n = -participation_n b''``. 1.566 for the first mode; their sum over
        all modes is 1.
        """
        roots, above = _roots(whole("count", count, 1))
        sign = _signs(len(roots))
        return 4 * sign * _sigma(roots, above) / roots

    def mode_shape(self, mode: int, x: Any) -> np.ndarray:
        """Shape of a mode, 1 at the tip.

        Parameters
        ----------
        mode : int
            Number of the mode, from 1.
        x : array_like
            Distances from the clamp [m].

        Returns
        -------
        ndarray, shape of `x`
            Accurate to rounding for any mode: nothing grows as cosh does.

        Raises
        ------
        InvalidInput
            If there is no such mode, or a place is not on the beam.
        """
        mode = whole("mode", mode, 1)
        try:
            x = np.asarray(x, float)
        except (TypeError, ValueError):
            raise InvalidInput("x", x, "distances from the clamp [m]") from None
        if not ((x >= 0) & (x <= self.length * (1 + 1e-12))).all():
            raise InvalidInput("x", x, f"places on the beam, 0 to {self.length:g} m")
        roots, above = _roots(mode)
        return _shape(roots[-1], above[-1], (-1.0) ** (mode - 1), x / self.length)

    def tuned(self, frequency: float) -> Cantilever:
        """The beam with the modulus that gives its first mode a measured frequency [Hz].

        A clamp that gives way, or a sensor's mass, lowers a frequency; this puts it down to the
        modulus, and so lowers all modes alike.

        Raises
        ------
        InvalidInput
            If the frequency is not positive.
        """
        frequency = number("frequency", frequency, positive=True)
        return replace(self, modulus=self.modulus * (frequency / self.frequencies(1)[0]) ** 2)

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the first mode shapes; see `impactsig.plot.mode_shapes`."""
        from .. import plot

        return plot.mode_shapes(self, ax, **options)


def _signs(count: int) -> np.ndarray:
    return (-1.0) ** np.arange(count)


def _roots(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Roots b of cos b cosh b = -1, and how far they are above (n - 1/2) pi.

    With b = (n - 1/2) pi + d the equation is sin d = (-1)^(n - 1) / cosh b, in which nothing
    overflows or cancels; d falls as exp(-b).
    """
    middle = (np.arange(count) + 0.5) * math.pi
    sign = _signs(count)
    above = sign * np.exp(-middle)
    for _ in range(8):  # Newton's method doubles the digits; from three it needs four rounds
        b = middle + above
        small = np.exp(-b)
        secant = 2 * small / (1 + small * small)
        tangent = (1 - small * small) / (1 + small * small)
        off = np.sin(above) - sign * secant
        above = above - off / (np.cos(above) + sign * secant * tangent)
    return middle + above, above


def _sigma(b: np.ndarray, above: np.ndarray) -> np.ndarray:
    """(cosh b + cos b) / (sinh b + sin b), divided through by cosh b; sin b = +-cos(above)."""
    small = np.exp(-b)
    secant = 2 * small / (1 + small * small)
    tangent = (1 - small * small) / (1 + small * small)
    cosine = -_signs(len(b)) * np.sin(above)
    sine = _signs(len(b)) * np.cos(above)
    return (1 + cosine * secant) / (tangent + sine * secant)


def _shape(b: float, above: float, sign: float, xi: np.ndarray) -> np.ndarray:
    """phi(xi) / phi(1) with phi(1) = 2 sign, of growing and falling exponentials apart."""
    cosine, sine = -sign * math.sin(above), sign * math.cos(above)
    small = math.exp(-b)
    # 1 - sigma, times exp(b): what multiplies the growing half.
    grows = 2 * (sine - cosine - small) / (1 - small * small + 2 * small * sine)
    sigma = 1 - grows * small
    y = b * xi
    far = grows * np.exp(y - b) / 2 + (1 + sigma) / 2 * np.exp(-y)
    far += sigma * np.sin(y) - np.cos(y)
    # Near the clamp all of it is y^2: there by the differences, of which none cancels.
    near = np.minimum(y, 1.0)
    even = 2 * (np.sinh(near / 2) ** 2 + np.sin(near / 2) ** 2)
    odd = near**3 / 3 * (1 + near**4 / 840 * (1 + near**4 / 7920 * (1 + near**4 / 32760)))
    return np.where(y < 1, even - sigma * odd, far) / (2 * sign)
