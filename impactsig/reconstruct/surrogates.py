"""Surrogates: random series that share with the data all that a null hypothesis allows them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from .._arguments import Seed, streams, whole
from ..errors import InvalidInput
from ._arguments import varying
from ._series import known, series, stretches

Method = Literal["shuffled", "phase", "iaaft"]

NULL = {
    "shuffled": "values drawn independently",
    "phase": "a linear Gaussian process",
    "iaaft": "a linear Gaussian process seen through a monotone function",
}
"""What each kind of surrogate stands for."""

LABEL = {"shuffled": "shuffled", "phase": "phase-randomised", "iaaft": "IAAFT"}

LEAST = 10
MOST_DROPPED = 0.1  # of the series, to make its ends meet
MOST_ITERATIONS = 1000


@dataclass(frozen=True, eq=False, repr=False)
class Surrogates:
    """Surrogates of a series, and how like it they are. ``np.asarray`` gives the values.

    Attributes
    ----------
    values : ndarray, shape (count, n)
        A surrogate a row.
    original : ndarray, shape (n,)
        What they are surrogates of: the stretch of the series from `start` on.
    start : int
        Index of the first value of the stretch, in the series or, of a run with gaps, in its
        longest part.
    method : str
        "shuffled", "phase" or "iaaft".
    spectrum_error : ndarray, shape (count,)
        How far the amplitude spectrum |S_f| of each is from that of the original |X_f|, the mean
        left out: sqrt(sum (|S_f| - |X_f|)^2 / sum |X_f|^2).
    iterations : ndarray of int, shape (count,)
        Of IAAFT, until the order of the values no longer changed; 0 for the others.
    warnings : tuple of str
        Why the surrogates may differ from the data in more than the null hypothesis says.
    """

    values: np.ndarray
    original: np.ndarray
    start: int
    method: Method
    spectrum_error: np.ndarray
    iterations: np.ndarray
    warnings: tuple[str, ...] = ()

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """The values, shape (count, n)."""
        return np.array(self.values, dtype=dtype, copy=copy)

    def __len__(self) -> int:
        return len(self.values)

    def describe(self) -> str:
        """In words."""
        count, n = self.values.shape
        words = f"{count} {LABEL[self.method]} surrogates of {n} values ({NULL[self.method]})"
        if count:
            words += f", spectrum within {self.spectrum_error.max():.2g}"
        return "; ".join((words, *self.warnings))

    def __repr__(self) -> str:
        return f"Surrogates({self.describe()})"


def surrogates(
    x: Any,
    count: int = 1,
    method: Method = "iaaft",
    *,
    match_ends: bool = True,
    seed: Seed = None,
) -> Surrogates:
    """Random series that share with `x` what a null hypothesis says, and nothing else.

    - "shuffled": the values in random order. Null hypothesis: they are drawn independently.
    - "phase": the amplitude spectrum of `x`, with random phases [Theiler1992]_. Null hypothesis:
      a linear Gaussian process. The spectrum is kept to rounding, the distribution of the values
      becomes nearly Gaussian.
    - "iaaft": the values of `x`, all of them, in an order whose spectrum is that of `x` as nearly
      as the iteration gets [SchreiberSchmitz1996]_. Null hypothesis: a linear Gaussian process
      seen through a monotone function. From a random order on, in turn the amplitudes of the
      spectrum are set right and the values put into the order of what comes of it, until the
      order no longer changes; `spectrum_error` says how far the spectrum then still is.

    The Fourier transform takes the series for one turn of a loop: where its last value does not
    lead on to its first, the jump spreads over the spectrum and the surrogates are rougher than
    the data. So for the last two methods the longest stretch is taken whose jump from end to
    start, and whose change of slope there, are no greater than the median between neighbours; up
    to a tenth of the series is left out for that. Where no stretch does it, as in a drift, the
    best is taken and `warnings` says so [SchreiberSchmitz2000]_.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        Ten values or more; of impacts, their interspike intervals [s], where the run has gaps the
        longest stretch between two of them.
    count : int
        How many surrogates.
    method : {"shuffled", "phase", "iaaft"}
        Which kind.
    match_ends : bool
        False takes the whole series, whatever its ends.
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same surrogates, the first of them whatever `count` is; a
        Generator is drawn from and moves on.

    Raises
    ------
    InvalidInput
        If `x` is no series of ten finite numbers that are not all equal, or an argument is not of
        its kind.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.random.default_rng(1).standard_normal(200).cumsum()
    >>> found = surrogates(x, 5, "iaaft", seed=1)
    >>> bool(np.all(np.sort(found.values) == np.sort(found.original)))
    True
    """
    values, notes = longest_stretch(x)
    count = whole("count", count, 0)
    if method not in _MAKE:
        raise InvalidInput("method", method, 'one of "shuffled", "phase", "iaaft"')
    start, stop = 0, len(values)
    if match_ends and method != "shuffled":
        start, stop, rough = _matching_ends(values)
        notes = (*notes, *rough)
    original = values[start:stop].copy()
    amplitude = np.abs(np.fft.rfft(original))
    made = np.empty((count, len(original)))
    iterations = np.zeros(count, np.int64)
    for row, rng in enumerate(streams(seed, count)):
        made[row], iterations[row] = _MAKE[method](original, amplitude, rng)
    error = np.linalg.norm(np.abs(np.fft.rfft(made))[:, 1:] - amplitude[1:], axis=1)
    error /= np.linalg.norm(amplitude[1:])
    for array in (made, original, error, iterations):
        array.flags.writeable = False
    return Surrogates(made, original, start, method, error, iterations, notes)


def longest_stretch(x: Any) -> tuple[np.ndarray, tuple[str, ...]]:
    """The values between two gaps that are most, and how many were left; they are not constant.

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


def _shuffled(
    x: np.ndarray, amplitude: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, int]:
    return rng.permutation(x), 0


def _phase_randomised(
    x: np.ndarray, amplitude: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, int]:
    n = len(x)
    turn = np.exp(2j * np.pi * rng.random(len(amplitude)))
    if n % 2 == 0:  # the highest frequency of an even number of samples has no phase but a sign
        turn[-1] = 1.0 if turn[-1].real > 0 else -1.0
    spectrum = amplitude * turn
    spectrum[0] = n * x.mean()
    return np.fft.irfft(spectrum, n), 0


def _iaaft(
    x: np.ndarray, amplitude: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, int]:
    n = len(x)
    ranked = np.sort(x)
    made = rng.permutation(x)
    before = np.zeros(0, np.intp)
    iteration = 0
    while iteration < MOST_ITERATIONS:
        iteration += 1
        spectrum = np.fft.rfft(made)
        size = np.abs(spectrum)
        size[size == 0] = 1.0
        order = np.argsort(np.fft.irfft(spectrum * (amplitude / size), n), kind="stable")
        made[order] = ranked
        if np.array_equal(order, before):
            break
        before = order
    return made, iteration


_MAKE: dict[str, Callable[..., tuple[np.ndarray, int]]] = {
    "shuffled": _shuffled,
    "phase": _phase_randomised,
    "iaaft": _iaaft,
}


def _matching_ends(x: np.ndarray) -> tuple[int, int, tuple[str, ...]]:
    """Start and stop of the longest stretch that can be closed to a loop, and what is amiss."""
    step, bend = np.diff(x), np.diff(x, 2)
    # A series that rarely changes has a median step of 0, which no other could keep to.
    usual_step = max(float(np.median(np.abs(step))), 1e-3 * float(x.std()))
    usual_bend = max(float(np.median(np.abs(bend))), 1e-3 * float(x.std()))
    spare = int(MOST_DROPPED * len(x))
    best, least = (0, len(x)), np.inf
    for dropped in range(spare + 1):
        start = np.arange(dropped + 1)
        last = start + len(x) - dropped - 1
        jump = np.abs(x[start] - x[last]) / usual_step
        slip = np.abs(step[start] - step[last - 1]) / usual_bend
        mismatch = np.maximum(jump, slip)
        k = int(np.argmin(mismatch))
        if mismatch[k] < least:
            best, least = (k, int(last[k]) + 1), float(mismatch[k])
        if least <= 1:
            return *best, ()
    note = (
        f"the ends of the series do not meet (by {least:.2g} times what neighbours differ by): "
        "its surrogates are rougher than it; remove a drift first"
    )
    return *best, ((note,) if least > 2 else ())
