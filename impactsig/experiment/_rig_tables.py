"""The tables of a rig file: keys and permitted values."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from .._arguments import choice, entries, flag, instance, limits, number, text, whole
from ..errors import InvalidInput

USES = ("impacts", "forcing", "tacho")
SOURCES = ("file name", "table", "channel", "metadata")
BRANCHES = ("file name", "table")
SWEEPS = ("channel", "law", "impacts")


class Key(NamedTuple):
    """One key of a table."""

    check: Callable[[str, Any], Any]
    help: str
    """What it says, for the file that `impactsig rig` writes."""


def _texts(name: str, value: Any) -> str:
    if not text(name, value).strip():
        raise InvalidInput(name, value, "a text that is not empty")
    return str(value)


def _any(name: str, value: Any) -> Any:
    """A value that the detector checks itself, a number or a text."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise InvalidInput(name, value, "a number, or a text")
    return value


def _positive(name: str, value: Any) -> float:
    return number(name, value, above=0)


def _from_zero(name: str, value: Any) -> float:
    return number(name, value, least=0)


def _scale(name: str, value: Any) -> float:
    if number(name, value) == 0:
        raise InvalidInput(name, value, "a finite number other than 0")
    return float(value)


def _begin(name: str, value: Any) -> float | str:
    """Where a sweep begins: a number, or the parameter of each run."""
    if isinstance(value, str):
        return choice(name, value, ("parameter",))
    return number(name, value, '"parameter" or a frequency above 0 [Hz]', above=0)


def _one_of(*words: str) -> Callable[[str, Any], str]:
    return lambda name, value: choice(name, value, words)


def _whole(least: int) -> Callable[[str, Any], int]:
    return lambda name, value: whole(name, value, least)


def _pair(name: str, value: Any) -> tuple[float, float]:
    required = "the shortest and the longest contact [s], such as [0, 0.1]"
    return limits(name, value, required, least=0)


def _pattern(name: str, value: Any) -> str:
    required = "a regular expression with a group named value, such as (?P<value>[0-9.]+)Hz"
    try:
        found = re.compile(text(name, value))
    except re.error as error:
        raise InvalidInput(name, value, required, f"Here: {error}") from None
    if "value" not in found.groupindex:
        raise InvalidInput(name, value, required)
    return str(value)


CHANNEL = {
    "name": Key(_texts, "name of the channel"),
    "number": Key(_whole(0), "its number from 0, in place of the name"),
    "use": Key(_one_of(*USES), '"impacts", "forcing" (rises once a period) or "tacho"'),
    "sensor": Key(_one_of("force", "sound"), '"force" or "sound"'),
    "scale": Key(_scale, "multiply samples by this"),
    "offset": Key(number, "then add this"),
    "unit": Key(text, "unit of the result"),
    "stop": Key(_whole(0), "the stop that it is at, where each stop has a channel"),
    "pulses": Key(_whole(1), "pulses of a tacho in a forcing period"),
}
PARAMETER = {
    "name": Key(_texts, "what is changed from run to run"),
    "unit": Key(text, "its unit"),
    "from": Key(_one_of(*SOURCES), '"file name", "table", "channel" or "metadata"'),
    "pattern": Key(_pattern, 'with "file name": in the path below the folder; group branch too'),
    "table": Key(_texts, 'with "table": CSV beside the rig, columns file, value and branch'),
    "channel": Key(_texts, 'with "channel": its mean is taken; of a forcing its frequency'),
    "key": Key(_texts, 'with "metadata": what the file calls it'),
    "branch": Key(_one_of("up", "down"), "the branch of runs that say none"),
}
FORCING = {
    "frequency": Key(_any, '"parameter", or a frequency [Hz] of all runs'),
}
READING = {
    "start": Key(number, "begin here [s]"),
    "stop": Key(number, "end before here [s]"),
    "rate": Key(_positive, "samples per second of a file that tells none [Hz]"),
    "resample": Key(_positive, "rate to which uneven samples are interpolated [Hz]"),
}
RAW = {
    "type": Key(_texts, "numbers without a header: int16, float32, ..."),
    "channels": Key(_whole(1), "channels side by side"),
    "byte_order": Key(_one_of("little", "big"), '"little" or "big"'),
    "skip": Key(_whole(0), "bytes before the first number"),
}
DETECTION = {
    "separate_stops": Key(flag, "tell two stops apart in one microphone"),
    "threshold": Key(_any, 'a level in the unit, or "6 sigma"'),
    "polarity": Key(_one_of("auto", "positive", "negative", "both"), "direction of the pulses"),
    "contact_level": Key(_any, 'level of contact times, or a share of the peak, "10 %"'),
    "contact_time": Key(_pair, "shortest and longest contact [s]"),
    "merge_within": Key(_from_zero, "impacts this close become one [s]"),
    "dead_time": Key(_from_zero, "impacts this soon after another are ignored [s]"),
    "gaps": Key(_one_of("refuse", "split"), "missing samples: refuse the file, or split the run"),
    "least_probability": Key(_positive, "leave out what is less likely an impact"),
}
SWEEP = {
    "from": Key(_one_of(*SWEEPS), 'the frequency comes from a "channel", a "law" or the "impacts"'),
    "start": Key(_begin, 'frequency at the beginning [Hz], or "parameter": that of each run'),
    "rate": Key(
        number, "change of the frequency [Hz/s], negative downwards and on the branch down"
    ),
    "window": Key(_whole(20), "impacts of which one period is identified"),
}
REPORT = {
    "dimension": Key(flag, "work out the correlation dimension of each run (seconds)"),
    "periods": Key(_whole(1), "greatest n of period(m, n) that is tried"),
}
TABLES: dict[str, Mapping[str, Key]] = {
    "parameter": PARAMETER,
    "forcing": FORCING,
    "reading": READING,
    "raw": RAW,
    "detection": DETECTION,
    "sweep": SWEEP,
    "report": REPORT,
}


def table(name: str, value: Any, keys: Mapping[str, Key]) -> dict[str, Any]:
    """Validate the keys and values of a table.

    Raises
    ------
    InvalidInput
        For the first that is not; its name is that of the table and the key.
    """
    instance(name, value, Mapping, f"a table with {', '.join(keys)}")  # type: ignore[type-abstract]
    checked = {}
    for key, one in value.items():
        if key not in keys:
            near = difflib.get_close_matches(str(key), keys, 1)
            remedy = f"Did you mean {near[0]}?" if near else ""
            raise InvalidInput(f"{name}.{key}", one, f"one of the keys {', '.join(keys)}", remedy)
        checked[key] = keys[key].check(f"{name}.{key}", one)
    return checked


def channel_tables(value: Any) -> tuple[dict[str, Any], ...]:
    """Validate the channels, each of which is named or numbered once."""
    required = "a list of tables, one a channel"
    if isinstance(value, (str, Mapping)) or not isinstance(value, Sequence):
        raise InvalidInput("channel", value, required, "Write [[channel]]")
    found: list[dict[str, Any]] = []
    for index, entry in enumerate(entries("channel", value, required)):
        where = f"channel[{index}]"
        channel = table(where, entry, CHANNEL)
        if ("name" in channel) == ("number" in channel):
            raise InvalidInput(
                where, entry, "a name or a number", 'Give name = "..." or number = 0'
            )
        if "pulses" in channel and channel.get("use") != "tacho":
            raise InvalidInput(f"{where}.pulses", channel["pulses"], 'a channel with use = "tacho"')
        if which(channel) in map(which, found):
            raise InvalidInput(where, which(channel), "every channel once")
        found.append(channel)
    sensors = [channel for channel in found if channel.get("use", "impacts") == "impacts"]
    if len(found) - len(sensors) > 1:
        raise InvalidInput("channel", value, "one forcing or tacho channel at most")
    if len(sensors) == 1 and "stop" in sensors[0]:
        where = f"channel[{found.index(sensors[0])}].stop"
        raise InvalidInput(where, sensors[0]["stop"], "several channels that hear impacts")
    return tuple(found)


def which(channel: Mapping[str, Any]) -> str | int:
    """Name or number of a channel."""
    chosen: str | int = channel["name"] if "name" in channel else channel["number"]
    return chosen
