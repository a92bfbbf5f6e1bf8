"""One clock for two recordings of the same machine: alignment by their impacts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ._arguments import flag, instance, number
from ._numerics.spread import DEVIATION_BY_MEDIAN
from ._showing import Shown
from .errors import InvalidInput
from .impacts import Impacts

SKEW = 2e-4
"""Greatest relative difference of two clocks that the search allows for."""
SEGMENT = 200
"""Impacts, at most, that the search lays beside the other train at once."""
SEGMENTS = 8
FEWEST = 6
"""Impacts that pairs are looked for with."""
SHARE = 0.5
"""Of the impacts of a segment: fewer pairs are chance."""
CHANCE = 0.01
"""Delays that chance alone may give as many pairs at; more, and the pairs prove nothing."""
ALIKE = 0.9
"""Of the pairs: another delay with as many is as good."""
SHARPER = 1.5
"""Times as much that pairs at another delay scatter: the delay is another one."""
SURELY = 10.0
"""Log-likelihood by which they must do so."""
TRIM = 4.0
"""Robust standard deviations beyond which a pair is not one."""


@dataclass(frozen=True, eq=False)
class Alignment(Shown):
    """Impacts in the clock of another recording.

    An instant `t` of the reference is ``delay + (1 + skew) t`` in the clock of the aligned train.

    Attributes
    ----------
    impacts : Impacts
        The aligned train, in the clock of the reference.
    delay, delay_error : float
        Delay at time 0 of the reference, and its standard error [s].
    skew, skew_error : float
        Relative rate error of the clock, positive if it runs fast, and its standard error; 1e-6 is
        1 ppm.
    pairs : ndarray of int, shape (n, 2)
        Indices of each aligned impact and of the same impact in the reference.
    error : ndarray, shape (n,)
        Time of the aligned impact minus that of the reference, for each pair [s].

    See Also
    --------
    align_impacts, results.Combination

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, align_impacts
    >>> times = np.cumsum(np.random.default_rng(1).uniform(0.03, 0.06, 100))
    >>> found = align_impacts(Impacts.from_times(times + 2.5), Impacts.from_times(times))
    >>> round(found.delay, 6), len(found.pairs)
    (2.5, 100)
    """

    impacts: Impacts = field(repr=False)
    delay: float
    delay_error: float
    skew: float
    skew_error: float
    pairs: np.ndarray = field(repr=False)
    error: np.ndarray = field(repr=False)

    def __str__(self) -> str:
        return (
            f"{len(self.pairs)} impacts in common; delay {self.delay:.9g} ± {self.delay_error:.1g} "
            f"s, skew {1e6 * self.skew:.3f} ± {1e6 * self.skew_error:.1g} ppm"
        )


class _Line(NamedTuple):
    """``time = offset + slope (reference - centre)``, with standard errors."""

    centre: float
    offset: float
    slope: float
    offset_error: float
    slope_error: float

    def at(self, time: np.ndarray) -> np.ndarray:
        """Convert instants of the reference to the other clock."""
        return self.offset + self.slope * (time - self.centre)

    def back(self, time: np.ndarray) -> np.ndarray:
        """Convert instants of the other clock to that of the reference."""
        return self.centre + (time - self.offset) / self.slope


def align_impacts(
    impacts: Impacts,
    reference: Impacts,
    within: float = 1e-3,
    *,
    longest_delay: float | None = None,
    skew: bool = True,
) -> Alignment:
    """Estimate offset and drift between the clocks of two recordings from their common impacts.

    A few successive impacts are compared with the whole other train, and the delay with the most
    matches is taken; if several delays match as many impacts, as in nearly periodic trains, the one
    with the smallest differences, if it is clearly best. Starting there, pairs are formed
    (`match_impacts`) and a straight line is fitted to them, over a span that is doubled until it
    contains both trains. Pairs that deviate from the line by more than four robust standard
    deviations are excluded.

    Parameters
    ----------
    impacts, reference : Impacts
        Two trains of the same machine. Each may lack impacts, and have additional ones.
    within : float
        Greatest deviation of a pair from the line [s].
    longest_delay : float, optional
        Greatest delay in either direction [s]; by default any for which the trains overlap.
    skew : bool
        Whether the rates of the clocks may differ, by up to 200 ppm. Set to False for two channels
        of one instrument.

    Returns
    -------
    Alignment

    Raises
    ------
    InvalidInput
        If the trains have too few impacts in common, or are periodic, so that several delays match
        equally well.

    See Also
    --------
    match_impacts, combine_impacts, results.Alignment

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, align_impacts
    >>> rng = np.random.default_rng(1)
    >>> reference = Impacts.from_times(np.cumsum(rng.uniform(0.03, 0.06, 500)))
    >>> clock = 2.5 + (1 + 5e-5) * reference.time
    >>> found = align_impacts(Impacts.from_times(clock + rng.normal(0, 2e-5, 500)), reference)
    >>> len(found.pairs), round(found.delay, 4), round(found.skew, 6)
    (500, 2.5, 5e-05)
    """
    for name, train in (("impacts", impacts), ("reference", reference)):
        instance(name, train, Impacts, "Impacts", "Impacts.from_times makes them from instants")
        if len(train) < FEWEST:
            raise InvalidInput(
                name, f"{len(train)} impacts", f"{FEWEST} or more", "Fewer fit at any delay"
            )
    within, skew = number("within", within, above=0), flag("skew", skew)
    most = math.inf
    if longest_delay is not None:
        most = number("longest_delay", longest_delay, above=0)
    a, b = impacts.time, reference.time
    begin, end, delay = _coarse(a, b, within, most, skew)
    line = _follow(a, b, _Line(0.0, delay, 1.0, 0.0, 0.0), begin, end, within, skew)
    pairs, error, line = _fit(a, b, line, within, skew)
    start = float(line.back(np.array(impacts.start)))
    aligned = replace(
        impacts,
        time=line.back(a),
        start=start,
        duration=impacts.duration / line.slope,
        gaps=line.back(impacts.gaps),
    )
    mean_error = math.hypot(line.offset_error, line.centre * line.slope_error)
    return Alignment(
        aligned,
        float(line.at(np.array(0.0))),
        mean_error,
        line.slope - 1.0,
        line.slope_error,
        pairs,
        error,
    )


def _coarse(
    a: np.ndarray, b: np.ndarray, within: float, most: float, skew: bool
) -> tuple[float, float, float]:
    """The delay at which most impacts of a segment pair, and the segment."""
    long = within / (2 * SKEW) if skew else math.inf
    best = (0, 0.0, 0.0, 0.0)
    rivals: list[float] = []
    for first in np.unique(np.linspace(0, len(a) - FEWEST, SEGMENTS).astype(int)):
        last = min(first + SEGMENT, int(np.searchsorted(a, a[first] + long)), len(a))
        if last - first < FEWEST:
            last = first + FEWEST
        count, delays = _votes(a[first:last], b, within, most)
        chance = _by_chance(count, last - first, b, within, min(most, a[-1] - a[0] + b[-1] - b[0]))
        if count >= SHARE * (last - first) and count > best[0] and chance < CHANCE:
            rivals = _sharpest(a[first:last], b, within, delays, skew)
            best = (count, float(a[first]), float(a[last - 1]), rivals[0])
    if not best[0]:
        raise InvalidInput(
            "impacts",
            f"{len(a)} and {len(b)} impacts",
            f"impacts that both trains hold, within {1e3 * within:g} ms at one delay",
            "Give a greater `within`, or check that the recordings overlap",
        )
    if len(rivals) > 1:
        raise InvalidInput(
            "longest_delay",
            None if math.isinf(most) else most,
            "a bound that determines a single delay, since the trains are periodic",
            f"Delays of {rivals[0]:.6g} and {rivals[1]:.6g} s match equally many impacts",
        )
    return best[1], best[2], best[3]


def _by_chance(count: int, of: int, b: np.ndarray, within: float, span: float) -> float:
    """Expected number of delays with as many pairs in two unrelated trains."""
    from scipy.special import pdtrc

    density = len(b) / max(float(b[-1] - b[0]), within)
    return span / within * float(pdtrc(count - 1, of * density * 2 * within))


def _votes(part: np.ndarray, b: np.ndarray, within: float, most: float) -> tuple[int, np.ndarray]:
    """Greatest number of pairs at one delay, and all delays with nearly as many."""
    spread = [one - b[np.abs(one - b) <= most] for one in part]
    difference = np.sort(np.concatenate(spread))
    if not len(difference):
        return 0, difference
    count = np.searchsorted(difference, difference + 2 * within, side="right")
    count -= np.arange(len(difference))
    top = min(int(count.max()), len(part))
    at = np.flatnonzero(count >= max(ALIKE * top, 2))
    peaks: list[tuple[int, float]] = []
    for group in np.split(at, np.flatnonzero(np.diff(difference[at]) > 2 * within) + 1):
        if len(group):
            k = group[np.argmax(count[group])]
            peaks.append((int(count[k]), float(np.median(difference[k : k + count[k]]))))
    peaks.sort(reverse=True)
    return top, np.array([delay for _, delay in peaks])


def _sharpest(
    part: np.ndarray, b: np.ndarray, within: float, delays: np.ndarray, skew: bool
) -> list[float]:
    """The delays less those at which partners scatter clearly more than at another one.

    A train of nearly equal intervals has a partner for most at any whole number of them, but those
    that are one impact agree to their errors, others to what the intervals vary by.
    """
    if len(delays) == 1:
        return [float(delays[0])]
    spread, number = np.empty(len(delays)), np.empty(len(delays))
    for k, delay in enumerate(delays):
        at = part - delay
        after = np.clip(np.searchsorted(b, at), 1, len(b) - 1)
        error = at - b[after - (at - b[after - 1] < b[after] - at)]
        near = np.abs(error) <= within * (1.0 + 1e-6)  # a pair at either end is one of a delay
        x, error = at[near] - at[near].mean(), error[near] - error[near].mean()
        if skew:
            error = error - x * float(x @ error) / max(float(x @ x), 1e-300)
        off = np.abs(error - np.median(error))
        spread[k], number[k] = max(float(np.median(off)), 1e-12), len(off)
    more = spread / spread.min()
    worse = (more > SHARPER) & (number * np.log(more) > SURELY)
    return [float(one) for one in delays[~worse]]


def _follow(
    a: np.ndarray, b: np.ndarray, line: _Line, begin: float, end: float, within: float, skew: bool
) -> _Line:
    """Fit the line to pairs in a span that doubles until it covers the train."""
    while True:
        inside = a[(a >= begin) & (a <= end)]
        _, _, line = _fit(inside, b, line, within, skew)
        if begin <= a[0] and end >= a[-1]:
            return line
        half = max(0.5 * (end - begin), within)
        begin, end = begin - half, end + half


def _fit(
    a: np.ndarray, b: np.ndarray, line: _Line, within: float, skew: bool
) -> tuple[np.ndarray, np.ndarray, _Line]:
    """Pairs within reach of a line, their delays, and the line fitted to them."""
    from ._numerics.assignment_kernels import assign

    pairs = assign(a, line.at(b), within)
    error = a[pairs[:, 0]] - line.at(b[pairs[:, 1]])
    if len(error):
        off = np.abs(error - np.median(error))
        spread = DEVIATION_BY_MEDIAN * float(np.median(off))
        pairs = pairs[off <= max(TRIM * spread, 1e-12)]
    if len(pairs) < 3:
        raise InvalidInput("impacts", f"{len(pairs)} pairs", "impacts that both trains hold")
    x, y = b[pairs[:, 1]], a[pairs[:, 0]]
    centre = float(x.mean())
    x = x - centre
    offset, slope = float(y.mean()), line.slope
    if skew:
        slope = 1.0 + float(x @ (y - offset - x)) / float(x @ x)
    error = y - offset - slope * x
    deviation = math.sqrt(float(error @ error) / (len(x) - 1 - skew))
    slope_error = deviation / math.sqrt(float(x @ x)) if skew else 0.0
    return pairs, error, _Line(centre, offset, slope, deviation / math.sqrt(len(x)), slope_error)
