"""Parameter and branch of a run: from the file name, a table, or the recording itself."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import ImpactsigError, InvalidInput, UnreadableFile
from .rig import Rig

DIRECTIONS = {
    "up": ("upward", "upwards", "rising", "increasing", "ascending", "forward"),
    "down": ("downward", "downwards", "falling", "decreasing", "descending", "backward"),
}
"""Other words for the two branches whose direction is known."""


class Place(NamedTuple):
    """Parameter value and branch of a run."""

    value: float
    """Of the parameter; NaN where the recording itself tells it."""
    branch: str
    """"up", "down", another word of the user's, or empty."""

    @classmethod
    def of(cls, value: float, branch: str) -> Place:
        """With the branch in small letters, and by its direction if the word tells one."""
        word = branch.lower()
        return cls(value, next((one for one, said in DIRECTIONS.items() if word in said), word))


def places(rig: Rig, folder: Path) -> Callable[[Path], Place | ImpactsigError]:
    """A function that finds the place of a recording from its path."""
    found = rig.parameter
    usual = found.get("branch", "")
    if found.get("from") == "file name":
        pattern = re.compile(found["pattern"])
        return lambda path: _named(path, folder, pattern, usual)
    if found.get("from") == "table":
        rows = _rows(folder / found["table"], usual)
        return lambda path: (
            rows.get(_key(path, folder))
            or rows.get(path.name)
            or InvalidInput(
                "parameter.table", path.name, f"a row of {found['table']} for every recording"
            )
        )
    return lambda path: Place(math.nan, usual)


def _key(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _named(
    path: Path, folder: Path, pattern: re.Pattern[str], usual: str
) -> Place | ImpactsigError:
    name = _key(path, folder)
    match = pattern.search(name)
    if match is None:
        return InvalidInput("parameter.pattern", pattern.pattern, f"a match in the name {name}")
    value = _number(match["value"])
    if value is None:
        return InvalidInput(
            "parameter.pattern", match["value"], f"a group value that is a number, in {name}"
        )
    return Place.of(value, match.groupdict().get("branch") or usual)


def _rows(path: Path, usual: str) -> dict[str, Place]:
    """The table of the runs, by file name.

    Raises
    ------
    UnreadableFile
        If it cannot be read, or a line of it is not what it must be.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UnreadableFile(
            path, f"cannot be read ({error})", "It is the parameter.table of the rig"
        ) from None
    rows: dict[str, Place] = {}
    for number, line in enumerate(lines, 2):
        if not {"file", "value"} <= set(line):
            raise UnreadableFile(path, "lacks a column file or value", "Name both in its first row")
        value = _number(line["value"])
        if value is None:
            raise UnreadableFile(path, f"line {number}: {line['value']!r} is not a number")
        rows[line["file"]] = Place.of(value, line.get("branch") or usual)
    return rows


def _number(written: Any) -> float | None:
    try:
        value = float(str(written).strip().replace(",", "."))
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def recorded_value(rig: Rig, path: Path, frequency: float | None) -> float:
    """Parameter value stored in the recording itself.

    Raises
    ------
    InvalidInput
        If it tells none.
    """
    found = rig.parameter
    origin = found.get("from")
    if origin == "metadata":
        from ..io import info

        metadata = info(path, raw=rig.reading_options().get("raw")).metadata
        value = _number(metadata.get(found["key"]))
        if value is None:
            raise InvalidInput(
                "parameter.key", found["key"],
                f"a number among the metadata: {', '.join(metadata) or 'there are none'}",
            )  # fmt: skip
        return value
    if origin != "channel":
        return math.nan
    forcing = rig.forcing_channel
    if forcing is not None and found["channel"] in (forcing.get("name"), forcing.get("number")):
        return math.nan if frequency is None else frequency
    from ..io import read

    options = {name: one for name, one in rig.reading_options().items() if name in _PART}
    return float(read(path, channel=found["channel"], **options).samples.mean(dtype=float))


_PART = ("start", "stop", "rate", "resample", "raw")


def stated_frequency(rig: Rig, path: Path) -> float | None:
    """Forcing frequency [Hz] that the rig states for a recording, or None.

    Raises
    ------
    InvalidInput, UnreadableFile
        If the name or the table does not tell it.
    """
    frequency = rig.forcing.get("frequency")
    if frequency != "parameter":
        return None if frequency is None else float(frequency)
    found = places(rig, path.parent)(path)
    if isinstance(found, ImpactsigError):
        raise found
    return found.value
