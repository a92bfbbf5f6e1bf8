"""The soft stop that comes closest to a rigid one, by the errors of their contacts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..._arguments import Seed, number, streams, whole
from ..._showing import Shown
from ...oscillators import KelvinVoigt
from .equivalence import (
    ContactSamples,
    EquivalenceError,
    Range,
    contact_errors,
    equivalence_error,
    finite_range,
    rms_error,
    samples_or_drawn,
)


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

    Returns
    -------
    SoftStopFit
        The `stop`, its `error`, and whether the search `converged` or ended at a bound (`at_edge`).

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
    >>> found = fit_soft_stop(0.85, seed=0, evaluations=1000)
    >>> restitution = stop_restitution(found.stop.stiffness, found.stop.damping)
    >>> round(restitution, 2)
    0.85
    """
    restitution = number("restitution", restitution, least=0.0, most=1.0)
    evaluations = whole("evaluations", evaluations, 100)
    given = [finite_range("stiffness", stiffness), finite_range("damping", damping)]
    samples = samples_or_drawn(samples)
    rng = streams(seed, 1)[0]
    from ._annealed_evolution import minimise

    def objective(x: np.ndarray) -> float:
        error = rms_error(*contact_errors(math.exp(x[0]), math.exp(x[1]), restitution, samples))
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
