"""`identify_period`: period(m, n), with drift or a tone, bands, chaos, or no structure."""

from __future__ import annotations

import weakref
from typing import Any, Literal, NamedTuple, cast

import numpy as np

from .._arguments import instance, number, whole
from ..errors import InvalidInput
from ..impacts import Impacts
from .forcing import Forcing, forcing_cycles
from .periodicity import LEAST_IMPACTS, Kind, Periodicity, SpeedDrift
from .phases.irregular import chaos_odds
from .phases.locking import EXPLAINED
from .phases.reading import (
    LEAST_REPEATS,
    Clock,
    Reading,
    Recurrence,
    forced_readings,
    free_readings,
    is_unlocked,
    recurrences,
    repeat_period,
    weigh,
)
from .phases.structure import SLOWEST, Structure, structure
from .phases.thinning import thinned
from .phases.tracking import RATE_ERROR
from .phases.verdict import KINDS, Verdict, locked_verdict, unlocked_verdict

MOST_RESOLUTION = 0.03
CERTAINLY_LOCKED = 1 - 1e-6  # beyond it, whether the rest would be chaos does not matter
SLOW_SHARE = 0.8  # of the variance of a drift that a single tone must be
SLOW_TURNS = 3  # of that tone in the run


class _Answered(NamedTuple):
    """The last question and its answer, since report, command and dimension ask the same."""

    impacts: weakref.ref[Impacts]
    options: tuple[float | None, int, float]
    answer: Periodicity


_answered: _Answered | None = None


def identify_period(
    impacts: Impacts,
    forcing_period: float | None = None,
    *,
    forcing: Forcing | None = None,
    max_periods: int = 8,
    resolution: float = 1e-3,
) -> Periodicity:
    """Identify the motion of a train: period(m, n), drifting, quasi-periodic, chaotic or irregular.

    *Tracking.* The speed of the forcing is tracked through the run by the harmonics of the forcing
    period, within 2.6 %, then by the phase of the impacts. Impacts that often come a fixed delay
    after others (echoes) are recognised as satellites.

    *Slots.* For n = 1, 2, ... the train is folded with n periods and modelled by m slots (phases),
    with impacts normally distributed about them, missed and spurious impacts. The phase follows a
    random walk of the speed, which is fitted alternately with the slots; the evidence decides n and
    whether there is drift. A period is accepted only if 72 % of the expected impacts occurred, 72 %
    of the impacts were expected, they scatter by less than 7.5 % of the forcing period, and
    unexpected impacts have no common phase. 30 % of the expected impacts suffice if the others are
    missing at random, that is independently of whether and when the previous ones occurred; a
    chaotic motion skips periods in a pattern.

    *Residuals.* A line in their spectrum indicates a second frequency (quasi-periodic); a nonlinear
    map from one to the next indicates chaos in narrow bands. Bands below `banded_below`, about the
    size of the jitter, are hidden by it: the odds of "periodic" against "banded" are then near 1.

    *No slots.* A train whose impacts are locked to phases of the forcing, or whose intervals
    predict of the next what a linear process does not, is chaotic; otherwise it is irregular. The
    confidence in the latter grows with the number of intervals.

    Parameters
    ----------
    impacts : Impacts
        At least eight impacts; impacts expected in gaps of the run do not count as missed.
    forcing_period : float, optional
        Mean period of the forcing [s], accurate to 2.6 % minus half of its drift. Without it n is
        unknown; the shortest time after which m impacts recur, `repeat_period`, is determined
        instead (m up to 8, jitter below 7.5 % of the mean interval), and `periods` is None.
    forcing : Recording or array_like, optional
        A channel of the forcing or of a tacho with one rising edge per forcing period, or the
        instants of these edges [s], in the clock of the impacts. The speed is then known, and a
        slow modulation of the impacts is not mistaken for drift.
    max_periods : int
        Greatest n tried. Longer repeats of up to 8 impacts are found as well.
    resolution : float
        Fraction of the forcing period (or of the mean interval, without a forcing period); instants
        that differ by less count as equal. This prevents hum in the signal from being identified as
        a doubled period.

    Returns
    -------
    Periodicity
        The `kind` of motion with the `probability` of each kind; m (`impacts`), n (`periods`),
        `phases`, `jitter` [s] and drift of the period.

    Raises
    ------
    InvalidInput
        If `forcing_period`, `max_periods` or `resolution` is not positive, the forcing period is
        too short to be resolved by the times, `forcing` does not cover the run or contradicts the
        forcing period, or the run consists of gaps only.

    See Also
    --------
    track_period, repair_intervals, orbit_period

    Notes
    -----
    Too few impacts, or a run shorter than four forcing periods, are not an error: `kind` says so.
    Without `forcing`, modulations below 0.042 per forcing period are identified as drift.

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, identify_period
    >>> train = Impacts.from_times(0.1 * np.arange(60) + 0.03 * (np.arange(60) % 2))
    >>> print(identify_period(train, forcing_period=0.1))
    period(2,2): 2 impacts in 2 forcing periods
    """
    global _answered
    forcing_period = _checked_period(impacts, forcing_period, max_periods, resolution)
    options = (forcing_period, max_periods, resolution)
    last = _answered
    if forcing is None and last and last.impacts() is impacts and last.options == options:
        return last.answer
    answer, _ = read_period(impacts, forcing_period, forcing, max_periods, resolution)
    if forcing is None:
        _answered = _Answered(weakref.ref(impacts), options, answer)
    return answer


def read_period(
    impacts: Impacts,
    forcing_period: float | None,
    forcing: Forcing | None = None,
    max_periods: int = 8,
    resolution: float = 1e-3,
) -> tuple[Periodicity, Reading | None]:
    """The result of `identify_period`, and the slots that it rests on."""
    time, count = impacts.time, len(impacts)
    intervals = impacts.intervals()
    silence = float(intervals.max(initial=0.0))
    few = _unknown("too few impacts", count, forcing_period, silence), None
    if count < LEAST_IMPACTS or time[-1] == time[0]:
        return few
    span = float(time[-1] - time[0] - np.diff(np.clip(impacts.gaps, time[0], time[-1])).sum())
    if span <= 0:
        raise InvalidInput("impacts.gaps", impacts.gaps.tolist(), "gaps that leave some of the run")
    if not intervals.any():
        return few
    clock = forcing_clock(impacts, forcing_period, forcing)
    if clock is not None and span < LEAST_REPEATS * clock.unit:
        return _unknown("too short a run", count, clock.unit, silence), None
    unit = None if clock is None else clock.unit
    readings = [] if clock is None else forced_readings(clock, max_periods, resolution)
    best, locked, candidates = weigh(readings, count, span)
    recurring: list[Recurrence] = []
    if best is None:
        recurring = recurrences(time)
        # together with those before, so that no multiple of what has failed slips through
        readings += free_readings(impacts, recurring, span, resolution, unit, max_periods)
        best, locked, candidates = weigh(readings, count, span)
    if locked < EXPLAINED:
        best, locked, candidates = thinned(
            (best, locked, candidates), impacts, clock, recurring, span, max_periods, resolution
        )
    chaos = 0.0
    if locked < CERTAINLY_LOCKED:
        chaos = chaos_odds(None if clock is None else clock.warps, intervals)
    if best is None:
        verdict = unlocked_verdict(locked, chaos)
        kind = "chaotic" if chaos > 0 else "irregular"
        answer = Periodicity(
            cast(Kind, kind),
            verdict.probability,
            verdict.probability[kind],
            None,
            None,
            count,
            unit,
            longest_silence=silence,
            intermittent=_is_intermittent(intervals),
            candidates=candidates,
        )
        return answer, None
    steady = clock is not None and clock.steady
    floor = resolution if unit is None else resolution * unit / best.unit
    found = structure(best.lock, floor, 0.0 if steady else SLOWEST)
    verdict = locked_verdict(best.lock, found, locked, chaos)
    return _periodicity(best, verdict, found, impacts, unit, steady, candidates), best


def _periodicity(
    best: Reading,
    verdict: Verdict,
    found: Structure,
    impacts: Impacts,
    forcing_period: float | None,
    steady: bool,
    candidates: tuple[Any, ...],
) -> Periodicity:
    """The result for a train with slots."""
    fit, repeat = best.lock.fit, repeat_period(best)
    kind = verdict.kind
    if kind not in KINDS[:4]:
        kind = "periodic"
    confidence = verdict.probability[kind]
    recurs = kind in ("periodic", "drifting")
    if recurs:
        confidence += verdict.hidden
    if recurs and forcing_period is not None and (best.periods is None or is_unlocked(best)):
        confidence = sum(verdict.probability[one] for one in ("periodic", "drifting"))
        confidence += verdict.hidden
        kind = "unlocked"
    count, periods = len(fit.centre), best.periods
    if kind == "unlocked" and periods is not None:
        # evenly spaced: each impact is a repeat
        count, periods, repeat = 1, None, repeat / count
    hits, due = int(fit.hits.sum()), int(fit.due.sum())
    tone = found.tone if kind == "quasi-periodic" else None
    echoes = best.satellites
    intervals = impacts.intervals()
    return Periodicity(
        cast(Kind, kind),
        verdict.probability,
        min(confidence, 1.0),
        count,
        periods,
        len(impacts),
        repeat / periods if periods else forcing_period,
        repeat,
        (fit.centre[:count] - fit.centre[0]) / (repeat / best.unit),
        fit.jitter * best.unit,
        1 - hits / due,
        1 - hits / fit.impacts,
        None if echoes is None else echoes.share,
        None if echoes is None else echoes.delay * best.unit,
        None if steady else _speed(best, impacts.time[0]),
        None if tone is None else tone.frequency,
        None if tone is None else tone.rms * best.unit,
        found.below * best.unit if recurs or kind == "unlocked" else None,
        float(intervals.max(initial=0.0)),
        _is_intermittent(intervals),
        candidates,
    )


def _speed(best: Reading, start: float) -> SpeedDrift:
    """Drift of the forcing speed that corresponds to the drift of the phase."""
    drift = best.lock.drift
    rate = 1 - np.diff(drift.phase) / np.diff(drift.at)
    middle = 0.5 * (drift.at[1:] + drift.at[:-1])
    if drift.log_odds <= 0:
        rate = np.full(len(rate), rate.mean())
    tone = _slow_tone(drift.at, drift.phase) if drift.log_odds > 0 else None
    return SpeedDrift(start + middle * best.unit, rate / rate.mean() - 1, drift.log_odds, tone)


def _slow_tone(at: np.ndarray, phase: np.ndarray) -> float | None:
    """Frequency per cycle of a drift that is a single tone; None if it is not."""
    span = float(at[-1] - at[0])
    since = (at - at[0]) / span
    line = np.polynomial.polynomial.polyvander(since, 2)
    rest = phase - line @ np.linalg.lstsq(line, phase, rcond=None)[0]
    turns = np.arange(SLOW_TURNS, SLOWEST * span * 1.2, 0.25)
    best, share = 0.0, 0.0
    for turn in turns:
        wave = np.column_stack(
            (line, np.cos(2 * np.pi * turn * since), np.sin(2 * np.pi * turn * since))
        )
        left = phase - wave @ np.linalg.lstsq(wave, phase, rcond=None)[0]
        gain = 1 - float(left @ left) / max(float(rest @ rest), 1e-300)
        if gain > share:
            best, share = float(turn), gain
    return best / span if share > SLOW_SHARE else None


def forcing_clock(
    impacts: Impacts, forcing_period: float | None, forcing: Forcing | None
) -> Clock | None:
    """The train in cycles of its forcing, as far as the forcing is known."""
    time, gaps = impacts.time, impacts.gaps
    if forcing is None:
        if forcing_period is None:
            return None
        start, unit = time[0], forcing_period
        _require_resolved(unit, time)
        return Clock((time - start) / unit, (gaps - start) / unit, unit, False)
    cycles, unit = forcing_cycles(forcing, time)
    _require_resolved(unit, time)
    if forcing_period is not None and abs(forcing_period / unit - 1) > RATE_ERROR:
        raise InvalidInput(
            "forcing",
            f"a period of {unit:.6g} s",
            f"the forcing period of {forcing_period:.6g} s within {100 * RATE_ERROR:.2g} %",
            "Leave `forcing_period` out, or thin a tacho of several pulses a turn",
        )
    lost = np.interp(gaps, time, cycles)
    return Clock(cycles - cycles[0], lost - cycles[0], unit, True)


def _require_resolved(forcing_period: float, time: np.ndarray) -> None:
    """Refuse a forcing period that is nothing beside the run."""
    span = float(time[-1] - time[0])
    if span > 1e9 * forcing_period:
        raise InvalidInput(
            "forcing_period",
            forcing_period,
            f"more than a billionth of the run of {span:.6g} s",
            "Give it in seconds",
        )


def _unknown(
    kind: Literal["too few impacts", "too short a run"],
    count: int,
    forcing_period: float | None,
    silence: float,
) -> Periodicity:
    nothing = dict.fromkeys(KINDS, 0.0)
    return Periodicity(
        kind, nothing, 0.0, None, None, count, forcing_period, longest_silence=silence
    )


def _checked_period(
    impacts: Impacts, forcing_period: float | None, max_periods: int, resolution: float
) -> float | None:
    """The forcing period as a float; the other arguments are checked too."""
    instance("impacts", impacts, Impacts, "Impacts", "Impacts.from_times makes them of instants")
    whole("max_periods", max_periods, 1)
    required = f"a positive share, {MOST_RESOLUTION} or less"
    number("resolution", resolution, required, above=0, most=MOST_RESOLUTION)
    if forcing_period is None:
        return None
    return number("forcing_period", forcing_period, "a positive time [s]", above=0)


def _is_intermittent(intervals: np.ndarray) -> bool:
    """Whether silence takes a tenth of the time: intervals four times longer than nine in ten."""
    if intervals.max() <= 4 * np.median(intervals):
        return False  # the quantile takes longer, and is the greater of both
    long = intervals > 4 * np.quantile(intervals, 0.9)
    return bool(intervals[long].sum() > 0.1 * intervals.sum())
