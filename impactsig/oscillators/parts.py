"""What acts on an oscillator besides its stops: forcing, base motion, friction, noise."""

from __future__ import annotations

import math
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

from .._arguments import flag, number
from ..errors import InvalidInput

columns_allowed: ContextVar[bool] = ContextVar("columns_allowed", default=False)
"""Whether numbers may be columns: while a scene makes a batch of arrays, and never else."""


@dataclass(frozen=True)
class Force:
    """A harmonic force ``amplitude * cos(angular_frequency * t + phase)`` on the mass.

    Parameters
    ----------
    amplitude : float
        Amplitude [N].
    angular_frequency : float
        Angular frequency [rad/s], positive; with other units of time, in radians per unit.
    phase : float
        Phase at t = 0 [rad]; -pi/2 makes it a sine.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    See Also
    --------
    BaseMotion, Oscillator

    Examples
    --------
    >>> import math
    >>> from impactsig import Force
    >>> Force(0.25, 2 * math.pi * 22.1, phase=-math.pi / 2).amplitude
    0.25
    """

    amplitude: float
    angular_frequency: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        numbers(self, "amplitude", "phase")
        numbers(self, "angular_frequency", above=0.0)


@dataclass(frozen=True)
class BaseMotion:
    """Harmonic motion of the base to which the spring, the damper or the stops are attached.

    Its displacement is ``amplitude * cos(angular_frequency * t + phase)``.

    Parameters
    ----------
    amplitude : float
        Amplitude [m].
    angular_frequency : float
        Angular frequency [rad/s], positive; with other units of time, in radians per unit.
    phase : float
        Phase at t = 0 [rad]; -pi/2 makes it a sine.
    spring, damper : bool
        Whether the spring and the damper are attached to the base; otherwise to the ground.
    stops : bool
        Whether the stops, and the surface on which the mass slides, move with the base.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    See Also
    --------
    Force, Oscillator

    Examples
    --------
    >>> import math
    >>> from impactsig import BaseMotion
    >>> base = BaseMotion(1e-3, 2 * math.pi * 20, stops=False)
    >>> base.amplitude, base.stops
    (0.001, False)
    """

    amplitude: float
    angular_frequency: float
    phase: float = 0.0
    spring: bool = True
    damper: bool = True
    stops: bool = False

    def __post_init__(self) -> None:
        numbers(self, "amplitude", "phase")
        numbers(self, "angular_frequency", above=0.0)
        for name in ("spring", "damper", "stops"):
            flag(name, getattr(self, name))


@dataclass(frozen=True)
class Friction:
    """Coulomb friction between the mass and the ground, or the base if it carries the stops.

    Parameters
    ----------
    kinetic : float
        Friction force while the mass slides [N].
    static : float, optional
        Greatest friction force while the mass sticks [N], at least `kinetic`; by default equal to
        it.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    See Also
    --------
    Oscillator, scenes.begley_virgin

    Examples
    --------
    >>> from impactsig import Friction
    >>> Friction(0.05).static
    0.05
    """

    kinetic: float
    static: float | None = None

    def __post_init__(self) -> None:
        numbers(self, "kinetic", least=0.0)
        if self.static is None:
            object.__setattr__(self, "static", self.kinetic)
        numbers(self, "static", least=self.kinetic)


@dataclass(frozen=True)
class Noise:
    """A random force f on the mass, or a random stiffness, Gaussian, white or filtered.

    White noise has ``<f(t) f(t + s)> = 2 intensity delta(s)``. Noise filtered with the time
    constant tau has ``<f(t) f(t + s)> = (intensity / tau) exp(-abs(s) / tau)``, which is equivalent
    for slow motions (an Ornstein-Uhlenbeck process [UhlenbeckOrnstein1930]_). Noise in a band about
    an angular frequency w has ``<f(t) f(t + s)> = (intensity / tau) exp(-abs(s) / tau) cos(w s)``:
    its two-sided spectral density, twice the intensity where the noise is white, is

        S(u) = intensity (1 / (1 + (u - w)^2 tau^2) + 1 / (1 + (u + w)^2 tau^2)),

    that is two lines of half width 1 / tau. Parametric noise acts on the stiffness: the force on
    the mass is f times its displacement. For white noise, the Ito and Stratonovich interpretations
    are the same, since it multiplies the displacement only.

    Parameters
    ----------
    intensity : float
        Half of the two-sided spectral density at zero frequency of noise without a band [N^2 s], at
        least 0; for parametric noise [N^2 s / m^2].
    correlation_time : float
        Time constant of the filter [s]; 0 leaves the noise white.
    angular_frequency : float
        Angular frequency of the middle of the band [rad/s], 0 for low-pass noise. Requires a
        correlation time.
    parametric : bool
        Whether the noise acts on the stiffness.

    Raises
    ------
    InvalidInput
        If a value is out of its range, or white noise is to have a band.

    See Also
    --------
    Oscillator, simulate_ensemble, averaged_density

    Examples
    --------
    >>> from impactsig import Noise, Oscillator, simulate
    >>> shaken = Oscillator(damping=0.2, noise=Noise(0.1, correlation_time=0.5))
    >>> motion = simulate(shaken, duration=10, seed=1)
    >>> narrow = Noise(0.1, correlation_time=5.0, angular_frequency=1.0)
    """

    intensity: float
    correlation_time: float = 0.0
    angular_frequency: float = 0.0
    parametric: bool = False

    def __post_init__(self) -> None:
        numbers(self, "intensity", "correlation_time", "angular_frequency", least=0.0)
        flag("parametric", self.parametric)
        if self.angular_frequency and not self.correlation_time:
            raise InvalidInput(
                "angular_frequency", self.angular_frequency, "0 of white noise",
                "Its spectrum is flat; correlation_time= tells how wide the band is",
            )  # fmt: skip


def numbers(
    owner: Any,
    *names: str,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
) -> None:
    """Convert the named fields to floats; in a batch they may be arrays, one number an oscillator.

    Raises
    ------
    InvalidInput
        If one is not a finite number in that range.
    """
    for name in names:
        value = getattr(owner, name)
        if columns_allowed.get() and (hasattr(value, "ndim") or hasattr(least, "ndim")):
            wrong = (value != value) | (abs(value) == math.inf)
            wrong = wrong | (value <= above) | (value < least) | (value > most)
            if not wrong.any():
                continue
            first = int(wrong.argmax())  # refused below as it is alone
            value, least = (_entry(one, first) for one in (value, least))
        object.__setattr__(owner, name, number(name, value, above=above, least=least, most=most))


def _entry(column: Any, k: int) -> Any:
    """An entry of a column, or the number that it is."""
    return column[k] if hasattr(column, "ndim") else column
