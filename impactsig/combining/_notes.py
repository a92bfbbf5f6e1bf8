"""What makes the train of several sensors doubtful."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._trains.impact_flags import CLIPPED
from ..impacts import Impacts
from ._columns import measuring_contacts
from ._gaps import covered

ALONE = 0.1
"""Of a sensor's impacts: those that no other recorded, where more than a few were missed."""


def units_differ(trains: Sequence[Impacts]) -> list[str]:
    """A note if no peaks are kept because the sensors that measure force have several units."""
    units = [train.unit for train in trains if train.peak is not None]
    if not units or measuring_contacts(trains):
        return []
    named = ", ".join(repr(unit) for unit in dict.fromkeys(units))
    return [
        f"the sensors have different units ({named}), so that the combined train has no peaks and "
        "impulses; give all sensors one unit by scale= and unit=, or Recording.calibrate"
    ]


def clipped(trains: Sequence[Impacts]) -> list[str]:
    """A note for each sensor that is clipped, where there are others."""
    if len(trains) < 2:
        return []
    names = _names(trains)
    counts = [int(np.count_nonzero(train.flags & CLIPPED)) for train in trains]
    return [
        f"{name} is clipped in {count} of its {len(train)} impacts: what it measures there are "
        "lower bounds, and an impact that counts with the peak of another sensor may have been "
        "stronger in this one"
        for name, count, train in zip(names, counts, trains, strict=True)
        if count
    ]


def missed(
    trains: Sequence[Impacts], delays: Sequence[float], index: np.ndarray, gaps: np.ndarray
) -> list[str]:
    """A note for each sensor that alone records impacts where its gaps are none of the train."""
    alone = (index >= 0) & (np.count_nonzero(index >= 0, axis=1) == 1)[:, None]
    notes = []
    for k, (name, train, late) in enumerate(zip(_names(trains), trains, delays, strict=True)):
        own = np.count_nonzero(alone[:, k])
        lost = _length(train.gaps) - _length(covered([train.gaps - late, gaps], 2))
        if own > ALONE * len(train) and lost > 1e-9 * train.duration:
            notes.append(
                f"{name} has gaps of {lost:.3g} s in which others recorded, and {own} of its "
                f"{len(train)} impacts are in no other sensor: such impacts are missed there. "
                "Where each stop has its own sensors, stops= takes no interval across"
            )
    return notes


def _length(spans: np.ndarray) -> float:
    return float(np.sum(spans[:, 1] - spans[:, 0]))


def _names(trains: Sequence[Impacts]) -> list[str]:
    """What notes call the sensors."""
    names = [str(train.settings.get("channel", "")) for train in trains]
    if all(names) and len(set(names)) == len(names):
        return names
    return [f"sensor {k + 1}" for k in range(len(trains))]
