"""Delay with which a sweep loses a motion, from the transients before and after.

A periodic motion is lost at the frequency f* at which its multiplier passes -1. What is off it
alternates from one period to the next, and its size A changes with the exponent

    s(f) = d ln|A| / d(forcing periods) = k (f* - f),

so in a sweep of the rate dot f, in which f forcing periods pass in a second,

    d ln|A| / df = s(f) f / dot f:

beyond f* what is off grows from next to nothing, and is only seen long after, the faster the sweep
and the steadier the machine the later [Baesens]_. The growth before a motion is lost, and the decay
after the same motion is taken up by a sweep the other way, are parabolas ln|A|(f) with one k and
one f*. Both are fitted together by weighted least squares. A decay alone, which begins near f*,
tells it by its curvature; a growth alone is seen far from f* and for a short while, and gives a
bound.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._numerics.spread import DEVIATION_BY_MEDIAN

BESIDE = 0.15
"""Forcing periods from where an impact is expected to where it is."""
SKIPPED = 3
"""Impacts in a row that may be missed."""
LONGEST = 400
"""Periods of a motion that are looked at."""
LEAST = 5
"""Fewest points from which an exponent is estimated."""
DOUBTED = 60
"""Impacts from a change within which its motion begins."""
LONG = 30
"""Periods in which a motion shows its noise beside its transient."""
ABOVE = 3.0
"""What is off a motion, over its noise, where it is a transient."""
BENT = 0.05
"""Error of ln|A| where there is no noise: the exponent is that of small transients."""
STRAIGHT = 0.1
"""Of the delay: what the exponent's course, taken as straight, may put it off by."""
FAR = 0.3
"""Of the way from a transient to a frequency extrapolated from it alone: the same."""
SETTLING = 20.0
"""Forcing periods that a motion is taken to last after it is lost where no transient is seen."""
UNSEEN = math.log(1e10)
"""Of the size at which what is off a motion is seen over that with which it may have begun."""


class Delay(NamedTuple):
    """Delay of a change: observed minus corrected value, with its standard error."""

    value: float
    error: float


def transient_of(
    cycles: np.ndarray, frequency: Callable[[np.ndarray], np.ndarray], first: int, n: int, step: int
) -> list[list[float]]:
    """The transient from an impact on: frequency, ln of the amplitude, standard error.

    Parameters
    ----------
    cycles : ndarray
        Forcing periods until each impact.
    frequency : callable
        Of the forcing after so many forcing periods [Hz].
    first : int
        The impact to begin with.
    n : int
        Forcing periods in a period of the motion.
    step : {1, -1}
        Later impacts, or earlier ones.
    """
    # The place of a change is known to some impacts: the motion begins where it is kept to.
    far = range(first, min(max(first + step * DOUBTED, -1), len(cycles)), step)
    first = next((one for one in far if continues(cycles, one, n, step)), first)
    place, at = _followed(cycles, first, n, step)
    if len(place) < LONG:
        return []
    phase = np.full(place[-1] + 1, np.nan)
    phase[place] = at - at[0] - step * n * place
    middle = np.arange(1, len(phase) - 1)
    off = 0.25 * (phase[:-2] - 2 * phase[1:-1] + phase[2:]) * (-1.0) ** middle
    known = np.isfinite(off)
    middle, off = middle[known], off[known]
    if len(off) < LONG:
        return []
    # What lies beyond may be another transient: the quietest stretch is none.
    quiet = min(np.median(abs(one)) for one in np.array_split(off, len(off) // (LONG // 2)))
    noise = DEVIATION_BY_MEDIAN * float(quiet)
    off = off * np.sign(np.median(off[:LEAST]))
    # The transient lasts from the change to where it is lost in the noise, or turns over.
    lost = off < ABOVE * noise
    beyond = np.flatnonzero(lost[2:] & lost[1:-1] & lost[:-2])
    last = int(beyond[0]) if len(beyond) else len(off)
    seen = off[:last]
    good = ~lost[:last]
    if np.count_nonzero(good) < LEAST:
        return []
    values = frequency(at[0] + step * n * middle[:last][good])
    seen = seen[good]
    error = np.hypot(noise / seen, BENT)
    return np.column_stack([values, np.log(seen), error]).tolist()


def continues(cycles: np.ndarray, first: int, n: int, step: int) -> bool:
    """Whether impacts still recur after n forcing periods beyond a change, if less exactly."""
    place = _followed(cycles, first, n, step)[0]
    return len(place) > LEAST and int(place[LEAST]) == LEAST


def _followed(cycles: np.ndarray, first: int, n: int, step: int) -> tuple[np.ndarray, np.ndarray]:
    """Impacts n forcing periods apart: how many periods from the first, and where."""
    place, at = [0], [float(cycles[first])]
    k = 0
    while len(place) < LONGEST and k - place[-1] <= SKIPPED:
        k += 1
        due = at[-1] + step * n * (k - place[-1])
        i = int(np.searchsorted(cycles, due))
        near = [one for one in (i - 1, i) if 0 <= one < len(cycles)]
        best = min(near, key=lambda one: abs(cycles[one] - due))
        if abs(cycles[best] - due) < BESIDE:
            place.append(k)
            at.append(float(cycles[best]))
    return np.array(place), np.array(at)


def lost_at(transients: Sequence[tuple[float, Any]]) -> tuple[float, float] | None:
    """Frequency at which the exponent of a motion vanishes, and its standard error [Hz].

    Parameters
    ----------
    transients : sequence of (float, array (k, 3))
        Of each the rate of its sweep [Hz/s] and what `transient_of` returns.

    Returns
    -------
    tuple of float, or None
        None where the transients do not tell.
    """
    parts = [(rate, np.asarray(seen, float)) for rate, seen in transients if len(seen)]
    if not parts:
        return None
    origin = float(np.mean(np.concatenate([seen[:, 0] for _, seen in parts])))
    rows, targets = [], []
    for k, (rate, seen) in enumerate(parts):
        x, pace = seen[:, 0] - origin, origin / rate
        level = np.zeros((len(seen), len(parts)))
        level[:, k] = 1.0
        rows.append(np.column_stack([pace * x, 0.5 * pace * x * x, level]) / seen[:, 2:])
        targets.append(seen[:, 1] / seen[:, 2])
    matrix, target = np.concatenate(rows), np.concatenate(targets)
    free = len(target) - matrix.shape[1]
    if free < 1 or np.linalg.matrix_rank(matrix) < matrix.shape[1]:
        return None
    found = np.linalg.lstsq(matrix, target, rcond=None)[0]
    misfit = float(np.sum((target - matrix @ found) ** 2)) / free
    covariance = np.linalg.inv(matrix.T @ matrix)[:2, :2] * max(misfit, 1.0)
    slope = found[1]
    if slope**2 < 4 * covariance[1, 1]:
        return None
    off = -found[0] / slope
    along = np.array([-1 / slope, -off / slope])
    return origin + off, math.sqrt(float(along @ covariance @ along))


def delay_of(value: float, rate: float, transients: Sequence[tuple[float, Any]]) -> Delay:
    """Delay of a change at an observed frequency, from the transients of the motion."""
    unseen = Delay(0.0, abs(rate) * SETTLING / value)
    if len(transients) == 1 and _grows(*transients[0]):
        return _delay_of_growth(value, rate, np.asarray(transients[0][1], float))
    found = lost_at(transients)
    if found is None:
        return unseen
    delay = value - found[0]
    error = math.hypot(found[1], STRAIGHT * delay)
    if delay * rate <= 0 or error > abs(delay):
        return unseen
    if len(transients) == 1:
        seen = np.asarray(transients[0][1], float)[:, 0]
        beyond = max(seen.min() - found[0], found[0] - seen.max())
        if beyond <= 0 or beyond > np.ptp(seen):
            return unseen
        error = math.hypot(found[1], FAR * beyond)
    return Delay(delay, math.hypot(error, unseen.error))


def _grows(rate: float, seen: Any) -> bool:
    """Whether a transient gets larger in time."""
    value, size, _ = np.asarray(seen, float).T
    return float(np.polyfit(value, size, 1)[0]) * rate > 0


def _delay_of_growth(value: float, rate: float, seen: np.ndarray) -> Delay:
    """From where the growth is seen on; unseen it may have lasted as long as from UNSEEN on.

    That is twice as long as at its pace, which it had not from the beginning.
    """
    weight = seen[:, 2] ** -1.0
    pace = float(np.polyfit(seen[:, 0], seen[:, 1], 1, w=weight)[0])  # [1/Hz]
    unseen = abs(rate) * SETTLING / value
    delay = value - float(seen[np.argmax(seen[:, 0] * -math.copysign(1.0, rate)), 0])
    if pace * rate <= 0 or delay * rate <= 0:
        return Delay(0.0, unseen)
    return Delay(delay, math.hypot(2 * UNSEEN / pace, unseen))
