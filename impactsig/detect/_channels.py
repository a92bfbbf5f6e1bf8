"""Several sensors of one machine: each searched alone, then one train of them all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from ..combining import combine_impacts
from ..errors import InvalidInput
from ..impacts import Impacts

FORCE_ONLY = ("threshold", "polarity", "contact_level", "contact_time")
"""Arguments that say nothing of sound, where channels are of both."""


def detect_channels(
    detect: Callable[..., Impacts],
    source: Any,
    channels: Sequence[str | int],
    sensors: Any,
    stops: Sequence[int | None] | None,
    options: dict[str, Any],
) -> Impacts:
    """As `detect_impacts` does it for several channels."""
    if not channels:
        raise InvalidInput("channel", channels, "a channel or more")
    alike = sensors is None or isinstance(sensors, str)
    kinds = [sensors] * len(channels) if alike else list(sensors)
    if len(kinds) != len(channels):
        raise InvalidInput("sensor", sensors, f"one for each of {len(channels)} channels")
    mixed = len(set(kinds)) > 1
    trains = []
    for channel, kind in zip(channels, kinds, strict=True):
        without = FORCE_ONLY if mixed and kind == "sound" else ()
        own = {name: value for name, value in options.items() if name not in without}
        trains.append(detect(source, channel=channel, sensor=kind, **own))
    found = combine_impacts(trains, stops=stops)
    names = [train.settings["channel"] for train in trains]
    return replace(
        found.impacts,
        settings={
            "channel": names,
            "delay": dict(zip(names, found.delays.tolist(), strict=True)),
            "delay_error": dict(zip(names, found.delay_errors.tolist(), strict=True)),
            "of_channel": {
                name: dict(train.settings) for name, train in zip(names, trains, strict=True)
            },
        },
    )
