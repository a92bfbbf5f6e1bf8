"""Corrections beside a recording: a table that is written, and read again with the recording."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._files.atomic import atomic_path
from ..errors import InvalidInput, UnreadableFile
from .corrections import DONE, channel_of, corrected, listed

if TYPE_CHECKING:
    from ..impacts import Impacts

SUFFIX = ".corrections.csv"
"""After the name of a recording: its corrections."""
NEEDED = ("channel", "action", "time", "to")
COLUMNS = (*NEEDED, "by", "at", "comment", "recording")
DIGITS = 16
"""Of the SHA-256 of a recording, by which the table knows it."""
NAMED = 3
"""Corrections, at most, that a note names."""


def write(impacts: Impacts, recording: Any) -> Path:
    """As `Impacts.write_corrections`."""
    import csv

    channel, digest = channel_of(impacts), sha256(recording)[:DIGITS]
    lines = read(recording)
    there = [line for line in lines if line["channel"] == channel]
    _check_recording({line["recording"] for line in there} - {""}, recording)
    # What others have written since the train was read is kept.
    known = [_named(line) for line in there]
    for line in impacts.settings.get("corrections", ()):
        if _named(line) not in known:
            lines.append({**line, "recording": digest})
    target = beside(recording)
    with (
        atomic_path(target) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n", extrasaction="ignore")
        writer.writeheader()
        writer.writerows(lines)
    return target


def applied(impacts: Impacts, recording: Any) -> Impacts:
    """As `Impacts.apply_corrections`."""
    channel = channel_of(impacts)
    if not beside(recording).exists():
        notes = dict.fromkeys((*impacts.notes, *_left_behind(recording, channel)))
        return replace(impacts, notes=tuple(notes)) if len(notes) > len(impacts.notes) else impacts
    lines = [line for line in read(recording) if line["channel"] == channel]
    _check_recording({line.pop("recording") for line in lines} - {""}, recording)
    done = [_named(line) for line in impacts.settings.get("corrections", ())]
    lines = [line for line in lines if _named(line) not in done]
    if not lines:
        return impacts
    made, misfits = [], []
    for line in lines:
        instants = [line["time"], line["time"] if line["to"] is None else line["to"]]
        within = all(impacts.start <= one <= impacts.stop for one in instants)
        if within:
            try:
                impacts = corrected(impacts, line)
            except InvalidInput:
                misfits.append(f"{line['action']} {line['time']:.6f} s")
                within = False
        made.append({**line, "made": within})
    if misfits:
        named = ", ".join(misfits[:NAMED]) + (", ..." if len(misfits) > NAMED else "")
        note = (
            f"{len(misfits)} of {len(lines)} corrections in {beside(recording).name} name no "
            f"impact that was found, and were not made: {named}"
        )
        impacts = replace(impacts, notes=(*impacts.notes, note))
    return listed(impacts, made)


def read(recording: Any) -> list[dict[str, Any]]:
    """The corrections beside a recording; none where there is no such file.

    Raises
    ------
    UnreadableFile
        If it is no table of corrections.
    """
    path = beside(recording)
    return _read_table(path) if path.exists() else []


def _read_table(path: Path) -> list[dict[str, Any]]:
    import csv

    try:
        # Spreadsheets begin a file in UTF-8 with a mark of it.
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            missing = [name for name in NEEDED if name not in (reader.fieldnames or ())]
            if missing:
                raise ValueError(f"it has no column {missing[0]!r}")
            return [_line(row, reader.line_num) for row in reader]
    except (OSError, ValueError, csv.Error) as error:
        raise UnreadableFile(
            path,
            f"not a table of corrections: {error}",
            f"Mend it (columns {', '.join(NEEDED)}, separated by commas), or move it away to go on "
            "without",
        ) from error


def _left_behind(recording: Any, channel: str) -> list[str]:
    """Notes on tables in the same folder that a recording has lost by being renamed."""
    notes, digest = list[str](), ""
    if not Path(recording).is_file():
        return notes
    for table in sorted(Path(recording).parent.glob(f"*{SUFFIX}")):
        if table.with_name(table.name.removesuffix(SUFFIX)).exists():
            continue
        try:
            lines = [line for line in _read_table(table) if line["channel"] == channel]
        except UnreadableFile:
            continue  # of no recording that is here
        digest = digest or sha256(recording)[:DIGITS]
        count = sum(line["recording"] == digest for line in lines)
        if count:
            notes.append(
                f"{table.name} has {count} corrections of this recording, made under another name "
                f"and not applied: rename it to {beside(recording).name} to apply them"
            )
    return notes


def _named(line: Mapping[str, Any]) -> tuple[Any, ...]:
    """What tells a correction from others, whether it could be made or not."""
    return tuple(line[name] for name in ("action", "time", "to", "by", "at", "comment"))


def _line(row: Mapping[str, Any], place: int) -> dict[str, Any]:
    """One line of the table, with its numbers read."""
    if None in row or None in [row[name] for name in NEEDED]:
        raise ValueError(f"line {place} has another number of cells than the first line")
    action = row["action"]
    if action not in DONE:
        raise ValueError(f"line {place}: action {action!r} is none of {', '.join(DONE)}")
    if (action == "move") != bool(row["to"]):
        wanted = "needs an instant" if action == "move" else "takes no instant"
        raise ValueError(f"line {place}: {action} {wanted} in the column 'to'")
    instants = {name: _instant(row[name], name, place) for name in ("time", "to") if row[name]}
    if "time" not in instants:
        raise ValueError(f"line {place}: the column 'time' is empty")
    texts = {name: row.get(name) or "" for name in COLUMNS}
    return {**texts, "to": None, **instants, "made": True}


def _instant(text: str, name: str, place: int) -> float:
    import math

    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"line {place}: {name} {text!r} is not a finite number [s]")
    return value


def _check_recording(known: set[str], recording: Any) -> None:
    """Refuse corrections that were made for another recording of the same name."""
    if not known:
        return
    digest = sha256(recording)[:DIGITS]
    if known != {digest}:
        raise UnreadableFile(
            beside(recording),
            f"corrections of another recording: {Path(recording).name} has changed since they "
            f"were made (SHA-256 {digest}..., not {(known - {digest}).pop()}...)",
            "Move the table away; or, if the impacts are the same ones, empty its column "
            "'recording'",
        )


def beside(recording: Any) -> Path:
    """Path of the corrections of a recording."""
    return Path(f"{recording}{SUFFIX}")


def sha256(path: str | Path) -> str:
    """SHA-256 of a file, in hexadecimal digits.

    Raises
    ------
    UnreadableFile
        If it cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UnreadableFile(path, f"cannot be read ({error.strerror})") from error
