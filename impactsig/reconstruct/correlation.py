"""The correlation sum: how many pairs of delay vectors lie within each radius."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import whole
from ..errors import InvalidInput
from ._arguments import dimensions_of, finite_range
from ._series import known, pairs_apart, series, unbroken
from ._theiler import theiler_window

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

PER_OCTAVE = 4
"""Default radii in each octave."""

OCTAVES = 40
"""How far below the greatest distance default radii are sought; beyond is rounding."""

ALL_PAIRS_UP_TO = 30_000
"""Delay vectors up to which the default radii reach to the greatest distance."""

NEIGHBOURS = 200
"""Where there are more, the greatest default radius holds about as many neighbours of each."""


@dataclass(frozen=True, eq=False)
class CorrelationSum:
    """What `correlation_sum` counted.

    Attributes
    ----------
    radii : ndarray, shape (r,)
        Radii, ascending, in the unit of the series.
    counts : ndarray of int64, shape (dimensions, r)
        Pairs within each radius, exact.
    pairs : ndarray of int64, shape (dimensions,)
        Pairs there are.
    dimensions : tuple of int
        Embedding dimensions, one for each row of `counts`.
    delay : int
        Delay, in steps of the series.
    theiler : int
        Pairs no further apart in time than this many steps were left out.
    """

    radii: np.ndarray
    counts: np.ndarray
    pairs: np.ndarray
    dimensions: tuple[int, ...]
    delay: int
    theiler: int

    @property
    def sums(self) -> np.ndarray:
        """The correlation sum C(r), the share of pairs within each radius, as `counts`."""
        return self.counts / self.pairs[:, None]

    @property
    def slope_radii(self) -> np.ndarray:
        """The radii that the local slopes are of: geometric means of neighbours, shape (r - 1,)."""
        return np.sqrt(self.radii[:-1]) * np.sqrt(self.radii[1:])

    def local_slopes(self) -> np.ndarray:
        """Slope of ln C against ln r between neighbouring radii, shape (dimensions, r - 1).

        A plateau over r that stays where it is as the dimension grows is the correlation
        dimension. Where the smaller radius holds no pair, the slope is nan.
        """
        logs = np.log(np.where(self.counts, self.counts, np.nan))
        return np.diff(logs, axis=1) / np.diff(np.log(self.radii))

    def describe(self) -> str:
        """What was counted, in words."""
        named = ", ".join(str(m) for m in self.dimensions)
        return (
            f"correlation sum: dimension {named}, delay {self.delay}, Theiler window "
            f"{self.theiler}, {len(self.radii)} radii from {self.radii[0]:.3g} to "
            f"{self.radii[-1]:.3g}; {self.counts[-1, -1]} of {self.pairs[-1]} pairs within the "
            f"greatest in dimension {self.dimensions[-1]}"
        )

    def plot(self, figure: Figure | SubFigure | None = None) -> Any:
        """Draw it; see `impactsig.plot.correlation_sum`."""
        from .. import plot

        return plot.correlation_sum(self, figure)

    def __str__(self) -> str:
        return self.describe()


def correlation_sum(
    x: Any,
    dimensions: int | Iterable[int] = range(1, 7),
    *,
    delay: int = 1,
    theiler: int | None = None,
    radii: Any = None,
    workers: int | None = None,
) -> CorrelationSum:
    """Count the pairs of delay vectors within each radius, exactly.

    The correlation sum [GrassbergerProcaccia1983]_ of the delay vectors
    y_i = (x_i, x_{i+d}, ..., x_{i+(m-1)d}) is the share of pairs, away from each other in time by
    more than the Theiler window W [Theiler1986]_, whose distance is r or less,

        C_m(r) = #{i < j : j - i > W, max_k |x_{i+kd} - x_{j+kd}| <= r} / ((n - W)(n - W - 1) / 2),

    with all n = N - (m - 1) d vectors of each dimension m (fewer where the run has gaps). A pair
    at exactly the distance r counts, pairs of equal vectors at every r. The comparison is that of
    the float64 numbers: every count is what comparing pair by pair gives. What is fast is that
    either all pairs are binned by the bits of their distances, in all dimensions at once, or near
    pairs alone, or whole pairs of boxes of a k-d tree that no radius divides (whichever is
    estimated to cost least).

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        The series; of impacts, their interspike intervals. A gap in the run counts as `delay`
        steps, and what reaches across it is no vector.
    dimensions : int or iterable of int, optional
        Embedding dimensions m, ascending; a single number stands for all from 1 up to it, [m] for
        m alone.
    delay : int, optional
        Delay d [steps]; of intervals the natural one is 1.
    theiler : int, optional
        Theiler window W [steps]: 0 leaves out only the pairs of a vector with itself. Unless
        given, two mean periods (from one rise through the mean to the next), or until the
        autocorrelation is not positive, where that is later; a tenth of the series at the most.
    radii : array_like, shape (r,), optional
        Radii, positive and ascending, in the unit of the series. Unless given, quarter octaves,
        2^(k/4): from the last that holds only pairs of equal vectors (or none) to the first that
        holds all pairs. With more than 30 000 vectors they end where a vector has about 200
        neighbours (in the lowest dimension asked for beyond 1), so that the cost grows as n.
    workers : int, optional
        Threads; as many as there are cores unless given. The counts do not depend on it.

    Returns
    -------
    CorrelationSum

    Raises
    ------
    InvalidInput
        If there is no pair of vectors of the greatest dimension (too short a series for it, the
        delay and the Theiler window); if the series is constant and no radii are given; if
        dimensions or radii are not positive and ascending; if an argument is not of its kind.

    Examples
    --------
    >>> import numpy as np
    >>> found = correlation_sum([0.0, 1.0, 3.0], 1, theiler=0, radii=[1.0, 2.0, 3.0])
    >>> found.counts
    array([[1, 2, 3]])
    """
    wanted = dimensions_of(dimensions)
    delay = whole("delay", delay, 1)
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
    pairs = np.array([pairs_apart(each, window) for each in vectors])
    # Here, because it brings the compiler, which wrong arguments should not wait for.
    from ._counting import count_pairs

    if radii is not None:
        chosen = _radii(radii)
        counts = count_pairs(values, wanted, delay, window, chosen, workers)
    else:
        chosen = _quarter_octaves(values, wanted, delay)
        counts = count_pairs(values, wanted, delay, window, chosen, workers)
        kept = _kept(counts)
        chosen, counts = chosen[kept], counts[:, kept]
    return CorrelationSum(chosen, counts, pairs, wanted, delay, window)


def _radii(given: Any) -> np.ndarray:
    radii = series(given, "radii", least=1)
    if radii[0] <= 0 or np.any(np.diff(radii) <= 0):
        raise InvalidInput("radii", given, "positive numbers, ascending, each once")
    return radii


def _quarter_octaves(x: np.ndarray, dimensions: tuple[int, ...], delay: int) -> np.ndarray:
    """All radii of the default that could matter."""
    values = known(finite_range(x))
    greatest = float(np.ptp(values))
    if greatest == 0:
        raise InvalidInput(
            "x",
            f"{len(values)} values that are all {values[0]:g}",
            "a series that varies",
            "Intervals that are all equal are those of a periodic motion, of dimension 0. "
            "With radii given they can be counted",
        )
    lowest = next((m for m in dimensions if m > 1), 1)
    if np.count_nonzero(unbroken(x, (lowest - 1) * delay + 1)) > ALL_PAIRS_UP_TO:
        greatest = _radius_of_neighbours(x, lowest, delay)
    last = min(np.ceil(PER_OCTAVE * np.log2(greatest)), PER_OCTAVE * 1024 - 1)
    radii = np.exp2(np.arange(last - PER_OCTAVE * OCTAVES, last + 1) / PER_OCTAVE)
    return radii[radii > 0]


def _radius_of_neighbours(x: np.ndarray, m: int, delay: int) -> float:
    """The radius within which a vector has about NEIGHBOURS others, from a sample of pairs."""
    n = len(x) - (m - 1) * delay
    # Drawn, because evenly spaced vectors would beat with a periodic series.
    i, j = np.random.default_rng(0).integers(n, size=(2, 2_000_000))
    i, j = i[i != j], j[i != j]
    d = np.zeros(len(i))
    for k in range(m):
        np.maximum(d, np.abs(x[i + k * delay] - x[j + k * delay]), out=d)
    d = known(d)
    radius = float(np.quantile(d, NEIGHBOURS / n))
    return radius or float(d[d > 0].min(initial=np.ptp(known(x))))


def _kept(counts: np.ndarray) -> slice:
    """From the last radius that adds nothing to the first to the first that adds all."""
    changes = np.flatnonzero(np.any(np.diff(counts, axis=1), axis=0))
    return slice(int(changes[0]), int(changes[-1]) + 2) if len(changes) else slice(0, None)
