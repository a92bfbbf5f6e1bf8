"""What period a train of impacts has: period(m, n), or none."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidInput
from ..impacts import Impacts
from ._phase import to_cycles
from ._slots import SlotFit, fit_slots, poisson_score
from .periodicity import LEAST_IMPACTS, Candidate, Periodicity

LEAST_REPEATS = 4
LEAST_SHARE = 0.8  # of the impacts a period predicts that must come, and of those that come
LEAST_SLOT_SHARE = 0.7  # of the times that one of the m impacts is due it must come
LEAST_CHANCE = 1e-4  # of the other impacts coming at random
WIDEST_FORCED = 0.03  # jitter [forcing periods] beyond which a phase is no phase
WIDEST_FREE = 0.045  # the same in mean intervals, where no forcing period is given
CLOCK_ERROR = 2e-3  # relative, of the forcing period given against the clock of the recording
MODE_ERROR = 0.02  # relative, of a repeat period read off the intervals
MOST_FREE = 8  # impacts in a repeat period sought without a forcing period


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
    hits and others being spurious; the likelihood, less a penalty for every slot, chooses n. It is
    a period only if 80 % of the impacts due came, 80 % of those that came were due, they scatter by
    less than 3 % of the forcing period, and what was not due came at no phase of its own; the
    probability of that, given the numbers seen, enters the confidence. Chaos near grazing fails
    here: its impacts gather about a phase, but whether one comes cannot be told.

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
        If `forcing_period`, `max_periods` or `resolution` is not positive, the forcing period is
        too short for the times to resolve it, or the gaps of the run leave nothing of it.

    Notes
    -----
    Too few impacts, and a run shorter than four forcing periods, give an answer that says so, not
    an error.

    Examples
    --------
    >>> import numpy as np
    >>> train = Impacts.from_times(0.1 * np.arange(60) + 0.03 * (np.arange(60) % 2))
    >>> print(identify_period(train, forcing_period=0.1))
    period(2,2): 2 impacts in 2 forcing periods
    """
    if not isinstance(impacts, Impacts):
        raise InvalidInput(
            "impacts",
            type(impacts).__name__,
            "Impacts",
            "Impacts.from_times makes them of instants",
        )
    if forcing_period is not None and not (_is_number(forcing_period) and forcing_period > 0):
        raise InvalidInput("forcing_period", forcing_period, "a positive time [s]")
    if isinstance(max_periods, bool) or not isinstance(max_periods, (int, np.integer)):
        raise InvalidInput("max_periods", max_periods, "a positive whole number")
    if max_periods < 1:
        raise InvalidInput("max_periods", max_periods, "a positive whole number")
    if not (_is_number(resolution) and 0 < resolution < WIDEST_FORCED):
        raise InvalidInput("resolution", resolution, f"a share from 0 to {WIDEST_FORCED}")
    time, count = impacts.time, len(impacts)
    intervals = impacts.intervals()
    silence = float(intervals.max(initial=0.0))
    if count < LEAST_IMPACTS or not intervals.any():
        return Periodicity(
            None, None, "too few impacts", 0.0, count, forcing_period, longest_silence=silence
        )
    span = float(time[-1] - time[0] - np.diff(np.clip(impacts.gaps, time[0], time[-1])).sum())
    if span <= 0:
        raise InvalidInput("impacts.gaps", impacts.gaps.tolist(), "gaps that leave some of the run")
    if forcing_period is not None and span < LEAST_REPEATS * forcing_period:
        return Periodicity(
            None, None, "too short a run", 0.0, count, forcing_period, longest_silence=silence
        )
    if forcing_period is not None and time[-1] - time[0] > 1e9 * forcing_period:
        raise InvalidInput(
            "forcing_period",
            forcing_period,
            f"more than a billionth of the run of {time[-1] - time[0]:.6g} s",
            "Give it in seconds",
        )
    trials: list[_Trial] = []
    if forcing_period is not None:
        cycles, base = to_cycles(time, forcing_period, CLOCK_ERROR)
        gaps = np.interp(impacts.gaps, time, cycles)
        for n in range(1, min(max_periods, int(cycles[-1] / LEAST_REPEATS)) + 1):
            fit = fit_slots(cycles, n, gaps, resolution, WIDEST_FORCED)
            trials.append(_Trial(fit, base, n, WIDEST_FORCED))
    best, candidates = _weigh(trials, count, span)
    if best is None:
        # together with those before, so that no multiple of what has failed slips through
        trials += _free_trials(impacts, span, resolution, forcing_period, max_periods)
        best, candidates = _weigh(trials, count, span)
    if best is None:
        return Periodicity(
            None,
            None,
            "intermittent" if _is_intermittent(intervals) else "aperiodic",
            1.0 - max((candidate.probability for candidate in candidates), default=0.0),
            count,
            forcing_period,
            longest_silence=silence,
            candidates=candidates,
        )
    fit, winner = trials[best].fit, candidates[best]
    return Periodicity(
        winner.impacts,
        winner.periods,
        "periodic" if winner.periods or forcing_period is None else "unlocked",
        winner.probability,
        count,
        winner.repeat_period / winner.periods if winner.periods else forcing_period,
        winner.repeat_period,
        (fit.centre - fit.centre[0]) / fit.fold,
        winner.jitter,
        winner.missed,
        winner.spurious,
        silence,
        candidates,
    )


def _is_number(value: Any) -> bool:
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    return real and math.isfinite(value)


class _Trial(NamedTuple):
    fit: SlotFit
    unit: float  # what the fit counts in [s]
    periods: int | None
    widest: float  # jitter that counts as none [unit]


def _free_trials(
    impacts: Impacts,
    span: float,
    resolution: float,
    forcing_period: float | None,
    max_periods: int,
) -> list[_Trial]:
    """Slots of repeat periods of 1 to 8 impacts, found from the train alone.

    With a forcing period, only those that are no multiple of it up to `max_periods`: these have
    been tried.
    """
    time = impacts.time
    trials: list[_Trial] = []
    for m in range(1, MOST_FREE + 1):
        differences = time[m:] - time[:-m]
        if len(differences) < LEAST_REPEATS * m:
            break
        repeat = _mode(differences)
        # as often as that, the impacts there are would have to come, roughly
        if not 0.6 < repeat * (len(time) - 1) / (m * span) < 1.6:
            continue
        cycles, repeat = to_cycles(time, repeat, MODE_ERROR)
        periods = None if forcing_period is None else _multiple(repeat / forcing_period)
        if periods is not None and periods <= max_periods:
            continue
        # in mean intervals, so that limits mean the same for every m
        unit, widest, floor = repeat / m, WIDEST_FREE, resolution
        if forcing_period is not None:
            widest = min(widest, WIDEST_FORCED * forcing_period / unit)
            floor = resolution * forcing_period / unit
        gaps = m * np.interp(impacts.gaps, time, cycles)
        fit = fit_slots(m * cycles, m, gaps, min(floor, widest / 2), widest)
        trials.append(_Trial(fit, unit, periods, widest))
    return trials


def _multiple(ratio: float) -> int | None:
    """The whole number of forcing periods that `ratio` is, within what is known of both."""
    nearest = round(ratio)
    return nearest if nearest >= 1 and abs(ratio - nearest) < CLOCK_ERROR * nearest else None


def _mode(values: np.ndarray) -> float:
    """Median of the quarter of the values that lie closest together."""
    ordered = np.sort(values)
    size = max(len(ordered) // 4, 2)
    start = int(np.argmin(ordered[size - 1 :] - ordered[: len(ordered) - size + 1]))
    return float(np.median(ordered[start : start + size]))


def _weigh(
    trials: list[_Trial], count: int, span: float
) -> tuple[int | None, tuple[Candidate, ...]]:
    """Probabilities of the trials, and which of them is the period, if any is."""
    if not trials:
        return None, ()
    # densities per second: the fits count in different units
    score = np.array([trial.fit.score - count * np.log(trial.unit) for trial in trials])
    score -= poisson_score(count, span)
    top = max(float(score.max()), 0.0)
    weight = np.exp(score - top)
    weight /= weight.sum() + np.exp(-top)
    candidates = []
    for trial, gain, share in zip(trials, score.tolist(), weight.tolist(), strict=True):
        fit = trial.fit
        hits, due = int(fit.hits.sum()), int(fit.due.sum())
        candidates.append(
            Candidate(
                len(fit.centre),
                trial.periods,
                fit.recurrence * trial.unit,
                gain,
                1 - hits / due if due else 1.0,
                1 - hits / count,
                fit.jitter * trial.unit,
                share * _predictive(fit, trial.widest),
            )
        )
    best = int(np.argmax([candidate.probability for candidate in candidates]))
    return (best if candidates[best].probability > 0.5 else None), tuple(candidates)


def _predictive(fit: SlotFit, widest: float) -> float:
    """Probability that the slots say when impacts come: see the limits at the top of this file."""
    from scipy.special import betaincc, ndtr

    hits, due = int(fit.hits.sum()), int(fit.due.sum())
    if not hits:
        return 0.0
    chance = (
        betaincc(hits + 1, due - hits + 1, LEAST_SHARE)
        * betaincc(hits + 1, fit.impacts - hits + 1, LEAST_SHARE)
        * np.prod(betaincc(fit.hits + 1, fit.due - fit.hits + 1, LEAST_SLOT_SHARE))
        * ndtr((widest / max(fit.jitter, 1e-12) - 1) * np.sqrt(2 * hits))
        * min(1.0, fit.chance / LEAST_CHANCE)
    )
    return float(chance)


def _is_intermittent(intervals: np.ndarray) -> bool:
    """Whether silence takes a tenth of the time: intervals four times longer than nine in ten."""
    long = intervals > 4 * np.quantile(intervals, 0.9)
    return bool(intervals[long].sum() > 0.1 * intervals.sum())
