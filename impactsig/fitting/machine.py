"""Result of a fit of one oscillator to several trains, with its uncertainties."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from .._showing import Shown, drawn_on_figure_by
from ._machine import EXTRA, PARAMETERS
from ._outcome import ALONE, interval_of, not_determined
from .result import OscillatorFit, in_words
from .trains.echoes import Echoes

MISFIT = 0.01
"""Of the p-value of all trains."""
CONTRADICTED = 1e-3
"""Chance that trains of one machine disagree as much, below which they contradict each other."""
DECIDED = 100.0
"""Logarithm of the odds from which another kind is ruled out."""


class Aside(NamedTuple):
    """Places of trains that were left aside; see `MachineFit`."""

    periodic: tuple[int, ...]
    unlocked: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class MachineFit(Shown):
    """One oscillator fitted to many trains, each with its own forcing.

    If several kinds of machine were compared, this is the most likely one.

    Attributes
    ----------
    values : dict of str to float
        Parameters common to all trains, free or known; see `OscillatorFit`. For a soft stop also
        its "stiffness" relative to that of the spring, and "restitution" is that of a free contact;
        for a machine with two stops "second_gap", the ratio of the distances of the farther and the
        nearer stop.
    intervals : dict of str to (float, float)
        95 % intervals of the free ones; (-inf, inf) for all if the trains do not determine one of
        them.
    free : tuple of str
        Names of the free parameters.
    covariance : ndarray, shape (free, free)
        Covariance of the free parameters, on the scale of `logarithmic`.
    logarithmic : tuple of bool
        For each free parameter, whether the covariance is that of its logarithm.
    runs : tuple of OscillatorFit
        Fit of each train that was used: its amplitude, the properties of the instrument, and the
        comparison with trains simulated at the optimum. Common parameters have the values and
        covariance from all trains.
    periodic : tuple of int
        Indices of the trains that were excluded because they are periodic.
    unlocked : tuple of int
        Indices of the trains that were excluded because their impacts are not locked to the stated
        forcing.
    p_value : float
        P-value of all trains together, by Fisher's method from those of the runs.
    warnings : tuple of str
        Warnings about the result.
    agreement : float
        P-value of the agreement of the trains on the common parameters, from what each train alone
        determines. Below 0.001 the intervals are widened by the disagreement.
    kind : {"rigid", "soft", "two-sided", "echo"}
        The most likely kind of machine: with one rigid stop, one soft stop, rigid stops on both
        sides, or one rigid stop whose impacts have echoes.
    log_odds : dict of str to float
        Logarithm of the evidence of each kind that was compared, minus that of the most likely one;
        -inf if no orbit of that kind fits the trains.
    echoes : dict of str to float
        For the kind "echo": "delay", the time from an impact to its echo [s], and "share", the
        fraction of impacts with an echo; otherwise empty.

    See Also
    --------
    fit_oscillator, plot.machine_fit

    Examples
    --------
    >>> from impactsig import fit_oscillator, measure, scenes, simulate
    >>> beams = [scenes.karpodinis(frequency) for frequency in (20.1, 20.3355)]
    >>> trains = [simulate(beam, periods=400, transient=300).impacts for beam in beams]
    >>> trains = [measure(train, jitter=2e-4, seed=1).impacts for train in trains]
    >>> fit = fit_oscillator(trains, [1 / 20.1, 1 / 20.3355], ["amplitude"], scene=beams[0], seed=1)
    >>> fit.free, [round(run.values["amplitude"], 2) for run in fit.runs]
    ((), [0.25, 0.25])
    """

    values: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    free: tuple[str, ...]
    covariance: np.ndarray = field(repr=False)
    logarithmic: tuple[bool, ...] = field(repr=False)
    runs: tuple[OscillatorFit, ...]
    periodic: tuple[int, ...]
    unlocked: tuple[int, ...]
    p_value: float
    agreement: float
    warnings: tuple[str, ...]
    kind: str
    log_odds: Mapping[str, float]
    echoes: Mapping[str, float]

    @property
    def decided(self) -> bool:
        """Whether the kind is decided: no other's `log_odds` are above -100.

        The evidence depends on the sequences of states that were drawn, and varies by some tens
        between draws, so that smaller odds are not significant.
        """
        return sum(odds > -DECIDED for odds in self.log_odds.values()) == 1

    @property
    def misfit(self) -> bool:
        """Whether the trains are unlike those of the oscillator found: `p_value` of 0.01 or less.

        The machine is then of another kind (a second or soft stop, friction), a parameter that is
        not free is wrong, or the forcing of a train is wrong; see the `p_value` of each of the
        `runs`. Of 37 machines of the fitted kind for which the search ended near the true values,
        one had a misfit; of 28 of another kind, with 4 runs of 400 instants each, 22 had a misfit
        or an error.
        """
        return self.p_value <= MISFIT

    def describe(self) -> str:
        """The numbers in a few lines of words."""
        lines = [] if len(self.log_odds) == 1 else [self._kinds()]
        lines += [in_words(name, self.values[name], self.intervals[name]) for name in self.free]
        if "amplitude" not in self.values:
            own = [run.values["amplitude"] for run in self.runs]
            lines.append(f"amplitudes {min(own):.4g} to {max(own):.4g}")
        followed = [run.explained or 0.0 for run in self.runs]
        lines.append(
            f"{len(self.runs)} trains; orbits follow {min(followed):.1%} or more of the flights of "
            f"each (p {self.p_value:.2g})"
        )
        return "\n".join((*lines, *self.warnings))

    def _kinds(self) -> str:
        others = [f"{name} {odds:.0f}" for name, odds in self.log_odds.items() if name != self.kind]
        told = "" if self.decided else "undecided; likeliest "
        if self.misfit:
            told = "none explains the trains; likeliest "
        return f"{told}{self.kind} (log odds of the others: {', '.join(others)})"

    plot = drawn_on_figure_by("machine_fit", "it")


def machine_of_runs(
    runs: tuple[OscillatorFit, ...],
    shared: tuple[str, ...],
    covariance: np.ndarray,
    aside: Aside,
    kind: str,
    log_odds: Mapping[str, float],
    heard: Echoes | None,
    agreement: float,
) -> MachineFit:
    """The machine, from each train beside the oscillator that all share.

    Parameters
    ----------
    runs : tuple of OscillatorFit
    shared : tuple of str
        Free parameters that all have in common, which come first in the covariance.
    covariance : ndarray
    aside : Aside
        The trains that were not used.
    agreement : float
        Chance that trains of one machine disagree as much; see `MachineFit`.
    """
    from scipy.special import gammaincc

    first, count = runs[0], len(shared)
    own = set(first.free) - set(shared)
    p_value = float(gammaincc(len(runs), -sum(math.log(run.p_value) for run in runs)))
    deviations = np.sqrt(np.diag(covariance))
    intervals = {}
    for name, deviation in zip(shared, deviations, strict=False):
        own_kind = (PARAMETERS | EXTRA)[name]
        intervals[name] = interval_of(name, own_kind, own_kind.scale(first.values[name]), deviation)
    undetermined = tuple(name for name in shared if not math.isfinite(intervals[name][0]))
    warnings = [] if "soft" in log_odds else [ALONE]
    rivals = [name for name, odds in log_odds.items() if name != kind and odds > -DECIDED]
    if rivals:
        named = " or ".join(rivals)
        warnings.insert(0, f"the kind of machine is not told: {named} explains the trains as well")
    if undetermined:
        intervals = dict.fromkeys(shared, (-math.inf, math.inf))
        warnings.insert(0, not_determined(undetermined))
    if aside.periodic:
        warnings.append(f"{len(aside.periodic)} periodic trains left aside: they tell too little")
    if aside.unlocked:
        named = ", ".join(map(str, aside.unlocked))
        warnings.append(
            f"trains left aside (counted from 0): {named}. Their impacts come at all phases of the "
            "forcing alike; check that their forcing_period is right to 0.2 %"
        )
    if agreement < CONTRADICTED:
        warnings.append(
            "the trains contradict each other: what each tells of the machine lies farther from "
            "what the others tell than its errors allow (agreement "
            f"{agreement:.1g}). The intervals are widened by that much, but one machine may not "
            "have made them all, or the search has gone astray: compare fits of some of the trains "
            "or with another `seed`"
        )
    if p_value <= MISFIT:
        warnings.append(
            "misfit: the trains are farther from simulated ones than these are from each other, "
            "and one oscillator does not explain them all. The machine is of another kind (name "
            "those to compare as `kinds`), a "
            "parameter that is not free is wrong, or one of the runs is not like the others (see "
            "their p-values); the intervals hold for that kind only"
        )
    return MachineFit(
        {name: value for name, value in first.values.items() if name not in own},
        intervals,
        shared,
        covariance[:count, :count],
        tuple(first.logarithmic[first.free.index(name)] for name in shared),
        runs,
        aside.periodic,
        aside.unlocked,
        p_value,
        agreement,
        tuple(warnings),
        kind,
        {name: float(odds) for name, odds in log_odds.items()},
        {} if heard is None else {"delay": heard.delay, "share": heard.share},
    )
