"""Delay of one sensor relative to others of the machine."""

from __future__ import annotations

import math

import numpy as np

from ..alignment import FEWEST, Alignment, align_impacts
from ..errors import InvalidInput
from ..impacts import Impacts

LONGEST_DELAY = 0.05  # [s], of sound, where none is given
SHARED = 0.5  # of the lesser train, that tells a longer delay
APART = (
    "two sensors have few impacts in common at any one delay, so that what both recorded may count "
    "twice. Where their clocks differ, align_impacts brings one to the other's"
)
CONSTANT = 30.0  # times less scatter than that of the intervals: a delay of instruments
SECOND, FEWEST_GROUPS = 1.0, 8  # spans whose errors are independent [s]
DRIFTS = 6.0  # standard errors of a skew that is one


def delay_of(
    train: Impacts, time: np.ndarray, cell: float | None, within: float, longest: float | None
) -> tuple[float, float, str]:
    """Delay of a train relative to instants of others [s], its standard error, and a note.

    Parameters
    ----------
    cell : delay of a load cell among the others, where the train is of one, too
    longest : the greatest difference of delays, if it is given
    """
    if longest is not None:
        return _delay(train, Impacts(time), within, longest)
    if cell is not None:
        return _delay_of_cells(train, time, cell, within)
    return _any_delay(train, Impacts(time), within)


def _delay_of_cells(
    train: Impacts, time: np.ndarray, late: float, within: float
) -> tuple[float, float, str]:
    """Delay of a load cell beside another that is `late`, its tolerance, and a note.

    A body carries an impact over metres in `within`. All impacts of two stops that are hit in turn
    have a partner that is later, too; but from stop to stop the time varies as the intervals do,
    whereas a delay between instruments is constant.
    """
    if min(len(train), len(time)) < 2:
        return late, math.inf, ""
    reference = Impacts(time + late)
    try:
        found = align_impacts(train, reference, within, longest_delay=within, skew=False)
    except InvalidInput:
        pass
    else:
        return late + found.delay, found.delay_error, _clocks_differ(found, time)
    if min(len(train), len(time)) >= FEWEST:
        try:
            found = align_impacts(train, reference, within, skew=False)
        except InvalidInput:
            return late, math.inf, ""
        many = len(found.pairs) >= SHARED * min(len(train), len(time))
        if many and _scatter(np.diff(time)) > CONSTANT * _scatter(found.error):
            return late + found.delay, found.delay_error, _starts_late(found.delay)
    return late, math.inf, ""


def _scatter(values: np.ndarray) -> float:
    """Median absolute deviation."""
    return float(np.median(np.abs(values - np.median(values))))


def _starts_late(delay: float) -> str:
    return (
        f"two sensors are {abs(delay):.3g} s apart, more than an impact needs from one to the "
        "other: they are taken for one machine whose channels start so late"
    )


def _any_delay(train: Impacts, reference: Impacts, within: float) -> tuple[float, float, str]:
    """Delay of a train with its tolerance, and a note: one of sound, else whatever suits."""
    delay, error, note = _delay(train, reference, within, None)
    if math.isfinite(error) or min(len(train), len(reference)) < 2:
        return delay, error, note
    if min(len(train), len(reference)) >= FEWEST:
        note = APART
    try:
        found = align_impacts(train, reference, within, skew=False)
    except InvalidInput:
        return delay, error, note
    if len(found.pairs) < SHARED * min(len(train), len(reference)):
        return delay, error, note
    return found.delay, found.delay_error, _starts_late(found.delay)


def _delay(
    train: Impacts, reference: Impacts, within: float, longest: float | None
) -> tuple[float, float, str]:
    """Delay of a train with its tolerance, and a note; (0, inf) if it cannot be estimated."""
    if min(len(train), len(reference)) < 2:
        return 0.0, math.inf, ""
    most, note = longest or LONGEST_DELAY, ""
    none, several = 0.0, math.inf  # bounds that leave no delay, and more than one
    while True:
        try:
            found = align_impacts(train, reference, within, longest_delay=most, skew=False)
        except InvalidInput as error:
            if error.argument == "longest_delay":
                if longest is not None:
                    raise
                several = most
            else:
                none = most
            if several - none < within or math.isinf(several):
                return 0.0, math.inf, ""
            most = 0.5 * (none + several)
            note = (
                "the impacts repeat themselves, so that several delays between its sensors suit "
                f"as well as each other: the one within {1e3 * most:.3g} ms is taken"
            )
        else:
            return found.delay, found.delay_error, note or _clocks_differ(found, reference.time)


def _clocks_differ(found: Alignment, reference: np.ndarray) -> str:
    """A note if two sensors drift apart, or have little in common; empty otherwise."""
    if len(found.pairs) < SHARED * min(len(found.impacts), len(reference)):
        return APART
    x, y = reference[found.pairs[:, 1]], found.error
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y) / float(x @ x)
    # Impacts of one second share a part of their errors.
    groups = np.unique(x // min(SECOND, float(np.ptp(x)) / FEWEST_GROUPS), return_inverse=True)[1]
    deviation = float(np.linalg.norm(np.bincount(groups, x * (y - slope * x)))) / float(x @ x)
    if abs(slope) < DRIFTS * max(deviation, 1e-9):
        return ""
    return (
        f"the clocks of two sensors differ by {1e6 * slope:.3g} ppm or more, which errors of "
        "instants do not hold: combine them once align_impacts has brought one to the clock of the "
        "other"
    )
