"""Corrections of a train by hand: impacts added, moved and rejected, one line for each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from .._arguments import entries, instance, number, text
from ..errors import InvalidInput
from . import impact_columns as tables

if TYPE_CHECKING:
    from ..impacts import Impacts

WITHIN = 1e-3
"""How far from an impact the instant that names it may be [s]."""
DONE = {"add": "added", "move": "moved", "reject": "rejected"}
"""Each action, and what is done to an impact by it."""


def edited(
    impacts: Impacts,
    add: Iterable[float],
    move: Mapping[float, float],
    reject: Iterable[float],
    by: str,
    comment: str,
) -> Impacts:
    """As `Impacts.edit`."""
    text("by", by), text("comment", comment)
    instance("move", move, Mapping, "a mapping of instants to instants, {1.25: 1.26}")  # type: ignore[type-abstract]
    wanted: list[tuple[str, float, float | None]] = [
        ("reject", number("reject", one), None) for one in _several("reject", reject)
    ]
    wanted += [("move", number("move", one), number("move", to)) for one, to in move.items()]
    wanted += [("add", number("add", one), None) for one in _several("add", add)]
    at = datetime.now(UTC).isoformat(timespec="seconds")
    lines = [
        {
            "channel": channel_of(impacts), "action": action, "time": time, "to": to,
            "by": by, "at": at, "comment": comment, "made": True,
        }
        for action, time, to in wanted
    ]  # fmt: skip
    for line in lines:
        impacts = corrected(impacts, line)
    return listed(impacts, lines)


def corrected(impacts: Impacts, line: Mapping[str, Any]) -> Impacts:
    """Apply one correction.

    Raises
    ------
    InvalidInput
        If there is no such impact, or an instant lies outside the run or is that of another.
    """
    import numpy as np

    from .impact_flags import EDITED

    action, time = line["action"], line["time"]
    known: dict[str, np.ndarray] = {}
    others = impacts
    if action != "add":
        near = int(np.argmin(np.abs(impacts.time - time))) if len(impacts) else -1
        if near < 0 or abs(impacts.time[near] - time) > WITHIN:
            nearest = f"; the nearest is at {impacts.time[near]:.9g} s" if near >= 0 else ""
            raise InvalidInput(
                action, f"{time:.9g} s",
                f"the instant of an impact, to {1e3 * WITHIN:g} ms{nearest}",
            )  # fmt: skip
        others = impacts[np.arange(len(impacts)) != near]
        if action == "reject":
            return others
        known = {name: values[[near]] for name, values in tables.columns(impacts).items()}
        time = line["to"]
    if not impacts.start <= time <= impacts.stop:
        raise InvalidInput(
            action,
            f"{time:.9g} s",
            f"an instant inside the run, {impacts.start:g} to {impacts.stop:g} s",
        )
    place = int(np.searchsorted(others.time, time))
    if place < len(others) and others.time[place] == time:
        required = "an instant at which there is no impact"
        raise InvalidInput(action, f"{time:.9g} s", required, "Reject that one first")
    left, right = max(place - 1, 0), min(place, len(others) - 1)
    columns: dict[str, Any] = {}
    for name, values in tables.columns(others).items():
        if name == "time":
            new = np.array([time])
        elif name == "flags":
            new = known.get(name, np.zeros(1, np.uint8)) | EDITED
        elif name == "probability":
            new = np.ones(1)  # whoever corrects it has seen it
        elif name in known and name not in ("time_error", tables.SHARED):
            new = known[name]
        elif not len(others):
            new = tables.filled(name, np.zeros(1), np.zeros(1, int), np.zeros(1, int))
        else:
            new = tables.filled(name, values, np.array([left]), np.array([right]))
        columns[name] = np.insert(values, place, new)
    return replace(others, **columns)


def listed(impacts: Impacts, lines: Sequence[Mapping[str, Any]]) -> Impacts:
    """Append lines to the train's list of corrections."""
    every = [*impacts.settings.get("corrections", ()), *lines]
    return replace(impacts, settings={**impacts.settings, "corrections": every})


def channel_of(impacts: Impacts) -> str:
    """Name of the channel that a train was detected in; names of several are joined."""
    channel = impacts.settings.get("channel", "")
    return channel if isinstance(channel, str) else " + ".join(channel)


def in_words(impacts: Impacts) -> str:
    """How many impacts were added, moved and rejected, by whom and when; empty if none were."""
    parts = [impacts.settings, *impacts.settings.get("of_channel", {}).values()]
    lines = [line for part in parts for line in part.get("corrections", ()) if line["made"]]
    if not lines:
        return ""
    actions = [line["action"] for line in lines]
    counts = [f"{actions.count(one)} {done}" for one, done in DONE.items() if one in actions]
    people = sorted({line["by"] for line in lines if line["by"]})
    days = sorted({line["at"][:10] for line in lines if line["at"]})
    words = ", ".join(counts) + " by " + (", ".join(people) or "hand")
    if not days:
        return words
    return f"{words}, {days[0]}" + (f" to {days[-1]}" if len(days) > 1 else "")


def _several(name: str, given: Iterable[float]) -> list[float]:
    return list(entries(name, given, "several instants, in a list for example"))
