"""The correlation dimension of a series: its value with an interval, or why it has none."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .._arguments import whole
from ..errors import InvalidInput, finite_number
from ..impacts import Impacts
from ._arguments import dimensions_of, finite_range, positive
from ._series import series, unbroken
from ._theiler import theiler_window
from ._values import exact_period
from .correlation import CorrelationSum

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

Verdict = Literal["dimension", "no plateau", "periodic", "constant"]

LEAST_VECTORS = 50

FINE = 0.02
"""Share of the standard deviation below which a resolution lets recurrences be told from chance."""


@dataclass(frozen=True, eq=False)
class DimensionEstimate:
    """What was read from the correlation sum of one embedding dimension.

    Attributes
    ----------
    embedding : int
        Embedding dimension m.
    value : float or None
        The estimate; None where no radius could be used.
    interval : tuple of float or None
        Its 95 % confidence interval.
    region : tuple of float or None
        Least and greatest radius of the scaling region, in the unit of the series.
    takens, slope, nearest : float or None
        By Takens' estimator averaged over the scaling region, by the slope of ln C against ln r in
        it, and by the distances to the nearest neighbours: that one is D1, not D2.
    extrapolated : float or None
        Where the local slopes in the region tend as r goes to 0; see `correlation_dimension`.
    resamples : ndarray, shape (resamples,)
        `value` of the resamples, already centred and scaled to its standard error.
    slopes, slope_errors : ndarray, shape (radii,)
        Local slopes at the radii of the correlation sum and their standard errors; nan where there
        are too few pairs.
    """

    embedding: int
    value: float | None
    interval: tuple[float, float] | None
    region: tuple[float, float] | None
    takens: float | None
    slope: float | None
    nearest: float | None
    extrapolated: float | None
    resamples: np.ndarray
    slopes: np.ndarray
    slope_errors: np.ndarray


@dataclass(frozen=True, eq=False)
class CorrelationDimension:
    """What `correlation_dimension` found, and on what evidence.

    Attributes
    ----------
    verdict : str
        "dimension"; "no plateau" (the estimates of the highest two embedding dimensions do not
        agree, as those of noise do not, or there are none); "periodic"; "constant".
    value : float or None
        The correlation dimension D2, 0 for a periodic or constant series; None without a plateau.
    interval : tuple of float or None
        Its 95 % confidence interval.
    region : tuple of float or None
        The scaling region of the highest embedding dimension it was read from.
    plateau : tuple of int
        Embedding dimensions that agree; the value is the mean of the highest two.
    by_dimension : tuple of DimensionEstimate
        What was read from each embedding dimension.
    estimator : str
        How the value was obtained.
    estimates : dict
        The same dimension by each estimator, mean of the same two embedding dimensions.
    extrapolated : float or None
        The limit of the local slopes for r to 0, if their slow rise goes on; not a measurement.
    period : int or None
        Steps after which a periodic series recurs.
    noise : float
        Standard deviation of the noise found on the series, in its unit; 0 where none shows for
        certain. Of a periodic series, of the scatter about its cycle.
    resolution : float
        Step in which the series was rounded, or as given.
    floor : float
        Radii below it were not used.
    correlation : CorrelationSum or None
        The correlation sums; None where the series is periodic or constant.
    warnings : tuple of str
        What to know before the value is used.
    """

    verdict: Verdict
    value: float | None
    interval: tuple[float, float] | None
    region: tuple[float, float] | None = None
    plateau: tuple[int, ...] = ()
    by_dimension: tuple[DimensionEstimate, ...] = ()
    estimator: str = "none"
    estimates: dict[str, float | None] | None = None
    extrapolated: float | None = None
    period: int | None = None
    noise: float = 0.0
    resolution: float = 0.0
    floor: float = 0.0
    correlation: CorrelationSum | None = None
    warnings: tuple[str, ...] = ()

    @property
    def spread(self) -> float | None:
        """Difference between the greatest and the least of the estimators' values."""
        known = [value for value in (self.estimates or {}).values() if value is not None]
        return max(known) - min(known) if len(known) > 1 else None

    def describe(self) -> str:
        """The answer in words."""
        if self.verdict == "constant":
            return "dimension 0: the series is constant"
        if self.verdict == "periodic":
            steps = (
                "every value recurs" if self.period == 1 else f"recurs every {self.period} steps"
            )
            within = f"noise of {self.noise:.2g}" if self.noise else "its resolution"
            return f"dimension 0: the series is periodic ({steps}, to within {within})"
        if self.verdict == "no plateau":
            read = [one for one in self.by_dimension if one.value is not None]
            listed = ", ".join(f"{one.value:.2f} (m = {one.embedding})" for one in read)
            words = f"no plateau: {listed or 'no radius holds enough pairs'}"
        else:
            assert self.value is not None
            assert self.interval is not None
            assert self.region is not None
            words = (
                f"correlation dimension {self.value:.2f}, 95 % interval {self.interval[0]:.2f} to "
                f"{self.interval[1]:.2f} (radii {self.region[0]:.3g} to {self.region[1]:.3g}, "
                f"embedding dimensions {self.plateau[0]} to {self.plateau[-1]}; {self.estimator})"
            )
            if self.extrapolated is not None:
                words += f"; extrapolated to radius 0, not measured: {self.extrapolated:.2f}"
        return "; ".join((words, *self.warnings))

    def plot(self, figure: Figure | SubFigure | None = None) -> Any:
        """Draw it; see `impactsig.plot.dimension`."""
        from .. import plot

        return plot.dimension(self, figure)

    def __str__(self) -> str:
        return self.describe()


def correlation_dimension(
    x: Any,
    dimensions: int | Iterable[int] = range(1, 6),
    *,
    delay: int = 1,
    theiler: int | None = None,
    region: tuple[float, float] | None = None,
    resolution: float | None = None,
    seed: int = 0,
    workers: int | None = None,
) -> CorrelationDimension:
    r"""The correlation dimension D2 of the attractor behind a series, with its uncertainty.

    C(r), the share of pairs of delay vectors within r of each other, grows as r^D2
    [GrassbergerProcaccia1983]_. For every embedding dimension m:

    - Radii below the floor are not used: twice the resolution, and 2.33 standard deviations of the
      noise, at which noise takes away a tenth of the pairs for every coordinate. The noise is found
      by how C_{m+1}/C_m falls towards small radii [Schreiber1993]_; where an attractor that still
      unfolds would explain that as well, the radii are left out but no noise is reported.
    - The estimate begins at a small radius (C = 0.17 / sqrt(n); an octave above the floor), with
      the maximum-likelihood estimate of Takens [Takens1985]_ and that of the distances to the
      nearest 8 neighbours [Badii1985]_, by inverse variance. Takens' estimates at larger radii, up
      to C = 0.1, are averaged with it as far as their difference from it is no more than chance
      (and 3 %); of those that fall, the less, the more likely it is that the power law bends, as
      the trend of all estimates in all embedding dimensions tells by Schwarz's criterion
      [Schwarz1978]_. The scaling region ends where they agree no longer. So long series are read at
      small radii, and short ones at the largest that the data does not contradict.
    - The interval comes from 200 resamples of blocks of time (a block jackknife, drawn from), in
      each of which all is estimated anew, with Student's t for the number of blocks. Of 150 to 200
      series each of 300 and 1000 values it held the mean of the estimator in 94 to 99 % for
      Rössler's and Lorenz's intervals (88 % of Lorenz's at 300 with 5 % noise, 95 to 96 % of the
      others with it) and for the maps of Hénon and Lozi and the tinkerbell map; in 91 % for the
      impacting beam; in 87 % (300) and 91 % (1000) for Ikeda's map. Of 200 values it holds 88
      to 92 %, of 100 74 to 86 %, which is warned of. It tells of chance, not of what all scales
      that can be seen have in common (Ikeda's map reads 0.2 high at 300 values): see `spread` and
      `extrapolated`.

    A series that recurs, to within its resolution or but for noise (`noise`), has the verdict
    "periodic": values that are apart and come in strict order, about which what is left foretells
    nothing. Of a single value that is said only of impacts, whose intervals then scatter by no more
    than 1 %. Missed and spurious impacts break the order: `identify_period` allows for them.

    The verdict is "dimension" where the estimates of the two highest m differ by no more than 0.4
    (each further coordinate of noise would add one); their mean is the value.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        The series; of impacts, their interspike intervals.
    dimensions : int or iterable of int, optional
        Embedding dimensions m, ascending, two at least; m alone stands for 1 to m.
    delay : int, optional
        Delay [steps]; of intervals the natural one is 1.
    theiler : int, optional
        Pairs no further apart in time than this [steps] are left out. Unless given, two mean
        periods (between rises through the mean), or until the autocorrelation is not positive.
    region : (float, float), optional
        Radii to use in place of the rule, in the unit of the series.
    resolution : float, optional
        Step of the numbers, in the unit of the series. Unless given, found if values repeat.
    seed : int, optional
        Of the resamples.
    workers : int, optional
        Threads of the counting; the result does not depend on it.

    Returns
    -------
    CorrelationDimension
        `extrapolated` is the intercept of the local slopes against 1 / ln(R / r), R being the range
        of the series: where they would go if their slow rise went on. It is no measurement, and
        None where it lies below the interval, as nothing rises there.

    Raises
    ------
    InvalidInput
        If x holds what is no finite number or has fewer than 50 vectors beyond the Theiler window;
        if an argument is not of its kind.
    """
    values = finite_range(series(x))
    wanted = _several(dimensions)
    delay = whole("delay", delay, 1)
    seed = whole("seed", seed, 0)
    workers = workers if workers is None else whole("workers", workers, 1)
    step = None if resolution is None else positive("resolution", resolution)
    chosen = None if region is None else _region(region)
    window = None if theiler is None else whole("theiler", theiler, 0)
    # Here, because it brings the compiler, which wrong arguments should not wait for.
    from . import _dimension, _periodic, _scaling

    greatest = float(np.abs(values).max())
    deviation = float((values / (greatest or 1.0)).std()) * greatest
    rounding = 8 * np.finfo(float).eps * greatest
    if step is None:
        step = _scaling.quantum(values)
    if np.ptp(values / (greatest or 1.0)) * greatest <= max(rounding, step if resolution else 0.0):
        return CorrelationDimension("constant", 0.0, (0.0, 0.0), resolution=step)
    marked = series(x, gap=delay)
    window = theiler_window(window, marked)
    vectors = np.count_nonzero(unbroken(marked, (wanted[-1] - 1) * delay + 1))
    if vectors - window < LEAST_VECTORS:
        raise InvalidInput(
            "x",
            f"{len(values)} values",
            f"at least {LEAST_VECTORS + window + (wanted[-1] - 1) * delay} for dimension "
            f"{wanted[-1]}, delay {delay} and a Theiler window of {window}",
            "Give more values, or ask for lower dimensions",
        )
    # Where the step is coarse, everything recurs to within it.
    tolerance = 2 * step if step < FINE * deviation else 0.0
    period = exact_period(values, tolerance + rounding)
    if period:
        return CorrelationDimension("periodic", 0.0, (0.0, 0.0), period=period, resolution=step)
    cycle = _periodic.noisy_cycle(values, step, isinstance(x, Impacts))
    if cycle:
        return CorrelationDimension(
            "periodic", 0.0, (0.0, 0.0), period=cycle.steps, noise=cycle.scatter, resolution=step
        )
    return _dimension.estimate(
        marked, wanted, delay, window, max(step, rounding), chosen, seed, workers
    )


def _several(given: int | Iterable[int]) -> tuple[int, ...]:
    dimensions = dimensions_of(given)
    if len(dimensions) < 2:
        raise InvalidInput(
            "dimensions",
            given,
            "two embedding dimensions or more",
            "Whether there is a plateau shows only as the dimension grows",
        )
    return dimensions


def _region(given: Any) -> tuple[float, float]:
    required = "two positive radii, the lesser first"
    try:
        low, high = given
    except (TypeError, ValueError):
        raise InvalidInput("region", given, required) from None
    low, high = finite_number("region", low, required), finite_number("region", high, required)
    if not 0 < low < high:
        raise InvalidInput("region", given, required)
    return low, high
