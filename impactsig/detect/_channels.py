"""Several sensors of one machine: detection in each, then one combined train."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from ..combining.combination import combine_impacts, stops_of_sensors
from ..errors import InvalidInput
from ..impacts import Impacts

FORCE_ONLY = ("threshold", "polarity", "contact_level", "contact_time")
"""Arguments that say nothing of sound, where channels are of both."""


def detect_channels(
    detect: Callable[..., Impacts],
    sources: Sequence[tuple[Any, str | int | None]],
    channels: Sequence[str | int],
    sensors: Any,
    stops: Sequence[int | None] | None,
    options: dict[str, Any],
    path: Any = None,
) -> Impacts:
    """Detect impacts in several channels and combine them into one train.

    Parameters
    ----------
    detect : callable
        Finds the impacts of one channel.
    sources : sequence of (source, channel)
        What to search for each of `channels`, and by which name the channel is chosen there.
    channels, sensors, stops, options
        As they were given.
    path : path-like, optional
        The recording, beside which the corrections of each channel are.
    """
    count = len(channels)
    if not count:
        raise InvalidInput("channel", channels, "a channel or more")
    twice = [one for one in channels if list(channels).count(one) > 1]
    if twice:
        raise InvalidInput("channel", twice[0], "every channel once", _ONCE)
    if options.get("polarity") == "both" and count > 1:
        raise InvalidInput(
            "polarity", "both", "one direction for several channels",
            "Search the channel of a sensor between two stops by itself",
        )  # fmt: skip
    alike = sensors is None or isinstance(sensors, str)
    kinds = [sensors] * count if alike else list(sensors)
    if len(kinds) != count:
        raise InvalidInput("sensor", sensors, f"one for all, or one for each of {count} channels")
    stops_of_sensors(stops, count)  # before hours of detection
    mixed = len(set(kinds)) > 1
    trains = []
    for (source, channel), kind in zip(sources, kinds, strict=True):
        without = FORCE_ONLY if mixed and kind == "sound" else ()
        own = {name: value for name, value in options.items() if name not in without}
        train = detect(source, channel=channel, sensor=kind, **own)
        trains.append(train if path is None else train.apply_corrections(path))
    names = _names([train.settings["channel"] for train in trains], channels)
    found = combine_impacts(trains, stops=stops)
    notes = [f"{name}: {note}" for name, train in zip(names, trains, strict=True)
             for note in train.notes]  # fmt: skip
    said = {note for train in trains for note in train.notes}
    notes += [note for note in found.impacts.notes if note not in said]
    if len(found.impacts):
        notes += [f"{name}: no impacts: {train.reason}"
                  for name, train in zip(names, trains, strict=True) if train.reason]  # fmt: skip
    return replace(
        found.impacts,
        notes=tuple(notes),
        settings={
            "channel": names,
            "stops": None if stops is None else list(stops),
            "delay": dict(zip(names, found.delays.tolist(), strict=True)),
            "delay_error": dict(zip(names, found.delay_errors.tolist(), strict=True)),
            "of_channel": {
                name: dict(train.settings) for name, train in zip(names, trains, strict=True)
            },
        },
    )


_ONCE = "One sensor counted twice would say that it is surer than it is"


def _names(found: list[str], channels: Sequence[str | int]) -> list[str]:
    """Names of the channels; equal names are numbered."""
    if len(set(found)) == len(found):
        return found
    if not all(isinstance(one, int) or str(one).isdecimal() for one in channels):
        raise InvalidInput("channel", ", ".join(map(str, channels)), "every channel once", _ONCE)
    return [f"{name} {number}".strip() for name, number in zip(found, channels, strict=True)]
