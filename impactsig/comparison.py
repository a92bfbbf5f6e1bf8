"""Comparison of two trains of impacts, such as a measured and a simulated one."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ._arguments import instance, texts
from ._showing import Shown, drawn_on_figure_by
from .errors import InvalidInput
from .impacts import Impacts
from .intervals import (
    Periodicity,
    coefficient_of_variation,
    cv2,
    identify_period,
    local_variation,
)

EXACT_BELOW = 10_000
"""Product of the sample sizes up to which the p-value is exact; beyond it is the limit law's."""


@dataclass(frozen=True, eq=False)
class Train:
    """Statistics of one train.

    Attributes
    ----------
    name : str
        What it is called.
    impacts : Impacts
        The train.
    count : int
        Its impacts.
    rate : float or None
        Impacts per second of the run less its gaps; None where that has no length.
    cv, cv2, lv : float or None
        Coefficient of variation of the intervals, CV2 and local variation; None where there are
        too few.
    period : Periodicity or None
        What `identify_period` says; None where no forcing period was given.
    """

    name: str
    impacts: Impacts
    count: int
    rate: float | None
    cv: float | None
    cv2: float | None
    lv: float | None
    period: Periodicity | None

    def describe(self) -> str:
        """Describe the result in one line of words."""
        words = f"{self.name}: {_impacts(self.count)} in {self.impacts.duration:.6g} s"
        if self.rate is not None:
            words += f", {self.rate:.5g} per second"
        known = (("CV", self.cv), ("CV2", self.cv2), ("LV", self.lv))
        words += "".join(f"; {name} {value:.3g}" for name, value in known if value is not None)
        if self.cv is None:
            words += "; too few intervals to say how they vary"
        return words + (f"; {self.period.describe()}" if self.period is not None else "")


@dataclass(frozen=True)
class Distance:
    """Distance between the distributions of one quantity in two trains.

    Attributes
    ----------
    count : (int, int)
        Sizes of the samples.
    mean, deviation : (float, float)
        Mean and standard deviation of each, in the unit of the quantity.
    statistic : float
        Kolmogorov-Smirnov: the greatest difference of the cumulative distributions, 0 to 1.
    p_value : float
        Probability of such a difference or a greater one between two samples of the same
        distribution, were their values independent. Those of one machine are not: take it as a
        scale, not as a verdict.
    wasserstein : float
        Mean distance that values must be moved to make one sample of the other, in the unit of
        the quantity.
    """

    count: tuple[int, int]
    mean: tuple[float, float]
    deviation: tuple[float, float]
    statistic: float
    p_value: float
    wasserstein: float


@dataclass(frozen=True, eq=False)
class Comparison(Shown):
    """Statistics of two trains, and the distances between their distributions.

    Attributes
    ----------
    a, b : Train
        Statistics of each train.
    interval : Distance or None
        Distance of the interspike intervals [s]; None if a train has none.
    contact_time, peak, impulse, approach_velocity : Distance or None
        Distance of these quantities; None if one of the trains lacks them, or the units differ.
    notes : tuple of str
        What was not compared, and why.

    See Also
    --------
    compare, plot.comparison

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, compare
    >>> steady = Impacts.from_times(0.05 * np.arange(100))
    >>> late = Impacts.from_times(0.051 * np.arange(100))
    >>> found = compare(steady, late)
    >>> round(found.interval.statistic, 6)
    1.0
    """

    a: Train
    b: Train
    interval: Distance | None
    contact_time: Distance | None
    peak: Distance | None
    impulse: Distance | None
    approach_velocity: Distance | None
    notes: tuple[str, ...]

    def describe(self) -> str:
        """The numbers in a few lines of words."""
        force = self.a.impacts.unit
        rows = (
            ("intervals", self.interval, "s"),
            ("contact time", self.contact_time, "s"),
            ("peak", self.peak, force),
            ("impulse", self.impulse, f"{force} s" if force else ""),
            ("approach velocity", self.approach_velocity, ""),
        )
        return "\n".join(
            (
                self.a.describe(),
                self.b.describe(),
                *(
                    _distance_in_words(name, found, unit)
                    for name, found, unit in rows
                    if found is not None
                ),
                *self.notes,
            )
        )

    plot = drawn_on_figure_by("comparison", "it")


def compare(
    a: Impacts,
    b: Impacts,
    *,
    forcing_period: float | None = None,
    names: tuple[str, str] = ("a", "b"),
) -> Comparison:
    """Compare the distributions of intervals, contact times and strengths of two trains.

    The distributions of the intervals are compared by the Kolmogorov-Smirnov statistic, which
    responds to any difference in shape, however small in time, and by the Wasserstein distance,
    which gives the size of the difference in seconds. For two periodic trains whose intervals
    differ by a microsecond, the first is 1 and the second a microsecond. Contact times and
    strengths are compared in the same way.

    Parameters
    ----------
    a, b : Impacts
        Measured or simulated.
    forcing_period : float, optional
        Period of the forcing [s] of both trains. If given, the period of each train is identified.
    names : (str, str), optional
        Names of the two trains.

    Returns
    -------
    Comparison
        Measures of trains with too few impacts are None; `notes` says why.

    Raises
    ------
    InvalidInput
        If a train is not Impacts, or `forcing_period` is not positive.

    See Also
    --------
    match_impacts, plot.comparison

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, compare
    >>> steady = Impacts.from_times(0.05 * np.arange(100))
    >>> late = Impacts.from_times(0.051 * np.arange(100))
    >>> round(compare(steady, late).interval.wasserstein, 6)
    0.001
    """
    for name, train in (("a", a), ("b", b)):
        instance(name, train, Impacts, "Impacts", "Impacts.from_times makes them from instants")
    called = texts("names", names, 2, "a train")
    first, second = (
        _train(name, train, forcing_period) for name, train in zip(called, (a, b), strict=True)
    )
    notes: list[str] = []
    found = {
        "interval": _distance(a.intervals(), b.intervals()),
        **{
            name: _distance(getattr(a, name), getattr(b, name))
            for name in ("contact_time", "approach_velocity")
        },
        **dict.fromkeys(("peak", "impulse")),
    }
    if found["interval"] is None:
        notes.append("intervals not compared: a train has fewer than two impacts")
    if a.unit == b.unit:
        for name in ("peak", "impulse"):
            found[name] = _distance(getattr(a, name), getattr(b, name))
    elif a.peak is not None and b.peak is not None:
        units = " and ".join(unit or "no unit" for unit in (a.unit, b.unit))
        notes.append(f"strengths not compared: their units differ, {units}")
    return Comparison(first, second, **found, notes=tuple(notes))


def _train(name: str, impacts: Impacts, forcing_period: float | None) -> Train:
    valid = impacts.duration - float(np.sum(impacts.gaps[:, 1] - impacts.gaps[:, 0]))
    period = None if forcing_period is None else identify_period(impacts, forcing_period)
    return Train(
        name,
        impacts,
        len(impacts),
        np.count_nonzero(~impacts.in_gap()) / valid if valid > 0 else None,
        _if_enough(coefficient_of_variation, impacts),
        _if_enough(cv2, impacts),
        _if_enough(local_variation, impacts),
        period,
    )


def _if_enough(measure: Callable[[Impacts], float], impacts: Impacts) -> float | None:
    """A measure of the intervals, or None if there are too few or all are zero."""
    try:
        return measure(impacts)
    except InvalidInput:
        return None


def _distance(x: np.ndarray | None, y: np.ndarray | None) -> Distance | None:
    if x is None or y is None or not len(x) or not len(y):
        return None
    from scipy.stats import ks_2samp, wasserstein_distance

    method = "exact" if len(x) * len(y) <= EXACT_BELOW else "asymp"
    with warnings.catch_warnings():  # where the exact one fails, the other is as good
        warnings.simplefilter("ignore", RuntimeWarning)
        test = ks_2samp(x, y, method=method)
    return Distance(
        (len(x), len(y)),
        (float(x.mean()), float(y.mean())),
        (float(x.std()), float(y.std())),
        float(test.statistic),
        float(test.pvalue),
        float(wasserstein_distance(x, y)),
    )


def _distance_in_words(name: str, found: Distance, unit: str) -> str:
    shown = [_quantity(value, unit) for value in (*found.mean, found.wasserstein)]
    return (
        f"{name}: mean {shown[0]} and {shown[1]}; Kolmogorov-Smirnov {found.statistic:.3g} "
        f"(p {found.p_value:.2g}), Wasserstein {shown[2]}"
    )


def _quantity(value: float, unit: str) -> str:
    if unit == "s" and 0 < abs(value) < 1:
        factor, unit = (1e3, "ms") if abs(value) >= 1e-4 else (1e6, "µs")
        value *= factor
    return f"{value:.5g} {unit}".rstrip()


def _impacts(count: int) -> str:
    return f"{count} impact" if count == 1 else f"{count} impacts"
