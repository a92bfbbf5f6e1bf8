"""Which oscillator a measured train of impacts comes from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .._arguments import Seed, number, streams
from ..comparison import Comparison, compare
from ..errors import InvalidInput
from ..impacts import INFERRED, Impacts
from ..intervals import identify_period
from ..oscillators import Oscillator

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEWEST = 200
"""Impacts below which no fit is tried: words of four intervals come too seldom."""
CONFIDENCE = 0.95
CLOCK_ERROR = 2e-3
"""Share by which the forcing frequency is refined on the impacts' phases."""
LOCKED = 25.0
"""Squared vector strength times the number of impacts from which the phases tell the frequency."""
JUDGED = 40
"""Trains simulated at the optimum, which tell whether the measured one is of their kind."""
LEAST_P = 1 / (JUDGED + 1)
"""Where all of these are nearer, the search has gone astray, or no oscillator of this kind fits."""
TRIES = 3
"""Searches before it is the latter that is believed."""
UNTOLD = {"restitution": 0.5}
"""Half-width of an interval that tells nothing; of parameters sought by their logarithm, log 5."""

Strengths = Literal["auto", "impulse", "peak", "approach_velocity"]


@dataclass(frozen=True, eq=False)
class OscillatorFit:
    """The oscillator found, how well it is told, and what that rests on.

    Attributes
    ----------
    values : dict of str to float
        Every parameter: "restitution", "damping" (as a share of the critical), "amplitude" (of the
        forcing: the deflection in gaps that it would have as a constant force),
        "natural_frequency" [Hz].
    intervals : dict of str to (float, float)
        95 % intervals of the free ones; (-inf, inf) where the impacts do not tell.
    free : tuple of str
        Which were free.
    covariance : ndarray, shape (free, free)
        On the scale of `logarithmic`.
    logarithmic : tuple of bool
        Of which free parameters the covariance is that of the logarithm.
    chain : dict of str to float
        What the measuring chain did: "jitter", standard deviation of the instants [s]; "missed"
        and "spurious", shares of the impacts; "strength_noise", standard deviation of the
        strengths as a share of each, where strengths were used.
    chain_intervals : dict of str to (float, float)
        95 % intervals of these.
    forcing_frequency : float
        As given, refined within 0.2 % on the impacts' phases [Hz].
    oscillator : Oscillator
        What to simulate: dimensionless, in units of the gap.
    strengths : str or None
        What was used as strength of the impacts.
    distance : float
        Mean squared distance of the measured moments from those of trains simulated at the
        optimum, by the median of what single ones of these have: about 1 where the oscillator
        explains the train.
    p_value : float
        Share of the simulated trains that are as far from their mean as the measured one.
    word_shares : ndarray, shape (3, words)
        How often each word of intervals comes: measured; mean and standard deviation of the
        simulated trains.
    comparison : Comparison
        The measured train, and one simulated at the optimum and measured alike.
    evaluations : int
        Trains simulated.
    warnings : tuple of str
        What to know before the numbers are used.
    """

    values: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    free: tuple[str, ...]
    covariance: np.ndarray = field(repr=False)
    logarithmic: tuple[bool, ...] = field(repr=False)
    chain: Mapping[str, float]
    chain_intervals: Mapping[str, tuple[float, float]] = field(repr=False)
    forcing_frequency: float
    oscillator: Oscillator = field(repr=False)
    strengths: str | None
    distance: float
    p_value: float
    word_shares: np.ndarray = field(repr=False)
    comparison: Comparison = field(repr=False)
    evaluations: int
    warnings: tuple[str, ...]

    def describe(self) -> str:
        """The numbers in a few lines of words."""
        lines = []
        for name in self.free:
            low, high = self.intervals[name]
            told = f"95 % interval {low:.4g} to {high:.4g}"
            if not math.isfinite(low):
                told = "not told by these impacts"
            lines.append(f"{name.replace('_', ' ')} {self.values[name]:.4g} ({told})")
        chain = self.chain
        noise = f"jitter {1e3 * chain['jitter']:.3g} ms, missed {chain['missed']:.1%}, "
        noise += f"spurious {chain['spurious']:.1%}"
        if self.strengths is not None:
            noise += f", noise of the strengths {chain['strength_noise']:.1%}"
        lines.append(noise)
        lines.append(
            f"distance {self.distance:.2f} of what simulated trains have among themselves "
            f"(p {self.p_value:.2g}); {self.evaluations} trains simulated"
        )
        return "\n".join((*lines, *self.warnings))

    def plot(self, figure: Figure | None = None) -> Any:
        """Draw it; see `impactsig.plot.oscillator_fit`."""
        from .. import plot

        return plot.oscillator_fit(self, figure)

    def __str__(self) -> str:
        return self.describe()


def fit_oscillator(
    impacts: Impacts,
    forcing_frequency: float,
    free: Sequence[str] = ("restitution", "damping", "amplitude"),
    *,
    natural_frequency: float | None = None,
    scene: Oscillator | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    strengths: Strengths | None = "auto",
    seed: Seed = 0,
) -> OscillatorFit:
    """Find the impact oscillator that a measured, irregular train of impacts comes from.

    ``x'' + 2 damping x' + x = amplitude cos(omega t)``, x < 1, ``x' -> -restitution x'`` at the
    stop; x in units of the gap, t in 1 / omega_n. No likelihood is needed: trains are simulated,
    measured as the real one was (jitter, missed and spurious impacts, noise of the strengths, all
    estimated with the rest), and compared by moments of the sequence of intervals, of the phases
    and of the strengths relative to their mean. Differential evolution [StornPrice1997]_ leads near
    the optimum; there the moments are regressed on the parameters, and the fit is that of indirect
    inference [Gourieroux1993]_, whose intervals come from the scatter of simulated trains.

    Intervals alone tell the restitution coefficient and the amplitude, but hardly the damping:
    from 2000 impacts of chaotic motion with a jitter of 1 % of the mean interval, the standard
    errors are about 0.03 to 0.05, 1 to 2 % and 15 to 20 %. With strengths to 5 % they are 0.02 to
    0.04, 0.5 to 1 % and 3 to 5 %.

    Parameters
    ----------
    impacts : Impacts
        200 or more, of a motion that is not periodic. Inferred impacts are left out.
    forcing_frequency : float
        Forcing frequency [Hz], right to 0.2 %.
    free : sequence of str
        Which parameters to find: of "restitution", "damping", "amplitude", "natural_frequency".
    natural_frequency : float, optional
        Natural frequency [Hz]; where it is free, about which. By default the scene's.
    scene : Oscillator, optional
        What is known of the machine: an oscillator with one harmonic force and one rigid stop, as
        `scenes.karpodinis`. Its parameters stand for those that are not free.
    bounds : dict of str to (float, float), optional
        Least and greatest value of a free parameter; by default 0 to 1 for the restitution
        coefficient, 0.001 to 0.5 for the damping, 0.01 to 10 for the amplitude, and 10 % about the
        natural frequency.
    strengths : {"auto", "impulse", "peak", "approach_velocity"} or None
        What tells how hard each impact was, in proportion to its approach velocity; "auto" takes
        the first of the impulse, the peak and the approach velocity that is there, None uses the
        instants only.
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same result.

    Returns
    -------
    OscillatorFit

    Raises
    ------
    InvalidInput
        If there are too few impacts, they are periodic (a few intervals that recur cannot tell
        several parameters), or an argument is out of its range.

    Notes
    -----
    The forcing must be harmonic and the stop rigid. Dead time and echoes are not in the chain.
    """
    if not isinstance(impacts, Impacts):
        raise InvalidInput("impacts", impacts, "Impacts", "Of instants make them by from_times")
    frequency = number("forcing_frequency", forcing_frequency, positive=True)
    from ._machine import PARAMETERS

    names = _free(free, tuple(PARAMETERS))
    known = _known(names, natural_frequency, scene)
    limits = _bounds(names, known, bounds)
    rng = streams(seed, 1)[0]
    used = _strengths(impacts, strengths)
    impacts = impacts[(impacts.flags & INFERRED) == 0]
    count = min(len(impacts), len(impacts.intervals()) + 1)
    if count < FEWEST:
        raise InvalidInput(
            "impacts", f"{count} impacts", f"{FEWEST} or more to fit, not cut apart by gaps",
            "2000 make the errors a third",
        )  # fmt: skip
    frequency = _refined(impacts, frequency)
    _refuse_periodic(impacts, frequency)
    return _fit(impacts, frequency, names, known, limits, used, rng)


def _fit(
    impacts: Impacts,
    frequency: float,
    names: tuple[str, ...],
    known: dict[str, float],
    limits: dict[str, tuple[float, float]],
    used: str | None,
    rng: np.random.Generator,
) -> OscillatorFit:
    from ._machine import as_train, oscillator
    from ._narrow import narrow
    from ._problem import Problem
    from ._search import begin, descend

    strength = None if used is None else getattr(impacts, used)
    train = as_train(impacts, frequency, strength)
    problem = Problem(names, known, limits, frequency, train, rng)
    tries = []
    for _ in range(TRIES):
        estimate = narrow(problem, *descend(problem, begin(problem)))
        look = np.array([problem.look(estimate.psi) for _ in range(JUDGED)])
        tries.append((*_judged(problem, look), estimate))
        if tries[-1][1] > LEAST_P:
            break
    distance, p_value, shares, estimate = min(tries, key=lambda one: one[0])
    values = problem.values(estimate.psi)
    count = len(names)
    told = _intervals(problem, estimate.psi, estimate.covariance)
    machine = oscillator(values, frequency)
    warnings = _warnings(names, told, p_value)
    if _settles(machine):
        told |= dict.fromkeys(names, (-math.inf, math.inf))
        warnings = (
            "the oscillator found moves periodically: one period cannot tell its parameters, "
            "and no interval is given",
            *warnings,
        )
    simulated = problem.simulate(estimate.psi)
    chain = {name: values[name] for name in problem.names[count:]}
    chain["jitter"] /= frequency
    spread = {name: told[name] for name in problem.names[count:]}
    spread["jitter"] = tuple(np.array(spread["jitter"]) / frequency)
    return OscillatorFit(
        {name: values[name] for name in (*known, *names)},
        {name: told[name] for name in names},
        names,
        estimate.covariance[:count, :count],
        tuple(problem.kind(name).logarithmic for name in names),
        chain,
        spread,
        frequency,
        machine,
        used,
        distance,
        p_value,
        shares,
        compare(impacts, simulated, forcing_period=1 / frequency, names=("measured", "simulated")),
        problem.evaluations,
        warnings,
    )


def _free(free: Sequence[str], known: tuple[str, ...]) -> tuple[str, ...]:
    names = (free,) if isinstance(free, str) else tuple(free)
    if not names or len(set(names)) < len(names) or not set(names) <= set(known):
        raise InvalidInput("free", free, f"some of {', '.join(known)}, each once")
    return tuple(name for name in known if name in names)


def _known(
    names: tuple[str, ...], natural_frequency: float | None, scene: Oscillator | None
) -> dict[str, float]:
    """Parameters that stay as they are; the natural frequency always."""
    from ._machine import PARAMETERS, parameters_of

    known: dict[str, float] = {}
    if scene is not None:
        if not isinstance(scene, Oscillator):
            raise InvalidInput("scene", scene, "an Oscillator, as of impactsig.scenes")
        known = parameters_of(scene)
    if natural_frequency is not None:
        known["natural_frequency"] = number("natural_frequency", natural_frequency, positive=True)
    for name in PARAMETERS:
        if name == "natural_frequency" and name not in known:
            raise InvalidInput(
                name, None, "a positive number [Hz]", "Give it, or a scene that has it"
            )
        if name not in names and name not in known:
            raise InvalidInput("free", names, f"{name} among them, or a scene that says what it is")
    return {
        name: value
        for name, value in known.items()
        if name not in names or name == "natural_frequency"
    }


def _bounds(
    names: tuple[str, ...],
    known: dict[str, float],
    bounds: Mapping[str, tuple[float, float]] | None,
) -> dict[str, tuple[float, float]]:
    from ._machine import PARAMETERS

    about = known["natural_frequency"]
    limits = {name: (PARAMETERS[name].low, PARAMETERS[name].high) for name in names}
    if "natural_frequency" in limits:
        limits["natural_frequency"] = (0.9 * about, 1.1 * about)
    for name, pair in (bounds or {}).items():
        if name not in names:
            raise InvalidInput("bounds", name, f"free parameters only: {', '.join(names)}")
        try:
            low, high = (number("bounds", one) for one in pair)
        except (TypeError, ValueError):
            low = high = math.nan
        least = 0.0 if name == "restitution" else 5e-324
        most = 1.0 if name in ("restitution", "damping") else math.inf
        if not least <= low < high <= most:
            kind = f"from {'0' if least == 0 else 'above 0'} to {most:g}"
            raise InvalidInput("bounds", f"{name}: {pair}", f"two numbers {kind}, the lesser first")
        limits[name] = (low, high)
    return limits


def _strengths(impacts: Impacts, strengths: Any) -> str | None:
    kinds = ("impulse", "peak", "approach_velocity")
    if strengths is None:
        return None
    if strengths == "auto":
        return next((kind for kind in kinds if getattr(impacts, kind) is not None), None)
    if strengths not in kinds:
        raise InvalidInput("strengths", strengths, f'"auto", None or one of {", ".join(kinds)}')
    if getattr(impacts, strengths) is None:
        raise InvalidInput("strengths", strengths, f"impacts with a measured {strengths}")
    return str(strengths)


def _refined(impacts: Impacts, frequency: float) -> float:
    """The frequency within 0.2 % at which the phases gather most, where they do."""
    from scipy.optimize import minimize_scalar

    time = impacts.time - impacts.time[0]
    step = 0.2 / time[-1]

    def gathered(trial: float) -> float:
        return float(np.abs(np.exp(2j * np.pi * trial * time).mean()) ** 2)

    reach = min(CLOCK_ERROR * frequency, 2000 * step)
    trials = np.arange(frequency - reach, frequency + reach, step)
    best = trials[np.argmax([gathered(trial) for trial in trials])]
    found = minimize_scalar(
        lambda trial: -gathered(trial), bounds=(best - step, best + step), method="bounded",
        options={"xatol": 1e-4 * step},
    )  # fmt: skip
    return float(found.x) if -found.fun * len(time) > LOCKED else frequency


def _refuse_periodic(impacts: Impacts, frequency: float) -> None:
    period = identify_period(impacts, 1 / frequency)
    if period.kind in ("periodic", "unlocked"):
        raise InvalidInput(
            "impacts",
            period.describe(),
            "impacts that do not recur",
            "Intervals that recur are too few numbers; measure where the motion is chaotic",
        )


def _intervals(
    problem: Any, psi: np.ndarray, covariance: np.ndarray
) -> dict[str, tuple[float, float]]:
    from scipy.stats import norm

    half = norm.ppf(0.5 + CONFIDENCE / 2) * np.sqrt(np.diag(covariance))
    told = {}
    for name, centre, reach in zip(problem.names, psi, half, strict=True):
        kind = problem.kind(name)
        if reach > UNTOLD.get(name, math.log(5)):
            told[name] = (-math.inf, math.inf)
            continue
        low, high = kind.value(centre - reach), kind.value(centre + reach)
        if not kind.logarithmic:  # shares
            low, high = max(low, 0.0), min(high, 1.0)
        told[name] = (low, high)
    return told


def _warnings(
    names: tuple[str, ...], told: dict[str, tuple[float, float]], p_value: float
) -> tuple[str, ...]:
    untold = [name.replace("_", " ") for name in names if not math.isfinite(told[name][0])]
    found = [f"these impacts do not tell the {name}" for name in untold]
    if p_value <= LEAST_P:
        found.append(
            "the measured train is farther from the simulated ones than they are from each other: "
            "the oscillator found does not explain it"
        )
    return tuple(found)


def _settles(machine: Oscillator) -> bool:
    """Whether the oscillator's impacts recur, without any measuring chain."""
    from ..simulate import simulate

    impacts = simulate(machine, periods=400, transient=600).impacts
    assert impacts is not None
    assert machine.forcing_period is not None
    if len(impacts) < 20:
        return True
    return identify_period(impacts, machine.forcing_period).kind == "periodic"


def _judged(problem: Any, look: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Distance of the measured moments from simulated ones, its rank, and the words' shares."""
    whole = look[np.isfinite(look).all(1)]
    centre, scatter = whole.mean(0), whole.std(0)
    varied = scatter > 1e-9
    among = np.mean(((whole - centre)[:, varied] / scatter[varied]) ** 2, axis=1)
    # A longer train scatters less, but for the error of the mean that it is compared with.
    share = problem.share + 1 / len(whole)
    own = float(np.mean((centre[varied] / scatter[varied]) ** 2)) / share
    p_value = (1 + int(np.sum(among >= own))) / (1 + len(whole))
    words = problem.moments.shares
    measured, scale = problem.measured[:words], problem.scale[:words]
    scale = np.where(np.isfinite(scale), scale, 0.0)
    shares = np.array([measured, measured + scale * centre[:words], scale * scatter[:words]])
    return own / float(np.median(among)), p_value, shares
