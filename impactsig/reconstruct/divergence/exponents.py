"""`lyapunov_exponent`: largest Lyapunov exponent, from the divergence of neighbours."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..._arguments import choice, number, pair, whole
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ...impacts import Impacts
from .._arguments import long_enough, varying
from .._series import known, series
from .._stated import stated_errors
from .._theiler import theiler_window
from .._values import exact_period, resolution, rounding_doubt, typical_gap

if TYPE_CHECKING:
    from ._region import Curve

LEAST = 100
"""Fewest references."""

LEAST_STEPS = 8
"""Steps that neighbours are followed for at the least, unless told."""

Verdict = Literal["divergence", "no divergence", "periodic", "no scaling region"]


@dataclass(frozen=True, eq=False)
class LyapunovExponent(Shown):
    """The largest Lyapunov exponent, with the divergence curve that it was fitted to.

    Attributes
    ----------
    exponent : float or None
        Largest exponent per value of the series (per interval for intervals); 0 for a periodic
        series, None without a scaling region.
    interval : tuple of float, or None
        Its 95 % interval, from the scatter over blocks of references and the deviation of the
        stretch curve from a line. It does not include the choice of the embedding.
    verdict : str
        "divergence"; "no divergence" (neighbours stay close for all steps: a periodic or
        quasi-periodic motion, or too few steps); "periodic" (the values recur exactly); "no scaling
        region" (neighbours separate at once, or not exponentially: noise, too short a series, or
        too low a dimension).
    step : float or None
        Time between values [s], if known; for impacts, the mean interval.
    stretch : ndarray, shape (K + 1,)
        S(k), k = 0 ... K: median of the logarithm of the gap after k values; -inf where the gap is
        0. If errors are known, the logarithm of the kernel width corrected for them; -inf where it
        is below the noise.
    mean_stretch : ndarray, shape (K + 1,)
        The mean instead of the median, as published, over the pairs whose gap is not 0.
    close : ndarray, shape (K + 1,)
        Fraction of the pairs that are still closer than exp(-1.5) times the median gap of any two
        values.
    region : tuple of int, or None
        First and last k of the fitted line.
    intercept : float
        S(0) of the fitted line; nan if there is none.
    far : float
        Logarithm of the median gap of any two values, at which S(k) levels off; nan for a periodic
        series.
    level : float or None
        The lower S(k) at which gaps level off if neighbours keep the phase of the motion.
    references : int
        Number of vectors whose neighbours were followed.
    method : {"rosenstein", "kantz"}
        Method.
    dimension, delay, theiler : int
        Values used.
    period : int or None
        Number of values after which the series recurs exactly.
    warnings : tuple of str
        Warnings about the result.

    See Also
    --------
    lyapunov_exponent, results.LyapunovSpectrum, plot.stretch_curve

    Examples
    --------
    >>> from impactsig import lyapunov_exponent
    >>> x = [0.4]
    >>> for _ in range(999):
    ...     x.append(4 * x[-1] * (1 - x[-1]))
    >>> found = lyapunov_exponent(x, dimension=2)
    >>> found.verdict
    'divergence'
    """

    exponent: float | None
    interval: tuple[float, float] | None
    verdict: Verdict
    step: float | None
    stretch: np.ndarray = field(default_factory=lambda: np.empty(0))
    mean_stretch: np.ndarray = field(default_factory=lambda: np.empty(0))
    close: np.ndarray = field(default_factory=lambda: np.empty(0))
    region: tuple[int, int] | None = None
    intercept: float = math.nan
    far: float = math.nan
    level: float | None = None
    references: int = 0
    method: Literal["rosenstein", "kantz"] = "rosenstein"
    dimension: int = 1
    delay: int = 1
    theiler: int = 0
    period: int | None = None
    noise: float | None = None
    warnings: tuple[str, ...] = ()

    @property
    def per_second(self) -> float | None:
        """The exponent per second [1/s]; None if it or the time between values is unknown.

        For intervals, the exponent per interval divided by the mean interval. This is the exponent
        of the motion, as the exponent of a return map divided by the mean return time is that of
        its flow.
        """
        if self.exponent is None or self.step is None:
            return None
        return self.exponent / self.step

    @property
    def interval_per_second(self) -> tuple[float, float] | None:
        """The 95 % interval of the exponent per second [1/s]."""
        if self.interval is None or self.step is None:
            return None
        return self.interval[0] / self.step, self.interval[1] / self.step

    def describe(self) -> str:
        """Describe the result in words."""
        if self.verdict == "periodic":
            words = f"periodic: the values recur after {self.period}, exponent 0"
        elif self.exponent is None:
            words = "no exponent: the stretch curve has no scaling region"
        else:
            words = f"largest Lyapunov exponent {self.exponent:.4g} per value"
            if self.interval is not None:
                words += f" (95 %: {self.interval[0]:.4g} to {self.interval[1]:.4g})"
            if self.per_second is not None:
                words += f", {self.per_second:.4g} per second"
            if self.verdict == "no divergence":
                words = f"neighbours stay together: {words}"
        return "; ".join((words, *self.warnings))

    plot = drawn_by("stretch_curve", "the stretch curve and the region")


def lyapunov_exponent(
    x: Any,
    *,
    dimension: int,
    delay: int = 1,
    theiler: int | None = None,
    method: Literal["rosenstein", "kantz"] = "rosenstein",
    step: float | None = None,
    steps: int | None = None,
    region: tuple[int, int] | None = None,
    radius: float | None = None,
    timing_error: float | None = None,
    value_error: float | None = None,
) -> LyapunovExponent:
    """Largest Lyapunov exponent, from the divergence of nearest neighbours.

    Neighbours in the embedding (Euclidean norm, exact) are followed, and the gap of their newest
    coordinate, y_i = x_{i+(m-1) delay}, is averaged over the references i:

        rosenstein:  S(k) = median_i ln abs(y_{i+k} - y_{j+k}),  j the nearest neighbour of i
        kantz:       S(k) = median_i ln mean_j abs(y_{i+k} - y_{j+k}),  all j within `radius` of i

    [Rosenstein1993]_, [Kantz1994]_. The exponent is the slope of S. The median is used instead of
    the mean of the papers, because pairs that have already reached the size of the attractor reduce
    the mean, and with it the slope, but not the median as long as they are less than half of all
    pairs. The newest coordinate represents the whole vector, because the others stay close for
    (m-1) delay steps even in noise.

    Errors of the values limit the smallest gaps and lead to too low an exponent. If they are known,
    S(k) = ln H_k, with H_k the width at which a Gaussian kernel over the gaps d_k, corrected for
    noise of variance s^2 on a value, has the mean 0.45:

        H_k / sqrt(H_k^2 - s^2) mean_i exp(-d_k^2 / (4 (H_k^2 - s^2))) = 0.45 .

    The mean of the left side is that without noise, as in `correlation_dimension`.

    The scaling region is chosen among all ranges of at least 4 points that end after 3 (m-1) delay
    steps, over which the gap grows by a factor e, in which 60 % of the pairs are closer than
    exp(-1.5) times the median gap of any two values (if errors are known, H_k is below exp(-1.2)
    times the width of any two values), and whose halves differ in slope by less than 35 %. It is
    the one with the smallest relative standard error of the slope, of sampling and curvature
    together. The interval is this error times Student's t. Its upper end is extended if a slightly
    steeper slope would leave no such range, because the gap would reach its limit before step 3
    (m-1) delay: only series in which the gap happens to grow slowly have a region then. The
    sampling error is the scatter over 30 blocks of successive references, the limit of a block
    bootstrap with many draws. It is multiplied by sqrt(1 + q), with q the fraction of pairs that
    are counted in both directions (all with the method of Kantz). For 100 series of 2000 values
    each, the interval contained the exponent of the Hénon map, of the logistic map (ln 2) and of x
    of the Lorenz flow in all cases (with the method of Kantz in 99 for Lorenz). With known noise of
    2 % it contained that of the Hénon map in 97 % of 60 series of 500 values and in all series of
    2000, and was 0.6 times as wide as with unknown noise. If a motion stays near a cycle
    (intermittency) for much of the series, the interval is too narrow.

    If neighbours keep the phase of the motion, as on the Rössler attractor or within the bands of a
    map, their gaps level off at an L below that of any two values, by exp(-0.5) or more. A line is
    then fitted to S - ln(1 - exp(S - L)), which is linear if d' = d (1 - d / exp(L)), and ends at L
    - 0.75. Separation along the flow does not grow, so that the gap may lack a growth of ln(2) / 2;
    the upper end of the interval is extended by it.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s], and `step` is
        their mean. Neighbours are not followed across a gap of the run.
    dimension : int
        m, coordinates of a vector.
    delay : int
        Between two coordinates; for intervals the natural delay is 1.
    theiler : int, optional
        Vectors i and j with abs(i - j) <= theiler are not neighbours; by default two mean periods,
        as in `correlation_sum`.
    method : {"rosenstein", "kantz"}
        See above. The method of Kantz averages gaps before taking the logarithm, which smooths
        noise but gives more weight to fast growth: it is biased upwards with increasing radius. For
        short series its scatter is larger, since most references have only one or two neighbours,
        and half of them none.
    step : float, optional
        Time between values [s], for the exponent per second.
    steps : int, optional
        K, number of steps for which neighbours are followed; by default until half of them are far
        apart, at most 512.
    region : tuple of int, optional
        First and last k of the line, instead of the rule above.
    radius : float, optional
        Radius for the method of Kantz, in the unit of `x`; by default half of the references have a
        neighbour.
    timing_error : float, optional
        Standard deviation of the errors of the instants, if the values are intervals between
        instants, as for `correlation_dimension`. By default (unless `value_error` is given), that
        of impacts is the root mean square of their `time_error`, without those more than five times
        that of the others. Only with the method of Rosenstein.
    value_error : float, optional
        Standard deviation of independent noise on each value. Only with the method of Rosenstein.

    Returns
    -------
    LyapunovExponent

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, is constant or too short, or has so few distinct
        values that all neighbours are equal.

    See Also
    --------
    lyapunov_spectrum, correlation_dimension, plot.stretch_curve

    Examples
    --------
    >>> from impactsig import lyapunov_exponent
    >>> x = [0.4]
    >>> for _ in range(1999):
    ...     x.append(4 * x[-1] * (1 - x[-1]))
    >>> found = lyapunov_exponent(x, dimension=2)
    >>> round(found.exponent, 1)  # of the logistic map, ln 2
    0.7
    """
    dimension, delay = whole("dimension", dimension, 1), whole("delay", delay, 1)
    choice("method", method, ("rosenstein", "kantz"))
    if radius is not None:
        required = 'a positive distance, with method "kantz" only'
        if method != "kantz":
            raise InvalidInput("radius", radius, required)
        radius = number("radius", radius, required, above=0)
    noise = stated_errors(x, timing_error, value_error)
    if method != "rosenstein":
        if timing_error is not None or value_error is not None:
            name = "value_error" if timing_error is None else "timing_error"
            given = value_error if timing_error is None else timing_error
            raise InvalidInput(name, given, 'None with method "kantz"', 'Use "rosenstein"')
        noise = None
    values = varying(series(x, gap=1))
    window = theiler_window(theiler, values)
    if step is None and isinstance(x, Impacts):
        step = float(known(values).mean())
    elif step is not None:
        step = number("step", step, "a positive time [s]", above=0)
    least_steps = LEAST_STEPS if steps is None else whole("steps", steps, 4)
    if region is not None:
        region = _given_region(region)
        least_steps = max(least_steps, region[1])
    long_enough(values, (dimension - 1) * delay + least_steps, window, LEAST)
    warnings = _doubts(values)
    period = exact_period(values)
    if period is not None:
        return LyapunovExponent(
            0.0, None, "periodic", step, method=method, dimension=dimension, delay=delay,
            theiler=window, period=period, warnings=tuple(warnings),
        )  # fmt: skip

    # Here, because it brings the compiler, which wrong arguments should not wait for.
    from ._following import Setting, follow_on
    from ._region import best_line, fit, interval, standard_error
    from ._stretch import LOWEST

    far = math.log(typical_gap(values))
    setting = Setting(
        values, dimension, delay, window, method, radius, far, noise and noise.of_value
    )
    followed = follow_on(setting, least_steps, steps is None)
    curve, close = followed.freed or followed.curve, followed.close
    end = followed.end
    told = curve.stretch > LOWEST
    verdict: Verdict = "divergence"
    if region is not None:
        line = fit(curve, *region) if told[region[0] : region[1] + 1].all() else None
    else:
        # By then the vectors have long turned to where they grow, and share no coordinate.
        turned = 3 * (dimension - 1) * delay
        begin = 0 if noise is None else noise.steps
        if not told[: end + 1].all():
            begin = max(begin, int(np.flatnonzero(~told[: end + 1])[-1]) + 1)
        low = math.log(2 * resolution(values) or 1e-300)
        line = best_line(followed.released or curve, begin, turned, end, low, followed.limit)
    if line is None and end == len(close) - 1:
        plain = followed.curve
        if (plain.stretch > LOWEST).all() and np.ptp(plain.stretch[1:]) < 1:
            verdict = "no divergence"
            curve, told = plain, plain.stretch > LOWEST
            line = fit(curve, len(close) // 8, len(close) - 1)
    if followed.level is not None:
        level = f"{math.exp(followed.level):.3g}"
        warnings.append(f"neighbours keep the phase of the motion: their gaps level off at {level}")
    if line is None:
        verdict = "no scaling region"
    elif verdict == "divergence" and line.slope < 2 * standard_error(line):
        warnings.append("the exponent is not told apart from 0")
    return LyapunovExponent(
        exponent=None if line is None else line.slope,
        interval=None if line is None else interval(line, followed.level is not None),
        verdict=verdict,
        step=step,
        stretch=np.where(told, curve.stretch, -np.inf),
        mean_stretch=followed.mean,
        close=close,
        region=None if line is None else (line.first, line.last),
        intercept=math.nan
        if line is None
        else _intercept(curve, line.first, line.last, line.slope),
        far=far,
        level=followed.level,
        references=followed.references,
        method=method,
        dimension=dimension,
        delay=delay,
        theiler=window,
        noise=None if noise is None else noise.of_value,
        warnings=tuple(warnings),
    )


def _given_region(region: Any) -> tuple[int, int]:
    first, last = pair("region", region, "first and last step of the line")
    first, last = whole("region", first, 0), whole("region", last, 1)
    if last - first < 1:
        raise InvalidInput("region", region, "a last step after the first")
    return first, last


def _doubts(values: np.ndarray) -> list[str]:
    """Warnings about the series itself."""
    few = rounding_doubt(values)
    return [f"{few}: gaps below {2 * resolution(values):.3g} are not used"] if few else []


def _intercept(curve: Curve, first: int, last: int, slope: float) -> float:
    middle = (first + last) / 2
    return float(np.mean(curve.stretch[first : last + 1]) - slope * middle)
