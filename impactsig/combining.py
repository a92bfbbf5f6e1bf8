"""One train of impacts from several sensors of the same machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _impact_columns as tables
from ._arguments import entries, number
from ._showing import Shown
from .alignment import align_impacts
from .errors import InvalidInput
from .impacts import Impacts

STRENGTH = 0.9
"""Quantile of its peaks that tells what a sensor makes of a strong impact."""
IN_THE_UNIT = ("peak", "peak_error", "impulse", "impulse_error")
OF_SEVERAL = ("time_error", "probability", "stop_index", "stop_probability", "pulses")


@dataclass(frozen=True, eq=False)
class Combination(Shown):
    """Impacts that several sensors recorded, each once.

    Attributes
    ----------
    impacts : Impacts
        All of them, in the clock of the first sensor. The instant is the weighted mean of those of
        the sensors that recorded an impact and know their errors; where none does, that of the
        first sensor, with an infinite error. Other columns, if all sensors have them, are those of
        the sensor in which the impact is strongest.
    index : ndarray of int, shape (n, sensors)
        Which impact of each sensor's train it is, -1 where that has none.
    delays, delay_errors : ndarray, shape (sensors,)
        How late each sensor is against the first, and the standard error [s]; inf where the two
        have too few impacts in common, and the delay is taken to be 0.

    See Also
    --------
    combine_impacts, results.Alignment

    Examples
    --------
    >>> from impactsig import Impacts, combine_impacts
    >>> left = Impacts.from_times([1.0, 1.5, 2.0])
    >>> right = Impacts.from_times([1.5, 2.5])
    >>> both = combine_impacts([left, right])
    >>> both.index
    array([[ 0, -1],
           [ 1,  0],
           [ 2, -1],
           [-1,  1]])
    """

    impacts: Impacts
    index: np.ndarray = field(repr=False)
    delays: np.ndarray
    delay_errors: np.ndarray


def combine_impacts(
    trains: Sequence[Impacts],
    *,
    stops: Sequence[int | None] | None = None,
    within: float = 1e-3,
    longest_delay: float = 0.05,
) -> Combination:
    """Make one train of those that several sensors of a machine recorded at the same time.

    How late each sensor is, as sound that travels to a microphone is, is found by `align_impacts`
    without skew. Impacts of two sensors at most `within` apart, once delays are taken off, are
    one, by the optimal assignment of `match_impacts`.

    Parameters
    ----------
    trains : sequence of Impacts
        One for each sensor, of one clock.
    stops : sequence of int or None, optional
        Which stop each sensor belongs to; None for one that hears them all. An impact is one on
        the stop whose sensor it is strongest in. Where sensors have one unit, peaks are compared,
        otherwise peaks over the ninth decile of each sensor's.
    within : float
        How far apart two instants of one impact may be [s].
    longest_delay : float
        Greatest difference of delays [s]; sound travels 17 m in the default. In trains that repeat
        themselves it must be less than half of what they repeat in.

    Returns
    -------
    Combination

    Raises
    ------
    InvalidInput
        If there is no train, an argument is out of range, several delays suit as well as each
        other, or a sensor of a stop has impacts without peaks.

    See Also
    --------
    align_impacts, match_impacts, detect_impacts

    Examples
    --------
    >>> from impactsig import Impacts, combine_impacts
    >>> left = Impacts.from_times([1.0, 1.5, 2.0], peak=[3.0, 0.2, 3.1])
    >>> right = Impacts.from_times([1.5, 2.5], peak=[2.9, 3.3])
    >>> both = combine_impacts([left, right], stops=[0, 1])
    >>> both.impacts.time, both.impacts.stop_index
    (array([1. , 1.5, 2. , 2.5]), array([0, 1, 0, 1]))
    """
    if not isinstance(trains, Sequence) or not trains:
        raise InvalidInput("trains", trains, "a sequence of Impacts, one for each sensor")
    for k, train in enumerate(trains):
        if not isinstance(train, Impacts):
            raise InvalidInput(f"trains[{k}]", train, "Impacts")
    within = number("within", within, above=0)
    longest_delay = number("longest_delay", longest_delay, above=0)
    own = stops_of_sensors(stops, len(trains))
    for k, (one, train) in enumerate(zip(own, trains, strict=True)):
        if one is not None and train.peak is None:
            raise InvalidInput(
                "stops", stops, "stops of sensors that measure peaks", f"trains[{k}] has none"
            )
    time = trains[0].time
    index = np.arange(len(time))[:, None]
    delays, errors = [0.0], [0.0]
    for train in trains[1:]:
        delay, error = _delay(train, Impacts(time), within, longest_delay)
        delays.append(delay)
        errors.append(error)
        time, index = _join(time, index, train.time - delay, within)
    known = _columns(trains, index, np.array(delays), own)
    order = np.argsort(known["time"], kind="stable")
    start = min(train.start - late for train, late in zip(trains, delays, strict=True))
    stop = max(train.stop - late for train, late in zip(trains, delays, strict=True))
    first = trains[0]
    impacts = Impacts(
        **{name: values[order] for name, values in known.items()},
        start=start,
        duration=stop - start,
        unit=first.unit if _one_unit(trains) else "",
        contact_level=first.contact_level if "contact_time" in known else None,
        gaps=_common_gaps(trains, delays),
        sensor=first.sensor if len({train.sensor for train in trains}) == 1 else "",
        source=first.source,
        recorded_at=first.recorded_at,
        reason="" if len(time) else "; ".join(dict.fromkeys(t.reason for t in trains if t.reason)),
        notes=tuple(dict.fromkeys(note for train in trains for note in train.notes)),
        disturbances=tuple(
            sorted((one for train in trains for one in train.disturbances), key=lambda d: d.start)
        ),
    )
    index = index[order]
    index.flags.writeable = False
    return Combination(impacts, index, np.array(delays), np.array(errors))


def stops_of_sensors(stops: Any, count: int) -> list[int | None]:
    """The stop that each of so many sensors belongs to.

    Raises
    ------
    InvalidInput
        If there are not as many stops, or one is neither None nor a whole number.
    """
    if stops is None:
        return [None] * count
    required = f"a whole number, 0 or greater, or None, for each sensor ({count})"
    own = entries("stops", stops, required)
    if len(own) != count or not all(one is None or _is_stop(one) for one in own):
        raise InvalidInput("stops", stops, required)
    return [None if one is None else int(one) for one in own]


def _is_stop(one: Any) -> bool:
    return isinstance(one, (int, np.integer)) and not isinstance(one, bool) and int(one) >= 0


def _delay(
    train: Impacts, reference: Impacts, within: float, longest: float
) -> tuple[float, float]:
    """How late a train is; (0, inf) where that cannot be seen."""
    if min(len(train), len(reference)) < 2:
        return 0.0, math.inf
    try:
        found = align_impacts(train, reference, within, longest_delay=longest, skew=False)
    except InvalidInput as error:
        if error.argument == "longest_delay":
            raise
        return 0.0, math.inf
    return found.delay, found.delay_error


def _join(
    time: np.ndarray, index: np.ndarray, other: np.ndarray, within: float
) -> tuple[np.ndarray, np.ndarray]:
    """Instants of both, and which impact of each train they are."""
    from ._assignment_kernels import assign

    pairs = assign(other, time, within)
    of_other = np.full(len(time), -1)
    of_other[pairs[:, 1]] = pairs[:, 0]
    alone = np.setdiff1d(np.arange(len(other)), pairs[:, 0])
    joined = np.concatenate((time, other[alone]))
    none = np.full((len(alone), index.shape[1]), -1)
    rows = np.column_stack((np.concatenate((index, none)), np.append(of_other, alone)))
    order = np.argsort(joined, kind="stable")
    return joined[order], rows[order]


def _columns(
    trains: Sequence[Impacts], index: np.ndarray, delays: np.ndarray, stops: list[int | None]
) -> dict[str, Any]:
    """What is known of each impact."""
    seen = index >= 0

    def of(values: Sequence[np.ndarray | None], missing: float) -> np.ndarray | None:
        """A column of each train at the impacts, shape (n, sensors), if all have it."""
        given = [one for one in values if one is not None]
        if len(given) < len(values):
            return None
        padded = [np.append(one, missing) for one in given]
        return np.column_stack([one[i] for one, i in zip(padded, index.T, strict=True)])

    instants = of([t.time - late for t, late in zip(trains, delays, strict=True)], 0.0)
    assert instants is not None
    rows = np.arange(len(index))
    earliest = np.argmax(seen, axis=1)
    known = {"time": instants[rows, earliest]}
    if any(train.time_error is not None for train in trains):
        errors = of(
            [
                np.full(len(train), np.inf) if train.time_error is None else train.time_error
                for train in trains
            ],
            np.inf,
        )
        assert errors is not None
        # An exact instant has all the weight.
        weight = np.where(seen, 1.0 / np.maximum(errors, 1e-12) ** 2, 0.0)
        total = weight.sum(axis=1)
        mean = (weight * instants).sum(axis=1) / np.where(total > 0, total, 1.0)
        known["time"] = np.where(total > 0, mean, known["time"])
        known["time_error"] = np.where(
            total > 0, 1.0 / np.sqrt(np.where(total > 0, total, 1.0)), np.inf
        )
        known["time_error"][known["time_error"] <= 1e-12] = 0.0
    chance = of([train.probability for train in trains], 0.0)
    if chance is not None:
        known["probability"] = 1.0 - np.prod(1.0 - chance, axis=1)
    strength = _strength(trains, of, seen)
    strongest = np.argmax(strength, axis=1) if strength is not None else earliest
    for name in (*tables.MEASURED, "flags"):
        values = of([getattr(train, name) for train in trains], 0)
        if values is None or name in OF_SEVERAL or (name in IN_THE_UNIT and not _one_unit(trains)):
            continue
        known[name] = values[rows, strongest]
    at = [k for k, stop in enumerate(stops) if stop is not None]
    if at and strength is not None:
        place = np.array([stops[k] for k in at])
        which = place[np.argmax(strength[:, at], axis=1)]
        known["stop_index"] = np.where(seen[:, at].any(axis=1), which, -1)
    return known


def _strength(trains: Sequence[Impacts], of: Any, seen: np.ndarray) -> np.ndarray | None:
    """Peaks, comparable from sensor to sensor; less than any where a sensor has none."""
    peaks: list[np.ndarray | None] = []
    for train in trains:
        if train.peak is None:
            peaks.append(None)
            continue
        usual = 1.0
        if not _one_unit(trains) and len(train):
            usual = float(np.quantile(train.peak, STRENGTH)) or 1.0
        peaks.append(train.peak / usual)
    strength = of(peaks, -np.inf)
    return None if strength is None else np.where(seen, strength, -np.inf)


def _one_unit(trains: Sequence[Impacts]) -> bool:
    return len({(train.unit, train.sensor) for train in trains}) == 1


def _common_gaps(trains: Sequence[Impacts], delays: Sequence[float]) -> np.ndarray:
    """Spans that are a gap of every train [s]."""
    edges = sorted(
        (float(at) - late, change)
        for train, late in zip(trains, delays, strict=True)
        for gap in train.gaps
        for at, change in zip(gap, (1, -1), strict=True)
    )
    found, open_, begin = [], 0, 0.0
    for at, change in edges:
        if open_ == len(trains):
            found.append((begin, at))
        open_ += change
        begin = at
    return np.array(found).reshape(-1, 2)
