"""The columns of a train that combines those of several sensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._trains import impact_columns as tables
from .._trains.impact_flags import CLIPPED
from ..impacts import Impacts

STRENGTH = 0.9
"""Quantile of its peaks that tells what a sensor makes of a strong impact."""
IN_THE_UNIT = ("peak", "impulse")
OF_SEVERAL = (
    "time_error",
    "probability",
    "stop_index",
    "stop_probability",
    "pulses",
)


def measuring_contacts(trains: Sequence[Impacts]) -> list[int]:
    """The sensors whose peaks are kept: all if their units agree, else the load cells."""
    every = range(len(trains))
    if _one_unit(trains):
        return [*every]
    found = [k for k in every if trains[k].contact_time is not None]
    return found if found and _one_unit([trains[k] for k in found]) else []


def combined_columns(
    trains: Sequence[Impacts], index: np.ndarray, delays: np.ndarray, stops: list[int | None]
) -> dict[str, Any]:
    """Merge the columns of several trains, impact by impact.

    Parameters
    ----------
    index : ndarray of int, shape (n, sensors)
        Which impact of each train it is, -1 where that has none.
    delays : ndarray, shape (sensors,)
    stops : list of int or None
        Which stop each sensor belongs to.
    """
    seen = index >= 0
    earliest = np.argmax(seen, axis=1)
    known = _instants(trains, index, delays, earliest)
    chances = [train.probability for train in trains if train.probability is not None]
    if len(chances) == len(trains):
        known["probability"] = 1.0 - np.prod(1.0 - _at(chances, index, 0.0), axis=1)
    strength = _strength(trains, index)
    # Where peaks cannot be compared, the first sensor that recorded it.
    rank = strength if strength is not None else np.where(seen, -np.arange(len(trains)), -np.inf)
    measuring = measuring_contacts(trains)
    for name in tables.MEASURED:
        if name in OF_SEVERAL or name in (*tables.ERRORS, *tables.SHARED_ERRORS):
            continue
        allowed = measuring if name in IN_THE_UNIT else range(len(trains))
        of = [k for k in allowed if getattr(trains[k], name) is not None]
        if of and seen[:, of].any():
            known |= _of_strongest(name, [trains[k] for k in of], index[:, of], rank[:, of])
    flags = _at([train.flags for train in trains], index, 0)
    if measuring:
        felt = np.any(seen[:, measuring], axis=1, keepdims=True)
        others = ~np.isin(np.arange(len(trains)), measuring)
        rank = np.where(felt & others, -np.inf, rank)
    known["flags"] = np.take_along_axis(flags, np.argmax(rank, axis=1)[:, None], axis=1)[:, 0]
    at = [k for k, stop in enumerate(stops) if stop is not None]
    if at and strength is not None:
        place = np.array([stops[k] for k in at])
        which = place[np.argmax(strength[:, at], axis=1)]
        known["stop_index"] = np.where(seen[:, at].any(axis=1), which, -1)
        known["flags"] = known["flags"] | (flags[:, at] & CLIPPED).max(axis=1)
    return known


def _instants(
    trains: Sequence[Impacts], index: np.ndarray, delays: np.ndarray, earliest: np.ndarray
) -> dict[str, np.ndarray]:
    """Weighted means of the instants, and their errors, if any sensor has some."""
    instants = _at([t.time - late for t, late in zip(trains, delays, strict=True)], index, 0.0)
    time = instants[np.arange(len(index)), earliest]
    if all(train.time_error is None for train in trains):
        return {"time": time}
    each = [np.full(len(t), np.inf) if t.time_error is None else t.time_error for t in trains]
    errors = _at(each, index, np.inf)
    # An exact instant has all the weight.
    weight = np.where(index >= 0, 1.0 / np.maximum(errors, 1e-12) ** 2, 0.0)
    total = weight.sum(axis=1)
    known = np.where(total > 0, total, 1.0)
    error = np.where(total > 0, 1.0 / np.sqrt(known), np.inf)
    error = np.where(error <= 1e-12, 0.0, error)
    columns = {
        "time": np.where(total > 0, (weight * instants).sum(axis=1) / known, time),
        "time_error": error,
    }
    if any(train.shared_time_error is not None for train in trains):
        parts = [
            np.zeros(len(t)) if t.shared_time_error is None else t.shared_time_error for t in trains
        ]
        # Each sensor's is its own.
        shared = np.sqrt(((weight * _at(parts, index, 0.0)) ** 2).sum(axis=1)) / known
        columns[tables.SHARED] = np.minimum(shared, error)
    return columns


def _of_strongest(
    name: str, trains: Sequence[Impacts], index: np.ndarray, rank: np.ndarray
) -> dict[str, np.ndarray]:
    """A column with its standard errors, taken from the sensor with the highest peak.

    What none of these sensors recorded is filled in, where errors can say so; else there is none.
    """
    chosen = np.argmax(rank, axis=1)[:, None]
    missed = ~(index >= 0).any(axis=1)
    names = [name]
    for part in (f"{name}_error", f"shared_{name}_error"):
        if all(getattr(train, part, None) is not None for train in trains):
            names.append(part)
    if missed.any() and f"{name}_error" not in names:
        return {}
    felt = np.flatnonzero(~missed)
    after = np.searchsorted(felt, np.flatnonzero(missed))
    left, right = felt[np.maximum(after - 1, 0)], felt[np.minimum(after, len(felt) - 1)]
    known = {}
    for one in names:
        values = _at([getattr(train, one) for train in trains], index, 0)
        known[one] = np.take_along_axis(values, chosen, axis=1)[:, 0]
        known[one][missed] = tables.filled(one, known[one], left, right)
    return known


def _at(columns: Sequence[np.ndarray], index: np.ndarray, missing: float) -> np.ndarray:
    """A column of each train at the impacts, shape (n, sensors)."""
    padded = [np.append(one, one.dtype.type(missing)) for one in columns]
    return np.column_stack([one[i] for one, i in zip(padded, index.T, strict=True)])


def _strength(trains: Sequence[Impacts], index: np.ndarray) -> np.ndarray | None:
    """Peaks in comparable units if all trains have them; -inf where a sensor missed the impact."""
    peaks = []
    for train in trains:
        if train.peak is None:
            return None
        usual = 1.0
        if not _one_unit(trains) and len(train):
            usual = float(np.quantile(train.peak, STRENGTH)) or 1.0
        peaks.append(train.peak / usual)
    return np.where(index >= 0, _at(peaks, index, -np.inf), -np.inf)


def _one_unit(trains: Sequence[Impacts]) -> bool:
    return len({(train.unit, train.sensor) for train in trains}) == 1
