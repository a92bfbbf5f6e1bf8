"""What period a train of impacts has: period(m, n), or none."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..errors import InvalidInput
from ..impacts import Impacts
from ._phase import to_cycles
from ._slots import SlotFit, fit_slots, poisson_score

Kind = Literal["periodic", "unlocked", "aperiodic", "intermittent", "too few impacts"]

LEAST_IMPACTS = 8
LEAST_REPEATS = 4
LEAST_SHARE = 0.8  # of the impacts a period predicts that must come, and of those that come
LEAST_SLOT_SHARE = 0.7  # of the times that one of the m impacts is due it must come
LEAST_CHANCE = 1e-3  # of the other impacts coming at random
WIDEST_FORCED = 0.03  # jitter [forcing periods] beyond which a phase is no phase
WIDEST_FREE = 0.045  # the same in mean intervals, where no forcing period is given
CLOCK_ERROR = 2e-3  # relative, of the forcing period given against the clock of the recording
MOST_FREE = 8  # impacts in a repeat period sought without a forcing period


@dataclass(frozen=True)
class Candidate:
    """One period that was tried.

    Attributes
    ----------
    impacts : int
        m, the impacts that recur.
    periods : int or None
        n, the forcing periods in which they do; None where the forcing period is not known.
    repeat_period : float
        The time in which they recur [s].
    score : float
        Gain in log-likelihood over impacts at random instants, less half the penalty of the
        Bayesian information criterion.
    missed, spurious, jitter : float
        As in `Periodicity`, were this the period.
    probability : float
        That this is the period, among the candidates and none.
    """

    impacts: int
    periods: int | None
    repeat_period: float
    score: float
    missed: float
    spurious: float
    jitter: float
    probability: float


@dataclass(frozen=True, eq=False)
class Periodicity:
    """What `identify_period` found, and on what evidence.

    Attributes
    ----------
    impacts, periods : int or None
        m and n of period(m, n): m impacts in n forcing periods. `periods` is None where the
        forcing period is not known or the repeat period is no multiple of it; both are None where
        there is no period.
    kind : str
        "periodic"; "unlocked" (periodic, but not in multiples of the forcing period given);
        "aperiodic"; "intermittent" (aperiodic, with long silent stretches, as near grazing);
        "too few impacts".
    confidence : float
        Probability of that answer under the models compared, 0 to 1; 0 for "too few impacts".
    count : int
        Impacts looked at.
    forcing_period : float or None
        The forcing period [s] in the clock of the recording, refined from the one given.
    repeat_period : float or None
        The time after which the motion recurs [s].
    phases : ndarray, shape (m,)
        When in the repeat period the impacts come, as shares of it, the first at 0.
    jitter : float or None
        Standard deviation of the impacts about their phases [s].
    missed, spurious : float or None
        Share of the impacts due that did not come; share of the impacts that were not due.
    longest_silence : float
        The longest interval [s].
    candidates : tuple of Candidate
        The periods that were tried.
    """

    impacts: int | None
    periods: int | None
    kind: Kind
    confidence: float
    count: int
    forcing_period: float | None = None
    repeat_period: float | None = None
    phases: np.ndarray = field(default_factory=lambda: np.empty(0))
    jitter: float | None = None
    missed: float | None = None
    spurious: float | None = None
    longest_silence: float = 0.0
    candidates: tuple[Candidate, ...] = ()

    @property
    def aperiodic(self) -> bool:
        """Whether the impacts were enough to tell, and do not recur."""
        return self.kind in ("aperiodic", "intermittent")

    def describe(self) -> str:
        """The answer in words."""
        if self.kind == "too few impacts":
            return f"period unknown: {self.count} impacts, {LEAST_IMPACTS} or more are needed"
        if self.kind == "aperiodic":
            return "aperiodic: the impacts do not recur"
        if self.kind == "intermittent":
            return (
                "aperiodic: impacting alternates with silence, "
                f"intermittently, of up to {self.longest_silence:.3g} s"
            )
        assert self.impacts is not None
        assert self.repeat_period is not None
        number = f"{self.impacts} impact{'s' if self.impacts > 1 else ''}"
        if self.periods is not None:
            span = "per forcing period"
            if self.periods > 1:
                span = f"in {self.periods} forcing periods"
            return f"period({self.impacts},{self.periods}): {number} {span}"
        words = f"periodic: {number} every {_milliseconds(self.repeat_period)}"
        if self.kind == "periodic":
            return f"{words} (forcing period not given)"
        assert self.forcing_period is not None
        ratio = self.repeat_period / self.forcing_period
        return f"{words}, which is {ratio:.4g} forcing periods: check the forcing frequency"

    def __str__(self) -> str:
        return self.describe()


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.4g} ms"


def identify_period(
    impacts: Impacts,
    forcing_period: float | None = None,
    *,
    max_periods: int = 8,
    resolution: float = 1e-3,
) -> Periodicity:
    """Tell whether impacts recur, and how: m impacts in n forcing periods, or never.

    The instants are counted in forcing periods, whose length is refined within 0.2 % and whose
    phase is followed through the run, so that neither a clock that is off nor one that drifts
    matters. For n = 1, 2, ... the run is folded with n periods, and the impacts are explained as
    hits of m slots of the fold, normally distributed about them, each slot missing some of its
    hits and others being spurious. The Bayesian information criterion chooses n. It is a period
    only if 80 % of the impacts due came, 80 % of those that came were due, and they scatter by
    less than 3 % of the forcing period; the probability of that, given the numbers seen, enters
    the confidence. Chaos near grazing fails here: its impacts gather about a phase, but whether one
    comes cannot be told.

    Parameters
    ----------
    impacts : Impacts
        Eight or more; impacts due in gaps of the run are not missed.
    forcing_period : float, optional
        Period of the forcing [s], right to 0.1 %. Without it (m, n) cannot be told, since any
        number of forcing periods may pass in a repeat: then m impacts in the shortest time after
        which they recur, `repeat_period`, are sought (m up to 8, jitter below 4.5 % of the mean
        interval), and `periods` is None.
    max_periods : int
        Greatest n tried. Longer repeats of up to 8 impacts are found as well.
    resolution : float
        Share of the forcing period (without one, of the mean interval); instants that differ by
        less are taken to be the same. Keeps a hum on the signal from passing for a doubled period.

    Raises
    ------
    InvalidInput
        If `forcing_period`, `max_periods` or `resolution` is not positive.

    Notes
    -----
    Too few impacts, and none, give an answer that says so, not an error.

    Examples
    --------
    >>> import numpy as np
    >>> train = Impacts.from_times(0.1 * np.arange(60) + 0.03 * (np.arange(60) % 2))
    >>> print(identify_period(train, forcing_period=0.1))
    period(2,2): 2 impacts in 2 forcing periods
    """
    if forcing_period is not None and not (np.isfinite(forcing_period) and forcing_period > 0):
        raise InvalidInput("forcing_period", forcing_period, "a positive time [s]")
    if not isinstance(max_periods, (int, np.integer)) or max_periods < 1:
        raise InvalidInput("max_periods", max_periods, "a positive whole number")
    if not 0 < resolution < WIDEST_FORCED:
        raise InvalidInput("resolution", resolution, f"a share from 0 to {WIDEST_FORCED}")
    time = impacts.time
    silence = float(impacts.intervals().max(initial=0.0))
    if len(time) < LEAST_IMPACTS or time[-1] == time[0]:
        return Periodicity(
            None, None, "too few impacts", 0.0, len(time), forcing_period, longest_silence=silence
        )
    fits: list[tuple[SlotFit, float, int | None]] = []  # slots, base period [s], n
    base = forcing_period
    if forcing_period is not None:
        cycles, base = to_cycles(time, forcing_period, CLOCK_ERROR)
        gaps = np.interp(impacts.gaps, time, cycles)
        for n in range(1, max_periods + 1):
            if cycles[-1] - cycles[0] >= LEAST_REPEATS * n:
                fit = fit_slots(cycles, n, gaps, resolution, WIDEST_FORCED)
                fits.append((fit, base, n))
    chosen, candidates = _weigh(fits, time, WIDEST_FORCED)
    if chosen is None:
        free = _free_fits(impacts, resolution)
        best, tried = _weigh(free, time, WIDEST_FREE)
        candidates += tried
        fits += free
        chosen = None if best is None else len(fits) - len(free) + best
    if chosen is None:
        return Periodicity(
            None,
            None,
            "intermittent" if _is_intermittent(impacts.intervals()) else "aperiodic",
            1.0 - max((c.probability for c in candidates), default=0.0),
            len(time),
            base,
            longest_silence=silence,
            candidates=candidates,
        )
    fit, _, periods = fits[chosen]
    winner = candidates[chosen]
    kind: Kind = "periodic"
    if periods is None and base is not None:
        periods = _multiple(winner.repeat_period / base)
        kind = "periodic" if periods else "unlocked"
    return Periodicity(
        winner.impacts,
        periods,
        kind,
        winner.probability,
        len(time),
        base,
        winner.repeat_period,
        (fit.centre - fit.centre[0]) / fit.fold,
        winner.jitter,
        winner.missed,
        winner.spurious,
        silence,
        candidates,
    )


def _multiple(ratio: float) -> int | None:
    """The whole number of forcing periods that `ratio` is, within what is known of both."""
    nearest = round(ratio)
    return nearest if nearest >= 1 and abs(ratio - nearest) < CLOCK_ERROR * nearest else None


def _free_fits(impacts: Impacts, resolution: float) -> list[tuple[SlotFit, float, int | None]]:
    """Slots of repeat periods of 1 to 8 impacts, found from the train alone."""
    time = impacts.time
    fits: list[tuple[SlotFit, float, int | None]] = []
    for m in range(1, MOST_FREE + 1):
        if len(time) < (LEAST_REPEATS + 1) * m:
            break
        repeat = _mode(time[m:] - time[:-m])
        if repeat <= 0 or time[-1] - time[0] < LEAST_REPEATS * repeat:
            continue
        cycles, repeat = to_cycles(time, repeat, 5 * CLOCK_ERROR)
        # in mean intervals, so that limits mean the same for every m
        gaps = m * np.interp(impacts.gaps, time, cycles)
        fit = fit_slots(m * cycles, m, gaps, resolution, WIDEST_FREE)
        fits.append((fit, repeat / m, None))
    return fits


def _mode(values: np.ndarray) -> float:
    """Median of the quarter of the values that lie closest together."""
    ordered = np.sort(values)
    size = max(len(ordered) // 4, 2)
    start = int(np.argmin(ordered[size - 1 :] - ordered[: len(ordered) - size + 1]))
    return float(np.median(ordered[start : start + size]))


def _weigh(
    fits: list[tuple[SlotFit, float, int | None]], time: np.ndarray, widest: float
) -> tuple[int | None, tuple[Candidate, ...]]:
    """Probabilities of the fits, and which of them is the period, if any is."""
    if not fits:
        return None, ()
    from scipy.special import betaincc, ndtr

    n, span = len(time), float(time[-1] - time[0])
    # densities per second: the fits count in different units
    score = np.array([fit.score - n * np.log(unit) for fit, unit, _ in fits])
    score -= poisson_score(n, span)
    weight = np.exp(score - max(float(score.max()), 0.0))
    weight[_repeats_another(fits, score)] = 0.0
    weight /= weight.sum() + np.exp(-max(float(score.max()), 0.0))
    candidates = []
    for (fit, unit, periods), gain, share in zip(fits, score, weight, strict=True):
        hits, due = int(fit.hits.sum()), int(fit.due.sum())
        predictive = 0.0
        if hits:
            predictive = (
                betaincc(hits + 1, due - hits + 1, LEAST_SHARE)
                * betaincc(hits + 1, n - hits + 1, LEAST_SHARE)
                * np.prod(betaincc(fit.hits + 1, fit.due - fit.hits + 1, LEAST_SLOT_SHARE))
                * ndtr((widest / max(fit.jitter, 1e-12) - 1) * np.sqrt(2 * hits))
                * min(1.0, fit.chance / LEAST_CHANCE)
            )
        candidates.append(
            Candidate(
                len(fit.centre),
                periods,
                fit.fold * unit,
                float(gain),
                1 - hits / due if due else 1.0,
                1 - hits / n,
                fit.jitter * unit,
                float(share * predictive),
            )
        )
    best = int(np.argmax([candidate.probability for candidate in candidates]))
    return (best if candidates[best].probability > 0.5 else None), tuple(candidates)


def _repeats_another(
    fits: list[tuple[SlotFit, float, int | None]], score: np.ndarray
) -> np.ndarray:
    """Fits that say no more than a better one does of a whole part of their repeat period."""
    density = np.array([len(fit.centre) / (fit.fold * unit) for fit, unit, _ in fits])
    repeat = np.array([fit.fold * unit for fit, unit, _ in fits])
    ratio = np.round(repeat[:, None] / repeat)
    same = np.isclose(density[:, None], density, rtol=1e-2)
    same &= (ratio > 1) & np.isclose(repeat[:, None], ratio * repeat, rtol=1e-2)
    return np.any(same & (score[:, None] <= score), axis=1)


def _is_intermittent(intervals: np.ndarray) -> bool:
    """Whether silence takes a tenth of the time: intervals four times longer than nine in ten."""
    if not len(intervals):
        return False
    long = intervals > 4 * np.quantile(intervals, 0.9)
    return bool(intervals[long].sum() > 0.1 * intervals.sum())
