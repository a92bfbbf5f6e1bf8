"""Time scales and ranges of a motion under noise, from which step and bins follow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InvalidInput
from ..oscillators import Oscillator
from .paths.posing import contact_rate, filtered_deviation, potential
from .paths.running import Group, Mover

FINE = 0.2  # default step by the fastest scale
PILOT_KEY = np.array([0x696D7061, 0x63747369], np.uint32)  # the pilot's own: a seed has no part
PILOT_PATHS = 8
PILOT_STEPS = 100_000
PILOT_LOOKS = 4096
TRIES = 60


@dataclass(frozen=True)
class Survey:
    """Scales and ranges found by a few short paths.

    Attributes
    ----------
    rate : float
        Greatest rate of change, per unit of the oscillator's time.
    fastest : str
        What changes so fast.
    ranges : tuple of (float, float)
        Of energy, displacement and velocity.
    """

    rate: float
    fastest: str
    ranges: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]

    def check(self, step: float, unit: float) -> None:
        """Refuse a step [s] that is larger than the fastest scale.

        Raises
        ------
        InvalidInput
            If it is.
        """
        scale = unit / self.rate
        if step > scale:
            raise InvalidInput(
                "step", step, f"at most {scale:.3g} s, the time scale of {self.fastest}",
                f"Leave it out for {self.default * unit:.3g} s",
            )  # fmt: skip

    @property
    def default(self) -> float:
        """The default step in the oscillator's unit of time: a fifth of a scale, to two digits."""
        step = FINE / self.rate
        digit = 10.0 ** (math.floor(math.log10(step)) - 1)
        return math.floor(step / digit * (1 + 1e-9)) * digit


def known_rates(oscillator: Oscillator) -> list[tuple[float, str]]:
    """Rates that follow from the oscillator's parameters, with their names."""
    mass, stiffness, damping = oscillator.mass, oscillator.stiffness, oscillator.damping
    rates = [
        (oscillator.angular_natural_frequency, "the natural oscillation"),
        (damping / mass, "the damping"),
    ]
    for stop in oscillator.stops:
        if stop.law.linear and not stop.law.rigid:
            contact, row = f"the contact with the stop at {stop.position:g}", stop.law.row()
            rates.append((math.sqrt((stiffness + row.stiffness) / mass), contact))
            rates.append(((damping + row.loss) / mass, contact))
    for force in oscillator.forces:
        omega = force.angular_frequency
        rates.append((omega, f"the forcing at angular frequency {omega:g}"))
    if oscillator.base:
        rates.append((oscillator.base.angular_frequency, "the motion of the base"))
    if oscillator.noise and oscillator.noise.correlation_time:
        rates.append((1 / oscillator.noise.correlation_time, "the filtered noise"))
        rates.append((oscillator.noise.angular_frequency, "the filtered noise"))
    if oscillator.noise and oscillator.noise.parametric:
        rates.append((_stiffened(oscillator), "the noise of the stiffness"))
    return rates


def _stiffened(oscillator: Oscillator) -> float:
    """Rate of an oscillator whose stiffness is increased by three standard deviations."""
    if deviation := filtered_deviation(oscillator):
        return math.sqrt(oscillator.stiffness / oscillator.mass + 3 * deviation)
    assert oscillator.noise is not None
    # The velocity spreads by sigma x sqrt(t) in a time t, in which x changes by v t.
    return float((2 * oscillator.noise.intensity / oscillator.mass**2) ** (1 / 3))


def survey(
    oscillator: Oscillator, span: float, q: np.ndarray, v: np.ndarray, phase: float
) -> Survey:
    """Simulate a few short paths from the first starts, with a suitable step.

    Parameters
    ----------
    oscillator : Oscillator
        The system.
    span : float
        How long it will, in its own unit of time.
    q, v : numpy.ndarray, shape (n,)
        Positions and velocities at t = 0, relative to the stops.
    phase : float
        Phase of the forcing at t = 0 [rad].

    Raises
    ------
    InvalidInput
        If the motion is lost however short the steps.
    """
    known = known_rates(oscillator)
    bent = oscillator.law is not None or not all(stop.law.linear for stop in oscillator.stops)
    lanes = np.arange(PILOT_PATHS) % len(q)
    least = 100 * FINE / span  # at least a hundred steps
    step = FINE / max(*(rate for rate, _ in known), 10 * least)
    for _ in range(TRIES):
        steps = min(max(round(span / step), 1), PILOT_STEPS)
        every = max(steps // PILOT_LOOKS, 1)
        group = Mover(oscillator, step, "splitting", phase, PILOT_KEY).start(
            q[lanes], v[lanes], np.arange(PILOT_PATHS)
        )
        seen = group.move(steps, every, steps // every)
        if not np.all(np.isfinite(seen)):
            step /= 4
            continue
        rate, fastest = max(known + _rates_met(oscillator, group, seen, step * every))
        if rate < least:
            rate, fastest = least, f"the run, 1/{100 * FINE:g} of it"
        if not bent or step <= 1.25 * FINE / rate:
            return Survey(rate, fastest, _ranges(oscillator, group, seen, step * every))
        step = FINE / rate
    raise InvalidInput(
        "oscillator", repr(oscillator), "a motion that stays finite",
        f"With steps down to {step * oscillator.time_unit:.1g} s it is lost",
    )  # fmt: skip


def _rates_met(
    oscillator: Oscillator, group: Group, seen: np.ndarray, apart: float
) -> list[tuple[float, str]]:
    """Rates that only the motion shows: of nonlinear forces and of flights."""
    from .paths.accumulating import local_rates

    p, law = group.mover.problem, group.mover.functions.law
    x, v = seen[..., 0].ravel(), seen[..., 1].ravel()
    speed = float(np.abs(v).max())
    rates = []
    if oscillator.law is not None:
        time = np.tile(apart * np.arange(1, seen.shape[1] + 1), len(seen))
        dx, dv = (1e-5 * max(float(np.ptp(values)), 1e-9) for values in (x, v))
        stiff, drag = local_rates(law, time, x, v, dx, dv, oscillator.mass)
        rates += [(stiff, "the law, by x"), (drag, "the law, by v")]
    elif not oscillator.stiffness and p.sigma:
        pull = abs(p.constant) + p.kinetic
        rates.append(((pull / p.sigma) ** 2, "load and friction against the noise"))
    for stop in oscillator.stops:
        if not stop.law.linear:
            contact = f"the contact with the stop at {stop.position:g}"
            rates.append((contact_rate(stop, oscillator.mass, speed), contact))
    if math.isfinite(p.high - p.low):
        rates.append((speed / (p.high - p.low), "the flights between the stops"))
    return rates


def _ranges(
    oscillator: Oscillator, group: Group, seen: np.ndarray, apart: float
) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    """Ranges of energy, displacement and velocity, with a margin beyond the short paths."""
    from .paths.accumulating import energies

    p, law = group.mover.problem, group.mover.functions.law
    late = seen[:, seen.shape[1] // 2 :]  # where the start is forgotten, if it is
    x, v = late[..., 0], late[..., 1]
    wide = 0.3 * float(np.ptp(x)) + 1e-12
    low, high = float(x.min()) - wide, float(x.max()) + wide
    if p.base_amplitude == 0.0:
        low, high = max(low, p.low), min(high, p.high)
    u = potential(oscillator, law, low, high)
    energy = np.empty(seen.shape[:2])
    energies(p, u, law, seen, apart, apart, energy)
    energy = energy[:, seen.shape[1] // 2 :]
    ground = np.empty((1, 512))
    rest = np.zeros((1, 512, 2))
    rest[0, :, 0] = np.linspace(low, high, 512)
    energies(p, u, law, rest, 0.0, 0.0, ground)
    least = float(ground.min())
    fast = 1.3 * float(np.abs(v).max()) + 1e-12
    most = least + 1.6 * (float(energy.max()) - least) + 1e-12
    return (least, most), (low, high), (-fast, fast)
