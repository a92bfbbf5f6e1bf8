"""An impacting oscillator as immutable, validated data, in any units."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

from .._arguments import all_of, flag, function, text
from ..errors import InvalidInput
from .parts import (
    BaseMotion,
    Force,
    Friction,
    Noise,
    columns_allowed,
    numbers,
)
from .recurrence import Recurrence, recurrence, repeats
from .stops import Stop


@dataclass(frozen=True)
class Oscillator:
    """A mass on a spring and a damper, under harmonic forcing, with stops and Coulomb friction.

    ``mass x'' + damping x' + stiffness x = load + forces`` while no stop is touched.

    Parameters
    ----------
    mass : float
        Mass [kg], positive.
    damping : float
        Damping [N s/m], at least 0.
    stiffness : float
        Stiffness [N/m], at least 0; with 0 the mass is free, as for a bouncing ball.
    forces : sequence of Force
        Harmonic forces on the mass. The forcing period is the common period of all forcing,
        `forcing_period`, and phases are 2 pi times the elapsed fraction of it.
    load : float
        Constant force [N].
    base : BaseMotion, optional
        Motion of the base.
    stops : sequence of Stop
        Stops, any number on either side. Soft stops may be placed behind each other and in front of
        a rigid one.
    friction : Friction, optional
        Coulomb friction.
    law : callable, optional
        An additional force ``law(t, x, v)`` on the mass [N], with t since the start of the
        simulation in the unit of time of the oscillator, and x, v relative to the ground; a
        function that numba can compile. Whether it depends on t, and with which period, is
        determined by evaluating it.
    noise : Noise, optional
        A random force on the mass, white or filtered: `simulate` computes one path,
        `simulate_ensemble` many.
    time_unit, length_unit, mass_unit : float
        Units of the values above in seconds, metres and kilograms: 1 for SI units; 1/omega_n of the
        machine, its gap and its mass for a dimensionless oscillator. Times of a simulation are in
        seconds, all other quantities in the units of the oscillator.
    name : str
        Name of the oscillator.
    in_seconds : bool
        Whether the unit of time is known, as it always is if `time_unit` is not 1. False for a
        dimensionless oscillator that does not represent a particular machine: times of a simulation
        are then dimensionless.

    Raises
    ------
    InvalidInput
        If a value is out of its range, stops overlap or one is out of reach of the mass, or an
        undamped oscillator is forced at resonance, where its motion without impacts is unbounded.

    See Also
    --------
    simulate, Stop, Force, scenes

    Examples
    --------
    >>> from impactsig import Oscillator, Rigid, Stop, simulate
    >>> ball = Oscillator(stiffness=0, load=-9.81, stops=(Stop(0.0, Rigid(0.8), "lower"),))
    >>> drop = simulate(ball, duration=2.0, initial=(1.0, 0.0))
    >>> round(float(drop.impacts.time[0]), 6)  # sqrt(2 h / g)
    0.451524
    """

    mass: float = 1.0
    damping: float = 0.0
    stiffness: float = 1.0
    forces: tuple[Force, ...] = ()
    load: float = 0.0
    base: BaseMotion | None = None
    stops: tuple[Stop, ...] = ()
    friction: Friction | None = None
    law: Callable[[float, float, float], float] | None = None
    noise: Noise | None = None
    time_unit: float = 1.0
    length_unit: float = 1.0
    mass_unit: float = 1.0
    name: str = ""
    in_seconds: bool = True

    def __post_init__(self) -> None:
        numbers(self, "mass", "time_unit", "length_unit", "mass_unit", above=0.0)
        numbers(self, "damping", "stiffness", least=0.0)
        numbers(self, "load")
        text("name", self.name)
        object.__setattr__(
            self, "in_seconds", flag("in_seconds", self.in_seconds) or self.time_unit != 1
        )
        for name, kind in (("forces", Force), ("stops", Stop)):
            required = f"{kind.__name__}(...), one or several"
            items = all_of(name, getattr(self, name), kind, required)
            object.__setattr__(self, name, items)
        if self.base is not None and not isinstance(self.base, BaseMotion):
            raise InvalidInput("base", self.base, "BaseMotion(...) or None")
        if self.friction is not None and not isinstance(self.friction, Friction):
            raise InvalidInput("friction", self.friction, "Friction(...) or None")
        if self.noise is not None and not isinstance(self.noise, Noise):
            raise InvalidInput("noise", self.noise, "Noise(...) or None")
        if self.noise is not None and self.noise.parametric and self.base is not None:
            raise InvalidInput(
                "noise", self.noise, "noise that is a force, where the base moves",
                "A stiffness that varies would pull at the base as well as at the mass",
            )  # fmt: skip
        if self.law is not None:
            function("law", self.law, "a function of t, x and v, or None", 3)
        if columns_allowed.get():  # the batch compares its columns with each other
            return
        self._check_stops()
        natural = self.stiffness / self.mass
        for frequency in self.angular_frequencies:
            # The forced response grows as 1 / |difference|, and digits are lost in that measure.
            # Divided twice, as the square of a frequency may be beyond what a float holds.
            detuning = abs(natural / frequency / frequency - 1.0)
            loss = self.damping / self.mass / frequency
            if math.hypot(detuning, loss) < 1e-6:
                raise InvalidInput(
                    "damping",
                    self.damping,
                    f"a positive damping under forcing at the natural frequency, {frequency:g}",
                    "Undamped, such a motion grows without bound",
                )

    def _check_stops(self) -> None:
        upper, lower = self.stops_on("upper"), self.stops_on("lower")
        if upper and lower and not lower[0].position < upper[0].position:
            raise InvalidInput(
                "stops",
                f"lower at {lower[0].position:g}, upper at {upper[0].position:g}",
                "room between the stops",
            )
        for near, far in [*pairwise(upper), *pairwise(lower)]:
            where = f"{near.position:g} and {far.position:g}"
            if near.position == far.position:
                raise InvalidInput("stops", where, "stops of a side at different positions")
            if near.law.rigid:
                other, way = ("lower", "above") if near.side == "upper" else ("upper", "below")
                raise InvalidInput(
                    "stops", f"{near.side} stops at {where}", "no stop behind a rigid one",
                    f"The mass cannot get past {near.position:g}. Where that stop is to keep it "
                    f'{way} {near.position:g}, give it side="{other}"',
                )  # fmt: skip

    @property
    def moved_by(self) -> str:
        """Name of the module whose `move` simulates it."""
        noisy = self.noise is not None and self.noise.intensity > 0
        return "impactsig.stochastic.noisy_motion" if noisy else "impactsig.simulation.simulation"

    @property
    def dimension(self) -> int:
        """Number of coordinates: displacement and velocity."""
        return 2

    def stops_on(self, side: str) -> tuple[Stop, ...]:
        """The stops on one side ("upper" or "lower"), in the order they are reached."""
        stops = (stop for stop in self.stops if stop.side == side)
        return tuple(sorted(stops, key=lambda stop: stop.sign * stop.position))

    @property
    def angular_natural_frequency(self) -> float:
        """Angular natural frequency, undamped [rad per unit of the oscillator's time]."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def angular_frequencies(self) -> tuple[float, ...]:
        """Angular frequencies of the forces in order, then of the base [rad per unit of time]."""
        of_forces = tuple(force.angular_frequency for force in self.forces)
        return of_forces + ((self.base.angular_frequency,) if self.base else ())

    @property
    def angular_forcing_frequency(self) -> float | None:
        """Angular frequency of the forcing period [rad per unit of time]; None without forcing."""
        return self._recurrence.frequency if self.angular_frequencies else None

    @property
    def forcing_period(self) -> float | None:
        """Least common period of all forcing [s], or None without forcing.

        The forcing consists of the forces, the base and a `law` that depends on time. Frequencies
        have a common period if their ratios are rational up to rounding, and it is at most 8
        periods of the first. Without a common period (`forcing_recurs` is False) this is the period
        of the first force, or else of the base.
        """
        omega = self.angular_forcing_frequency
        return None if omega is None else 2 * math.pi / omega * self.time_unit

    @property
    def forcing_recurs(self) -> bool:
        """Whether there is forcing, all of which repeats after `forcing_period`."""
        return bool(self.angular_frequencies) and self._recurrence.recurs

    @property
    def law_depends_on_time(self) -> bool:
        """Whether `law` depends on t, judged by its values at some instants and states."""
        if self.law is None:
            return False
        period = (
            2 * math.pi / (self.angular_frequencies or (self.angular_natural_frequency or 1.0,))[0]
        )
        shares = (0.3819660112501051, 0.8541019662496845)  # of no common measure with the period
        size = self._size
        speed = size * 2 * math.pi / period
        return not all(repeats(self.law, share * period, size, speed) for share in shares)

    @property
    def _recurrence(self) -> Recurrence:
        return recurrence(self.angular_frequencies, self.law, self._size)

    @property
    def _size(self) -> float:
        """Length at which a law is looked at."""
        return max((abs(stop.position) for stop in self.stops), default=0.0) or 1.0

    def in_units(self, time: float = 1.0, length: float = 1.0, mass: float = 1.0) -> Oscillator:
        """The same oscillator, expressed in other units of time, length and mass.

        ``oscillator.in_units()`` is in SI units; ``in_units(1 / omega_n, gap, mass)`` of a
        machine in SI units is dimensionless, with unit mass, stiffness and gap.

        Parameters
        ----------
        time, length, mass : float
            Seconds, metres and kilograms in one of the new units.

        Raises
        ------
        InvalidInput
            If a unit is not positive, or the oscillator has a part that is a function, which cannot
            be converted.
        """
        new = replace(Oscillator(), time_unit=time, length_unit=length, mass_unit=mass)
        if self.law is not None or any(stop.law.function is not None for stop in self.stops):
            raise InvalidInput(
                "law" if self.law else "restitution", "a function", "a number, to change its unit",
                "Write the function anew in the new units, and replace() it",
            )  # fmt: skip
        t = self.time_unit / new.time_unit
        x = self.length_unit / new.length_unit
        m = self.mass_unit / new.mass_unit
        newton = m * x / t**2

        friction, noise = self.friction, self.noise
        return replace(
            new,
            mass=self.mass * m,
            damping=self.damping * m / t,
            stiffness=self.stiffness * m / t**2,
            load=self.load * newton,
            forces=tuple(
                replace(
                    force,
                    amplitude=force.amplitude * newton,
                    angular_frequency=force.angular_frequency / t,
                )
                for force in self.forces
            ),
            base=self.base
            and replace(
                self.base,
                amplitude=self.base.amplitude * x,
                angular_frequency=self.base.angular_frequency / t,
            ),
            stops=tuple(
                replace(stop, position=stop.position * x, law=stop.law.in_units(t, x, m))
                for stop in self.stops
            ),
            friction=friction and Friction(friction.kinetic * newton, friction.static * newton),  # type: ignore[operator]
            noise=noise
            and replace(
                noise,
                intensity=noise.intensity * (newton / x if noise.parametric else newton) ** 2 * t,
                correlation_time=noise.correlation_time * t,
                angular_frequency=noise.angular_frequency / t,
            ),
            name=self.name,
            in_seconds=self.in_seconds,
        )

    def __repr__(self) -> str:
        parts = [f"mass={self.mass:g}, damping={self.damping:g}, stiffness={self.stiffness:g}"]
        parts += [repr(force) for force in self.forces]
        if self.load:
            parts.append(f"load={self.load:g}")
        if self.base:
            parts.append(repr(self.base))
        parts += [repr(stop) for stop in self.stops]
        if self.friction:
            parts.append(repr(self.friction))
        if self.law:
            parts.append(f"law={getattr(self.law, '__name__', self.law)}")
        if self.noise:
            parts.append(repr(self.noise))
        units = (("time", "s"), ("length", "m"), ("mass", "kg"))
        for name, symbol in units:
            unit = getattr(self, f"{name}_unit")
            if unit != 1:
                parts.append(f"{name}_unit={unit:g} {symbol}")
        title = f"{self.name!r}: " if self.name else ""
        return f"Oscillator({title}{'; '.join(parts)})"
