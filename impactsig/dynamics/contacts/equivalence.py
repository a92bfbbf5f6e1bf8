"""Equivalence of a soft and a rigid stop, contact by contact.

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
            low, high = finite_range(name, given, positive)
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

    Returns
    -------
    EquivalenceError
        e_g (`value`), with the errors of the velocity, e_1, and of the contact time, e_2, of each
        contact.

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
    samples = samples_or_drawn(samples)
    velocity, lasts = contact_errors(stop.stiffness, stop.damping, restitution, samples)
    if not np.all(np.isfinite(lasts)):
        raise InvalidInput("stop", stop, "one that lets go of the mass within a thousand periods")
    return EquivalenceError(rms_error(velocity, lasts), velocity, lasts, stop, restitution)


def samples_or_drawn(given: ContactSamples | None) -> ContactSamples:
    """The contacts given, or those of seed 0."""
    if given is None:
        return ContactSamples.draw(seed=0)
    instance("samples", given, ContactSamples, "ContactSamples(...) or None")
    return given


def contact_errors(
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


def rms_error(velocity: np.ndarray, lasts: np.ndarray) -> float:
    """The error e_g, from e_1 and e_2 of every contact."""
    return math.sqrt(np.mean(velocity**2 + lasts**2))


def finite_range(name: str, given: Any, positive: bool = True) -> tuple[float, float]:
    """Two finite numbers that are not negative, or positive, the lesser first."""
    try:
        low, high = map(float, given)
    except Exception:
        low = high = math.nan
    if not (0 <= low <= high < math.inf and (low > 0 or not positive)):
        kind = "positive" if positive else "non-negative"
        raise InvalidInput(name, given, f"two finite {kind} numbers, the lesser first")
    return low, high
