"""The motion through a run: probabilities over time, and instants of change."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from .._arguments import instance, number, whole
from .._showing import Shown, drawn_by
from ..errors import InvalidInput
from ..impacts import Impacts
from .forcing import Forcing
from .period import forcing_clock, identify_period
from .periodicity import LEAST_IMPACTS, Periodicity
from .phases.locking import lock
from .phases.reading import Clock
from .phases.slots import poisson_score
from .phases.tracking import best_path
from .phases.verdict import KINDS

OVERLAPPING = 4  # windows that an impact is in
CHANGE = 5.0  # log-odds against a change from one window to the next
UNLIKELY = -8.0  # least log-odds of a period in a window
CERTAIN = 1e-12  # least probability of none
UNSUPPORTED = -50.0  # log-evidence of a period that was not found in a part
STEPS = 12  # places at which a change is looked for, first far apart, then near each other


@dataclass(frozen=True)
class Stretch:
    """A part of the run with one motion.

    Attributes
    ----------
    start, stop : float
        [s].
    period : Periodicity
        What `identify_period` says of its impacts.
    """

    start: float
    stop: float
    period: Periodicity


@dataclass(frozen=True, eq=False, repr=False)
class PeriodTrack(Shown):
    """Kind of motion through a run: probabilities over time, and instants of change.

    Attributes
    ----------
    time : ndarray, shape (k,)
        Middles of the windows [s].
    windows : tuple of Periodicity
        Result of `identify_period` for each window.
    probability : ndarray, shape (k, 6)
        Of "periodic", "drifting", "quasi-periodic", "banded", "chaotic" and "irregular", in this
        order (`kinds`), in each window.
    changes : ndarray
        Instants at which the motion changes to another period, or loses it [s].
    stretches : tuple of Stretch
        The parts of the run between them.

    See Also
    --------
    track_period, results.Periodicity, plot.period_track

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, track_period
    >>> found = track_period(Impacts.from_times(0.05 * np.arange(120)), 0.05, max_periods=2)
    >>> len(found.changes), found.stretches[0].period.name
    (0, 'period(1,1)')
    """

    time: np.ndarray
    windows: tuple[Periodicity, ...]
    probability: np.ndarray
    changes: np.ndarray
    stretches: tuple[Stretch, ...]
    kinds = KINDS

    def describe(self) -> str:
        """Describe the result in words, a line for each stretch."""
        return "\n".join(
            f"{one.start:.4g} to {one.stop:.4g} s: {one.period.describe()}"
            for one in self.stretches
        )

    def __repr__(self) -> str:
        return f"PeriodTrack({len(self.stretches)} stretches, {len(self.windows)} windows)"

    plot = drawn_by("period_track", "the probabilities over time")


def track_period(
    impacts: Impacts,
    forcing_period: float | None = None,
    *,
    forcing: Forcing | None = None,
    window: int = 60,
    max_periods: int = 8,
    resolution: float = 1e-3,
) -> PeriodTrack:
    """Track the motion through a run: probabilities of periods over time, and changes.

    `identify_period` is applied to windows that overlap by three quarters. Viterbi's algorithm
    finds the most probable sequence of periods, where a change has the probability exp(-5). Each
    change is then placed where the periods before and after it explain the impacts best, and each
    stretch between changes is identified again. Successive stretches with the same motion are
    joined.

    Parameters
    ----------
    impacts : Impacts
        The train.
    forcing_period, forcing, max_periods, resolution
        As for `identify_period`; one of the first two is needed.
    window : int
        Number of impacts in a window. A motion that lasts for fewer impacts is not detected.

    Returns
    -------
    PeriodTrack
        Probabilities of the kinds in each window, shape (k, 6), the instants of `changes` [s] and
        the `stretches` between them.

    Raises
    ------
    InvalidInput
        If there are fewer impacts than `window`, `window` is less than 20, no forcing is given, or
        an argument is refused by `identify_period`.

    See Also
    --------
    identify_period, plot.period_track

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, track_period
    >>> turns = np.arange(150.0)
    >>> turns[75::2] += 0.2
    >>> found = track_period(Impacts.from_times(0.05 * turns), 0.05, max_periods=2)
    >>> found.stretches[0].period.name, found.stretches[-1].period.name
    ('period(1,1)', 'period(2,2)')
    """
    return track(impacts, forcing_period, forcing, window, max_periods, resolution)


def track(
    impacts: Impacts,
    forcing_period: float | None = None,
    forcing: Forcing | None = None,
    window: int = 60,
    max_periods: int = 8,
    resolution: float = 1e-3,
    *,
    steady: bool = True,
) -> PeriodTrack:
    """As `track_period`; unless `steady`, a stretch has the motion of its windows.

    In a sweep the phases of a periodic motion drift with the frequency, by more over a stretch than
    over a window, so that the stretch as a whole does not recur.
    """
    window = whole("window", window, 20)
    instance("impacts", impacts, Impacts, "Impacts")
    if forcing is None and forcing_period is None:
        raise InvalidInput(
            "forcing_period", None, "the forcing period [s]", "Or give the channel of the forcing"
        )
    if forcing_period is not None:
        forcing_period = number("forcing_period", forcing_period, "a positive time [s]", above=0)
    if len(impacts) < window:
        raise InvalidInput("impacts", f"{len(impacts)} impacts", f"{window} or more, a window")

    def asked(first: int, last: int) -> Periodicity:
        return identify_period(
            impacts[first:last],
            forcing_period,
            forcing=forcing,
            max_periods=max_periods,
            resolution=resolution,
        )

    stride = window // OVERLAPPING
    first = np.arange(0, len(impacts) - window + 1, stride)
    windows = tuple(asked(int(one), int(one) + window) for one in first)
    states = sorted({_orbit(one) for one in windows}, key=str)
    odds = np.array([[_log_odds(one, state) for state in states] for one in windows])
    # windows overlap: each impact counts once
    path = best_path(odds * stride / window, CHANGE * (1 - np.eye(len(states))))
    path = _without_straddling(path, [k for k, one in enumerate(states) if one[0] is None])
    clock = forcing_clock(impacts, forcing_period, forcing)
    assert clock is not None
    edges = [0]
    for k in np.flatnonzero(np.diff(path)):
        low = max(int(first[k]) + window // 4, edges[-1] + LEAST_IMPACTS)
        high = min(int(first[k + 1]) + 3 * window // 4, len(impacts) - LEAST_IMPACTS)
        pair = states[path[k]], states[path[k + 1]]
        edges.append(_place(clock, low, max(high, low + 1), window, pair, resolution))
    edges.append(len(impacts))
    parts = [asked(*both) for both in itertools.pairwise(edges)]
    # what shows a period in windows, as chaos near one does, may show none in the whole
    while steady and (
        alike := [k for k in range(1, len(parts)) if _orbit(parts[k]) == _orbit(parts[k - 1])]
    ):
        del edges[alike[0]]
        parts[alike[0] - 1 : alike[0] + 1] = [asked(*edges[alike[0] - 1 : alike[0] + 1])]
    time = impacts.time
    changes = np.array([0.5 * (time[one - 1] + time[one]) for one in edges[1:-1]])
    bounds = [float(time[0]), *changes.tolist(), float(time[-1])]
    stretches = tuple(
        Stretch(*both, part) for both, part in zip(itertools.pairwise(bounds), parts, strict=True)
    )
    # a window across a change shows neither motion: what is beyond is cut off
    spans = [_within(edges, int(one), int(one) + window) for one in first]
    windows = tuple(
        found if span == (one, one + window) else asked(*span)
        for one, span, found in zip(first.tolist(), spans, windows, strict=True)
    )
    middle = np.array([0.5 * (time[low] + time[high - 1]) for low, high in spans])
    probability = np.array([[one.probability[kind] for kind in KINDS] for one in windows])
    return PeriodTrack(middle, windows, probability, changes, stretches)


def _within(edges: list[int], first: int, last: int) -> tuple[int, int]:
    """The part of a window within the stretch of its middle."""
    k = int(np.searchsorted(edges, (first + last) // 2, side="right"))
    return max(first, edges[k - 1]), min(last, edges[k])


Orbit = tuple[int | None, int | None]


def _orbit(found: Periodicity) -> Orbit:
    return found.impacts, found.periods


def _log_odds(found: Periodicity, state: Orbit) -> float:
    """Log-odds of a period in a window against none.

    Of slots that fall short of a period, as those of chaos do, the score counts for nothing: it
    says how much better they are than impacts at random, not that impacts keep to them.
    """
    if state[0] is None:
        return 0.0
    alike = [
        candidate.probability
        for candidate in found.candidates
        if (candidate.impacts, candidate.periods) == state
    ]
    none = max(1 - sum(candidate.probability for candidate in found.candidates), CERTAIN)
    return float(np.log(max([*alike, none * np.exp(UNLIKELY)]) / none))


def _without_straddling(path: np.ndarray, none: list[int]) -> np.ndarray:
    """Remove a loss of the period that only windows across a change seem to show.

    A window across a change shows neither of the motions, and fewer than four in a row overlap.
    """
    path = path.copy()
    bounds = np.concatenate(([0], np.flatnonzero(np.diff(path)) + 1, [len(path)])).tolist()
    for low, high in itertools.pairwise(bounds[1:-1]):
        if path[low] in none and high - low < OVERLAPPING:
            middle = (low + high) // 2
            path[low:middle], path[middle:high] = path[low - 1], path[high]
    return path


def _place(
    clock: Clock, low: int, high: int, window: int, pair: tuple[Orbit, Orbit], resolution: float
) -> int:
    """First impact after a change of the motion, located coarsely and then finely."""
    # the same impacts for every place: each adds evidence to the one or the other
    start, stop = max(low - window // 2, 0), high + window // 2
    while True:
        step = max((high - low) // STEPS, 1)
        places = np.arange(low, high, step)
        gains = [
            _evidence_of(clock, start, at, pair[0], resolution)
            + _evidence_of(clock, at, stop, pair[1], resolution)
            for at in places.tolist()
        ]
        best = int(places[int(np.argmax(gains))])
        if step == 1:
            return best
        low, high = max(best - step, low), min(best + step + 1, high)


def _evidence_of(clock: Clock, first: int, last: int, state: Orbit, resolution: float) -> float:
    """Log-evidence of a period in a part of the train, over that of impacts at random."""
    if state[1] is None:
        return 0.0
    cycles = clock.cycles[first:last]
    part = Clock(cycles - cycles[0], clock.gaps - cycles[0], clock.unit, clock.steady)
    locks = lock(part.warps, part.gaps, [state[1]], resolution, steady=part.steady)
    scores = [one.score for one in locks if len(one.fit.centre) == state[0]]
    return max([*scores, UNSUPPORTED]) - poisson_score(len(cycles), max(part.cycles[-1], 1e-9))
