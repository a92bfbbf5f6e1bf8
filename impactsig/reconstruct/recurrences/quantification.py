"""Measures of recurrence plots: how long a series stays near earlier states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._arguments import thread_count, whole
from ..._running.threads import in_threads
from ..._showing import Shown
from ...errors import InvalidInput
from .._series import known, pairs_apart, unbroken
from .recurrence import RecurrencePlot, chosen_radius, vectors_of


@dataclass(frozen=True, eq=False, repr=False)
class RecurrenceQuantification(Shown):
    """Measures of the lines in a recurrence plot; None if there is no line to measure.

    Attributes
    ----------
    recurrence_rate : float
        RR, fraction of the pairs (i, j), abs(i - j) > theiler, that are within the radius.
    determinism : float or None
        DET, fraction of the recurrences in diagonal lines.
    mean_diagonal : float or None
        L, mean length of a diagonal line [vectors].
    longest_diagonal : int
        L_max [vectors].
    entropy : float or None
        ENTR, Shannon entropy of the lengths of the diagonal lines [nat].
    laminarity : float or None
        LAM, fraction of the recurrences in vertical lines.
    trapping_time : float or None
        TT, mean length of a vertical line [vectors].
    longest_vertical : int
        V_max [vectors].
    diagonals, verticals : ndarray of int, shape (N + 1,)
        P(l): number of lines of length l, including those shorter than the minimum.
    radius : float or None
        In the unit of the series; None of a given matrix.
    dimension, delay : int or None
        As given; None of a given matrix.
    theiler, least_diagonal, least_vertical : int
        As given.
    warnings : tuple of str
        Warnings about the result.

    See Also
    --------
    recurrence_quantification, results.RecurrencePlot

    Examples
    --------
    >>> from impactsig import recurrence_quantification
    >>> found = recurrence_quantification([0, 1, 0, 1, 0], radius=0.5)
    >>> found.determinism, found.longest_diagonal
    (0.75, 3)
    """

    recurrence_rate: float
    determinism: float | None
    mean_diagonal: float | None
    longest_diagonal: int
    entropy: float | None
    laminarity: float | None
    trapping_time: float | None
    longest_vertical: int
    diagonals: np.ndarray
    verticals: np.ndarray
    radius: float | None
    dimension: int | None
    delay: int | None
    theiler: int
    least_diagonal: int
    least_vertical: int
    warnings: tuple[str, ...] = ()

    def describe(self) -> str:
        """Describe the result in words."""
        words = [f"recurrence rate {self.recurrence_rate:.3g}"]
        if self.determinism is not None:
            words.append(f"determinism {self.determinism:.3g}, laminarity {self.laminarity:.3g}")
        if self.mean_diagonal is not None:
            words.append(
                f"diagonal lines of {self.mean_diagonal:.3g} on average, "
                f"{self.longest_diagonal} at most"
            )
        return "; ".join((*words, *self.warnings))


def recurrence_quantification(
    x: Any,
    dimension: int = 1,
    delay: int = 1,
    *,
    radius: float | None = None,
    rate: float | None = None,
    theiler: int | None = None,
    least_diagonal: int = 2,
    least_vertical: int = 2,
    workers: int | None = None,
) -> RecurrenceQuantification:
    """Measures of the diagonal and vertical lines of a recurrence plot, [Marwan2007]_.

    With P(l) the number of diagonal lines of length l (R_{i+k,j+k} = 1 for k = 0 ... l - 1, as long
    as can be), Q(v) that of vertical ones, l >= l_min and v >= v_min in the sums unless noted,

        DET = sum l P(l) / sum_{l>=1} l P(l),       L = sum l P(l) / sum P(l),
        ENTR = -sum p(l) ln p(l),  p(l) = P(l) / sum P(l),
        LAM = sum v Q(v) / sum_{v>=1} v Q(v),      TT = sum v Q(v) / sum Q(v).

    Points with abs(i - j) <= theiler are no recurrences, and RR is the share of the others. A line
    that touches the edge of the plot, or a gap of the run, counts with the length it has there. The
    result is exact. It takes N^2 comparisons (a few ns each) and memory for N numbers; the matrix
    is not stored.

    Parameters
    ----------
    x : Impacts, array_like of shape (n,), RecurrencePlot, or ndarray of bool of shape (n, m)
        A series in the order of time; of impacts, their interspike intervals [s]. Or a recurrence
        matrix, which need not be square (as that of two series); its columns are the vertical
        lines, and no other setting but `theiler` and the least lengths is then given.
    dimension, delay : int
        Coordinates of a vector, and the values from one to the next.
    radius : float, optional
        In the unit of `x`.
    rate : float, optional
        RR, instead of the radius: the smallest radius with this fraction of the pairs is used.
    theiler : int, optional
        Pairs of vectors at most so many steps apart are excluded. By default 0, the main diagonal;
        for an array of bool -1, which excludes none.
    least_diagonal, least_vertical : int
        l_min and v_min.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it.

    Returns
    -------
    RecurrenceQuantification
        RR, DET, L, L_max, ENTR, LAM, TT and V_max (lengths in vectors), with the numbers of lines
        of each length, P and Q, shape (N + 1,).

    Raises
    ------
    InvalidInput
        If `x` is neither a series of finite numbers nor a matrix of bool, gives no pair of vectors
        outside `theiler`, or neither or both of `radius` and `rate` are given.

    See Also
    --------
    recurrence_plot, ordinal_patterns

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import recurrence_quantification
    >>> recurrence_quantification([0, 1, 0, 1, 0], radius=0.5).determinism
    0.75
    >>> recurrence_quantification(np.eye(4, dtype=bool)).longest_diagonal
    4
    """
    least_diagonal = whole("least_diagonal", least_diagonal, 1)
    least_vertical = whole("least_vertical", least_vertical, 1)
    if isinstance(x, RecurrencePlot) or (isinstance(x, np.ndarray) and x.ndim == 2):
        measured = _of_matrix(x, theiler, least_diagonal, least_vertical)
        if radius is not None or rate is not None:
            raise InvalidInput("radius", radius, "none, nor a rate, with a matrix")
        return measured
    values, dimension, delay = vectors_of(x, dimension, delay)
    workers = workers if workers is None else whole("workers", workers, 1)
    theiler = 0 if theiler is None else whole("theiler", theiler, 0)
    count = len(values) - (dimension - 1) * delay
    pairs = 2 * pairs_apart(unbroken(values, len(values) - count + 1), theiler)
    if not pairs:
        raise InvalidInput(
            "x",
            f"{len(known(values))} values",
            f"at least {theiler + 2 + len(values) - count} for dimension {dimension}, delay "
            f"{delay} and theiler {theiler}",
        )
    radius = chosen_radius(values, dimension, delay, theiler, radius, rate)
    from ._lines import line_lengths

    parts = 4 * thread_count(workers)

    def part(k: int) -> tuple[np.ndarray, np.ndarray]:
        return line_lengths(values, dimension, delay, radius, theiler, k, parts)

    found = in_threads(part, range(parts), workers)
    diagonals, verticals = (sum(lines) for lines in zip(*found, strict=True))
    present = known(values)
    constant = present.min() == present.max()
    return _measures(
        diagonals, verticals, pairs, radius, dimension, delay, theiler,
        least_diagonal, least_vertical, constant,
    )  # fmt: skip


def _of_matrix(
    x: Any, theiler: int | None, least_diagonal: int, least_vertical: int
) -> RecurrenceQuantification:
    plot = x if isinstance(x, RecurrencePlot) else None
    matrix = np.asarray(x if plot is None else plot.matrix)
    if matrix.dtype != np.bool_ or not matrix.size:
        raise InvalidInput(
            "x", f"an array of {matrix.dtype}, shape {matrix.shape}",
            "a series, or a recurrence matrix of bool", "distances <= radius makes one",
        )  # fmt: skip
    if theiler is None:
        theiler = -1 if plot is None else 0
    theiler = whole("theiler", theiler, -1)
    rows, columns = matrix.shape
    lags = np.arange(-rows + 1, columns)
    lengths = np.minimum(rows, columns - lags) - np.maximum(0, -lags)
    pairs = int(lengths[np.abs(lags) > theiler].sum())
    if plot is not None:  # rows of a gap are empty on the main diagonal too
        pairs = 2 * pairs_apart(np.diagonal(matrix), theiler)
    if pairs <= 0:
        raise InvalidInput("x", f"shape {matrix.shape}", f"points outside theiler = {theiler}")
    from ._lines import matrix_lines

    diagonals, verticals = matrix_lines(np.ascontiguousarray(matrix), theiler)
    radius, dimension, delay = (
        (None, None, None) if plot is None else (plot.radius, plot.dimension, plot.delay)
    )
    return _measures(
        diagonals, verticals, pairs, radius, dimension, delay, theiler,
        least_diagonal, least_vertical, False,
    )  # fmt: skip


def _measures(
    diagonals: np.ndarray,
    verticals: np.ndarray,
    pairs: int,
    radius: float | None,
    dimension: int | None,
    delay: int | None,
    theiler: int,
    least_diagonal: int,
    least_vertical: int,
    constant: bool,
) -> RecurrenceQuantification:
    points = int(diagonals @ np.arange(len(diagonals)))
    warnings: tuple[str, ...] = ()
    if constant:
        warnings = ("the series is constant: every vector recurs always",)
    elif points == 0:
        warnings = ("no vectors are within the radius: use a larger one",)
    elif points == pairs:
        warnings = ("all vectors are within the radius: use a smaller one",)
    diagonal = _Lines.of(diagonals, least_diagonal)
    vertical = _Lines.of(verticals, least_vertical)
    for array in (diagonals, verticals):
        array.flags.writeable = False
    return RecurrenceQuantification(
        points / pairs,
        diagonal.share,
        diagonal.mean,
        diagonal.longest,
        diagonal.entropy,
        vertical.share,
        vertical.mean,
        vertical.longest,
        diagonals,
        verticals,
        radius,
        dimension,
        delay,
        theiler,
        least_diagonal,
        least_vertical,
        warnings,
    )


@dataclass(frozen=True)
class _Lines:
    share: float | None
    mean: float | None
    entropy: float | None
    longest: int

    @classmethod
    def of(cls, lines: np.ndarray, least: int) -> _Lines:
        """Measures of the lines not shorter than `least`."""
        length = np.arange(len(lines))
        points = int(lines @ length)
        length, kept = length[least:], lines[least:]
        if not kept.any():
            return cls(0.0 if points else None, None, None, 0)
        share = kept[kept > 0] / kept.sum()
        inside = int(kept @ length)
        return cls(
            inside / points,
            inside / int(kept.sum()),
            float(-np.sum(share * np.log(share))) + 0.0,
            int(length[kept > 0].max()),
        )
