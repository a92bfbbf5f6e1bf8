"""Pairs of impacts of two trains, and the precision and recall of a detector."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ._arguments import instance, number
from ._showing import Shown
from .impacts import Impacts


@dataclass(frozen=True, eq=False)
class Matching(Shown):
    """Pairs of detected and true impacts, with precision, recall and timing errors.

    Attributes
    ----------
    pairs : numpy.ndarray of int, shape (n, 2)
        Indices of each detected impact and of the matching true one, in order of time.
    spurious : numpy.ndarray of int
        Indices of detected impacts that match no true one.
    missed : numpy.ndarray of int
        Indices of true impacts that were not found.
    error : numpy.ndarray, shape (n,)
        Time of the detected impact minus that of the true one and minus the delay, for each pair
        [s].
    delay : float
        Delay that was subtracted from the detected instants [s].
    within : float
        Greatest difference of the two instants of a pair [s].

    See Also
    --------
    match_impacts, results.Alignment

    Examples
    --------
    >>> from impactsig import Impacts, match_impacts
    >>> truth = Impacts.from_times([1.0, 2.0, 3.0])
    >>> found = match_impacts(Impacts.from_times([1.0001, 2.5, 3.0001]), truth)
    >>> found.pairs, found.spurious, found.missed
    (array([[0, 0],
           [2, 2]]), array([1]), array([1]))
    """

    pairs: np.ndarray = field(repr=False)
    spurious: np.ndarray = field(repr=False)
    missed: np.ndarray = field(repr=False)
    error: np.ndarray = field(repr=False)
    delay: float
    within: float

    @property
    def precision(self) -> float:
        """Share of the detected impacts that are true; NaN if none were detected."""
        return _share(len(self.pairs), len(self.spurious))

    @property
    def recall(self) -> float:
        """Share of the true impacts that were detected; NaN if there are none."""
        return _share(len(self.pairs), len(self.missed))

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; NaN where both trains are empty."""
        return _share(2 * len(self.pairs), len(self.spurious) + len(self.missed))

    @property
    def rms(self) -> float:
        """Root of the mean square of the errors [s]; NaN where there are no pairs."""
        return float(np.sqrt(np.mean(self.error**2))) if len(self.error) else math.nan

    def describe(self) -> str:
        """Describe the result in one line of words."""
        words = (
            f"{len(self.pairs)} of {len(self.pairs) + len(self.missed)} impacts found, "
            f"{len(self.spurious)} spurious; F1 {self.f1:.4f} within {1e3 * self.within:g} ms"
        )
        if len(self.pairs):
            words += f", {1e6 * self.rms:.3g} µs RMS"
        return words


def match_impacts(
    found: Impacts, truth: Impacts, within: float = 1e-3, *, delay: float | None = 0.0
) -> Matching:
    """Pair detected impacts with true ones.

    Among all sets of disjoint pairs that differ by at most `within`, the one with the greatest sum
    of ``within - |error|`` is taken: the optimal assignment in which an unmatched impact costs half
    of `within` [Rahmathullah2017]_.

    Parameters
    ----------
    found, truth : Impacts
        The detected and the true impacts.
    within : float
        How far apart two of a pair may be [s].
    delay : float, optional
        Delay of all detected impacts [s], such as the travel time of sound to a microphone. None
        estimates it as the median error of the pairs, iterating until the pairs do not change; it
        must be less than `within`. Use `align_impacts` if it may be larger or the clocks differ.

    Returns
    -------
    Matching

    Raises
    ------
    InvalidInput
        If a train is not Impacts, or a number is out of range.

    See Also
    --------
    align_impacts, compare

    Examples
    --------
    >>> from impactsig import Impacts, match_impacts
    >>> truth = Impacts.from_times([1.0, 2.0, 3.0])
    >>> print(match_impacts(Impacts.from_times([1.0001, 2.5, 3.0001]), truth))
    2 of 3 impacts found, 1 spurious; F1 0.6667 within 1 ms, 100 µs RMS
    """
    for name, train in (("found", found), ("truth", truth)):
        instance(name, train, Impacts, "Impacts", "Impacts.from_times makes them from instants")
    within = number("within", within, above=0)
    late = 0.0 if delay is None else number("delay", delay)
    from ._numerics.assignment_kernels import assign

    pairs = assign(found.time - late, truth.time, within)
    while delay is None and len(pairs):
        late = float(np.median(found.time[pairs[:, 0]] - truth.time[pairs[:, 1]]))
        again = assign(found.time - late, truth.time, within)
        if len(again) <= len(pairs):  # it may go back and forth between as many
            pairs = again
            break
        pairs = again
    return Matching(
        pairs=pairs,
        spurious=np.setdiff1d(np.arange(len(found)), pairs[:, 0]),
        missed=np.setdiff1d(np.arange(len(truth)), pairs[:, 1]),
        error=found.time[pairs[:, 0]] - late - truth.time[pairs[:, 1]],
        delay=late,
        within=within,
    )


def _share(part: int, rest: int) -> float:
    return part / (part + rest) if part + rest else math.nan
