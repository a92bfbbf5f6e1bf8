"""Corrections of a train by hand, and the table beside a recording that holds them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _impact_columns as tables
from ._arguments import number
from ._atomic import atomic_path
from .errors import InvalidInput, UnreadableFile

if TYPE_CHECKING:
    from .impacts import Impacts

SUFFIX = ".corrections.csv"
"""After the name of a recording: its corrections."""
WITHIN = 1e-3
"""How far from an impact the instant that names it may be [s]."""
HEAD = ("channel", "action", "time", "to", "by", "at", "comment")


def edited(
    impacts: Impacts,
    add: Iterable[float],
    move: Mapping[float, float],
    reject: Iterable[float],
    by: str,
    comment: str,
) -> Impacts:
    """As `Impacts.edit`."""
    at = datetime.now(UTC).isoformat(timespec="seconds")
    lines: list[tuple[str, float, float | None]] = [
        ("reject", number("reject", one), None) for one in reject
    ]
    lines += [("move", number("move", one), number("move", to)) for one, to in move.items()]
    lines += [("add", number("add", one), None) for one in add]
    table = [
        dict(zip(HEAD, (_channel(impacts), action, time, to, by, at, comment), strict=True))
        for action, time, to in lines
    ]
    return applied(impacts, table)


def applied(impacts: Impacts, table: list[dict[str, Any]]) -> Impacts:
    """The train with corrections made, one after the other; its settings list them."""
    for line in table:
        impacts = _one(impacts, line)
    done = [*impacts.settings.get("corrections", ()), *table]
    return replace(impacts, settings={**impacts.settings, "corrections": done})


def _channel(impacts: Impacts) -> str:
    return str(impacts.settings.get("channel", ""))


def applied_beside(impacts: Impacts, recording: Any) -> Impacts:
    """The train with the corrections of its channel made that stand beside its recording."""
    own = [line for line in read(recording) if line["channel"] == _channel(impacts)]
    return applied(impacts, own) if own else impacts


def write(impacts: Impacts, recording: Any) -> Path:
    """As `Impacts.write_corrections`."""
    import csv

    target = Path(f"{recording}{SUFFIX}")
    others = [line for line in read(recording) if line["channel"] != _channel(impacts)]
    with (
        atomic_path(target) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.DictWriter(file, HEAD, lineterminator="\n")
        writer.writeheader()
        writer.writerows([*others, *impacts.settings.get("corrections", ())])
    return target


def read(recording: Any) -> list[dict[str, Any]]:
    """The corrections beside a recording; none where there is no such file.

    Raises
    ------
    UnreadableFile
        If it is no table of corrections.
    """
    import csv

    path = Path(f"{recording}{SUFFIX}")
    if not path.exists():
        return []
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        table: list[dict[str, Any]] = []
        for row in rows:
            to = float(row["to"]) if row["to"] else None
            known = {"time": float(row["time"]), "to": to}
            if row["action"] not in ("add", "move", "reject") or (to is None) != (
                row["action"] != "move"
            ):
                raise ValueError(f"line {len(table) + 2}: {row['action']!r} to {to}")
            table.append({name: known.get(name, row[name]) for name in HEAD})
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise UnreadableFile(
            path,
            f"not a table of corrections ({error})",
            f"Its columns are {', '.join(HEAD)}; move it away to go on without",
        ) from error
    return table


def _one(impacts: Impacts, line: Mapping[str, Any]) -> Impacts:
    import numpy as np

    from ._impact_flags import EDITED

    action, time = line["action"], line["time"]
    if action != "add":
        near = int(np.argmin(np.abs(impacts.time - time))) if len(impacts) else -1
        if near < 0 or abs(impacts.time[near] - time) > WITHIN:
            raise InvalidInput(
                action, f"{time:.9g} s", f"the instant of an impact, to {1e3 * WITHIN:g} ms"
            )
        others = impacts[np.arange(len(impacts)) != near]
        if action == "reject":
            return others
        known = {name: values[[near]] for name, values in tables.columns(impacts).items()}
        time = line["to"]
    else:
        others, known = impacts, {}
    if not impacts.start <= time <= impacts.stop:
        raise InvalidInput(
            action,
            f"{time:.9g} s",
            f"an instant inside the run, {impacts.start:g} to {impacts.stop:g} s",
        )
    place = int(np.searchsorted(others.time, time))
    left, right = max(place - 1, 0), min(place, len(others) - 1)
    columns: dict[str, Any] = {}
    for name, values in tables.columns(others).items():
        if name == "time":
            new = np.array([time])
        elif name == "flags":
            new = known.get(name, np.zeros(1, np.uint8)) | EDITED
        elif name == "probability":
            new = np.ones(1)  # whoever corrects it has seen it
        elif name in known and name != "time_error":
            new = known[name]
        elif not len(others):
            new = np.zeros(1)
        else:
            new = tables.filled(name, values, np.array([left]), np.array([right]))
        columns[name] = np.insert(values, place, new)
    return replace(others, **columns)
