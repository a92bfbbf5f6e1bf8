"""An impacting oscillator as immutable, validated data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from ..errors import InvalidInput


@dataclass(frozen=True)
class Force:
    """A harmonic force ``amplitude * cos(frequency * t + phase)`` on the mass.

    Parameters
    ----------
    amplitude : float
        Amplitude [N].
    frequency : float
        Angular frequency [rad/s], positive.
    phase : float
        Phase at t = 0 [rad]; -pi/2 makes it a sine.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        _numbers(self, "amplitude", "phase")
        _numbers(self, "frequency", above=0.0)


@dataclass(frozen=True)
class BaseMotion:
    """Harmonic motion ``amplitude * cos(frequency * t + phase)`` of what the mass hangs on.

    Parameters
    ----------
    amplitude : float
        Amplitude [m].
    frequency : float
        Angular frequency [rad/s], positive.
    phase : float
        Phase at t = 0 [rad]; -pi/2 makes it a sine.
    spring, damper : bool
        Whether the spring and the damper hang on the base; one that does not is held by the
        ground.
    stops : bool
        Whether the stops move with the base.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0
    spring: bool = True
    damper: bool = True
    stops: bool = False

    def __post_init__(self) -> None:
        _numbers(self, "amplitude", "phase")
        _numbers(self, "frequency", above=0.0)


@dataclass(frozen=True)
class Rigid:
    """A rigid stop: x' -> -restitution x', relative to the stop.

    Parameters
    ----------
    restitution : float
        Restitution coefficient, from 0 (no rebound) to 1 (no loss).
    """

    restitution: float

    def __post_init__(self) -> None:
        _numbers(self, "restitution", least=0.0, most=1.0)


@dataclass(frozen=True)
class KelvinVoigt:
    """A soft stop: a spring and a damper side by side, touched without mass.

    While the mass is beyond the stop it feels ``-stiffness * depth - damping * depth'``. Contact
    ends where the depth is zero again, so that the damper may pull at the end.

    Parameters
    ----------
    stiffness : float
        Stiffness of the stop [N/m], positive.
    damping : float
        Damping of the stop [N s/m].
    """

    stiffness: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        _numbers(self, "stiffness", above=0.0)
        _numbers(self, "damping", least=0.0)

    @classmethod
    def equivalent(cls, restitution: float, stiffness: float, mass: float = 1.0) -> KelvinVoigt:
        """The soft stop of given stiffness that returns the share `restitution` of the velocity.

        Its damping, ``-2 ln r sqrt(stiffness mass / (pi^2 + ln^2 r))``, makes one contact free of
        other forces end at zero depth with r times the velocity [Okolewski2021]_.

        Raises
        ------
        InvalidInput
            If the restitution is not in (0, 1]: none has infinite damping.
        """
        Rigid(restitution)
        if restitution == 0:
            raise InvalidInput("restitution", restitution, "0 < restitution <= 1")
        loss = math.log(restitution)
        return cls(stiffness, -2 * loss * math.sqrt(stiffness * mass / (math.pi**2 + loss**2)))


@dataclass(frozen=True)
class Stop:
    """A stop on one side of the mass.

    Parameters
    ----------
    position : float
        Where the mass touches it [m], measured from the base where the stops move with that.
    law : Rigid or KelvinVoigt
        The contact law.
    side : {"upper", "lower"}
        "upper" keeps the mass below `position`, "lower" above it.
    """

    position: float
    law: Rigid | KelvinVoigt
    side: Literal["upper", "lower"] = "upper"

    def __post_init__(self) -> None:
        _numbers(self, "position")
        if self.side not in ("upper", "lower"):
            raise InvalidInput("side", self.side, '"upper" or "lower"')
        if not isinstance(self.law, (Rigid, KelvinVoigt)):
            raise InvalidInput("law", self.law, "Rigid(...) or KelvinVoigt(...)")


@dataclass(frozen=True)
class Oscillator:
    """A mass on a spring and a damper, under harmonic forcing, that hits stops.

    ``mass x'' + damping x' + stiffness x = load + forces`` while no stop is touched.

    Parameters
    ----------
    mass : float
        Mass [kg], positive.
    damping : float
        Damping [N s/m], at least 0.
    stiffness : float
        Stiffness [N/m], at least 0; 0 leaves the mass free, as a bouncing ball.
    forces : sequence of Force
        Harmonic forces on the mass. The first (or else the base) is the reference that forcing
        periods and phases are counted by.
    load : float
        Constant force [N].
    base : BaseMotion, optional
        Motion of the base.
    stops : sequence of Stop
        At most one on either side.
    time_unit : float
        Seconds in one unit of the oscillator's time: 1 in SI units, 1/omega_n of the machine for
        a dimensionless oscillator. Results give time in seconds, and all else in the
        oscillator's own units.
    name : str
        What to call it.

    Raises
    ------
    InvalidInput
        If a value is out of its range, two stops share a side or leave no room between them, or
        an undamped oscillator is forced at resonance, where its free motion has no bound.
    """

    mass: float = 1.0
    damping: float = 0.0
    stiffness: float = 1.0
    forces: tuple[Force, ...] = ()
    load: float = 0.0
    base: BaseMotion | None = None
    stops: tuple[Stop, ...] = ()
    time_unit: float = 1.0
    name: str = ""

    def __post_init__(self) -> None:
        _numbers(self, "mass", "time_unit", above=0.0)
        _numbers(self, "damping", "stiffness", least=0.0)
        _numbers(self, "load")
        for name, kind in (("forces", Force), ("stops", Stop)):
            items = getattr(self, name)
            items = (items,) if isinstance(items, kind) else tuple(items)
            if not all(isinstance(item, kind) for item in items):
                raise InvalidInput(name, items, f"{kind.__name__}(...), one or several")
            object.__setattr__(self, name, items)
        if self.base is not None and not isinstance(self.base, BaseMotion):
            raise InvalidInput("base", self.base, "BaseMotion(...) or None")
        upper, lower = self.stop("upper"), self.stop("lower")
        if len(self.stops) > (upper is not None) + (lower is not None):
            raise InvalidInput("stops", self.stops, "at most one stop on either side")
        if upper is not None and lower is not None and not lower.position < upper.position:
            raise InvalidInput(
                "stops",
                f"lower at {lower.position:g}, upper at {upper.position:g}",
                "room between the stops",
            )
        natural = self.stiffness / self.mass
        frequencies = [force.frequency for force in self.forces]
        for frequency in frequencies + ([self.base.frequency] if self.base else []):
            # The forced response grows as 1 / |difference|, and digits are lost in that measure.
            detuning = abs(natural - frequency**2) / frequency**2
            loss = self.damping / (self.mass * frequency)
            if math.hypot(detuning, loss) < 1e-6:
                raise InvalidInput(
                    "damping",
                    self.damping,
                    f"damping, or forcing away from the resonance at {frequency:g} rad/s",
                )

    def stop(self, side: str) -> Stop | None:
        """The stop on that side ("upper" or "lower"), or None."""
        return next((stop for stop in self.stops if stop.side == side), None)

    @property
    def natural_frequency(self) -> float:
        """Angular natural frequency, undamped, per unit of the oscillator's time."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def forcing_frequency(self) -> float | None:
        """Angular frequency of the reference forcing, or None where there is no forcing."""
        if self.forces:
            return self.forces[0].frequency
        return self.base.frequency if self.base else None

    @property
    def forcing_period(self) -> float | None:
        """Period of the reference forcing [s], or None where there is no forcing."""
        omega = self.forcing_frequency
        return None if omega is None else 2 * math.pi / omega * self.time_unit

    def __repr__(self) -> str:
        parts = [f"mass={self.mass:g}, damping={self.damping:g}, stiffness={self.stiffness:g}"]
        parts += [repr(force) for force in self.forces]
        if self.load:
            parts.append(f"load={self.load:g}")
        if self.base:
            parts.append(repr(self.base))
        parts += [repr(stop) for stop in self.stops]
        if self.time_unit != 1:
            parts.append(f"time_unit={self.time_unit:g} s")
        title = f"{self.name!r}: " if self.name else ""
        return f"Oscillator({title}{'; '.join(parts)})"


def _numbers(
    owner: Any,
    *names: str,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
) -> None:
    """Make the named fields floats, or say what is wrong with one."""
    for name in names:
        value = getattr(owner, name)
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise InvalidInput(name, value, "a real number") from None
        if not (math.isfinite(number) and number > above and least <= number <= most):
            wanted = "a finite number"
            if above > -math.inf:
                wanted += f" > {above:g}"
            if least > -math.inf:
                wanted += f" >= {least:g}"
            if most < math.inf:
                wanted += f" and <= {most:g}"
            raise InvalidInput(name, value, wanted)
        object.__setattr__(owner, name, number)
