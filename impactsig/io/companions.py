"""Recordings in two files: the samples, and the settings of the instrument beside them.

Oscilloscopes of Rohde & Schwarz write NAME.Wfm.csv, which holds samples and nothing else, and
NAME.csv, whose lines are ``Key:value:``. Either is opened with its companion, which is found by
its name alone.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from ..errors import UnreadableFile
from ._encoding import encoding_of

_SAMPLES = ".wfm.csv"
_SETTING = re.compile(r"\s*(\w+):(.*?):?\s*")
_SURE = b"SignalHardwareRecordLength:"  # a word that no other file has
_LARGEST = 1 << 20  # bytes of settings


def samples_of(path: Path, head: bytes) -> Path:
    """The file of the samples: the given one, or the one whose settings it holds.

    Raises
    ------
    UnreadableFile
        If it holds settings and no file of samples is beside it.
    """
    if path.name.lower().endswith(_SAMPLES) or _SURE not in head:
        return path
    found = _beside(path, f"{path.stem}{_SAMPLES}")
    if found is None:
        raise UnreadableFile(
            path,
            "contains the settings of an oscilloscope, but no samples",
            f"Put {path.stem}.Wfm.csv, which the oscilloscope wrote with it, into the same folder",
        )
    return found


def settings_beside(path: Path) -> Path | None:
    """The file of settings beside a file of samples, if it has one."""
    if not path.name.lower().endswith(_SAMPLES):
        return None
    return _beside(path, f"{path.name[: -len(_SAMPLES)]}.csv")


def without_settings(paths: Iterable[Path]) -> list[Path]:
    """Drop the files that hold only the settings of another."""
    paths = list(paths)
    settings = {settings_beside(path) for path in paths}
    return [path for path in paths if path not in settings]


def settings_of(path: Path) -> tuple[dict[str, str], str]:
    """The settings beside a file of samples, by name, and a note if there are none."""
    if not path.name.lower().endswith(_SAMPLES):
        return {}, ""
    found = settings_beside(path)
    if found is None:
        stem = path.name[: -len(_SAMPLES)]
        return {}, f"Its rate stands in {stem}.csv, written with it: put that beside it"
    with found.open("rb") as file:
        content = file.read(_LARGEST)
    lines = content.decode(encoding_of(content), "replace").splitlines()
    return {match[1]: match[2] for line in lines if (match := _SETTING.fullmatch(line))}, ""


def lines_above(path: Path, settings: dict[str, str], rows: int) -> tuple[str, ...]:
    """Settings of the time base, as lines of a text header.

    Raises
    ------
    UnreadableFile
        If the file of samples holds several acquisitions, between which time passes.
    """
    count = settings.get("NumberOfAcquisitions", "1").strip()
    if count.isdecimal() and int(count) > 1:
        raise UnreadableFile(
            path,
            f"holds {count} acquisitions one after the other, and how long it was between them is "
            "not known",
            "Export them one by one",
        )
    length = settings.get("SignalHardwareRecordLength", "").strip()
    # The screen begins at XStart; what was recorded begins earlier.
    start = "HardwareXStart" if length == str(rows) else "XStart"
    if length.isdecimal() and rows == int(length) + 1:
        raise UnreadableFile(
            path, "has a time stamp before its samples", "Export it with time stamps off"
        )
    kept = {"SignalResolution": "dt", start: "t0", "Source": "source", "VerticalUnit": "vunit"}
    return tuple(
        "\t".join((word, *settings[key].split(":")))
        for key, word in kept.items()
        if key in settings
    )


def _beside(path: Path, name: str) -> Path | None:
    """The file of that name in the same folder, whatever its case."""
    if (exact := path.with_name(name)).is_file():
        return exact
    return next(
        (one for one in path.parent.iterdir() if one.name.lower() == name.lower() and one != path),
        None,
    )
