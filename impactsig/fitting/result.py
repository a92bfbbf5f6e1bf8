"""Result of a fit, with its uncertainty and evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .._arguments import Seed, streams, whole
from .._showing import Shown, drawn_on_figure_by
from ..comparison import Comparison, compare
from ..errors import InvalidInput
from ..impacts import Impacts
from ..oscillators import Oscillator
from .prediction import Posterior, Prediction, predicted

LEAST_TRAINS = 40
"""Of a prediction: with fewer no p-value is below 1/41, nor does a band hold 95 % of them."""
MISFIT = 0.1
"""Of the p-value. A soft stop is hidden in part by the parameters of the rigid one that is fitted,
so that its p-value is often 2/41 or 3/41; a lower level would leave these fits unmarked."""
DECIDED = 20.0
"""Logarithm of the odds from which an orbit tells a soft stop from a rigid one. As parameters move,
single flights are left out or taken in again, each for 8."""


@dataclass(frozen=True, eq=False)
class OscillatorFit(Shown):
    """The fitted oscillator, with confidence intervals and a test of the fit.

    Attributes
    ----------
    values : dict of str to float
        Every parameter: "restitution", "damping" (as a fraction of critical damping), "amplitude"
        (of the forcing: the deflection in gaps that it would have as a constant force),
        "natural_frequency" [Hz].
    intervals : dict of str to (float, float)
        95 % intervals of the free ones. (-inf, inf) of all where the impacts do not tell one: the
        others make up for what is taken for it.
    free : tuple of str
        Which were free.
    covariance : ndarray, shape (free, free)
        On the scale of `logarithmic`.
    logarithmic : tuple of bool
        Of which free parameters the covariance is that of the logarithm.
    chain : dict of str to float
        What the measuring chain did: "jitter", standard deviation of the instants [s]; "missed"
        and "spurious", shares of the impacts; where strengths were used, "strength_noise", their
        standard deviation as a share of each, and "strength_floor", the strength, by the mean of
        all, below which it shrinks no further: that of s is the share of ``hypot(s, floor)``.
    chain_intervals : dict of str to (float, float)
        95 % intervals of these but of the floor.
    forcing_period : float
        As given, refined within 0.2 % on the impacts' phases [s].
    oscillator : Oscillator
        What to simulate: dimensionless, in units of the gap.
    strengths : str or None
        What was used as strength of the impacts.
    explained : float or None
        Share of the flights from impact to impact that one orbit of the oscillator follows within
        the noise; of the others an end was missed or is false. None where strengths were not used.
    distance : float
        Mean squared distance of the measured moments from the mean of 41 trains, the measured one
        and 40 simulated at parameters drawn from what the fit leaves open, by the median of what
        the simulated ones have: about 1 where the oscillator explains the train. Each moment is in
        units of its scatter among these trains.
    p_value : float
        Share of these trains that are as far from their mean as the measured one, or farther; 1/41
        at least. A simulated train with too few impacts to compare, or ten times as many as were
        measured, counts as nearer.
    word_shares : ndarray, shape (3, words)
        How often each word of intervals comes: measured; mean and standard deviation of the
        simulated trains.
    measured, simulated : Impacts
        The train that was fitted, and one simulated at the optimum and measured alike.
    evaluations : int
        Trains simulated.
    warnings : tuple of str
        What to know before the numbers are used.
    kind : {"rigid", "soft", "two-sided", "echo"}
        The kind of machine that was fitted.
    log_odds : dict of str to float
        Where strengths were used, logarithm of the likelihood of the nearest orbit of an oscillator
        with a "rigid" and with a "soft" stop, less that of the likelier one, whichever was fitted;
        -inf where none was found. Else empty.

    See Also
    --------
    fit_oscillator, plot.oscillator_fit

    Examples
    --------
    >>> from impactsig import fit_oscillator, measure, scenes, simulate
    >>> beam = scenes.karpodinis(20.1)
    >>> motion = simulate(beam, periods=400, transient=300)
    >>> train = measure(motion.impacts, jitter=2e-4, seed=1).impacts
    >>> fit = fit_oscillator(train, 1 / 20.1, ["amplitude"], scene=beam)
    >>> fit.free, fit.values["restitution"]
    (('amplitude',), 0.2)
    """

    values: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    free: tuple[str, ...]
    covariance: np.ndarray = field(repr=False)
    logarithmic: tuple[bool, ...] = field(repr=False)
    chain: Mapping[str, float]
    chain_intervals: Mapping[str, tuple[float, float]] = field(repr=False)
    forcing_period: float
    oscillator: Oscillator = field(repr=False)
    strengths: str | None
    explained: float | None
    distance: float
    p_value: float
    word_shares: np.ndarray = field(repr=False)
    measured: Impacts = field(repr=False)
    simulated: Impacts = field(repr=False)
    evaluations: int
    warnings: tuple[str, ...]
    kind: str
    log_odds: Mapping[str, float]
    _posterior: Posterior | None = field(default=None, repr=False)

    @cached_property
    def comparison(self) -> Comparison:
        """Comparison of the measured and the simulated train."""
        return compare(
            self.measured,
            self.simulated,
            forcing_period=self.forcing_period,
            names=("measured", "simulated"),
        )

    def predict(self, trains: int = 200, *, seed: Seed = None) -> Prediction:
        """Compare the measured train with trains drawn from the posterior of the fit.

        Each is simulated at parameters of its own, normally distributed about the optimum with
        their covariance, and measured by a chain whose jitter, missed and spurious impacts and
        noise of the strengths are drawn with them.

        Parameters
        ----------
        trains : int
            How many, 40 or more.
        seed : int, SeedSequence or Generator, optional
            The same seed gives the same result; a Generator is advanced.

        Returns
        -------
        Prediction
            Bands of the intervals and of the return map, and what the oscillator does not explain.

        Raises
        ------
        InvalidInput
            If the impacts do not tell the parameters, so that there is nothing to draw from, or
            hardly any train has enough impacts to compare.
        """
        count = whole("trains", trains, LEAST_TRAINS)
        if self._posterior is None or not np.isfinite(list(self.intervals.values())).all():
            raise InvalidInput(
                "fit", "one that does not tell its parameters", "one with finite intervals",
                "Strengths, more impacts, or fewer free parameters tell them",
            )  # fmt: skip
        return predicted(self._posterior, self.measured, count, streams(seed, 1)[0])

    @property
    def misfit(self) -> bool:
        """Whether the train contradicts the fitted oscillator: `p_value` of 0.1 or less.

        Then a second stop, friction or wrong parameters among those that are not free are likelier
        than chance, and the intervals need not hold the truth. One train in ten of an oscillator
        that is right has so small a p-value. It is one too where the other kind of stop is likelier
        by 20 or more in `log_odds`.
        """
        return self.p_value <= MISFIT or self.log_odds.get(self.kind, 0.0) <= -DECIDED

    def describe(self) -> str:
        """The numbers in a few lines of words."""
        lines = [in_words(name, self.values[name], self.intervals[name]) for name in self.free]
        lines = [*stop_in_words(self.kind, self.log_odds), *lines]
        chain = self.chain
        noise = f"jitter {1e3 * chain['jitter']:.3g} ms, missed {chain['missed']:.1%}, "
        noise += f"spurious {chain['spurious']:.1%}"
        if self.strengths is not None:
            noise += f", noise of the strengths {chain['strength_noise']:.1%}"
            if chain["strength_floor"] > 0:
                noise += f" of each, but of {chain['strength_floor']:.0%} of their mean at least"
        lines.append(noise)
        if self.explained is not None:
            lines.append(f"one orbit follows {self.explained:.1%} of the flights")
        lines.append(
            f"distance {self.distance:.2f} of what simulated trains have among themselves "
            f"(p {self.p_value:.2g}); {self.evaluations} trains simulated"
        )
        return "\n".join((*lines, *self.warnings))

    plot = drawn_on_figure_by("oscillator_fit", "it")

    def __str__(self) -> str:
        return self.describe()


def stop_in_words(kind: str, log_odds: Mapping[str, float]) -> list[str]:
    """The kind of stop that was fitted, beside the other; nothing where they were not compared."""
    own = log_odds.get(kind, 0.0)
    return [
        f"{kind} stop (log odds of a {name} one {odds - own:.0f})"
        for name, odds in log_odds.items()
        if name != kind
    ]


def in_words(name: str, value: float, interval: tuple[float, float]) -> str:
    """A parameter with its interval."""
    low, high = interval
    known = f"95 % interval {low:.4g} to {high:.4g}"
    if not math.isfinite(low):
        known = "not determined by these impacts"
    return f"{name.replace('_', ' ')} {value:.4g} ({known})"
