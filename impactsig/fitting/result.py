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
        All parameters: "restitution", "damping" (ratio to critical damping), "amplitude" (of the
        forcing: the deflection under a constant force of that size, in units of the gap),
        "natural_frequency" [Hz].
    intervals : dict of str to (float, float)
        95 % intervals of the free ones. (-inf, inf) for all if the impacts do not determine one of
        them, since errors of one are compensated by the others.
    free : tuple of str
        Names of the free parameters.
    covariance : ndarray, shape (free, free)
        Covariance of the free parameters, on the scale of `logarithmic`.
    logarithmic : tuple of bool
        For each free parameter, whether the covariance is that of its logarithm.
    chain : dict of str to float
        Properties of the instrument: "jitter", standard deviation of the instants [s]; "missed" and
        "spurious", fractions of the impacts; with strengths also "strength_noise", their relative
        standard deviation, and "strength_floor", the strength, relative to the mean, below which
        the noise does not decrease further: the noise of a strength s is proportional to
        ``hypot(s, floor)``.
    chain_intervals : dict of str to (float, float)
        95 % intervals of these, except for the floor.
    forcing_period : float
        The given period, refined within 0.2 % from the phases of the impacts [s].
    oscillator : Oscillator
        The fitted oscillator, dimensionless, in units of the gap.
    strengths : str or None
        The quantity that was used as strength of the impacts.
    explained : float or None
        Fraction of the flights from impact to impact that one orbit of the oscillator fits within
        the noise; at an end of the others, an impact was missed or is false. None without
        strengths.
    distance : float
        Mean squared distance of the measured moments from the mean of 41 trains, the measured one
        and 40 that are simulated at parameters drawn from the covariance of the fit, relative to
        the median of the simulated ones: about 1 if the oscillator explains the train. Each moment
        is in units of its scatter among these trains.
    p_value : float
        Fraction of these trains that are at least as far from their mean as the measured one; at
        least 1/41. A simulated train with too few impacts to compare, or ten times as many as
        measured, counts as nearer.
    word_shares : ndarray, shape (3, words)
        Frequency of each word of intervals: measured; mean and standard deviation of the simulated
        trains.
    measured, simulated : Impacts
        The train that was fitted, and one that was simulated at the optimum and measured in the
        same way.
    evaluations : int
        Number of simulated trains.
    warnings : tuple of str
        Warnings about the result.
    kind : {"rigid", "soft", "two-sided", "echo"}
        The kind of machine that was fitted.
    log_odds : dict of str to float
        With strengths, logarithm of the likelihood of the best orbit of an oscillator with a
        "rigid" and with a "soft" stop, minus that of the more likely one, whichever was fitted;
        -inf if none was found. Otherwise empty.

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

        Each train is simulated with parameters from a normal distribution about the optimum with
        their covariance, and measured by an instrument whose jitter, missed and spurious impacts
        and noise of the strengths are drawn together with them.

        Parameters
        ----------
        trains : int
            Number of trains, at least 40.
        seed : int, SeedSequence or Generator, optional
            The same seed gives the same result; a Generator is advanced.

        Returns
        -------
        Prediction
            Bands of the intervals and of the return map, and what the oscillator does not explain.

        Raises
        ------
        InvalidInput
            If the impacts do not determine the parameters, or hardly any simulated train has enough
            impacts to compare.
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

        A second stop, friction or wrong values of fixed parameters are then more likely than
        chance, and the intervals may not contain the true values. One in ten trains of a correct
        oscillator has so small a p-value. It is also a misfit if the other kind of stop is more
        likely by 20 or more in `log_odds`.
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
