"""Recurrence plots: returns of a series near earlier states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._arguments import number, thread_count, whole
from ..._running.threads import in_threads
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from .._series import known, pairs_apart, series, unbroken

MOST_VECTORS = 10_000  # in a matrix of one byte an element


@dataclass(frozen=True, eq=False, repr=False)
class RecurrencePlot(Shown):
    """Pairs of delay vectors of a series that are close to each other.

    Attributes
    ----------
    matrix : ndarray of bool, shape (N, N)
        R_ij: whether vectors i and j are within the radius; N^2 bytes. Rows and columns that
        represent a gap of the run are False, also on the main diagonal.
    radius : float
        In the unit of the series.
    dimension, delay : int
        Of the vectors.

    See Also
    --------
    recurrence_plot, recurrence_quantification, plot.recurrence_plot

    Examples
    --------
    >>> from impactsig import recurrence_plot
    >>> found = recurrence_plot([0, 1, 0, 1], radius=0.5)
    >>> found.matrix.sum(axis=0)
    array([2, 2, 2, 2])
    """

    matrix: np.ndarray
    radius: float
    dimension: int
    delay: int

    def describe(self) -> str:
        """Describe the result in words."""
        count = int(np.count_nonzero(np.diagonal(self.matrix)))
        others = count * max(count - 1, 1)
        share = (int(np.count_nonzero(self.matrix)) - count) / others
        return (
            f"{share:.3g} of the pairs of {count} vectors ({self.dimension} dimensions, "
            f"delay {self.delay}) are within {self.radius:.4g}"
        )

    plot = drawn_by("recurrence_plot", "the recurrence plot")


def recurrence_plot(
    x: Any,
    dimension: int = 1,
    delay: int = 1,
    *,
    radius: float | None = None,
    rate: float | None = None,
    workers: int | None = None,
) -> RecurrencePlot:
    """Recurrence plot of a series: R_ij = 1 if abs(v_i - v_j) <= radius.

    The distance is the largest difference of a coordinate [Marwan2007]_.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    dimension, delay : int
        Coordinates of a vector, and the values from one to the next.
    radius : float, optional
        Radius, in the unit of `x`; a tenth of its standard deviation is a reasonable first choice.
    rate : float, optional
        Recurrence rate, instead of the radius: the smallest radius with this fraction of the pairs
        of different vectors is used.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    RecurrencePlot
        The `matrix` R, bool of shape (N, N) for N vectors, and the `radius`.

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, is too short for one vector, or gives more than 10
        000 of them (100 MB); `recurrence_quantification` takes more.

    See Also
    --------
    recurrence_quantification, plot.recurrence_plot

    Examples
    --------
    >>> from impactsig import recurrence_plot
    >>> recurrence_plot([0, 1, 0, 1], radius=0.5).matrix.astype(int)
    array([[1, 0, 1, 0],
           [0, 1, 0, 1],
           [1, 0, 1, 0],
           [0, 1, 0, 1]])
    """
    values, dimension, delay = vectors_of(x, dimension, delay)
    workers = workers if workers is None else whole("workers", workers, 1)
    count = len(values) - (dimension - 1) * delay
    if count > MOST_VECTORS:
        raise InvalidInput(
            "x",
            f"{count} delay vectors",
            f"{MOST_VECTORS} or fewer: the matrix would take {count**2 / 1e6:.0f} MB",
            "Give a part of it, or use recurrence_quantification, which does not store the matrix",
        )
    radius = chosen_radius(values, dimension, delay, 0, radius, rate)
    from ._lines import close_pairs

    matrix = np.empty((count, count), np.bool_)
    parts = 4 * thread_count(workers)

    def part(k: int) -> None:
        close_pairs(values, dimension, delay, radius, k, parts, matrix)

    in_threads(part, range(parts), workers)
    matrix.flags.writeable = False
    return RecurrencePlot(matrix, radius, dimension, delay)


def vectors_of(x: Any, dimension: int, delay: int) -> tuple[np.ndarray, int, int]:
    """A series that has a delay vector, and its dimension and delay, validated."""
    dimension, delay = whole("dimension", dimension, 1), whole("delay", delay, 1)
    span = (dimension - 1) * delay + 1
    values = series(x, least=span, gap=delay)
    if not unbroken(values, span).any():
        raise InvalidInput("x", f"{len(known(values))} values", f"{span} without a gap, a vector")
    return values, dimension, delay


def chosen_radius(
    values: np.ndarray,
    dimension: int,
    delay: int,
    theiler: int,
    radius: float | None,
    rate: float | None,
) -> float:
    """The given radius, or the one that gives the recurrence rate."""
    if rate is None:
        return number("radius", radius, least=0)
    if radius is not None:
        raise InvalidInput("radius", radius, "a radius or a rate, not both")
    rate = number("rate", rate, above=0, most=1.0)
    span = (dimension - 1) * delay + 1
    pairs = pairs_apart(unbroken(values, span), theiler)
    if not pairs:
        raise InvalidInput("x", f"{len(known(values))} values", "two vectors outside `theiler`")
    from ._rate import radius_of

    wanted = max(round(rate * pairs), 1)
    return radius_of(values, dimension, delay, theiler, wanted)
