"""What to read of a file, decided before any sample is read."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from .._arguments import choice, number, text
from ..errors import ImpactsigWarning, InvalidInput, UnreadableFile
from ..recording import Recording, Sensor, channel_index, check_calibration, sample_span
from ._source import Signal, Source
from .formats import guarded
from .times.timebase import DOUBTFUL
from .times.uneven import resampled

AUDIO_RATES = frozenset(
    (8000, 11025, 12000, 16000, 22050, 24000, 32000, 44100, 48000, 88200, 96000, 176400, 192000)
)
"""Rates that sound is recorded at [Hz]."""


class Plan(NamedTuple):
    """Which signals to read, over which span, and how to convert them."""

    channels: list[int]
    rate: float
    origin: float
    first: int
    last: int
    sensor: Sensor
    scale: float
    offset: float
    unit: str | None


def prepare(
    path: str | PathLike[str],
    channel: str | int | None,
    start: float | None,
    stop: float | None,
    scale: float,
    offset: float,
    unit: str | None,
    rate: float | None,
    sensor: Sensor | None,
    resample: float | None,
    opened: Callable[[], Source],
) -> tuple[Source, Plan]:
    """Open a file by calling `opened`, and decide what to read."""
    if rate is not None and resample is not None:
        raise InvalidInput("resample", resample, "None where rate is given", "Give one of the two")
    check_calibration(scale, offset)
    if rate is not None:
        rate = number("rate", rate, "a positive number [Hz]", above=0)
    if unit is not None:
        text("unit", unit)
    if sensor is not None:
        choice("sensor", sensor, ("force", "sound"))
    source = opened()
    try:
        if resample is not None:
            source = resampled(source, resample, path)
        _warn_of_notes(source, path)  # first: it may say why there is no such channel
        signals = source.signals
        if rate is not None:
            signals = tuple(replace(signal, rate=rate) for signal in signals)
        channels = _largest_set(signals) if channel is None else [_find(signals, channel)]
        chosen = signals[channels[0]]
        in_file = source.signals[channels[0]].rate
        if rate is not None and in_file is not None and abs(rate - in_file) > DOUBTFUL * in_file:
            of = f" for {chosen.name!r}" if chosen.name else ""
            _warn(
                f"{path}: the file gives a rate of {in_file:g} Hz{of}; rate={rate:g} Hz is taken "
                "instead"
            )
        if chosen.length == 0:
            raise UnreadableFile(path, f"channel {chosen.name!r} contains no samples")
        if chosen.rate is None:
            remedy = f"{chosen.no_rate or 'The file does not tell it'}; give rate= (--rate)"
            if source.times is not None:
                remedy += ", or resample= (--resample) to interpolate between the times there are"
            raise InvalidInput("rate", None, f"the number of samples per second of {path}", remedy)
        if not chosen.start < chosen.start + chosen.length / chosen.rate < math.inf:
            raise UnreadableFile(
                path,
                f"its samples begin at {chosen.start:g} s, and are {chosen.length / chosen.rate:g} "
                "s long: no clock tells them apart",
            )
        first, last = sample_span(start, stop, chosen.rate, chosen.length, chosen.start)
        if sensor is None:
            sound = source.audio and unit is None and chosen.rate in AUDIO_RATES
            sensor = "sound" if sound else "force"
        if channel is None:
            _warn_of_other_channels(signals, channels, path)
    except BaseException:
        source.close()
        raise
    plan = Plan(
        channels, chosen.rate, chosen.start, first, last, sensor, float(scale), float(offset), unit
    )
    return source, plan


def recording(source: Source, plan: Plan, first: int, last: int, name: str) -> Recording:
    """Samples [first, last) as a Recording; fewer, with a warning, if the file ends early."""
    with guarded(Path(name), source.format):
        samples = source.read(plan.channels, first, last)
    truncated = bool(source.truncated)
    if len(samples) < last - first:
        if not len(samples) and first == plan.first:
            raise UnreadableFile(name, f"has none of its {last} samples", "The file is cut short")
        truncated = True
        warnings.warn(
            f"{name}: cut short after {first + len(samples)} of {last} samples",
            ImpactsigWarning,
            stacklevel=3,
        )
    signals = [source.signals[index] for index in plan.channels]
    found = Recording(
        samples=samples[:, 0] if len(signals) == 1 else samples,
        rate=plan.rate,
        units=tuple(signal.unit for signal in signals),
        channels=tuple(signal.name for signal in signals),
        start=plan.origin + first / plan.rate,
        recorded_at=signals[0].recorded_at,
        source=name,
        sensor=plan.sensor,
        truncated=truncated,
    )
    return found.calibrate(plan.scale, plan.offset, plan.unit)


def _find(signals: tuple[Signal, ...], which: str | int) -> int:
    """Index of a signal by full name, by a short name that only it has, or by index."""
    names = tuple(signal.name for signal in signals)
    if isinstance(which, str) and which not in names:
        found = [i for i, signal in enumerate(signals) if signal.alias == which]
        if len(found) == 1:
            return found[0]
        if found:
            listed = ", ".join(repr(names[i]) for i in found)
            raise InvalidInput("channel", which, f"one of {listed}", "Several have this name")
    return channel_index(names, which)


def _sets(signals: tuple[Signal, ...]) -> list[list[int]]:
    """Indices of signals with a common time base and length, set by set."""
    sets: dict[tuple, list[int]] = {}
    for index, signal in enumerate(signals):
        key = (signal.rate, signal.length, signal.start, signal.segment, signal.recorded_at)
        sets.setdefault(key, []).append(index)
    return list(sets.values())


def _largest_set(signals: tuple[Signal, ...]) -> list[int]:
    return max(_sets(signals), key=lambda chosen: sum(signals[i].length for i in chosen))


def _warn_of_notes(source: Source, path: str | PathLike[str]) -> None:
    """Warn of defects of the file."""
    if source.truncated:
        _warn(f"{path}: cut short: {source.truncated}")
    for note in source.notes:
        _warn(f"{path}: {note}")


def _warn_of_other_channels(
    signals: tuple[Signal, ...], loaded: list[int], path: str | PathLike[str]
) -> None:
    """Warn of the channels that are not loaded."""
    if len(loaded) == len(signals):
        return
    left = [signal for index, signal in enumerate(signals) if index not in loaded]
    rates = ["unknown rate" if s.rate is None else f"{s.rate:g} Hz" for s in left]
    listed = ", ".join(
        f"{signal.name!r} ({signal.length} samples at {rate})"
        for signal, rate in list(zip(left, rates, strict=True))[:8]
    )
    more = f" and {len(left) - 8} more" if len(left) > 8 else ""
    _warn(
        f"{path}: channels of another length, rate or time are left out: {listed}{more}. "
        f"Read one with channel={left[0].name!r}"
    )


_warn = partial(warnings.warn, category=ImpactsigWarning, stacklevel=4)
