"""Candidate periods of a train, with or without a forcing period, and their evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...impacts import Impacts
from ..periodicity import Candidate
from ._satellites import SAME, Satellites, satellites
from .locking import USUAL, WIDEST, Attendance, Lock, lock, predictive
from .slots import bunching_chance, poisson_score
from .structure import FEWEST, SLOWEST, residuals, strongest_line
from .tracking import RATE_ERROR, Warps

LEAST_REPEATS = 4
MOST_FREE = 8  # impacts in a repeat period that is sought without a forcing period
CLOCK_ERROR = 2e-3  # relative, of the forcing period against the clock of the recording
UNEVEN = 4.0  # standard errors by which slots at even distances may be off
SLIPPED = 0.25  # turns of a tone against slots in the run from which on they are distinguished
TOO_FEW = 8  # impacts that are left once satellites are taken out


class Reading(NamedTuple):
    """Slots that were tried, and the time in which they count."""

    lock: Lock
    unit: float  # the cycle of the clock given [s]
    periods: int | None
    cycles: np.ndarray  # (k,) the impacts that the slots explain, in cycles of the clock given
    satellites: Satellites | None
    score: float  # log-evidence of all impacts [1/s]


@dataclass(frozen=True, eq=False)
class Clock:
    """A train in cycles of a forcing."""

    cycles: np.ndarray
    gaps: np.ndarray
    unit: float  # [s]
    steady: bool  # measured by a tacho, so that no drift is left

    @cached_property
    def warps(self) -> Warps:
        """The train in warps of its time."""
        return Warps(self.cycles)

    @cached_property
    def echoes(self) -> Satellites | None:
        """The satellites of the train, if enough impacts remain without them."""
        found = satellites(self.cycles)
        return None if found is None or (~found.which).sum() < TOO_FEW else found

    @cached_property
    def alone(self) -> Warps:
        """The train without its satellites in warps of its time."""
        assert self.echoes is not None
        return Warps(self.cycles[~self.echoes.which])


class Recurrence(NamedTuple):
    """The time in which the train most often recurs after so many impacts."""

    impacts: int
    period: float  # [s]
    warps: Warps  # of the train in cycles of it


def recurrences(time: np.ndarray) -> list[Recurrence]:
    """The recurrence times of 1 to 8 impacts."""
    found = []
    for m in range(1, MOST_FREE + 1):
        differences = time[m:] - time[:-m]
        if len(differences) < LEAST_REPEATS * m:
            break
        period = _mode(differences)
        if period > np.spacing(np.abs(time).max()):  # else it is rounding
            found.append(Recurrence(m, period, Warps((time - time[0]) / period)))
    return found


def forced_readings(
    clock: Clock, max_periods: int, resolution: float, attendance: Attendance = USUAL
) -> list[Reading]:
    """Slots for repeats of 1, 2, ... forcing periods, with and without satellites."""
    folds = list(range(1, min(max_periods, int(clock.cycles[-1] / LEAST_REPEATS)) + 1))
    found = _readings(clock, folds, resolution, attendance, None)
    if clock.echoes is not None:
        found += _readings(clock, folds, resolution, attendance, clock.echoes)
    return found


def _readings(
    clock: Clock,
    folds: list[int],
    floor: float,
    attendance: Attendance,
    echoes: Satellites | None,
) -> list[Reading]:
    warps = clock.warps if echoes is None else clock.alone
    bonus = 0.0 if echoes is None else echoes.score(floor)
    locks = lock(warps, clock.gaps, folds, floor, steady=clock.steady, attendance=attendance)
    if echoes is not None:
        locks = [_without_orphans(one, echoes, attendance) for one in locks]
    density = len(clock.cycles) * np.log(clock.unit)
    readings = [
        Reading(one, clock.unit, one.fit.fold, warps.cycles, echoes, one.score + bonus - density)
        for one in locks
    ]
    return _tones_for_slots(readings, clock.steady)


def _without_orphans(one: Lock, echoes: Satellites, attendance: Attendance) -> Lock:
    """Ignore the bunching of echoes whose impact was missed."""
    fit = one.fit
    others = ~fit.hit & (np.abs(fit.offset - echoes.delay) > 2 * SAME)
    width = max(fit.jitter, 1e-12)
    chance = bunching_chance(
        fit.cycles[others] % fit.fold, fit.offset[others], fit.fold, len(fit.centre), width
    )
    fit = fit._replace(chance=chance)
    return one._replace(fit=fit, probability=predictive(fit, attendance))


def _tones_for_slots(readings: list[Reading], steady: bool) -> list[Reading]:
    """Add the evidence of a tone to readings with fewer slots than the best.

    A tone at nearly k/7 of the forcing is as well explained by seven slots as by one slot and the
    tone. What has fewer slots than the best gets the evidence of its tone, unless that cannot be
    told from slots: as it keeps its phase in them through the run.
    """
    if not readings:
        return readings
    best = max(readings, key=lambda one: one.score)
    fold, m = best.lock.fit.fold, len(best.lock.fit.centre)
    if m < 3:
        return readings
    found = []
    for one in readings:
        fit, gain = one.lock.fit, 0.0
        _, at, z = residuals(one.lock)
        if len(fit.centre) < m and len(z) >= FEWEST:
            density = len(fit.centre) / fit.fold
            tone = strongest_line(at, z, density, 0.0 if steady else SLOWEST)
            span = at[-1] - at[0]
            if tone is not None and _off_slots(tone.frequency * fold) > fold * SLIPPED / span:
                left = float(np.sum((z - tone.wave) ** 2)) / float(z @ z)
                gain = -0.5 * len(z) * np.log(max(left, 1e-12)) - 1.5 * np.log(len(z))
                gain -= np.log(max(density * span / 2, 2.0))
        found.append(one._replace(score=one.score + max(gain, 0.0)))
    return found


def _off_slots(value: float) -> float:
    return abs(value - round(value))


def free_readings(
    impacts: Impacts,
    recurring: list[Recurrence],
    span: float,
    resolution: float,
    forcing_period: float | None,
    max_periods: int,
    attendance: Attendance = USUAL,
) -> list[Reading]:
    """Slots of repeat periods of 1 to 8 impacts, found from the train alone.

    With a forcing period, only those that are no multiple of it up to `max_periods`: these have
    been tried.
    """
    time = impacts.time
    found: list[Reading] = []
    for m, repeat, warps in recurring:
        # as often as that, the impacts there are would have to come, roughly
        if not attendance.kept < repeat * (len(time) - 1) / (m * span) < 1.6:
            continue
        periods = None if forcing_period is None else _multiple(repeat / forcing_period)
        if periods is not None and periods <= max_periods:
            continue
        gaps = (impacts.gaps - time[0]) / repeat
        # in mean intervals, so that limits mean the same for every m
        widest, floor = WIDEST / m, resolution / m
        if forcing_period is not None:
            widest = min(widest, WIDEST * forcing_period / repeat)
            floor = resolution * forcing_period / repeat
        density = len(time) * np.log(repeat)
        found += [
            Reading(one, repeat, periods, warps.cycles, None, one.score - density)
            for one in lock(
                warps, gaps, [1], min(floor, widest / 2), widest=widest, attendance=attendance
            )
        ]
    return found


def weigh(
    readings: list[Reading], count: int, span: float
) -> tuple[Reading | None, float, tuple[Candidate, ...]]:
    """The most probable reading if it is the period, its probability, and all that were tried."""
    if not readings:
        return None, 0.0, ()
    score = np.array([one.score for one in readings]) - poisson_score(count, span)
    top = max(float(score.max()), 0.0)
    weight = np.exp(score - top)
    weight /= weight.sum() + math.exp(-top)
    candidates = tuple(
        _candidate(one, float(gain), float(share))
        for one, gain, share in zip(readings, score, weight, strict=True)
    )
    best = int(np.argmax([one.probability for one in candidates]))
    probability = candidates[best].probability
    return (readings[best] if probability > 0.5 else None), probability, candidates


def _candidate(one: Reading, gain: float, share: float) -> Candidate:
    fit = one.lock.fit
    hits, due = int(fit.hits.sum()), int(fit.due.sum())
    return Candidate(
        len(fit.centre),
        one.periods,
        repeat_period(one),
        gain,
        1 - hits / due if due else 1.0,
        1 - hits / fit.impacts,
        fit.jitter * one.unit,
        share * one.lock.probability,
    )


def is_unlocked(one: Reading) -> bool:
    """Whether the slots are evenly spaced at a rate that is not locked to the forcing.

    A wrong forcing period makes m slots in n of a repeat that is nearly n/m of it.
    """
    fit = one.lock.fit
    m = len(fit.centre)
    if m == 1 or fit.fold % m == 0 or one.lock.drift.log_odds > 0:
        return False
    apart = np.diff(np.append(fit.centre, fit.centre[0] + fit.fold))
    error = UNEVEN * max(fit.jitter, 1e-4) * np.sqrt(2 * m / max(int(fit.hits.sum()), 1))
    rate = repeat_period(one) / (fit.fold * one.unit)
    return bool(np.abs(apart - fit.fold / m).max() < error and abs(rate - 1) > CLOCK_ERROR)


def repeat_period(one: Reading) -> float:
    """Mean period of the slots over the run [s]."""
    fit = one.lock.fit
    stretch = (one.cycles[-1] - one.cycles[0]) / (fit.cycles[-1] - fit.cycles[0])
    return float(fit.fold * stretch * one.unit)


def _multiple(ratio: float) -> int | None:
    """The integer that `ratio` equals within its uncertainty, if any."""
    nearest = round(ratio)
    return nearest if nearest >= 1 and abs(ratio - nearest) < RATE_ERROR * nearest else None


def _mode(values: np.ndarray) -> float:
    """Median of the densest quarter of the values."""
    ordered = np.sort(values)
    size = max(len(ordered) // 4, 2)
    start = int(np.argmin(ordered[size - 1 :] - ordered[: len(ordered) - size + 1]))
    return float(np.median(ordered[start : start + size]))
