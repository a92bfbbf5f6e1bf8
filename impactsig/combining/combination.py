"""One train of impacts from several sensors of the same machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._arguments import entries, instance, number, whole
from .._showing import Shown
from ..errors import InvalidInput
from ..impacts import Impacts
from ._columns import combined_columns, measuring_contacts
from ._delays import delay_of
from ._gaps import gaps_of_stops
from ._notes import clipped, missed, units_differ


@dataclass(frozen=True, eq=False)
class Combination(Shown):
    """Impacts that several sensors recorded, each once.

    Attributes
    ----------
    impacts : Impacts
        All impacts, in the clock of the first sensor. The instant is the weighted mean over the
        sensors that recorded the impact and have standard errors; if none has, that of the first
        sensor, with an infinite error. Other columns are those of the sensor in which the impact is
        strongest, among the sensors that have them (for peaks and impulses in different units,
        among those that measure contact times). If none of these recorded the impact, the value is
        the mean of the measured ones before and after it, with an infinite error; a column without
        standard errors is omitted. A gap is a span in which no sensor recorded, or, if sensors
        belong to stops, no sensor of one of the stops: its impacts are missed.
    index : ndarray of int, shape (n, sensors)
        Index of the impact in the train of each sensor, -1 if the sensor did not record it.
    delays, delay_errors : ndarray, shape (sensors,)
        Delay of each sensor relative to the first, and its standard error [s]; inf if the two have
        too few impacts in common, in which case the delay is taken as 0.

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
    longest_delay: float | None = None,
) -> Combination:
    """Combine the trains of several sensors of one machine into one train.

    The delay of each sensor, for example the travel time of sound to a microphone, is estimated by
    `align_impacts` without skew. Impacts of two sensors that differ by at most `within` after
    correction for the delays are the same impact, by the optimal assignment of `match_impacts`.

    Parameters
    ----------
    trains : sequence of Impacts
        The train of each sensor, all in the same clock.
    stops : sequence of int or None, optional
        The stop that each sensor belongs to; None for a sensor that records all stops. An impact is
        assigned to the stop of the sensor in which it is strongest, by peaks if the sensors have
        the same unit, otherwise by peaks relative to the ninth decile of each sensor. If any of the
        peaks is clipped, the assignment is uncertain, and the impact is flagged as clipped.
    within : float
        Greatest difference between two instants of the same impact [s].
    longest_delay : float, optional
        Greatest difference of delays [s]. For periodic trains it must be less than half of their
        period. By default it is `within` for two load cells, which respond to an impact at the same
        time, so that the impacts of a machine that hits two stops in turn are kept apart. Otherwise
        it is 0.05 s, in which sound travels 17 m. If several delays below this limit match equally
        well, the smallest is taken; if none matches, any delay at which most impacts of one train
        are in the other, as for an instrument that was started later; between two load cells, only
        one that varies much less than the intervals do. `impacts.notes` reports this.

    Returns
    -------
    Combination

    Raises
    ------
    InvalidInput
        If there is no train, an argument is out of range, several delays match equally well, or a
        sensor of a stop has impacts without peaks.

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
    required = "a sequence of Impacts, one for each sensor"
    trains = entries("trains", trains, required)
    if not trains:
        raise InvalidInput("trains", trains, required)
    for k, train in enumerate(trains):
        instance(f"trains[{k}]", train, Impacts, "Impacts")
    within = number("within", within, above=0)
    if longest_delay is not None:
        longest_delay = number("longest_delay", longest_delay, above=0)
    stop_of_sensor = stops_of_sensors(stops, len(trains))
    for k, (one, train) in enumerate(zip(stop_of_sensor, trains, strict=True)):
        if one is not None and train.peak is None:
            raise InvalidInput(
                "stops", stops, "stops of sensors that measure peaks", f"trains[{k}] has none"
            )
    time = trains[0].time
    index = np.arange(len(time))[:, None]
    delays, errors, notes = [0.0], [0.0], list[str]()
    for train in trains[1:]:
        earlier = zip(trains, delays, strict=False)
        cells = [late for one, late in earlier if one.sensor == train.sensor == "force"]
        cell = cells[0] if cells else None
        delay, error, note = delay_of(train, time, cell, within, longest_delay)
        notes += [note] if note else []
        delays.append(delay)
        errors.append(error)
        time, index = _join(time, index, train.time - delay, within)
    gaps = gaps_of_stops(trains, delays, stop_of_sensor)
    notes += clipped(trains) + units_differ(trains) + missed(trains, delays, index, gaps)
    known = combined_columns(trains, index, np.array(delays), stop_of_sensor)
    order = np.argsort(known["time"], kind="stable")
    start = min(train.start - late for train, late in zip(trains, delays, strict=True))
    stop = max(train.stop - late for train, late in zip(trains, delays, strict=True))
    first = trains[0]
    measuring = measuring_contacts(trains)
    impacts = Impacts(
        **{name: values[order] for name, values in known.items()},
        start=start,
        duration=stop - start,
        unit=trains[measuring[0]].unit if measuring else "",
        contact_level=_contact_level(trains) if "contact_time" in known else None,
        gaps=gaps,
        sensor=first.sensor if len({train.sensor for train in trains}) == 1 else "",
        source=first.source,
        recorded_at=first.recorded_at,
        reason="" if len(time) else "; ".join(dict.fromkeys(t.reason for t in trains if t.reason)),
        notes=tuple(dict.fromkeys(note for train in trains for note in train.notes))
        + tuple(dict.fromkeys(notes)),
        disturbances=tuple(
            sorted((one for train in trains for one in train.disturbances), key=lambda d: d.start)
        ),
    )
    index = index[order]
    index.flags.writeable = False
    return Combination(impacts, index, np.array(delays), np.array(errors))


def _contact_level(trains: Sequence[Impacts]) -> float | str | None:
    """Level at which the contact times of the combined train are measured."""
    return next(train.contact_level for train in trains if train.contact_time is not None)


def stops_of_sensors(stops: Any, count: int) -> list[int | None]:
    """Validate the stops that sensors belong to.

    Raises
    ------
    InvalidInput
        If there are not as many stops, or one is neither None nor a whole number.
    """
    if stops is None:
        return [None] * count
    required = f"a whole number, 0 or greater, or None, for each sensor ({count})"
    each = entries("stops", stops, required)
    if len(each) != count:
        raise InvalidInput("stops", stops, required)
    return [None if stop is None else whole("stops", stop, 0) for stop in each]


def _join(
    time: np.ndarray, index: np.ndarray, other: np.ndarray, within: float
) -> tuple[np.ndarray, np.ndarray]:
    """Instants of both trains in one, and the index of each impact in either."""
    from .._numerics.assignment_kernels import assign

    pairs = assign(other, time, within)
    of_other = np.full(len(time), -1)
    of_other[pairs[:, 1]] = pairs[:, 0]
    alone = np.setdiff1d(np.arange(len(other)), pairs[:, 0])
    joined = np.concatenate((time, other[alone]))
    none = np.full((len(alone), index.shape[1]), -1)
    rows = np.column_stack((np.concatenate((index, none)), np.append(of_other, alone)))
    order = np.argsort(joined, kind="stable")
    return joined[order], rows[order]
