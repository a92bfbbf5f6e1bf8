"""Equivalence of a soft and a rigid stop, contact by contact, and the best soft stop.

The mass reaches the stop at depth 0 with velocity x'_0 at some phase of the forcing and leaves it
with x'_1 after the contact time t_1. What a rigid stop would have done differs from that by

    e_1 = x'_1 + r x'_0,    e_2 = t_1,    e = sqrt(e_1^2 + e_2^2),

and e_g is the root of the mean of e^2 over contacts [Tian]_.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..._arguments import Seed, instance, number, reals, streams, whole
from ..._showing import Shown
from ...errors import InvalidInput
from ...oscillators import KelvinVoigt

Range = tuple[float, float]


@dataclass(frozen=True)
class ContactSamples:
    """Contacts with the stop of ``x'' + 2 zeta x' + x = A sin(omega t + phi)`` at a gap.

    All arrays have shape (count,), and all numbers are dimensionless, as in `scenes.tian`.

    Attributes
    ----------
    amplitude, angular_frequency, phase : numpy.ndarray
        Amplitude A, angular frequency omega, and phase of the forcing at the touch [rad].
    velocity : numpy.ndarray
        Approach velocity.
    damping_ratio : numpy.ndarray
        Damping of the oscillator as a fraction of critical damping (zeta).
    gap : float
        Where the stop is.

    See Also
    --------
    equivalence_error, fit_soft_stop

    Examples
    --------
    >>> from impactsig import ContactSamples
    >>> contacts = ContactSamples.draw(count=100, seed=1)
    >>> contacts.velocity.shape
    (100,)
    """

    amplitude: np.ndarray
    angular_frequency: np.ndarray
    phase: np.ndarray
    velocity: np.ndarray
    damping_ratio: np.ndarray
    gap: float = 1.0

    def __post_init__(self) -> None:
        names = ("velocity", "amplitude", "angular_frequency", "phase", "damping_ratio")
        shape: Any = None
        for name in names:
            given = getattr(self, name)
            kind = {
                "angular_frequency": "positive",
                "velocity": "positive",
                "damping_ratio": ">= 0",
            }
            least = {"positive": 5e-324, ">= 0": 0.0}.get(kind.get(name, ""), -math.inf)
            required = f"finite {kind.get(name, '')} numbers, one for each contact".replace(
                "  ", " "
            )
            values = reals(name, given, required)
            shape = values.shape if shape is None else shape
            good = values.ndim == 1 and values.size and values.shape == shape
            if not (good and np.all(np.isfinite(values) & (values >= least))):
                raise InvalidInput(name, given, required)
            object.__setattr__(self, name, values)
        object.__setattr__(self, "gap", number("gap", self.gap, least=0.0))

    def __len__(self) -> int:
        return len(self.velocity)

    def __repr__(self) -> str:
        return f"ContactSamples({len(self)} contacts, gap = {self.gap:g})"

    @classmethod
    def draw(
        cls,
        count: int = 1000,
        *,
        amplitude: Range = (0.1, 2.0),
        angular_frequency: Range = (0.5, 4.0),
        velocity: Range = (0.05, 4.0),
        damping_ratio: Range = (0.01, 0.05),
        gap: float = 1.0,
        seed: Seed = None,
    ) -> ContactSamples:
        """Draw contacts uniformly from a box, the phase from a whole turn.

        Parameters
        ----------
        count : int
            How many.
        amplitude, angular_frequency, velocity, damping_ratio : (float, float)
            Range of each. The ranges are not given in the available text of the paper; these are
            our choice.
        gap : float
            Where the stop is; 1 is our choice.
        seed : int, SeedSequence or Generator, optional
            The same seed gives the same result; a Generator is advanced.

        Raises
        ------
        InvalidInput
            If a range is not two finite positive numbers in order (the amplitude and the damping
            ratio may be 0), or another argument out of range.
        """
        rng = streams(seed, 1)[0]
        count = whole("count", count, 1)

        def evenly(name: str, given: Any, positive: bool = True) -> np.ndarray:
            low, high = _range(name, given, positive)
            return rng.uniform(low, high, count)

        return cls(
            evenly("amplitude", amplitude, positive=False),
            evenly("angular_frequency", angular_frequency),
            rng.uniform(0, 2 * math.pi, count),
            evenly("velocity", velocity),
            evenly("damping_ratio", damping_ratio, positive=False),
            gap,
        )


@dataclass(frozen=True)
class EquivalenceError(Shown):
    """Difference between a soft and a rigid stop, over a set of contacts.

    Attributes
    ----------
    value : float
        e_g.
    velocity : numpy.ndarray
        e_1 of every contact, shape (contacts,).
    contact_time : numpy.ndarray
        e_2 of every contact.
    stop : KelvinVoigt
        The soft stop.
    restitution : float
        Restitution coefficient of the rigid one.

    See Also
    --------
    equivalence_error, results.SoftStopFit

    Examples
    --------
    >>> from impactsig import KelvinVoigt, equivalence_error
    >>> found = equivalence_error(KelvinVoigt(10_000, 10.3), 0.85)
    >>> round(found.value, 3), found.velocity.shape
    (0.031, (1000,))
    """

    value: float
    velocity: np.ndarray = field(repr=False)
    contact_time: np.ndarray = field(repr=False)
    stop: KelvinVoigt
    restitution: float


def equivalence_error(
    stop: KelvinVoigt, restitution: float, samples: ContactSamples | None = None
) -> EquivalenceError:
    """Difference between a soft and a rigid stop: e_g over contacts [Tian]_.

    Each contact is computed by the exact flow up to the instant at which its depth is zero again,
    without a time step.

    Parameters
    ----------
    stop : KelvinVoigt
        The soft stop, which must end its contacts at zero depth as the paper's does; its
        stiffness and damping in units of the oscillator's stiffness and of mass times natural
        frequency.
    restitution : float
        Restitution coefficient of the rigid stop, 0 to 1.
    samples : ContactSamples, optional
        The contacts; by default ``ContactSamples.draw(seed=0)``, 1000 of them.

    Raises
    ------
    InvalidInput
        If an argument is out of range or a contact lasts for a thousand periods.

    See Also
    --------
    fit_soft_stop, stop_damping

    Examples
    --------
    >>> from impactsig import ContactSamples, KelvinVoigt, equivalence_error
    >>> contacts = ContactSamples.draw(count=100, seed=1)
    >>> stiff = equivalence_error(KelvinVoigt.equivalent(0.85, 1e6), 0.85, contacts)
    >>> soft = equivalence_error(KelvinVoigt.equivalent(0.85, 1e3), 0.85, contacts)
    >>> stiff.value < soft.value
    True
    """
    instance("stop", stop, KelvinVoigt, "KelvinVoigt(...)")
    if stop.ends != "gap":
        raise InvalidInput("stop", stop, 'a stop with ends="gap"')
    restitution = number("restitution", restitution, least=0.0, most=1.0)
    samples = _samples(samples)
    velocity, lasts = _errors(stop.stiffness, stop.damping, restitution, samples)
    if not np.all(np.isfinite(lasts)):
        raise InvalidInput("stop", stop, "one that lets go of the mass within a thousand periods")
    return EquivalenceError(_rms(velocity, lasts), velocity, lasts, stop, restitution)


@dataclass(frozen=True)
class SoftStopFit(Shown):
    """The soft stop that is closest to a rigid one.

    Attributes
    ----------
    stop : KelvinVoigt
        The stop found.
    error : EquivalenceError
        How far it is from the rigid one.
    course : numpy.ndarray
        Least e_g so far, after each generation.
    evaluations : int
        Number of evaluations of e_g.
    converged : bool
        Whether all members of the last generation agreed; if not, the limit of `evaluations` was
        reached.
    at_edge : tuple of str
        Which of "stiffness" and "damping" are at a bound, so that wider bounds would give another
        stop. The stiffness always is, since the contact time decreases with increasing stiffness
        without a limit.

    See Also
    --------
    fit_soft_stop, results.EquivalenceError

    Examples
    --------
    >>> from impactsig import fit_soft_stop
    >>> found = fit_soft_stop(0.85, evaluations=200, seed=0)
    >>> found.evaluations, "stiffness" in found.at_edge
    (200, False)
    """

    stop: KelvinVoigt
    error: EquivalenceError = field(repr=False)
    course: np.ndarray = field(repr=False)
    evaluations: int
    converged: bool
    at_edge: tuple[str, ...]


def fit_soft_stop(
    restitution: float,
    *,
    stiffness: Range = (10.0, 1e4),
    damping: Range = (0.1, 1e3),
    samples: ContactSamples | None = None,
    seed: Seed = None,
    evaluations: int = 10_000,
) -> SoftStopFit:
    """Find the soft stop with the least e_g, by annealed differential evolution [Tian]_.

    The search variables are the logarithms of stiffness and damping. The method is differential
    evolution towards the best member, with self-adapting step and crossover, and Metropolis
    acceptance of worse trials at a decreasing temperature. Values outside the bounds are set to the
    bounds.

    Parameters
    ----------
    restitution : float
        Restitution coefficient of the rigid stop, 0 to 1.
    stiffness, damping : (float, float)
        Bounds, in the units of `equivalence_error`; the greatest stiffness is that of the paper,
        the others are our choice.
    samples : ContactSamples, optional
        The contacts; by default ``ContactSamples.draw(seed=0)``, 1000 of them.
    seed : int, SeedSequence or Generator, optional
        Of the search. The same seed gives the same result; a Generator is advanced.
    evaluations : int
        Greatest number of evaluations of e_g.

    Raises
    ------
    InvalidInput
        If an argument is out of range.

    See Also
    --------
    equivalence_error, match_rate, stop_damping

    Examples
    --------
    >>> from impactsig import fit_soft_stop, stop_restitution
    >>> found = fit_soft_stop(0.85, evaluations=1000)
    >>> restitution = stop_restitution(found.stop.stiffness, found.stop.damping)
    >>> round(restitution, 2)
    0.85
    """
    restitution = number("restitution", restitution, least=0.0, most=1.0)
    evaluations = whole("evaluations", evaluations, 100)
    given = [_range("stiffness", stiffness), _range("damping", damping)]
    samples = _samples(samples)
    rng = streams(seed, 1)[0]
    from ._annealed_evolution import minimise

    def objective(x: np.ndarray) -> float:
        error = _rms(*_errors(math.exp(x[0]), math.exp(x[1]), restitution, samples))
        return error if math.isfinite(error) else 1e300

    low, high = np.log(np.array(given)).T
    found = minimise(objective, low, high, rng, 1e-6, evaluations)
    ends = ((low, [pair[0] for pair in given]), (high, [pair[1] for pair in given]))
    best = np.exp(found.x)
    at_edge = []
    for n, name in enumerate(("stiffness", "damping")):
        for edge, value in ends:
            if found.x[n] == edge[n]:
                best[n] = value[n]  # to the digit that was given
                at_edge.append(name)
    stop = KelvinVoigt(*best)
    return SoftStopFit(
        stop,
        equivalence_error(stop, restitution, samples),
        found.course,
        found.evaluations,
        found.converged,
        tuple(at_edge),
    )


def _samples(given: ContactSamples | None) -> ContactSamples:
    if given is None:
        return ContactSamples.draw(seed=0)
    instance("samples", given, ContactSamples, "ContactSamples(...) or None")
    return given


def _errors(
    stiffness: float, damping: float, restitution: float, samples: ContactSamples
) -> tuple[np.ndarray, np.ndarray]:
    """e_1 and e_2 of every contact."""
    from ._contact_flight import flights

    lasts, leaves = np.empty(len(samples)), np.empty(len(samples))
    flights(
        np.full(len(samples), 1 + stiffness),
        samples.damping_ratio + damping / 2,
        samples.angular_frequency,
        samples.amplitude * np.sin(samples.phase),
        samples.amplitude * np.cos(samples.phase),
        np.full(len(samples), -samples.gap),
        samples.velocity,
        lasts,
        leaves,
    )
    return leaves + restitution * samples.velocity, lasts


def _rms(velocity: np.ndarray, lasts: np.ndarray) -> float:
    return math.sqrt(np.mean(velocity**2 + lasts**2))


def _range(name: str, given: Any, positive: bool = True) -> tuple[float, float]:
    try:
        low, high = map(float, given)
    except Exception:
        low = high = math.nan
    if not (0 <= low <= high < math.inf and (low > 0 or not positive)):
        kind = "positive" if positive else "non-negative"
        raise InvalidInput(name, given, f"two finite {kind} numbers, the lesser first")
    return low, high
