"""A uniform cantilever beam, and its modes from its dimensions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

from .._arguments import instance, number, one_or_several, reals, whole
from .._showing import drawn_by
from ..errors import InvalidInput
from .parts import BaseMotion, Force, numbers
from .stops import Stop

if TYPE_CHECKING:  # the command's help needs no arrays
    from collections.abc import Sequence

    import numpy as np

MOST_MODES = 100


@dataclass(frozen=True)
class Cantilever:
    """A slender beam of rectangular section, clamped at x = 0 and free at its tip, x = length.

    `simulate` follows it in its first `modes` modes, before a stop at its tip.

    Euler and Bernoulli's beam ``rho A w_tt + E I w_xxxx = 0`` [Rao2017]_, I = width thickness^3/12,
    has the modes

        psi_n(x) = phi_n(x) / phi_n(L),    phi_n = cosh y - cos y - sigma_n (sinh y - sin y),

    with y = beta_n x, ``cos(beta_n L) cosh(beta_n L) = -1`` and the angular frequencies
    ``beta_n^2 sqrt(E I / (rho A))``. They are 1 at the tip, so that a modal coordinate is the
    contribution of its mode to the deflection of the tip, and every mode has the same modal mass, a
    quarter of that of the beam.

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
    stop : Stop, optional
        Stop at the tip: rigid, with a number as restitution coefficient, or a Kelvin-Voigt stop
        whose contact ends at the gap.
    forcing : Force or BaseMotion, optional
        A force at the tip [N], or a motion of the clamp [m], which with ``stops=True`` carries the
        stop.
    damping_ratio : float or sequence of float
        Damping of all modes, or of each, as a fraction of critical damping. The default is our
        choice, as for `scenes.karpodinis`.
    modes : int
        Number of modes in a simulation, from the first; with 1 it is equivalent to
        `scenes.cantilever`.

    Raises
    ------
    InvalidInput
        If a value is not positive, a part is not supported for a beam, or the beam is thicker than
        a fifth of its length, where shear and rotary inertia, which are neglected, are relevant.

    See Also
    --------
    scenes.cantilever, apparent_restitution, plot.mode_shapes

    Examples
    --------
    >>> from dataclasses import replace
    >>> from impactsig import BaseMotion, Cantilever, Rigid, Stop, simulate
    >>> ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850)
    >>> ruler.frequencies(2).round(2)
    array([ 20.89, 130.9 ])
    >>> stopped = replace(ruler, stop=Stop(1e-3, Rigid(0.6)), forcing=BaseMotion(2e-4, 130.0))
    >>> motion = simulate(stopped, periods=20)
    """

    length: float
    width: float
    thickness: float
    modulus: float
    density: float
    stop: Stop | None = None
    forcing: Force | BaseMotion | None = None
    damping_ratio: float | Sequence[float] = 0.03
    modes: int = 8

    moved_by: ClassVar[str] = "impactsig.simulation.beam.beams"
    time_unit: ClassVar[float] = 1.0
    in_seconds: ClassVar[bool] = True

    def __post_init__(self) -> None:
        numbers(self, "length", "width", "thickness", "modulus", "density", above=0.0)
        if self.thickness > self.length / 5:
            raise InvalidInput(
                "thickness",
                self.thickness,
                f"at most a fifth of the length, {self.length / 5:g} m",
                "A stouter beam shears; in metres, is each number what it should be?",
            )
        object.__setattr__(self, "modes", whole("modes", self.modes, 1, MOST_MODES))
        _check_stop(self.stop)
        _check_forcing(self.forcing)
        object.__setattr__(self, "damping_ratio", _ratios(self.damping_ratio, self.modes))

    @property
    def dimension(self) -> int:
        """Number of coordinates: displacement and velocity of every mode that is followed."""
        return 2 * self.modes

    @property
    def angular_forcing_frequency(self) -> float | None:
        """Angular frequency of the forcing [rad/s], or None where there is no forcing."""
        return None if self.forcing is None else self.forcing.angular_frequency

    @property
    def forcing_period(self) -> float | None:
        """Period of the forcing [s], or None where there is no forcing."""
        return None if self.forcing is None else 2 * math.pi / self.forcing.angular_frequency

    @property
    def damping_ratios(self) -> tuple[float, ...]:
        """Damping of each mode that is followed, as a fraction of critical damping."""
        given = self.damping_ratio
        return (given,) * self.modes if isinstance(given, float) else tuple(given)

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
        """Static stiffness at the tip, 3 E I / L^3 [N/m].

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
        """Modal participation factors of base motion, shape (count,).

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
            The shape, accurate to rounding for any mode.

        Raises
        ------
        InvalidInput
            If there is no such mode, or a position is not on the beam.
        """
        from ._cantilever_modes import roots, shape

        mode = whole("mode", mode, 1)
        x = reals("x", x, "distances from the clamp [m]")
        if not ((x >= 0) & (x <= self.length * (1 + 1e-12))).all():
            raise InvalidInput("x", x, f"places on the beam, 0 to {self.length:g} m")
        b, above = roots(mode)
        return shape(b[-1], above[-1], (-1.0) ** (mode - 1), x / self.length)

    def tuned(self, frequency: float) -> Cantilever:
        """The beam with Young's modulus adjusted to a measured first natural frequency.

        A compliant clamp, or the mass of a sensor, lowers the frequencies; this attributes the
        change to the modulus, which changes all modes by the same factor.

        Parameters
        ----------
        frequency : float
            Measured natural frequency of the first mode [Hz].

        Raises
        ------
        InvalidInput
            If the frequency is not positive.
        """
        frequency = number("frequency", frequency, above=0)
        return replace(self, modulus=self.modulus * (frequency / self.frequencies(1)[0]) ** 2)

    plot = drawn_by("mode_shapes", "the first mode shapes")


def _check_stop(stop: Any) -> None:
    """Refuse a stop that the beam's engine does not support."""
    if stop is None:
        return
    instance("stop", stop, Stop, "a Stop(...) at the tip, or None")
    law = stop.law
    if not law.linear or law.only_pushes or law.function is not None:
        raise InvalidInput(
            "stop.law", law, 'Rigid(a number), or KelvinVoigt(...) that ends at the "gap"',
            "Other laws are for one mode: simulate(scenes.cantilever(...))",
        )  # fmt: skip


def _check_forcing(forcing: Any) -> None:
    """Refuse a forcing that the beam's engine does not support."""
    if forcing is None or isinstance(forcing, Force):
        return
    instance("forcing", forcing, BaseMotion, "Force(...) at the tip, BaseMotion(...) or None")
    if not (forcing.spring and forcing.damper):
        raise InvalidInput("forcing", forcing, "a base that both spring and damper hang on")


def _ratios(given: Any, modes: int) -> float | tuple[float, ...]:
    """Damping of all modes, or of each."""
    required = f"a number, or one for each of {modes} modes"
    several, single = one_or_several("damping_ratio", given, required)
    ratios = tuple(number("damping_ratio", one) for one in several)
    if not single and len(ratios) != modes:
        raise InvalidInput("damping_ratio", given, required)
    if not all(0 <= ratio < 1 for ratio in ratios):
        raise InvalidInput("damping_ratio", given, "shares of the critical, 0 or greater, below 1")
    return ratios[0] if single else ratios
