"""Search a force record, and put what was found into the columns and settings of `Impacts`."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._trains.impact_columns import ERRORS, SHARED_ERRORS
from ..errors import InvalidInput
from ..impacts import KINDS, Disturbance
from ._both_ways import detect_both_ways, other_way
from ._force import MOST_SAMPLES, detect_force
from ._force_impacts import ForceImpacts
from ._force_stretch import Wanted
from ._merge import Columns
from ._notes import force_notes
from .signal.source import Source


def find_force(
    source: Source, wanted: Wanted, contact_level: float | str
) -> tuple[Columns, dict[str, Any]]:
    """Columns of the impacts of a force record, and what else `Impacts` holds of them."""
    _refuse_long(wanted, source.head.rate)
    rate, in_memory = source.head.rate, source.in_memory
    found = detect_force(source.pieces, rate, wanted, in_memory=in_memory)
    columns, run = _described(found, source, wanted, contact_level)
    if found is not None and found.either:
        count, rings = other_way(source.pieces, rate, wanted, found, in_memory=in_memory)
        if count:
            why = (
                "most of them close to one: where a structure rings that the impacts shake, "
                'sensor="sound" finds when each of them begins, and merge_within takes those '
                "within such a time for one."
                if rings
                else "and disturb their search: where the sensor is between two stops, "
                'polarity="both" finds the impacts on either.'
            )
            note = f"{count} pulses as high as the impacts point the other way, {why}"
            run["notes"] = (note, *run["notes"])
    return columns, run


def find_both_ways(
    source: Source, wanted: Wanted, contact_level: float | str
) -> tuple[Columns, dict[str, Any]]:
    """Impacts on two stops that one sensor is between: 0 where it is pushed up, 1 down."""
    _refuse_long(wanted, source.head.rate)
    ways = detect_both_ways(source.pieces, source.head.rate, wanted, in_memory=source.in_memory)
    if ways is None:
        return _described(None, source, wanted, contact_level)
    (up, run), (down, other) = [_described(one, source, wanted, contact_level) for one in ways]
    stops = np.repeat((0, 1), (len(up["time"]), len(down["time"])))
    columns = {name: np.concatenate((up[name], down[name])) for name in up} | {"stop_index": stops}
    order = np.argsort(columns["time"], kind="stable")
    if len(down["time"]) > len(up["time"]):
        run, other = other, run
    run["settings"]["polarity"] = "both"
    run["notes"] = tuple(dict.fromkeys((*run["notes"], *other["notes"])))
    # What is no pulse disturbs the search of both directions alike.
    wide = tuple(one for one in other["disturbances"] if one.kind == "wide")
    run["disturbances"] = tuple(sorted((*run["disturbances"], *wide), key=lambda one: one.start))
    return {name: values[order] for name, values in columns.items()}, run


def _refuse_long(wanted: Wanted, rate: float) -> None:
    """Raise InvalidInput if contacts of more samples than can be searched for were asked for."""
    if wanted.longest is not None and wanted.longest * rate > MOST_SAMPLES:
        raise InvalidInput(
            "contact_time",
            (wanted.shortest, wanted.longest),
            f"contacts of at most {MOST_SAMPLES:g} samples, {MOST_SAMPLES / rate:g} s",
            "Resample the recording: such long contacts need fewer samples a second",
        )


def _described(
    found: ForceImpacts | None, source: Source, wanted: Wanted, contact_level: float | str
) -> tuple[Columns, dict[str, Any]]:
    """Columns of what was found in a force record, and what there is to say of it."""
    rate, unit, start = source.head.rate, source.head.unit, source.head.start
    names = (
        *("time", "contact_time", "peak", "impulse", "rise_time"),
        *(*ERRORS, *SHARED_ERRORS, "probability"),
    )
    if found is None:
        columns: Columns = {name: np.empty(0) for name in names} | {"flags": np.empty(0, np.uint8)}
        reason = "the record is constant, or too short to show its noise"
        return columns, {"reason": reason, "settings": {}}
    if wanted.level.sigma is not None and found.silent:
        raise InvalidInput(
            "threshold",
            f"{wanted.level.sigma:g} sigma",
            "a level in the unit",
            "This record has no noise to take a multiple of",
        )
    first, contact, peak, impulse, rise = found.columns.T
    values = (
        start + first / rate,
        contact / rate,
        peak,
        impulse / rate,
        rise / rate,
        *(found.errors / (rate, rate, 1.0, rate)).T,
        *(found.shared / (rate, 1.0)).T,
        found.probability,
    )
    columns = dict(zip(names, values, strict=True)) | {"flags": found.flags}
    level = found.threshold
    if wanted.level.unit is not None:
        level = wanted.level.unit
    elif wanted.level.sigma is not None:
        level = wanted.level.sigma * found.response_noise
    reason = ""
    if not len(first):
        shown = f" {unit}" if unit else ""
        reason = f"no pulse reaches the threshold of {level:.3g}{shown}"
        if found.disturbances:
            reason += f", but for what is none: {_counted(found.disturbances)}"
    settings: dict[str, Any] = {
        "least_probability": wanted.level.least_probability,
        "polarity": "positive" if found.sign > 0 else "negative",
        "width": found.width / rate,
        "response_noise": found.response_noise,
    }
    if found.step:
        settings["converter_step"] = found.step
    if found.saturation is not None:
        settings["saturation"] = found.saturation
    if found.hum:
        settings["hum"] = {f"{f:g} Hz": a for f, a in found.hum.items()}
    if found.constant:
        settings["ac_coupling"] = found.constant / rate
    silent = [one.duration / rate for one in found.disturbances if one.kind == "dropout"]
    if silent:
        settings["dropouts"] = sum(silent)
    if wanted.longest is not None:
        settings["contact_time"] = (wanted.shortest, wanted.longest)
    return columns, {
        "threshold": level,
        "noise": found.noise,
        "contact_level": contact_level,
        "reason": reason,
        "notes": force_notes(found, rate, wanted.longest is None),
        "disturbances": tuple(
            Disturbance(one.kind, start + one.start / rate, one.duration / rate, one.height)
            for one in found.disturbances
        ),
        "settings": settings,
    }


def _counted(disturbances: list[Disturbance]) -> str:
    """Number of disturbances of each kind, in words."""
    kinds = [one.kind for one in disturbances]
    return ", ".join(f"{kinds.count(kind)} {KINDS[kind]}" for kind in dict.fromkeys(kinds))
