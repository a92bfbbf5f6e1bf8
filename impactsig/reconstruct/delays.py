"""Choice of the embedding delay, by autocorrelation or mutual information."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from .._arguments import choice, refuse, whole
from .._showing import Shown, drawn_by
from ..errors import InvalidInput
from ._arguments import varying
from ._series import known, series, stretches, unbroken
from .information import NEIGHBORS, information, scored

LEAST = 16
"""Fewest values that a delay is looked for in."""

RISE = 6.0
"""Rise that makes a minimum, in standard deviations of the information of independent values."""

SCATTER = 1.25
"""Standard deviation of the information of independent values, times sqrt(neighbours n)."""

NOTHING = -0.5 * math.log(1 - math.exp(-2))
"""Information [nat] of Gaussian values with a correlation of 1/e: less is as good as none."""


@dataclass(frozen=True, eq=False)
class DelayChoice(Shown):
    """Autocorrelation or mutual information of a series over the lag, and the delay chosen.

    Attributes
    ----------
    delay : int or None
        The delay chosen, in values of the series; None where the rule finds none.
    rule : str
        The rule, in words.
    reason : str
        Why no delay was found; otherwise empty.
    curve : ndarray, shape (longest + 1,)
        Autocorrelation, or average mutual information [nat], at the lags 0, 1, ..., longest.
    level : float or None
        Level that the curve is compared with, where the rule has one.
    method : {"autocorrelation", "mutual information"}
        What the curve is.
    neighbors : int or None
        k of the mutual information.
    noise : float
        Standard deviation of the curve for independent values.

    See Also
    --------
    embedding_delay, plot.delay_choice

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import embedding_delay
    >>> found = embedding_delay(np.sin(np.arange(1000) * 2 * np.pi / 42), "zero")
    >>> found.delay
    11
    """

    delay: int | None
    rule: str
    reason: str
    curve: np.ndarray
    level: float | None
    method: Literal["autocorrelation", "mutual information"]
    neighbors: int | None
    noise: float

    def describe(self) -> str:
        """Describe the result in words."""
        if self.delay is None:
            return f"no delay by {self.method}: {self.reason}"
        return f"delay {self.delay} by {self.method} ({self.rule})"

    plot = drawn_by("delay_choice", "the curve and the choice")


def embedding_delay(
    x: Any,
    rule: Literal["minimum", "1/e", "zero"] = "minimum",
    *,
    longest: int | None = None,
    neighbors: int | None = None,
) -> DelayChoice:
    """Delay for the embedding of a sampled series.

    At the first minimum of the average mutual information [FraserSwinney1986]_, or where the
    autocorrelation first falls to 1/e, or to zero. For interspike intervals the natural delay is 1;
    this function is for sampled signals.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    rule : {"minimum", "1/e", "zero"}
        A minimum of the information, or the level at or below which the autocorrelation must be.
    longest : int, optional
        Longest lag; by default n/4, and for the information the lesser of n/10 and 200.
    neighbors : int, optional
        k of the estimator of the information; 4 by default.

    Returns
    -------
    DelayChoice

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, constant, or shorter than 16 values.

    See Also
    --------
    mutual_information, delay_embed, plot.delay_choice

    Notes
    -----
    The autocorrelation is ``C(k) = sum_i (x_i - mean)(x_{i+k} - mean) / (n - k) / variance``, over
    all n - k pairs (without pairs across a gap of the run).

    The mutual information I(k) is that of the pairs (x_i, x_{i+k}), as `mutual_information`
    estimates it, by nearest neighbours. At lag 0 it depends only on the number of values. A minimum
    is significant if the curve rises above it, before it falls lower, by more than six standard
    deviations of the information of independent values, about 1.25/sqrt(k n) for k neighbours. The
    search ends if the curve falls below six of these, or below 0.073, the information of Gaussian
    values with a correlation of 1/e; there is then no delay, with the reason in the result.

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import embedding_delay
    >>> found = embedding_delay(np.sin(np.arange(1000) * 2 * np.pi / 42), "zero")
    >>> found.delay  # the first beyond a quarter of the period
    11
    """
    choice("rule", rule, ("minimum", "1/e", "zero"))
    if rule == "minimum":
        k = NEIGHBORS if neighbors is None else whole("neighbors", neighbors, 1)
        return _by_information(x, longest, k)
    refuse("of the autocorrelation", 'Leave it out, or take rule="minimum"', neighbors=neighbors)
    return _by_autocorrelation(x, rule, longest)


def _by_autocorrelation(x: Any, rule: str, longest: int | None) -> DelayChoice:
    """Delay at which the autocorrelation first falls to a level."""
    values = varying(series(x, least=LEAST, gap=1))
    count = len(known(values))
    longest = _longest(longest, values, count // 4)
    from scipy.fft import irfft, next_fast_len, rfft

    centred = values - known(values).mean()
    centred /= np.nanmax(np.abs(centred))
    sums, pairs = np.zeros(longest + 1), np.zeros(longest + 1)
    for part in stretches(centred):
        size = next_fast_len(len(part) + longest, real=True)
        sums += irfft(np.abs(rfft(part, size)) ** 2, size)[: longest + 1]
        pairs += np.maximum(len(part) - np.arange(longest + 1), 0)
    curve = sums / pairs
    curve /= curve[0]
    level = math.exp(-1) if rule == "1/e" else 0.0
    below = np.flatnonzero(curve <= level)
    delay = int(below[0]) if len(below) else None
    words = "first lag at or below 1/e" if rule == "1/e" else "first lag at or below zero"
    reason = "" if len(below) else f"it stays above {level:.3g} up to lag {longest}"
    noise = 1 / math.sqrt(count)
    return DelayChoice(delay, words, reason, curve, level, "autocorrelation", None, noise)


def _by_information(x: Any, longest: int | None, neighbors: int) -> DelayChoice:
    """Delay at the first minimum of the average mutual information."""
    values = varying(series(x, least=max(LEAST, 4 * neighbors), gap=1))
    present = ~np.isnan(values)
    count = int(np.count_nonzero(present))
    longest = _longest(longest, values, min(count // 10, 200))
    scores = values.copy()
    scores[present] = scored(values[present], 0)
    curve = np.empty(longest + 1)
    for lag in range(longest + 1):
        together = unbroken(values, lag + 1)
        pairs = int(np.count_nonzero(together))
        if pairs <= neighbors:
            raise InvalidInput(
                "longest", longest, f"a lag with more than {neighbors} pairs between the same gaps"
            )
        curve[lag] = information(
            scores[: len(together)][together], scores[lag:][together], neighbors
        )
    noise = SCATTER / math.sqrt(neighbors * count)
    level = max(RISE * noise, NOTHING)
    gone = np.flatnonzero(curve <= level)
    searched = curve[: gone[0]] if len(gone) else curve
    delay = _first_minimum(searched, RISE * noise)
    reason = ""
    if delay is None:
        reason = f"it has no minimum up to lag {longest}"
        if len(gone):
            reason = f"it falls below {level:.2g} nat at lag {gone[0]} without a minimum"
    words = "first minimum"
    return DelayChoice(delay, words, reason, curve, level, "mutual information", neighbors, noise)


def _longest(longest: int | None, values: np.ndarray, default: int) -> int:
    """The longest lag; at most half of the values between gaps."""
    n = max(len(part) for part in stretches(values))
    if longest is None:
        return min(max(default, 1), max(n // 2, 1))
    longest = whole("longest", longest, 1)
    if longest > n // 2:
        raise InvalidInput("longest", longest, f"at most {n // 2}, half of {n} values in a row")
    return longest


def _first_minimum(curve: np.ndarray, rise: float) -> int | None:
    """Lag of the first minimum from which the curve rises by `rise` before falling lower."""
    lowest = 1
    for lag in range(2, len(curve)):
        if curve[lag] < curve[lowest]:
            lowest = lag
        elif curve[lag] > curve[lowest] + rise:
            return lowest
    return None
