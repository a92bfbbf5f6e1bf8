"""Surrogates: random series that keep what the null hypothesis allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..._arguments import Seed, choice, streams, whole
from ..._showing import Shown
from ...errors import InvalidInput
from .._arguments import varying
from .._series import known, series, stretches
from ._sieve import Scores, coefficients, draw, ranked

Method = Literal["autoregressive", "shuffled"]

NULL = {
    "autoregressive": "a linear Gaussian process seen through a monotone function",
    "shuffled": "values drawn independently",
}
"""What each kind of surrogate stands for."""

LEAST = 10


@dataclass(frozen=True, eq=False, repr=False)
class Surrogates(Shown):
    """Surrogates of a series. ``np.asarray`` gives the values.

    Attributes
    ----------
    values : ndarray, shape (count, n)
        The surrogates, one per row.
    original : ndarray, shape (n,)
        The original series; for a run with gaps, its longest part.
    method : str
        "autoregressive" or "shuffled".
    order : int
        Order of the autoregressive process; 0 for shuffled values.
    warnings : tuple of str
        Properties of the series that the surrogates do not reproduce.

    See Also
    --------
    surrogates, results.SurrogateTest

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import surrogates
    >>> made = surrogates(np.random.default_rng(1).standard_normal(200), 5, seed=1)
    >>> np.asarray(made).shape
    (5, 200)
    """

    values: np.ndarray
    original: np.ndarray
    method: Method
    order: int
    warnings: tuple[str, ...] = ()

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """The values, shape (count, n)."""
        return np.array(self.values, dtype=dtype, copy=copy)

    def __len__(self) -> int:
        return len(self.values)

    def describe(self) -> str:
        """Describe the surrogates in words."""
        count, n = self.values.shape
        words = f"{count} {self.method} surrogates of {n} values ({NULL[self.method]})"
        if self.method == "autoregressive":
            words += f", order {self.order}"
        return "; ".join((words, *self.warnings))


def surrogates(
    x: Any, count: int = 1, method: Method = "autoregressive", *, seed: Seed = None
) -> Surrogates:
    """Surrogate series: random realisations of a null hypothesis about a series.

    - "autoregressive": the values of `x`, all of them, in the order of a linear Gaussian process
      that is correlated as the data are [Buhlmann1997]_. Null hypothesis: a linear Gaussian process
      seen through a monotone function. An autoregressive process is fitted to the normal scores of
      `x` (Burg's method, order by AIC, coefficients corrected for the bias that realisations show),
      and each surrogate puts the values of `x` into the order of a realisation.
    - "shuffled": the values in random order. Null hypothesis: they are drawn independently.

    Fourier surrogates (random phases, IAAFT) are not offered: for a linear process observed through
    a function with heavy tails, the spectrum of IAAFT surrogates differs from that of the data, and
    linearity is wrongly rejected in up to 80 % of the cases.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        Ten values or more; of impacts, their interspike intervals [s], where the run has gaps the
        longest stretch between two of them.
    count : int
        Number of surrogates.
    method : {"autoregressive", "shuffled"}
        Kind of surrogates.
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same result; a Generator is advanced. The first surrogates are the
        same whatever `count` is.

    Returns
    -------
    Surrogates
        The `values`, shape (count, n), in the unit of `x`, with the settings of the process.

    Raises
    ------
    InvalidInput
        If `x` is not a series of ten finite numbers that are not all equal, or an argument is not
        of its kind.

    See Also
    --------
    surrogate_test

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import surrogates
    >>> x = np.random.default_rng(1).standard_normal(200).cumsum()
    >>> made = surrogates(x, 5, seed=1)
    >>> bool(np.all(np.sort(made.values) == np.sort(made.original)))
    True
    """
    values, notes = longest_stretch(x)
    count = whole("count", count, 0)
    choice("method", method, NULL)
    original = values.copy()
    rows, order = rows_of(original, np.sort(original), count, method, seed)
    for array in (rows, original):
        array.flags.writeable = False
    return Surrogates(rows, original, method, order, notes)


def rows_of(
    x: np.ndarray, ascending: np.ndarray, count: int, method: Method, seed: Seed
) -> tuple[np.ndarray, int]:
    """Surrogates with `ascending` as values by rank, in the order of a random process.

    Returns
    -------
    rows : ndarray, shape (count, n)
    order : int
    """
    first, *others = streams(seed, 1 + count)
    rows = np.empty((count, len(x)))
    if method == "shuffled":
        own = ranked(x, ascending)
        for row, rng in zip(rows, others, strict=True):
            row[:] = rng.permutation(own)
        return rows, 0
    process = coefficients(x, Scores.of(x), first)
    for row, rng in zip(rows, others, strict=True):
        row[:] = ranked(draw(process, len(x), rng), ascending)
    return rows, len(process)


def longest_stretch(x: Any) -> tuple[np.ndarray, tuple[str, ...]]:
    """The longest stretch between gaps, and how many values are left out.

    Surrogates have no gaps, and what they are compared with must be as long and as whole.
    """
    marked = series(x, gap=1)
    values = max(stretches(marked), key=len)
    left, parts = len(known(marked)) - len(values), len(stretches(marked))
    if len(values) < LEAST:
        between = " between two gaps" if left else ""
        raise InvalidInput("x", f"{len(values)} values{between}", f"at least {LEAST}")
    if not left:
        return varying(values), ()
    note = f"{len(values)} values between two gaps stand for all {left + len(values)}"
    return varying(values), (f"{note}, the longest of {parts} stretches",)
