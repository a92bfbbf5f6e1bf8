"""Stops and their laws of contact: what each engine asks of a law is a method of its class."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

from .._arguments import choice
from ..errors import InvalidInput
from . import laws
from .equivalents import stop_damping
from .parts import numbers


class ContactLaw(ABC):
    """What engines and analyses ask of a law of contact.

    A law is a frozen dataclass of its parameters. Its formulas are in `laws`, since kernels compile
    them.
    """

    rigid: ClassVar[bool] = False
    """Whether it reverses the velocity at once, so that a contact has no depth and no duration."""

    linear: ClassVar[bool] = True
    """Whether the equation of motion is linear in contact; the stepping engine moves others."""

    @property
    def only_pushes(self) -> bool:
        """Whether contact ends where the force would pull, before the depth is zero again."""
        return False

    @property
    def by_approach(self) -> float | None:
        """Loss per velocity times the approach velocity, if the loss depends on that."""
        return None

    @property
    def function(self) -> Callable[[float], float] | None:
        """The user's function within the law, if it has one."""
        return None

    @abstractmethod
    def row(self, spring: float = 1.0, damper: float = 1.0, speed: float = 1.0) -> laws.Row:
        """The parameters in the coding of `laws`, in other units.

        A stiffness is divided by `spring`, a damping of Kelvin and Voigt's by `damper`; the loss
        of Hunt and Crossley is multiplied by `speed`, a unit of velocity over that of the law.
        """

    @abstractmethod
    def in_units(self, time: float, length: float, mass: float) -> ContactLaw:
        """The same law in other units, of which the present ones are `time`, `length`, `mass`."""

    def push(self, depth: Any, inward: Any) -> Any:
        """Force of a soft stop in contact, with a loss that does not depend on the approach."""
        _, stiffness, loss, exponent, _ = self.row()
        if self.linear:
            return laws.spring_push(stiffness, loss, depth, inward)
        import numpy as np

        depth = np.maximum(depth, 0.0)
        return laws.hertz_push(stiffness, exponent, loss, depth, np.sqrt(depth), inward)


@dataclass(frozen=True)
class Rigid(ContactLaw):
    """A rigid stop: x' -> -restitution x', relative to the stop.

    Parameters
    ----------
    restitution : float or callable
        Restitution coefficient, from 0 (no rebound) to 1 (no loss), or a function of the approach
        velocity [m/s] that numba can compile.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    See Also
    --------
    KelvinVoigt, Hertz, Stop

    Examples
    --------
    >>> from impactsig import Rigid, Stop
    >>> Stop(1.0, Rigid(0.7)).law.restitution
    0.7
    """

    restitution: float | Callable[[float], float]

    rigid = True

    def __post_init__(self) -> None:
        if not callable(self.restitution):
            numbers(self, "restitution", least=0.0, most=1.0)

    @property
    def function(self) -> Callable[[float], float] | None:
        """The restitution coefficient, where that is a function."""
        return self.restitution if callable(self.restitution) else None

    def row(self, spring: float = 1.0, damper: float = 1.0, speed: float = 1.0) -> laws.Row:
        """The parameters in the coding of `laws`."""
        r = laws.BY_FUNCTION if callable(self.restitution) else self.restitution
        return laws.Row(laws.RIGID, 0.0, 0.0, 1.0, r)

    def in_units(self, time: float, length: float, mass: float) -> Rigid:
        """The same law: a number has no unit."""
        return self


@dataclass(frozen=True)
class KelvinVoigt(ContactLaw):
    """A massless soft stop: a spring and a damper in parallel.

    In contact the force on the mass is ``-stiffness * depth - damping * depth'``.

    Parameters
    ----------
    stiffness : float
        Stiffness of the stop [N/m], positive.
    damping : float
        Damping of the stop [N s/m].
    ends : {"gap", "force"}
        End of the contact: where the depth is zero again, so that the damper may pull at the end,
        or where the force is zero, so that the stop only pushes.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    See Also
    --------
    Hertz, Rigid, stop_restitution, fit_soft_stop

    Examples
    --------
    >>> from impactsig import KelvinVoigt, stop_restitution
    >>> soft = KelvinVoigt.equivalent(0.85, 10_000.0)
    >>> round(stop_restitution(soft.stiffness, soft.damping), 6)
    0.85
    """

    stiffness: float
    damping: float = 0.0
    ends: Literal["gap", "force"] = "gap"

    def __post_init__(self) -> None:
        numbers(self, "stiffness", above=0.0)
        numbers(self, "damping", least=0.0)
        choice("ends", self.ends, ("gap", "force"))

    @classmethod
    def equivalent(
        cls,
        restitution: float,
        stiffness: float,
        mass: float = 1.0,
        ends: Literal["gap", "force"] = "gap",
    ) -> KelvinVoigt:
        """Soft stop with a given stiffness and restitution coefficient.

        Its damping is given by `stop_damping` for the same end of the contact.

        Raises
        ------
        InvalidInput
            If the restitution coefficient is not in (0, 1].
        """
        cls(stiffness, ends=ends)
        return cls(stiffness, stop_damping(restitution, stiffness, mass, formula=ends), ends)

    @property
    def only_pushes(self) -> bool:
        """Whether contact ends where the force is zero."""
        return self.ends == "force"

    def row(self, spring: float = 1.0, damper: float = 1.0, speed: float = 1.0) -> laws.Row:
        """The parameters in the coding of `laws`."""
        code = laws.PUSHER if self.only_pushes else laws.SPRING
        return laws.Row(code, self.stiffness / spring, self.damping / damper, 1.0, laws.NO_NUMBER)

    def in_units(self, time: float, length: float, mass: float) -> KelvinVoigt:
        """The same law in other units."""
        stiffness, damping = self.stiffness * mass / time**2, self.damping * mass / time
        return replace(self, stiffness=stiffness, damping=damping)


@dataclass(frozen=True)
class Hertz(ContactLaw):
    """A stop whose force follows a power of the depth, 3/2 (Hertz) for a sphere on a plane.

    ``force = stiffness * depth**exponent * (1 + loss * depth')``, where the loss is `damping`
    [HuntCrossley1975]_, or ``3 (1 - restitution^2) / (4 approach velocity)``
    [LankaraniNikravesh1990]_ where a restitution coefficient is given.

    Parameters
    ----------
    stiffness : float
        Stiffness [N/m^exponent], positive.
    exponent : float
        Exponent of the depth, at least 1.
    damping : float
        Loss per velocity [s/m].
    restitution : float, optional
        Restitution coefficient, instead of `damping`. The formula is of first order, and accurate
        for small losses only.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    See Also
    --------
    KelvinVoigt, Rigid, Stop

    Examples
    --------
    >>> from impactsig import Force, Hertz, Oscillator, Stop, simulate
    >>> ball = Hertz(1e6, restitution=0.9)
    >>> machine = Oscillator(damping=0.1, forces=(Force(0.5, 0.9),), stops=(Stop(1.0, ball),))
    >>> motion = simulate(machine, periods=5)
    >>> motion.status
    'complete'
    """

    stiffness: float
    exponent: float = 1.5
    damping: float = 0.0
    restitution: float | None = None

    linear = False

    def __post_init__(self) -> None:
        numbers(self, "stiffness", above=0.0)
        numbers(self, "exponent", least=1.0)
        numbers(self, "damping", least=0.0)
        if self.restitution is not None:
            numbers(self, "restitution", least=0.0, most=1.0)
            if self.damping:
                raise InvalidInput("damping", self.damping, "no damping beside a restitution")

    @property
    def by_approach(self) -> float | None:
        """Loss of Lankarani and Nikravesh, times the approach velocity."""
        r = self.restitution
        return None if r is None else 0.75 * (1 - r * r)

    def row(self, spring: float = 1.0, damper: float = 1.0, speed: float = 1.0) -> laws.Row:
        """The parameters in the coding of `laws`."""
        own = laws.NO_NUMBER if self.by_approach is None else self.by_approach
        stiffness, loss = self.stiffness / spring, self.damping * speed
        return laws.Row(laws.HERTZ, stiffness, loss, self.exponent, own)

    def in_units(self, time: float, length: float, mass: float) -> Hertz:
        """The same law in other units."""
        newton = mass * length / time**2
        stiffness = self.stiffness * newton / length**self.exponent
        return replace(self, stiffness=stiffness, damping=self.damping * time / length)


@dataclass(frozen=True)
class Stop:
    """A stop on one side of the mass.

    Parameters
    ----------
    position : float
        Position at which the mass touches the stop [m], relative to the base if the stops move with
        it.
    law : Rigid, KelvinVoigt or Hertz
        The contact law.
    side : {"upper", "lower"}
        "upper" keeps the mass below `position`, "lower" above it.

    Raises
    ------
    InvalidInput
        If a value is out of its range.

    See Also
    --------
    Rigid, KelvinVoigt, Hertz, Oscillator

    Examples
    --------
    >>> from impactsig import Oscillator, Rigid, Stop
    >>> between = Oscillator(stops=(Stop(1.0, Rigid(0.7)), Stop(-1.0, Rigid(0.7), "lower")))
    >>> [stop.side for stop in between.stops]
    ['upper', 'lower']
    """

    position: float
    law: ContactLaw
    side: Literal["upper", "lower"] = "upper"

    def __post_init__(self) -> None:
        numbers(self, "position")
        choice("side", self.side, ("upper", "lower"))
        if not isinstance(self.law, ContactLaw):
            raise InvalidInput("law", self.law, "Rigid(...), KelvinVoigt(...) or Hertz(...)")

    @property
    def sign(self) -> int:
        """1 of an upper stop, -1 of a lower one."""
        return 1 if self.side == "upper" else -1
