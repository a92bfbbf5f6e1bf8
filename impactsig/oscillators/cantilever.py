"""A uniform cantilever beam: what its drawings say of its modes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from .._arguments import number, whole
from ..errors import InvalidInput
from .parts import numbers

if TYPE_CHECKING:  # the command's help needs no arrays
    import numpy as np
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
        from ._cantilever_modes import roots

        return roots(whole("count", count, 1))[0]

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
        from ._cantilever_modes import roots, sigma_of, signs

        b, above = roots(whole("count", count, 1))
        return 4 * signs(len(b)) * sigma_of(b, above) / b

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
        import numpy as np

        from ._cantilever_modes import roots, shape

        mode = whole("mode", mode, 1)
        try:
            x = np.asarray(x, float)
        except (TypeError, ValueError):
            raise InvalidInput("x", x, "distances from the clamp [m]") from None
        if not ((x >= 0) & (x <= self.length * (1 + 1e-12))).all():
            raise InvalidInput("x", x, f"places on the beam, 0 to {self.length:g} m")
        b, above = roots(mode)
        return shape(b[-1], above[-1], (-1.0) ** (mode - 1), x / self.length)

    def tuned(self, frequency: float) -> Cantilever:
        """The beam with the modulus that gives its first mode a measured frequency [Hz].

        A clamp that gives way, or a sensor's mass, lowers a frequency; this puts it down to the
        modulus, and so lowers all modes alike.

        Raises
        ------
        InvalidInput
            If the frequency is not positive.
        """
        frequency = number("frequency", frequency, above=0)
        return replace(self, modulus=self.modulus * (frequency / self.frequencies(1)[0]) ** 2)

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the first mode shapes; see `impactsig.plot.mode_shapes`."""
        from .. import plot

        return plot.mode_shapes(self, ax, **options)
