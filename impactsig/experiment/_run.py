"""Analysis of one recording: impacts, forcing, period, and their statistics."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..detect.files import detect_file
from ..errors import ImpactsigError, ImpactsigWarning, InvalidInput
from ..intervals.forcing import forcing_cycles, keeps_phase, rising_instants
from ..intervals.period import identify_period
from ..io import read
from ._contacts import mean_contact
from ._motions import NO_IMPACTS
from ._rig_tables import which
from ._sweep import swept
from .parameter import _PART, recorded_value
from .rig import Rig

if TYPE_CHECKING:
    from ..impacts import Impacts
    from ..intervals import Periodicity

UNLOCKED = (
    "the impacts keep no phase of a forcing within 0.2 % of the stated frequency: was it swept, or "
    "is it another?"
)


class Run(NamedTuple):
    """The stored result of a recording."""

    impacts: Impacts
    summary: dict[str, Any]


def worked_out(path: Path, rig: Rig, frequency: float | None) -> Run:
    """Detect the impacts of a recording and identify its motion.

    Parameters
    ----------
    path : Path
        The recording.
    rig : Rig
        How it is read.
    frequency : float or None
        Forcing frequency [Hz] as far as it is stated; a forcing channel takes precedence.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ImpactsigWarning)
        impacts = detect_file(path, rig.reading_options(), rig.detecting_options())
        instants = forcing_instants(rig, path)
        cycles = None
        if instants is not None:
            if len(instants) < 2:
                raise InvalidInput("channel", _named(rig), "a forcing that rises twice or more")
            inside = impacts.time if len(impacts) else instants[:1]
            cycles, period = forcing_cycles(instants, inside)
            frequency = 1 / period
        value = recorded_value(rig, path, frequency)
        summary = described(impacts, rig, None if rig.sweep else frequency, instants)
    notes = [str(one.message) for one in caught if issubclass(one.category, ImpactsigWarning)]
    stated = frequency if instants is None and not rig.sweep else None
    if stated and len(impacts) > 1 and not keeps_phase(impacts.time, stated):
        notes.append(UNLOCKED)
    return Run(
        impacts,
        summary
        | {
            "value": _plain(value),
            "forcing_frequency": frequency,
            "cycles": None if cycles is None else cycles[: len(impacts)].tolist(),
            "notes": list(dict.fromkeys([*impacts.notes, *notes])),
        },
    )


def forcing_instants(rig: Rig, path: Path) -> np.ndarray | None:
    """Instants at which forcing periods begin, if the rig records the forcing."""
    channel = rig.forcing_channel
    if channel is None:
        return None
    options = {name: one for name, one in rig.reading_options().items() if name in _PART}
    recording = read(path, channel=which(channel), **options)
    return rising_instants(recording)[:: channel.get("pulses", 1)]


def described(
    impacts: Impacts, rig: Rig, frequency: float | None, instants: np.ndarray | None
) -> dict[str, Any]:
    """The row of a run in the table of the experiment."""
    row: dict[str, Any] = {
        "impacts": len(impacts),
        "duration": impacts.duration,
        "sensor": impacts.sensor,
        "unit": impacts.unit,
        "reason": impacts.reason,
        "recorded_at": impacts.recorded_at.isoformat() if impacts.recorded_at else None,
    }
    intervals = impacts.intervals()
    row |= _moments("interval", intervals)
    for name in ("contact_time", "peak", "impulse"):
        column = getattr(impacts, name)
        row |= _moments(name, np.empty(0) if column is None else column)
    timed = impacts.contact_time is not None and impacts.duration > 0
    row["time_in_contact"] = impacts.time_in_contact() if timed else None
    row["contact_time_error"] = None
    if not rig.sweep and row["contact_time"] is not None:
        plain = row["contact_time"]
        row["contact_time"], row["contact_time_error"] = mean_contact(impacts)
        if row["time_in_contact"] and plain:
            row["time_in_contact"] *= row["contact_time"] / plain
    row["impacts_per_period"] = (
        len(impacts) / (frequency * impacts.duration) if frequency and impacts.duration else None
    )
    row |= _period(impacts, rig, frequency, instants)
    if rig.report.get("dimension"):
        row |= _dimension(impacts, row)
    return row


def _period(
    impacts: Impacts, rig: Rig, frequency: float | None, instants: np.ndarray | None
) -> dict[str, Any]:
    nothing = dict.fromkeys(("m", "n", "jitter", "missed", "spurious", "locked_frequency"))
    if not len(impacts):
        return {"kind": NO_IMPACTS, "period": NO_IMPACTS, "confidence": 1.0, **nothing}
    if rig.sweep:
        found = swept(impacts, rig, instants)
        return {"kind": "swept", "period": "", "confidence": None, **nothing, **found}
    period: Periodicity = identify_period(
        impacts,
        None if instants is not None or frequency is None else 1 / frequency,
        forcing=instants,
        max_periods=rig.report.get("periods", 8),
    )
    return {
        "kind": period.kind,
        "period": period.name,
        "confidence": period.confidence,
        "m": period.impacts,
        "n": period.periods,
        "jitter": period.jitter,
        "missed": period.missed,
        "spurious": period.spurious,
        "locked_frequency": 1 / period.forcing_period if period.forcing_period else None,
    }


def _dimension(impacts: Impacts, row: dict[str, Any]) -> dict[str, Any]:
    if row["kind"] in ("periodic", "drifting", NO_IMPACTS):
        return {"dimension": 0.0, "dimension_low": 0.0, "dimension_high": 0.0}
    from ..reconstruct.dimensions.dimension import correlation_dimension

    try:
        found = correlation_dimension(impacts)
    except ImpactsigError:
        return dict.fromkeys(("dimension", "dimension_low", "dimension_high"))
    low, high = found.interval or (None, None)
    return {
        "dimension": _plain(found.dimension),
        "dimension_low": _plain(low),
        "dimension_high": _plain(high),
    }


def _moments(name: str, values: np.ndarray) -> dict[str, Any]:
    some = values[np.isfinite(values)]
    if not len(some):
        return {name: None, f"{name}_spread": None}
    mean = float(some.mean())
    if len(some) == 1:
        return {name: mean, f"{name}_spread": None}
    off = some - mean
    return {name: mean, f"{name}_spread": math.sqrt(float(off @ off) / (len(some) - 1))}


def _plain(value: Any) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _named(rig: Rig) -> str | int:
    channel = rig.forcing_channel
    assert channel is not None
    return which(channel)
