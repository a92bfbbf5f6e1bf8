"""Write a rig file for a recording, with every key explained."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..io.formats import FORMATS
from ._rig_tables import CHANNEL, TABLES, Key
from .parameter import DIRECTIONS

if TYPE_CHECKING:
    from ..io import FileInfo

_PAIRS = tuple(zip(*((way, *words) for way, words in DIRECTIONS.items()), strict=True))
_VALUE = re.compile(r"\d+(?:\.\d+)?(\s*_?\s*)Hz")
_WAY = "|".join(word for pair in _PAIRS for word in pair)
_BEFORE = re.compile(rf"(?<![^\W\d_])({_WAY})([\W_]+)$", re.IGNORECASE)
_AFTER = re.compile(rf"([\W_]+)({_WAY})(?![^\W\d_])", re.IGNORECASE)
_EXAMPLES: dict[str, Any] = {
    "use": "impacts", "sensor": "force", "scale": 1.0, "offset": 0.0, "pulses": 1,
    "parameter.name": "frequency", "parameter.unit": "Hz", "parameter.from": "file name",
    "parameter.pattern": "(?P<value>[0-9.]+)Hz", "parameter.table": "runs.csv",
    "parameter.channel": "drive", "parameter.key": "frequency", "parameter.branch": "up",
    "forcing.frequency": "parameter", "reading.start": 0.0, "reading.stop": 10.0,
    "reading.rate": 50000.0, "reading.resample": 1000.0, "raw.type": "int16", "raw.channels": 1,
    "raw.byte_order": "little", "raw.skip": 0, "detection.separate_stops": True,
    "detection.threshold": "6 sigma", "detection.polarity": "auto", "detection.contact_level": 0.0,
    "detection.contact_time": [0.0, 0.03], "detection.merge_within": 0.0,
    "detection.dead_time": 0.0, "detection.gaps": "refuse", "detection.least_probability": 0.5,
    "sweep.from": "law", "sweep.start": 18.0, "sweep.rate": 0.02, "sweep.window": 60,
    "report.dimension": True, "report.periods": 8,
}  # fmt: skip
_ASIDE = 42
"""The column at which the explanation of a key begins."""


def rig_of_recording(path: Path) -> str:
    """Text of a ``rig.toml`` for recordings such as this one.

    Raises
    ------
    UnreadableFile
        If the recording cannot be read.
    """
    from ..io import info, read_blocks

    file = info(path)
    sensor = "force"
    if any(channel.rate for channel in file.channels):
        sensor = read_blocks(path, channel=0).sensor
    return rig_text(file, sensor, _others(path))


def _others(path: Path) -> list[str]:
    """Endings of other kinds of recordings beside a file, the most frequent first."""
    usual = {ending for one in FORMATS for ending in one.extensions} - {path.suffix.lower()}
    try:
        beside = [one.suffix.lower() for one in path.parent.iterdir() if one.is_file()]
    except OSError:  # it is no file of a folder
        return []
    return [ending for ending, _ in Counter(one for one in beside if one in usual).most_common()]


def rig_text(file: FileInfo, sensor: str, others: Sequence[str] = ()) -> str:
    """Text of a ``rig.toml``, in which uncertain values are comments.

    `others` are endings of files beside it that may be recordings too.
    """
    path = Path(file.path)
    lines = [
        f"# The rig of {_plain(path.name)} ({file.format}): how its recordings are read.",
        "# Commands read it with --rig, or where it lies beside the recordings as rig.toml.",
        "# A line that begins with # is not set; what it shows is an example.",
        "",
    ]
    if others:
        start = re.match(r"[^\W\d]*", path.stem)[0]  # type: ignore[index]
        lines.append(
            f"# This leaves out {', '.join(others)}; {_entry('files', f'{start}*')} would not."
        )
    lines.append(
        f"{_entry('files', f'*{path.suffix}')}  # which files of the folder are recordings"
    )
    for index, channel in enumerate(file.channels):
        known: dict[str, Any] = {"name": channel.name} if channel.name else {"number": index}
        known["sensor"] = sensor
        if channel.unit:
            known["unit"] = channel.unit
        rate = "rate unknown" if channel.rate is None else f"{channel.rate:g} Hz"
        guessed = "" if channel.unit else "; the file does not say of which sensor, so check that"
        lines += [
            "",
            f"# channel {index}: {channel.length} samples, {rate}{guessed}",
            "[[channel]]",
        ]
        at = {"stop": index} if len(file.channels) > 1 else {}  # one alone is refused
        lines += _keys("", CHANNEL, known, _EXAMPLES | at)
    set_to: dict[str, dict[str, Any]] = {}
    if (pattern := _pattern(path.stem)) is not None:
        set_to["parameter"] = {
            "name": "frequency", "unit": "Hz", "from": "file name", "pattern": pattern,
        }  # fmt: skip
        set_to["forcing"] = {"frequency": "parameter"}
    for name, keys in TABLES.items():
        known = set_to.get(name, {})
        if name == "parameter" and file.metadata and not known:
            lines += ["", f"# metadata of this file: {_plain(', '.join(file.metadata))}"]
        head = f"[{name}]" if known else f"# [{name}]"
        lines += ["", head, *_keys(f"{name}.", keys, known, _EXAMPLES)]
    return "\n".join(lines) + "\n"


def _keys(
    prefix: str, keys: Mapping[str, Key], known: Mapping[str, Any], examples: Mapping[str, Any]
) -> list[str]:
    lines = []
    for key, one in keys.items():
        if key in known:
            entry = _entry(key, known[key])
        elif f"{prefix}{key}" in examples:
            entry = f"# {_entry(key, examples[f'{prefix}{key}'])}"
        else:
            continue
        lines.append(f"{entry:<{_ASIDE}}  # {one.help}")
    return lines


def _entry(key: str, value: Any) -> str:
    if key == "pattern" and "'" not in value:
        return f"{key} = '{value}'"
    # A TOML basic string, number, truth value or list is written as JSON writes it.
    return f"{key} = {json.dumps(value)}"


def _pattern(stem: str) -> str | None:
    """A pattern for the number in a name that is followed by Hz, where there is one.

    It has a group for the branch where a word beside the number tells a direction.
    """
    found = _VALUE.search(stem)
    if found is None:
        return None
    value = f"(?P<value>[0-9.]+){_literal(found[1])}Hz"
    if before := _BEFORE.search(stem, 0, found.start()):
        return f"{_branches(before[1])}{_literal(before[2])}{value}"
    if stem[: found.start()].endswith("."):  # no part of the number
        value = rf"\.{value}"
    if after := _AFTER.match(stem, found.end()):
        return f"{value}{_literal(after[1])}{_branches(after[2])}"
    return value


def _branches(word: str) -> str:
    """A pattern of a direction and its opposite, written as the word is."""
    pair = next(one for one in _PAIRS if word.lower() in one)
    alike = str.upper if word.isupper() else str.title if word.istitle() else str
    return f"(?P<branch>{'|'.join(map(alike, pair))})"


def _literal(text: str) -> str:
    return re.escape(text).replace("\\ ", " ")


def _plain(text: str) -> str:
    return "".join(one if one.isprintable() else "?" for one in text)
