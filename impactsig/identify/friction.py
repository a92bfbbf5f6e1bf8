"""`identify_friction`: viscous damping and Coulomb friction from a free decay."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .._arguments import number
from .._showing import Shown
from ..errors import ImpactsigWarning, InvalidInput
from ..recording import Recording
from ._swings import Machine, decrement, extrema, swings
from .resonance import CLEAN, MISFIT, _greatest, _samples, _unevenness

FEWEST = 4  # extrema
SHARES = (1.0, 0.8, 0.9, 1.1, 1.2)  # of the friction that the extrema tell, to start from
SMALL = 2.0  # times the friction: swings that are left out, as a greater static friction ends them


class Bounded(NamedTuple):
    """A value, its standard error and its interval."""

    value: float
    error: float
    interval: tuple[float, float]


@dataclass(frozen=True, eq=False, repr=False)
class FrictionDecay(Shown):
    """Damping and friction of a machine with one degree of freedom.

    Attributes
    ----------
    natural_frequency : Bounded
        Undamped natural frequency [Hz].
    damping_ratio : Bounded
        Viscous damping as a fraction of critical damping.
    friction : Bounded
        Coulomb friction force divided by the stiffness [unit]: half the range in which the mass can
        rest.
    centre : Bounded
        Rest position of the spring [unit].
    level : float
        Coverage of the intervals.
    decrement : (float, float)
        Damping ratio and friction by successive extrema alone [FeenyLiang1996]_.
    extremum_time, extremum : ndarray, shape (n,)
        Successive extrema [s, unit].
    start, duration : float
        Start and length of the span that was fitted [s].
    noise : float
        Standard deviation of the residuals [unit].
    signal_to_noise : float
        Ratio of the power of the oscillation over the span to that of the noise [dB].
    p_value : float
        Probability that residuals of the true model in white noise are as unevenly distributed over
        the frequencies.

    See Also
    --------
    identify_friction, results.Resonance

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Friction, Oscillator, Recording, identify_friction, simulate
    >>> machine = Oscillator(damping=0.04, friction=Friction(0.05))
    >>> swing = simulate(machine, duration=60.0, initial=(1.7, 0.3))
    >>> found = identify_friction(Recording(swing.sample(np.arange(1200) / 20)[0], 20.0))
    >>> round(float(found.damping_ratio.value), 6), round(float(found.friction.value), 6)
    (0.02, 0.05)
    """

    natural_frequency: Bounded
    damping_ratio: Bounded
    friction: Bounded
    centre: Bounded
    level: float
    decrement: tuple[float, float]
    extremum_time: np.ndarray
    extremum: np.ndarray
    start: float
    duration: float
    noise: float
    signal_to_noise: float
    p_value: float

    @property
    def misfit(self) -> bool:
        """Whether the record contradicts the model: `p_value` of 0.001 or less.

        The stated errors are then not valid. Above 100 dB the residuals are rounding errors.
        """
        return self.p_value <= MISFIT and not self.signal_to_noise > CLEAN

    def __repr__(self) -> str:
        told = "; ".join(
            f"{name} {one.value:.6g} ± {one.error:.1g}"
            for name, one in (
                ("natural frequency", self.natural_frequency),
                ("damping ratio", self.damping_ratio),
                ("friction", self.friction),
            )
        )
        return f"FrictionDecay({told}{'; misfit' if self.misfit else ''})"


def identify_friction(recording: Recording, *, level: float = 0.95) -> FrictionDecay:
    """Estimate viscous damping and Coulomb friction together, from a free decay.

    ``x'' + 2 zeta omega x' + omega^2 (x - centre + friction sgn x') = 0`` is fitted to the samples
    by least squares, starting from an estimate by successive extrema [FeenyLiang1996]_. In white
    noise this is maximum likelihood; the intervals come from its curvature.

    Parameters
    ----------
    recording : Recording
        One channel, the displacement of a machine that oscillates freely from the first sample on.
    level : float
        Coverage of the intervals, between 0 and 1.

    Returns
    -------
    FrictionDecay

    Raises
    ------
    InvalidInput
        If an argument is out of its range, the record has missing samples or several channels, or
        it has too few swings.

    Warns
    -----
    ImpactsigWarning
        If the model does not explain the record.

    Notes
    -----
    If the model does not explain the whole record, only its beginning is fitted: up to its last
    clear extremum, and at most up to the first one within twice the friction from the centre. If
    static friction exceeds kinetic friction, the mass comes to rest earlier than in the model.

    See Also
    --------
    identify_resonance, results.FrictionDecay

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Friction, Oscillator, Recording, identify_friction, simulate
    >>> machine = Oscillator(damping=0.04, friction=Friction(0.05))
    >>> swing = simulate(machine, duration=60.0, initial=(1.7, 0.3))
    >>> found = identify_friction(Recording(swing.sample(np.arange(1200) / 20)[0], 20.0))
    >>> round(float(found.damping_ratio.value), 6), round(float(found.friction.value), 6)
    (0.02, 0.05)
    """
    samples = _samples(recording)
    level = number("level", level, above=0.0, most=1.0)
    rate = float(recording.rate)
    frequency = _greatest(samples, rate)
    time, levels = extrema(samples, frequency, rate)
    times, levels = _swinging(time, levels)
    if len(levels) < FEWEST:
        raise InvalidInput(
            "recording", f"{len(levels)} extrema", f"{FEWEST} or more, of one free decay",
            "Record for longer, or from a greater displacement",
        )  # fmt: skip
    by_extrema = decrement(levels)
    guess = _guess(samples, times, by_extrema, rate)
    found = _best(samples, guess, rate, levels)
    fitted = _judged(recording, samples, found, level, by_extrema[:2], times, levels)
    machine = found[0]
    clear = np.abs(levels - machine.centre) > SMALL * abs(machine.friction)
    ends = len(clear) - 1 if clear.all() else int(np.argmin(clear))
    if fitted.misfit and ends >= FEWEST:
        part = samples[: max(int(times[ends] * rate), 32)]
        found = _fitted(part, machine, rate)
        fitted = _judged(recording, part, found, level, by_extrema[:2], times, levels)
    if fitted.misfit:
        warnings.warn(
            "viscous damping and Coulomb friction do not explain the record "
            f"(p = {fitted.p_value:.1g}): the errors do not hold",
            ImpactsigWarning,
            stacklevel=2,
        )
    return fitted


def _swinging(time: np.ndarray, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The extrema as long as they alternate and clearly decrease."""
    if len(levels) < 3:
        return time, levels
    swing = np.abs(np.diff(levels))
    half = np.median(np.diff(time)[: max(3, len(time) // 4)])
    right = (np.abs(np.diff(time) / half - 1) < 0.3) & (swing > 0.03 * swing.max())
    right[1:] &= np.sign(np.diff(levels))[1:] != np.sign(np.diff(levels))[:-1]
    count = len(right) if right.all() else int(np.argmin(right))
    return time[: count + 1], levels[: count + 1]


def _guess(samples: np.ndarray, times: np.ndarray, by_extrema: tuple, rate: float) -> Machine:
    ratio, friction, centre = by_extrema
    omega = math.pi * (len(times) - 1) / (times[-1] - times[0]) / math.sqrt(1 - ratio**2)
    early = samples[: max(6, round(0.25 * 2 * math.pi / omega * rate))]
    t = np.arange(len(early)) / rate
    curve = np.polyfit(t, early, 3)
    return Machine(omega, ratio, friction, centre, float(curve[-1]), float(curve[-2]))


def _fitted(
    samples: np.ndarray, guess: Machine, rate: float
) -> tuple[Machine, np.ndarray, np.ndarray]:
    """Least-squares fit: the machine, the derivatives of the model, and the residual."""
    from scipy.optimize import least_squares

    time = np.arange(len(samples)) / rate
    size = float(np.ptp(samples))
    scale = np.array([guess.omega, 1.0, size, size, size, size * guess.omega])

    def residual(values: np.ndarray) -> np.ndarray:
        return (swings(Machine(*(values * scale)), time) - samples) / size

    options = {"xtol": 1e-11, "ftol": 1e-11, "gtol": 1e-14}
    found = least_squares(residual, np.array(guess) / scale, jac="2-point", **options)
    found = least_squares(residual, found.x, jac="3-point", max_nfev=12, **options)
    machine = Machine(*(float(value) for value in found.x * scale))
    return machine, found.jac * size / scale, found.fun * size


def _best(
    samples: np.ndarray, guess: Machine, rate: float, levels: np.ndarray
) -> tuple[Machine, np.ndarray, np.ndarray]:
    """The best of several least-squares fits.

    How often the mass swings until it rests is a whole number, so the sum of squares has a minimum
    for each. Its neighbours are come to from other shares of the loss that is friction's, each with
    the damping that the extrema have beside it.
    """
    way = np.where(levels[:-1] > levels[1:], 1.0, -1.0)
    found = []
    for share in SHARES:
        friction = share * guess.friction
        here, there = (one - guess.centre - way * friction for one in (levels[:-1], levels[1:]))
        loss = -math.log(min(max(-float(here @ there) / float(here @ here), 1e-3), 1.0)) / math.pi
        start = guess._replace(friction=friction, ratio=loss / math.hypot(1.0, loss))
        found.append(_fitted(samples, start, rate))
    return min(found, key=lambda one: float(one[2] @ one[2]))


def _judged(
    recording: Recording,
    samples: np.ndarray,
    fit: tuple[Machine, np.ndarray, np.ndarray],
    level: float,
    by_extrema: tuple[float, float],
    times: np.ndarray,
    levels: np.ndarray,
) -> FrictionDecay:
    """The machine with its intervals, and the goodness of fit."""
    from scipy.stats import t as student

    found, jacobian, left = fit
    free = len(samples) - len(found)
    variance = float(left @ left) / free
    size = np.linalg.norm(jacobian, axis=0)
    inverse = np.linalg.pinv((jacobian / size).T @ (jacobian / size)) / np.outer(size, size)
    errors = np.sqrt(np.maximum(variance * np.diag(inverse), 0.0))
    reach = float(student.ppf((1 + level) / 2, free))

    def bounded(k: int, unit: float = 1.0) -> Bounded:
        value, error = found[k] / unit, float(errors[k]) / unit
        return Bounded(value, error, (value - reach * error, value + reach * error))

    power = np.abs(np.fft.rfft(left - left.mean())[1:]) ** 2
    noise = math.sqrt(variance)
    swing = float(np.var(samples))
    return FrictionDecay(
        bounded(0, 2 * math.pi), bounded(1), bounded(2), bounded(3), level, by_extrema,
        recording.start + times, levels, recording.start, len(samples) / float(recording.rate),
        noise, 10 * math.log10(swing / variance) if variance > 0 else math.inf,
        _unevenness(power),
    )  # fmt: skip
