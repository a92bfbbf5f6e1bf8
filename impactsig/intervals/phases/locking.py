"""Joint fit of slots and a warp of time to a train."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..._running.watched import progress
from ._drift import WANDERS, Drift, fit_drift
from .slots import SlotFit, fit_slots
from .tracking import Warps, is_sparse

WIDEST = 0.08  # [cycles] standard deviation of slots that are looked for
LEAST_DUE = 0.72  # of the impacts that come must be due
MOST_JITTER = 0.075  # [cycles] beyond which a phase is no phase
LEAST_CHANCE = 1e-4  # of the other impacts coming at random
ROUNDS = 3  # of slots and drift in turn
MOST_FOLDS = 3  # for which that is done
EXPLAINED = 0.99  # probability of slots at a constant rate from which on no drift is looked for
HOPELESS = 1e-3  # and below which no other folds are
WORSE = 10.0  # by which the score of slots may fall in a round


class Attendance(NamedTuple):
    """Least shares of due instants that must have an impact."""

    all: float  # over all slots
    each: float  # at each of them
    kept: float  # at one that is fitted at all
    begun: float  # over all, and of the impacts, for slots and drift to be fitted in turn


USUAL = Attendance(0.72, 0.65, 0.6, 0.5)
THINNED = Attendance(0.3, 0.25, 0.2, 0.25)
"""Where impacts may be left out at random."""


class Lock(NamedTuple):
    """Slots in a warped time."""

    fit: SlotFit
    drift: Drift  # of the clock given [cycles]
    score: float  # log-evidence, the drift integrated over
    probability: float  # that the slots say when impacts come, against the limits above


def lock(
    warps: Warps,
    gaps: np.ndarray,
    folds: list[int],
    floor: float,
    *,
    steady: bool = False,
    widest: float = WIDEST,
    attendance: Attendance = USUAL,
) -> list[Lock]:
    """Slots and drift for every fold in which slots are found.

    The rate is taken as constant first; where that explains not nearly everything it is tracked,
    and then the phase. Slots and drift are fitted in turn for the folds that explain the train best
    beforehand. `gaps` are in the cycles of the clock given; `steady` says that this is a tacho's.
    """
    cycles = warps.cycles
    if not steady and is_sparse(cycles):
        return []
    constant = cycles if steady else warps.constant
    first = _fits(cycles, constant, gaps, folds, floor, widest, attendance)
    if steady:
        return _settle(cycles, first, gaps, floor, widest, WANDERS[:0], attendance)
    locks = _settle(cycles, first, gaps, floor, widest, WANDERS, attendance)
    if locks:
        best = max(locks, key=lambda one: one.score)
        if best.probability > EXPLAINED and best.drift.log_odds < 0:
            return locks
    # a tracked rate takes about one number from 60 cycles of the train
    penalty = 0.5 * np.log(len(cycles)) * cycles[-1] / 60
    better: dict[int, SlotFit] = {}
    tried = [constant]  # of a short run, or of few impacts, no more than that is followed
    for warp in (warps.rate, warps.phase):
        if any(warp is one for one in tried):
            continue
        tried.append(warp)
        for fold, fit in _fits(cycles, warp, gaps, folds, floor, widest, attendance).items():
            known = better.get(fold, first.get(fold))
            if known is None or fit.score - penalty > known.score:
                better[fold] = fit._replace(score=fit.score - penalty)
    if better:
        locks = _settle(cycles, first | better, gaps, floor, widest, WANDERS, attendance)
    if len(folds) == 1 or not locks:
        return locks
    best = max(locks, key=lambda one: one.score)
    if best.probability < HOPELESS:
        return locks
    # in the warp of the best, other folds may have slots that they had in none before
    warp = cycles - phase_at(best.drift, cycles)
    others = [fold for fold in folds if fold != best.fit.fold]
    again = _fits(cycles, warp, gaps, others, floor, widest, attendance)
    locks += [
        _settled(cycles, fit, gaps, floor, widest, WANDERS, attendance, 0) for fit in again.values()
    ]
    return list({one.fit.fold: one for one in sorted(locks, key=lambda one: one.score)}.values())


def _fits(
    cycles: np.ndarray,
    warp: np.ndarray,
    gaps: np.ndarray,
    folds: list[int],
    floor: float,
    widest: float,
    attendance: Attendance,
) -> dict[int, SlotFit]:
    """Slots of each fold in a warped time, if there are any."""
    lost = np.interp(gaps, cycles, warp)
    fits = {}
    with progress(len(folds), " periods tried", leave=False) as advance:
        for fold in folds:
            fits[fold] = fit_slots(warp, fold, lost, floor, widest, attendance.kept)
            advance(1)
    return {fold: fit for fold, fit in fits.items() if len(fit.centre)}


def _settle(
    cycles: np.ndarray,
    fits: dict[int, SlotFit],
    gaps: np.ndarray,
    floor: float,
    widest: float,
    wanders: np.ndarray,
    attendance: Attendance,
) -> list[Lock]:
    """Locks of the fits, the best of them refined in rounds of slots and drift."""
    found = []
    with progress(len(fits), " periods fitted", leave=False) as advance:
        for rank, fit in enumerate(sorted(fits.values(), key=lambda fit: -fit.score)):
            rounds = ROUNDS if rank < MOST_FOLDS else 0
            found.append(_settled(cycles, fit, gaps, floor, widest, wanders, attendance, rounds))
            advance(1)
    return found


def due(fit: SlotFit) -> np.ndarray:
    """The due instant nearest to each impact, in the cycles of the fit."""
    m = len(fit.centre)
    return fit.instant // m * fit.fold + fit.centre[fit.instant % m]


def phase_at(drift: Drift, x: np.ndarray) -> np.ndarray:
    """The drift of the phase, extrapolated linearly beyond its ends."""
    phase = np.interp(x, drift.at, drift.phase)
    for end, inner, beyond in ((0, 1, x < drift.at[0]), (-1, -2, x > drift.at[-1])):
        slope = (drift.phase[end] - drift.phase[inner]) / (drift.at[end] - drift.at[inner])
        phase[beyond] = drift.phase[end] + slope * (x[beyond] - drift.at[end])
    return phase


def predictive(fit: SlotFit, attendance: Attendance, widest: float = MOST_JITTER) -> float:
    """Probability that the slots predict the impacts, by the limits at the top of this file."""
    from scipy.special import betaincc, ndtr

    hits, total = int(fit.hits.sum()), int(fit.due.sum())
    if not hits:
        return 0.0
    chance = (
        betaincc(hits + 1, total - hits + 1, attendance.all)
        * betaincc(hits + 1, fit.impacts - hits + 1, LEAST_DUE)
        * np.prod(betaincc(fit.hits + 1, fit.due - fit.hits + 1, attendance.each))
        * ndtr((widest / max(fit.jitter, 1e-12) - 1) * np.sqrt(2 * hits))
        * min(1.0, fit.chance / LEAST_CHANCE)
    )
    return float(chance)


def _settled(
    cycles: np.ndarray,
    fit: SlotFit,
    gaps: np.ndarray,
    floor: float,
    widest: float,
    wanders: np.ndarray,
    attendance: Attendance,
    rounds: int,
) -> Lock:
    """Fit slots and drift alternately; returns the last fit that has slots."""
    drift = _drift(cycles, fit, floor, wanders)
    hits = int(fit.hits.sum())
    if hits < attendance.begun * max(int(fit.due.sum()), fit.impacts):
        rounds = 0
    for _ in range(rounds):
        warp = cycles - phase_at(drift, cycles)
        lost = gaps - phase_at(drift, gaps)
        better = fit_slots(warp, fit.fold, lost, floor, widest, attendance.kept)
        if not len(better.centre) or better.score < fit.score - WORSE:
            break
        same = np.array_equal(better.hit, fit.hit) and np.array_equal(better.instant, fit.instant)
        fit = better
        if same:
            break
        drift = _drift(cycles, fit, floor, wanders)
    probability = predictive(fit, attendance, MOST_JITTER * widest / WIDEST)
    return Lock(fit, drift, _score(fit, drift, floor), probability)


def _drift(cycles: np.ndarray, fit: SlotFit, floor: float, wanders: np.ndarray) -> Drift:
    at = cycles[fit.hit]
    return fit_drift(at, at - due(fit)[fit.hit], floor, wanders)


def _score(fit: SlotFit, drift: Drift, floor: float) -> float:
    """Score of the slots, with the evidence of the offsets in place of their likelihood."""
    hits, sigma = int(fit.hits.sum()), max(fit.jitter, floor)
    likelihood = -hits * (np.log(sigma * np.sqrt(2 * np.pi)) + 0.5 * (fit.jitter / sigma) ** 2)
    return float(fit.score - likelihood + drift.log_evidence)
