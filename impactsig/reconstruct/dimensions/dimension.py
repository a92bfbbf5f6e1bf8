"""`correlation_dimension`: slope of the correlation sum between two scales, and the dimension."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..._arguments import limits, number, thread_count, whole
from ..._showing import Shown, drawn_on_figure_by
from ...errors import InvalidInput
from ...impacts import Impacts
from .._arguments import finite_range
from .._fits import Fit, FitName, fit_of
from .._series import series, stretches, unbroken
from .._stated import BY_IMPACTS, stated_errors
from .._theiler import theiler_window
from .._values import quantum
from ..recognition.kinds import Kind

if TYPE_CHECKING:
    from .._stated import Stated
    from ._estimate import Setting
    from ._noise import Noise

Verdict = Literal[
    "dimension", "slope", "no scales", "noise", "quasi-periodic", "periodic", "constant"
]

LEAST_VECTORS = 50

RESOLUTION_FLOOR = 2.0
"""Least scale in steps of the values."""

FARTHEST = 1e100
"""Ranges of the series beyond which no length is told from others: its square is a number still."""


@dataclass(frozen=True)
class ScaleSlope:
    """Slope of ln K against ln H between two scales.

    Attributes
    ----------
    value : float
        D(H1, H2).
    interval : tuple of float
        Its 95 % confidence interval, for the noise-free slope between the same scales.
    scales : tuple of float
        H1 and H2, in the unit of the series.
    embedding : int
        Embedding dimension m.
    errors : dict of str to float
        Standard errors by what they come from.
    """

    value: float
    interval: tuple[float, float]
    scales: tuple[float, float]
    embedding: int
    errors: dict[str, float]

    @property
    def span(self) -> float:
        """Distance W of the two scales in e-folds."""
        return float(np.log(self.scales[1] / self.scales[0]))


@dataclass(frozen=True)
class KaplanYorke:
    """The dimension D1 by the formula of Kaplan and Yorke, 1 + l1 / |l2|.

    Attributes
    ----------
    value : float
    interval : tuple of float
        Its 95 % confidence interval, by that of the exponent.
    exponent : float
        l1, the largest exponent, per impact.
    contraction : float
        -(l1 + l2), as given.
    """

    value: float
    interval: tuple[float, float]
    exponent: float
    contraction: float


@dataclass(frozen=True, eq=False)
class CorrelationDimension(Shown):
    """Estimate of the correlation dimension, with its evidence.

    Attributes
    ----------
    verdict : str
        "dimension"; "slope" (the slope is not the dimension of the attractor, see `reason`); "no
        scales" (no slope could be estimated); "noise", "quasi-periodic", "periodic" and "constant"
        are recognised before the sum is computed.
    dimension : float or None
        Correlation dimension D2 of the attractor; 0 for a periodic or constant series, the number
        of independent frequencies for a quasi-periodic one; None if it cannot be determined.
    interval : tuple of float or None
        Its 95 % confidence interval.
    slope : ScaleSlope or None
        The slope between the two scales.
    dimension_slope : ScaleSlope or None
        The slope that estimates the dimension, with its interval and standard errors, over the
        range of scales where the total error is least.
    reason : str
        Why there is no dimension.
    needed : str
        What would allow an estimate, such as a longer run.
    kaplan_yorke : KaplanYorke or None
        D1, if a contraction was given and the exponent could be estimated.
    period : int or None
        Period of a periodic series, in steps.
    noise : float
        Standard deviation of the noise on a value, in the unit of the series; for a periodic or
        quasi-periodic series, of the scatter about it.
    timing_error : float
        Standard deviation of the timing error that causes this noise; 0 if it has another cause.
    noise_source : str
        Source of the estimate of the noise.
    resolution : float
        Rounding step of the values; 0 if they are not rounded.
    floor : float
        Smallest usable scale, given noise and resolution.
    scales, sums, slopes, slope_errors : ndarray, shape (k,)
        H and K(H) in the embedding of the slope; local slopes over an octave about each scale, nan
        at both ends; half-widths of their 95 % intervals.
    delay, theiler : int
        Values used.
    missed, spurious : float
        Fractions of missed and spurious impacts that were taken into account.
    warnings : tuple of str
        Warnings about the result.

    See Also
    --------
    correlation_dimension, results.CorrelationSum, plot.dimension

    Examples
    --------
    >>> from impactsig import correlation_dimension
    >>> x = [0.4]
    >>> for _ in range(999):
    ...     x.append(1 - 1.4 * x[-1] ** 2 + 0.3 * (x[-2] if len(x) > 1 else 0))
    >>> found = correlation_dimension(x)
    >>> low, high = found.interval
    >>> low < 1.21 < high  # D2 of the Hénon map
    True
    """

    verdict: Verdict
    dimension: float | None
    interval: tuple[float, float] | None
    slope: ScaleSlope | None = None
    dimension_slope: ScaleSlope | None = None
    reason: str = ""
    needed: str = ""
    kaplan_yorke: KaplanYorke | None = None
    period: int | None = None
    noise: float = 0.0
    timing_error: float = 0.0
    noise_source: str = ""
    resolution: float = 0.0
    floor: float = 0.0
    scales: np.ndarray = field(default_factory=lambda: np.empty(0))
    sums: np.ndarray = field(default_factory=lambda: np.empty(0))
    slopes: np.ndarray = field(default_factory=lambda: np.empty(0))
    slope_errors: np.ndarray = field(default_factory=lambda: np.empty(0))
    delay: int = 1
    theiler: int = 0
    missed: float = 0.0
    spurious: float = 0.0
    warnings: tuple[str, ...] = ()

    def describe(self) -> str:
        """The answer in words, with what the intervals cover."""
        words = [self._recognised() or self._counted()]
        if self.kaplan_yorke is not None:
            one = self.kaplan_yorke
            words.append(
                f"D1 by Kaplan and Yorke {one.value:.3f}, 95 % interval {one.interval[0]:.3f} to "
                f"{one.interval[1]:.3f} (exponent {one.exponent:.3g}, contraction "
                f"{one.contraction:.3g} per impact)"
            )
        return "; ".join((*words, *self.warnings))

    def _recognised(self) -> str:
        if self.verdict == "constant":
            return "dimension 0: the series is constant"
        if self.verdict == "periodic":
            steps = (
                "every value recurs" if self.period == 1 else f"recurs every {self.period} steps"
            )
            within = f"noise of {self.noise:.2g}" if self.noise else "its resolution"
            return f"dimension 0: the series is periodic ({steps}, to within {within})"
        if self.verdict == "quasi-periodic":
            if self.dimension is None:
                return f"no dimension: {self.reason}"
            tones = f"{self.dimension:.0f} independent frequenc" + (
                "y" if self.dimension == 1 else "ies"
            )
            return f"dimension {self.dimension:.0f}: the series is quasi-periodic ({tones})"
        if self.verdict == "noise":
            return f"no dimension: {self.reason}"
        return ""

    def _counted(self) -> str:
        noise = f"noise {self.noise_source}"
        if self.noise:
            noise = f"noise of {self.noise:.2g} {self.noise_source}"
        if self.slope is None:
            return f"no slope: {self.reason} ({noise})"
        one = self.slope
        words = (
            f"slope {one.value:.2f}, 95 % interval {one.interval[0]:.2f} to {one.interval[1]:.2f}, "
            f"between scales {one.scales[0]:.3g} and {one.scales[1]:.3g} (embedding dimension "
            f"{one.embedding}; {noise}; floor {self.floor:.3g}; the interval covers "
            f"{_listed(one)})"
        )
        if self.dimension is None or self.interval is None or self.dimension_slope is None:
            needed = f" (needed: {self.needed})" if self.needed else ""
            return f"{words}; no dimension of the attractor: {self.reason}{needed}"
        taken = self.dimension_slope
        return (
            f"correlation dimension {self.dimension:.2f}, 95 % interval {self.interval[0]:.2f} to "
            f"{self.interval[1]:.2f} (read between scales {taken.scales[0]:.3g} and "
            f"{taken.scales[1]:.3g}; the interval covers {_listed(taken)}); {words}"
        )

    plot = drawn_on_figure_by("dimension", "it")


def _listed(one: ScaleSlope) -> str:
    """What an interval covers, in words."""
    words = [name for name, error in one.errors.items() if error or name == "chance"]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def correlation_dimension(
    x: Any,
    dimension: int | None = None,
    *,
    delay: int = 1,
    theiler: int | None = None,
    scales: tuple[float, float] | None = None,
    timing_error: float | None = None,
    value_error: float | None = None,
    missed: float = 0.0,
    spurious: float | None = None,
    resolution: float | None = None,
    contraction: float | None = None,
    fit: FitName | Fit = "least squares",
    workers: int | None = None,
) -> CorrelationDimension:
    r"""Slope of the correlation sum between two scales, and the dimension if it has one.

    The sum is that of a Gaussian kernel of width H over the differences d of all pairs of delay
    vectors, corrected for noise of covariance S [GrassbergerProcaccia1983]_, [Diks1996]_,

    .. math:: K(H) = \sqrt{\det H^2 I / \det(H^2 I - S)} \;
        \big\langle \exp(-\tfrac14 d^T (H^2 I - S)^{-1} d) \big\rangle ,

    whose mean is exactly that without noise. It grows as H^D2. The slope of ln K against ln H is
    fitted by least squares from H1 to H2. H1 is the greatest of 1.5 standard deviations of the
    noise, twice the resolution, and the scale whose kernel sums to 60 pairs (or to 0.25 pairs per
    vector, if this leaves W = 1.6 e-folds). At H2, K = 0.03 (0.01 if the slope is above 1.5 and
    this leaves W = 1.6), or less if the slope rises there and unrelated vectors explain the rise:
    with m coordinates, K_1(H)^m of the pairs are near by chance. If this leaves less than 1.6
    e-folds and the slope D is below 1.4, K = 0.08^D at H2. `fit` selects another fit.

    The slope is the primary result. Its interval is for the noise-free slope between the same two
    scales. It includes the statistical error (from the scatter over 32 blocks of time) and, if
    applicable, the uncertainty of an estimated noise and of missed and spurious impacts. If the
    scales span at least W = 1.6 e-folds, the dimension D2 of the attractor is the slope over the
    range of at least 1.6 e-folds where its total error is least (`dimension_slope` of the result),
    unless a further coordinate adds more than 0.15. Its interval also includes the choice of
    scales, since a slope over W e-folds deviates from the limit by 0.13 / W, as a standard error;
    the contribution of a further coordinate; the possible contribution of unrelated vectors (u,
    with an uncertainty of u / sqrt 3); and, if slopes corrected for these still rise by g from the
    upper half of the scales to the lower one, a further rise (g / 2 / sqrt 3).

    Constant, periodic (also with noise, or according to `identify_period`) and quasi-periodic
    series and linear noise are recognised before the sum is computed.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        The series; of impacts, their interspike intervals.
    dimension : int, optional
        Embedding dimension m. By default the smallest integer above twice the slope
        [SauerYorke1991]_, and at least 3.
    delay : int, optional
        Delay [steps]; of intervals the natural one is 1.
    theiler : int, optional
        Pairs that are not further apart in time than this [steps] are excluded. By default two mean
        periods (between rises through the mean), or the first lag at which the autocorrelation is
        not positive.
    scales : (float, float), optional
        H1 and H2, in the unit of the series, instead of the rule above. H1 is increased to the
        noise floor and to the scale of 60 pairs if necessary.
    timing_error : float, optional
        Standard deviation of the errors of the instants, if the values are intervals between
        instants. By default (unless `value_error` is given), that of impacts is the root mean
        square of their `time_error` (without `shared_time_error`, which cancels in short
        intervals), weighted by their part in close pairs, without those more than five times that
        of the others; if there are no errors, it is estimated from the data.
    value_error : float, optional
        Standard deviation of independent noise on each value.
    missed, spurious : float, optional
        Fractions of missed and spurious impacts. The slope is corrected by the effect of adding as
        many again, and the interval widened by it; above 12 % together no dimension is given. By
        default, `spurious` is the mean of 1 - `probability` of the impacts.
    resolution : float, optional
        Rounding step of the values, in the unit of the series. By default it is determined from
        repeated values.
    contraction : float, optional
        Mean contraction of areas from impact to impact, in e-folds; adds D1 by Kaplan and Yorke.
        For an oscillator with one stop it is 2 ln(1 / r) plus twice the damping rate times the mean
        interval.
    fit : {"least squares", "theil-sen"} or callable
        Fit of the slope: least squares over all scales, the median of the slopes between any two,
        or a function fit(x, y) of ln H and ln K that returns the slope.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    CorrelationDimension

    Raises
    ------
    InvalidInput
        If a value is not finite, there are fewer than 50 vectors beyond the Theiler window, or an
        argument is invalid.

    See Also
    --------
    correlation_sum, lyapunov_exponent, surrogate_test, plot.dimension

    Examples
    --------
    >>> import math
    >>> import numpy as np
    >>> from impactsig import correlation_dimension
    >>> found = correlation_dimension(np.sin(np.arange(500) * math.sqrt(2)))
    >>> found.verdict, found.dimension
    ('quasi-periodic', 1.0)
    """
    values = finite_range(series(x))
    m = None if dimension is None else whole("dimension", dimension, 1)
    delay = whole("delay", delay, 1)
    thread_count(workers)
    rule = fit_of(fit)
    step = None if resolution is None else number("resolution", resolution, above=0)
    chosen = None if scales is None else _scales(scales)
    errors = stated_errors(x, timing_error, value_error)
    missed = number("missed", missed, least=0, most=0.5)
    if spurious is None:
        spurious = _doubtful(x)
    spurious = number("spurious", spurious, least=0, most=0.5)
    if (missed or spurious) and values.min() <= 0:
        raise InvalidInput(
            "missed", missed, "0 for values that are no intervals", "Intervals are positive"
        )
    if contraction is not None:
        contraction = number("contraction", contraction, above=0)
    window = None if theiler is None else whole("theiler", theiler, 0)
    marked = series(x, gap=delay)
    window = theiler_window(window, marked)
    least = (m or 3) * delay
    if np.count_nonzero(unbroken(marked, least - delay + 1)) - window < LEAST_VECTORS:
        raise InvalidInput(
            "x",
            f"{len(values)} values",
            f"at least {LEAST_VECTORS + window + least - delay} for dimension {m or 3}, delay "
            f"{delay} and a Theiler window of {window}",
            "Give more values, or ask for a lower dimension",
        )
    # Here, because they bring the compiler, which wrong arguments should not wait for.
    from ..recognition.recognition import recognise
    from . import _estimate as _dimension

    stated, step = step or 0.0, quantum(values) if step is None else step
    impacts = x if isinstance(x, Impacts) else None
    longest = max(stretches(series(x, gap=1)), key=len)
    kind = recognise(impacts, values, longest, step, stated, window)
    if kind.name != "motion":
        return of_kind(kind, step)
    # In the range of the series, so that no square overflows.
    unit = float(np.ptp(values / np.abs(values).max()) * np.abs(values).max())
    if chosen is not None:
        chosen = _in_ranges(chosen[0], unit), _in_ranges(chosen[1], unit)
    setting = _dimension.Setting(
        marked / unit,
        delay,
        window,
        _in_ranges(RESOLUTION_FLOOR * step, unit),
        chosen,
        missed,
        spurious,
        unit,
        step,
        workers,
        rule,
    )
    if errors is not None and errors.source == BY_IMPACTS:
        from ._among_pairs import error_among_pairs

        errors = errors._replace(timing=error_among_pairs(x, delay, errors.timing))
    noise = _noise(errors, impacts is not None, step, setting)
    found = _dimension.estimate(setting, noise, m)
    if contraction is None:
        return found
    added, doubt = _kaplan_yorke(x, window, contraction, unit * noise.timing, unit * noise.value)
    warnings = (*found.warnings, doubt) if doubt else found.warnings
    return replace(found, kaplan_yorke=added, warnings=warnings)


def of_kind(kind: Kind, resolution: float = 0.0) -> CorrelationDimension:
    """The result for a series that is recognised before any pairs are counted."""
    assert kind.name != "motion"
    dimension: float | None = 0.0
    reason = ""
    if kind.name == "quasi-periodic":
        dimension = float(kind.tones) or None
        reason = "" if dimension else "the series is quasi-periodic, of more than 2 frequencies"
    elif kind.name == "noise":
        dimension, reason = None, "nothing tells the series from linear noise"
    return CorrelationDimension(
        kind.name,
        dimension,
        None if dimension is None else (dimension, dimension),
        reason=reason,
        period=kind.period,
        noise=kind.scatter,
        resolution=resolution,
    )


def _in_ranges(length: float, unit: float) -> float:
    """A length in ranges of the series; 0 where it is far below what float64 tells apart."""
    found = min(length / unit, FARTHEST)
    return found if found > 1 / FARTHEST else 0.0


def _noise(errors: Stated | None, of_impacts: bool, step: float, given: Setting) -> Noise:
    """The noise in units of the range of the series: known or estimated."""
    from ._noise import Noise, estimated

    rounding = step / math.sqrt(12)
    if errors is not None:
        stated = errors.source == "as given"
        level = math.hypot(errors.value, rounding if stated else 0.0)
        return Noise(
            _in_ranges(errors.timing, given.unit), _in_ranges(level, given.unit), errors.source
        )
    found = estimated(
        given.values, given.delay, given.theiler, given.floor, of_impacts, given.workers
    )
    if rounding and not found.of_value:
        return found._replace(value=rounding / given.unit, source="by rounding alone")
    return found._replace(value=math.hypot(found.value, rounding / given.unit))


def _kaplan_yorke(
    x: Any, theiler: int, contraction: float, timing: float, value: float
) -> tuple[KaplanYorke | None, str]:
    """D1 from the largest exponent, with what to know of it, or the reason for none."""
    from ..divergence.exponents import lyapunov_exponent
    from ..recognition.lingering import LONG, lingering

    try:
        found = lyapunov_exponent(
            x, dimension=2, theiler=theiler, timing_error=timing, value_error=value
        )
    except InvalidInput as error:
        return None, f"no D1: {error}"
    if found.exponent is None or found.interval is None or found.verdict != "divergence":
        return None, "no D1: the series has no exponent"

    def of(exponent: float) -> float:
        return 1 + max(exponent, 0.0) / (contraction + max(exponent, 0.0))

    low, high = found.interval
    stays, doubt = lingering(series(x)), ""
    if stays > LONG:
        doubt = (
            f"for {stays:.0%} of the time the motion is near a cycle (intermittency): intervals of "
            "D1 then hold it in 80 to 90 % of the series, not in 95 %"
        )
    return KaplanYorke(of(found.exponent), (of(low), of(high)), found.exponent, contraction), doubt


def _doubtful(x: Any) -> float:
    """Expected share of spurious impacts, from their probabilities."""
    if not isinstance(x, Impacts) or x.probability is None or not len(x.probability):
        return 0.0
    return float(1 - x.probability.mean())


def _scales(given: Any) -> tuple[float, float]:
    return limits("scales", given, "two positive scales, the lesser first", above=0.0)
