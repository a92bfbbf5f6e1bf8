"""`correlation_sum`: share of pairs of vectors within each radius, and generalised sums."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..._arguments import choice, number, reals, whole
from ..._showing import Shown, drawn_on_figure_by
from ...errors import InvalidInput
from ...impacts import Impacts
from .._arguments import dimensions_of, finite_range
from .._fits import Fit, FitName, fit_of
from .._series import known, pairs_apart, series, unbroken
from .._theiler import theiler_window
from ._radii import given_radii, radii_of_points, radii_of_series, with_pairs

if TYPE_CHECKING:
    from ._point_sums import Kernel, Norm

DIMENSIONS = range(1, 7)
"""Embedding dimensions of a series."""


@dataclass(frozen=True, eq=False)
class CorrelationSum(Shown):
    """Correlation sums over radii and embedding dimensions.

    Attributes
    ----------
    radii : ndarray, shape (r,)
        Radii, ascending, in the unit of the series.
    counts : ndarray, shape (dimensions, r)
        Number of pairs within each radius, exact, of type int64; for the Gaussian kernel its sum
        over all pairs.
    pairs : ndarray of int64, shape (dimensions,)
        Number of pairs of vectors that were compared.
    dimensions : tuple of int
        Embedding dimensions, one for each row of `counts`; for given vectors their length.
    delay : int
        Delay, in steps of the series.
    theiler : int
        Pairs no further apart in time than this many steps were left out.
    norm, kernel : str
        As given.
    q : float
        Order of the sums.
    sums : ndarray, shape (dimensions, r)
        The correlation sum C_q(r); of order 2 the share of pairs within each radius.

    See Also
    --------
    correlation_sum, correlation_dimension, plot.correlation_sum

    Examples
    --------
    >>> from impactsig import correlation_sum
    >>> found = correlation_sum([0.0, 1.0, 3.0], 1, theiler=0, radii=[1.0, 2.0, 3.0])
    >>> found.counts, found.pairs
    (array([[1, 2, 3]]), array([3]))
    """

    radii: np.ndarray
    counts: np.ndarray
    pairs: np.ndarray
    dimensions: tuple[int, ...]
    delay: int
    theiler: int
    norm: Norm
    kernel: Kernel
    q: float
    sums: np.ndarray

    @property
    def slope_radii(self) -> np.ndarray:
        """Radii of the local slopes: geometric means of neighbours, shape (r - 1,)."""
        return np.sqrt(self.radii[:-1]) * np.sqrt(self.radii[1:])

    def local_slopes(self) -> np.ndarray:
        """Slope of ln C against ln r between neighbouring radii, shape (dimensions, r - 1).

        A plateau over r that does not change with the embedding dimension is the dimension D_q. If
        C of the smaller radius is 0, the slope is nan.
        """
        logs = np.log(np.where(self.sums > 0, self.sums, np.nan))
        return np.diff(logs, axis=1) / np.diff(np.log(self.radii))

    def slope(self, low: float, high: float, fit: FitName | Fit = "least squares") -> np.ndarray:
        """Slope of ln C against ln r over the radii from `low` to `high`, shape (dimensions,).

        If it is the same over a wide range of radii, and does not grow with the embedding
        dimension, it is the generalized dimension D_q. It is nan if C of a radius is 0.

        Parameters
        ----------
        low, high : float
            Bounds of the radii, inclusive, in the unit of the series.
        fit : {"least squares", "theil-sen"} or callable
            The line through all points, the median of the slopes between any two, or a function
            fit(x, y) of ln r and ln C that returns the slope.

        Raises
        ------
        InvalidInput
            If fewer than two radii are within the range, or `fit` returns no finite number.
        """
        rule = fit_of(fit)
        low, high = number("low", low, above=0), number("high", high, above=0)
        within = (self.radii >= low) & (self.radii <= high)
        if np.count_nonzero(within) < 2:
            raise InvalidInput(
                "high",
                f"{high:g}, {np.count_nonzero(within)} radii from {low:g} on",
                f"a range that holds two of the radii, {self.radii[0]:g} to {self.radii[-1]:g}",
            )
        logs = np.log(self.radii[within])
        return np.array(
            [
                rule(logs, np.log(each[within])) if np.all(each[within] > 0) else np.nan
                for each in self.sums
            ]
        )

    def describe(self) -> str:
        """Describe the result in words."""
        named = ", ".join(str(m) for m in self.dimensions)
        order = "" if self.q == 2 else f" of order {self.q:g}"
        kind = "" if self.norm == "max" else f"{self.norm} norm, "
        kind += "" if self.kernel == "step" else f"{self.kernel} kernel, "
        return (
            f"correlation sum{order}: dimension {named}, {kind}delay {self.delay}, Theiler window "
            f"{self.theiler}, {len(self.radii)} radii from {self.radii[0]:.3g} to "
            f"{self.radii[-1]:.3g}; {self.counts[-1, -1]:.10g} of {self.pairs[-1]} pairs within "
            f"the greatest in dimension {self.dimensions[-1]}"
        )

    plot = drawn_on_figure_by("correlation_sum", "it")


def correlation_sum(
    x: Any,
    dimensions: int | Iterable[int] | None = None,
    *,
    delay: int | None = None,
    theiler: int | None = None,
    radii: Any = None,
    norm: Norm = "max",
    kernel: Kernel = "step",
    q: float = 2,
    workers: int | None = None,
) -> CorrelationSum:
    r"""Correlation sum: share of the pairs of delay vectors within each radius, counted exactly.

    The correlation sum [GrassbergerProcaccia1983]_ of the delay vectors
    y_i = (x_i, x_{i+d}, ..., x_{i+(m-1)d}) is the share of pairs, away from each other in time by
    more than the Theiler window W [Theiler1986]_, whose distance is r or less,

        C_m(r) = #{i < j : j - i > W, max_k abs(x_{i+kd} - x_{j+kd}) <= r}
                 / ((n - W)(n - W - 1) / 2),

    with all n = N - (m - 1) d vectors of each dimension m (fewer where the run has gaps). A pair at
    exactly the distance r counts, pairs of equal vectors at every r. Distances are compared as
    float64 numbers, so that every count equals that of a loop over all pairs. Depending on the
    estimated cost, all pairs are binned by the bits of their distances, in all dimensions at once,
    or only near pairs, or whole pairs of boxes of a k-d tree that no radius divides.

    With C_i(r) the share of the partners of vector i within r, the sum of order q
    [HentschelProcaccia1983]_,

    .. math:: C_q(r) = \Big( \frac1n \sum_i C_i(r)^{q-1} \Big)^{1/(q-1)} ,
        \qquad C_1(r) = \exp \frac1n \sum_i \ln C_i(r) ,

    grows as r^D_q; `CorrelationSum.slope` estimates D_q. For q <= 1 it is 0 if a vector has no
    neighbour within r.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,) or (n, d)
        The series; for impacts, their interspike intervals. A gap in the run counts as `delay`
        steps, and no vector extends across it. A two-dimensional array contains the vectors
        themselves in order of time.
    dimensions : int or iterable of int, optional
        Embedding dimensions m, ascending; a single number means all from 1 up to it, [m] only m. By
        default 1 to 6; not for vectors.
    delay : int, optional
        Delay d [steps]; by default 1, which is natural for intervals. Not for vectors.
    theiler : int, optional
        Theiler window W [steps]; 0 excludes only the pairs of a vector with itself. By default the
        larger of two mean periods (between rises through the mean) and the first lag at which the
        autocorrelation is not positive, but at most a tenth of the series; for vectors, that of
        their first coordinate.
    radii : array_like, shape (r,), optional
        Radii, positive and ascending, in the unit of the series. By default quarter octaves,
        2^(k/4), from the last with only pairs of equal vectors (or none) to the first with all
        pairs. With more than 30 000 vectors they end where a vector has about 200 neighbours (in
        the lowest requested dimension above 1), so that the cost is proportional to n. For the
        Gaussian kernel they start where it sums to one pair.
    norm : {"max", "euclidean"}
        Distance of two vectors: the maximum norm or the Euclidean norm of their difference.
    kernel : {"step", "gaussian"}
        Contribution of a pair at the distance d: 1 if d <= r, or exp(-(d / 2r)^2), as in
        `correlation_dimension`.
    q : float
        Order of the sum. Vectors, the Euclidean norm, the Gaussian kernel and orders other than 2
        compare all pairs, so that the cost grows as n^2.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    CorrelationSum

    Raises
    ------
    InvalidInput
        If there is no pair of vectors of the greatest dimension (the series is too short for it,
        the delay and the Theiler window); if dimensions or a delay are given for vectors; if the
        series is constant and no radii are given; if dimensions or radii are not positive and
        ascending; if an argument is invalid.

    See Also
    --------
    correlation_dimension, delay_embed

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import correlation_sum
    >>> found = correlation_sum([0.0, 1.0, 3.0], 1, theiler=0, radii=[1.0, 2.0, 3.0])
    >>> found.counts
    array([[1, 2, 3]])

    The middle third set, of dimension ln 2 / ln 3 for every order, by its 1024 points of depth 10:

    >>> points = [0.0]
    >>> for depth in range(10):
    ...     points = [p / 3 for p in points] + [(p + 2) / 3 for p in points]
    >>> found = correlation_sum(np.c_[points], theiler=0, q=1, radii=3.0 ** np.arange(-4, 0))
    >>> found.slope(0.01, 0.4).round(2)
    array([0.64])
    """
    norm = cast("Norm", choice("norm", norm, ("max", "euclidean")))
    kernel = cast("Kernel", choice("kernel", kernel, ("step", "gaussian")))
    q = number("q", q)
    if _two_dimensional(x):
        points = _vectors(x, dimensions, delay)
        workers = workers if workers is None else whole("workers", workers, 1)
        window = _window(theiler_window(theiler, points[:, 0]), np.arange(len(points)))
        given = [(points, np.arange(len(points)))]
        return _of_points(given, 1, window, radii, norm, kernel, q, workers)
    wanted = dimensions_of(DIMENSIONS if dimensions is None else dimensions)
    delay = whole("delay", 1 if delay is None else delay, 1)
    values = series(x, gap=delay)
    workers = workers if workers is None else whole("workers", workers, 1)
    window = theiler_window(theiler, values)
    vectors = [unbroken(values, (m - 1) * delay + 1) for m in wanted]
    if np.count_nonzero(vectors[-1]) < 2:
        raise InvalidInput(
            "x",
            f"{len(known(values))} values",
            f"at least {(wanted[-1] - 1) * delay + 2} for dimension {wanted[-1]} at delay {delay}"
            + (", all of them between the same gaps" if np.isnan(values).any() else ""),
        )
    farthest = int(np.ptp(np.flatnonzero(vectors[-1])))
    if window >= farthest:
        raise InvalidInput(
            "theiler",
            window,
            f"at most {farthest - 1}: the vectors of dimension {wanted[-1]} are {farthest} steps "
            "apart at the most",
        )
    if (norm, kernel, q) != ("max", "step", 2):
        places = [np.flatnonzero(each) for each in vectors]
        given = [
            (np.column_stack([values[at + k * delay] for k in range(m)]), at)
            for m, at in zip(wanted, places, strict=True)
        ]
        return _of_points(given, delay, window, radii, norm, kernel, q, workers)
    pairs = np.array([pairs_apart(each, window) for each in vectors])
    # Here, because it brings the compiler, which wrong arguments should not wait for.
    from ._counting import count_pairs

    if radii is not None:
        chosen = given_radii(radii)
        counts = count_pairs(values, wanted, delay, window, chosen, workers)
    else:
        chosen = radii_of_series(values, wanted, delay)
        counts = count_pairs(values, wanted, delay, window, chosen, workers)
        kept = with_pairs(counts)
        chosen, counts = chosen[kept], counts[:, kept]
    sums = counts / pairs[:, None]
    return CorrelationSum(chosen, counts, pairs, wanted, delay, window, "max", "step", 2.0, sums)


def _two_dimensional(x: Any) -> bool:
    try:
        return not isinstance(x, Impacts) and np.ndim(x) == 2
    except Exception:  # rows of different lengths, or an array that raises
        return False


def _vectors(x: Any, dimensions: Any, delay: Any) -> np.ndarray:
    """Validate given vectors, shape (n, d)."""
    for name, value in (("dimensions", dimensions), ("delay", delay)):
        if value is not None:
            raise InvalidInput(
                "x",
                f"shape {np.shape(x)}, and {name} {value}",
                "one dimension, shape (n,), for delay vectors",
                f"Leave {name} out for vectors of shape (n, d), which are taken as they are",
            )
    vectors = reals("x", x, "finite numbers, shape (n, d)")
    if not np.all(np.isfinite(vectors)):
        raise InvalidInput("x", f"{np.sum(~np.isfinite(vectors))} not finite", "finite numbers")
    if len(vectors) < 2 or not vectors.shape[1]:
        raise InvalidInput("x", f"shape {vectors.shape}", "at least 2 vectors of 1 coordinate")
    for column in vectors.T:
        finite_range(column)
    return np.ascontiguousarray(vectors, dtype=np.float64)


def _window(theiler: int, times: np.ndarray) -> int:
    """Validate the Theiler window, which must leave a pair."""
    if theiler >= times[-1] - times[0]:
        raise InvalidInput(
            "theiler", theiler, f"at most {times[-1] - times[0] - 1}, so that a pair remains"
        )
    return theiler


def _of_points(
    given: list[tuple[np.ndarray, np.ndarray]],
    delay: int,
    theiler: int,
    radii: Any,
    norm: Norm,
    kernel: Kernel,
    q: float,
    workers: int | None,
) -> CorrelationSum:
    """The sum of given vectors, by the partners of each."""
    # Here, because it brings the compiler, which wrong arguments should not wait for.
    from ._point_sums import generalized, point_sums

    chosen = given_radii(radii) if radii is not None else radii_of_points(given[-1][0], norm)
    rows = []
    for vectors, times in given:
        found = point_sums(vectors, times, theiler, chosen, norm, kernel, workers)
        total = found.sum(axis=0)
        earlier = np.searchsorted(times, times - theiler, side="left")
        partners = earlier + len(times) - np.searchsorted(times, times + theiler, side="right")
        some = partners > 0
        rows.append(
            (
                total // 2 if kernel == "step" else total / 2,
                generalized(found[some] / partners[some, None], q) if q != 2 else total,
                partners.sum(),
            )
        )
    counts, sums, ends = (np.array(each) for each in zip(*rows, strict=True))
    if q == 2:
        sums = sums / ends[:, None]
    if radii is None:
        kept = (
            with_pairs(counts) if kernel == "step" else slice(int(np.argmax(counts[0] >= 1)), None)
        )
        chosen, counts, sums = chosen[kept], counts[:, kept], sums[:, kept]
    dimensions = tuple(vectors.shape[1] for vectors, _ in given)
    return CorrelationSum(
        chosen, counts, ends // 2, dimensions, delay, theiler, norm, kernel, q, sums
    )
