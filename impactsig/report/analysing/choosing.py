"""Choice of the channels to search, where the user chose none."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..._arguments import PER_CHANNEL
from ...detect.files import WHOLE_BELOW, open_recording
from ...detect.roles import (
    LOOKED_AT,
    SHOW_IMPACTS,
    SOUND,
    UNKNOWN,
    Role,
    role_by_label,
    role_by_look,
    searched,
)
from ...errors import ImpactsigError, InvalidInput
from ...recording import Recording

if TYPE_CHECKING:
    from ...io import Blocks, FileInfo

MOST = 8
"""Channels shown at most beside those that are searched."""
CHOOSE = "Choose with --channel (and --sensor), or a rig file (impactsig rig)"


class Chosen(NamedTuple):
    """Opened channels, those to be searched first.

    Attributes
    ----------
    sources : list of Recording or of blocks
    readings : list of dict
        How each is read, with its number as channel.
    roles : list of str
        What each is taken for.
    searched : int
        How many of them are searched.
    doubt : str
        What the reader is to be warned of.
    """

    sources: list[Recording | Blocks]
    readings: list[dict[str, Any]]
    roles: list[str]
    searched: int
    doubt: str


def chosen(file: FileInfo, reading: Mapping[str, Any]) -> Chosen:
    """Open the channels of a file and decide which of them to search.

    Raises
    ------
    ImpactsigError
        If none can be read, for the reason of the first.
    """
    shared = {name: one for name, one in reading.items() if name not in PER_CHANNEL}
    sensor = reading.get("sensor")
    sources, left_out = _opened(file, shared)
    roles = {
        k: _role(file.channels[k].name, file.channels[k].unit, one, "unit" not in reading)
        for k, one in sources.items()
    }
    order = list(sources)
    found = searched([roles[k] for k in order], [file.channels[k].unit for k in order], sensor)
    hit = [order[k] for k in found.channels]
    others = [k for k in order if k not in hit]
    shown = [*hit, *others[:MOST]]
    readings = []
    for k in shown:
        own = {name: reading[name] for name in PER_CHANNEL if k in hit and name in reading}
        if k in hit and sensor is None and roles[k].kind == SOUND and sources[k].sensor == "force":
            own["sensor"] = "sound"
        readings.append(shared | {"channel": k} | own)
        if own:
            sources[k] = _changed(file, sources[k], shared | {"channel": k}, own)
    doubts = [f"left out: {text}" for text in left_out]
    if others[MOST:]:
        names = ", ".join(file.channels[k].name or str(k) for k in others[MOST:])
        doubts.append(f"not shown, as there are so many channels: {names}")
    listed = ", ".join(f"{k}: {one.name!r}" for k, one in enumerate(file.channels))
    if not hit:
        doubts.insert(0, f"no channel was searched, as {found.doubt}: {listed}. {CHOOSE}")
    elif found.doubt:
        taken = " and ".join(repr(file.channels[k].name or f"channel {k}") for k in hit)
        doubts.insert(0, f"{taken} searched for impacts {found.doubt}. {CHOOSE}")
    return Chosen(
        [sources[k] for k in shown], readings, [str(roles[k]) for k in shown], len(hit),
        "; ".join(doubts),
    )  # fmt: skip


def _opened(
    file: FileInfo, shared: Mapping[str, Any]
) -> tuple[dict[int, Recording | Blocks], list[str]]:
    """Each readable channel by its number, and why others cannot be read.

    Read at once where they lie side by side and memory holds them all.
    """
    from ...io import read, read_blocks

    lengths = {one.length for one in file.channels}
    rates = {one.rate for one in file.channels}
    total = sum(one.length for one in file.channels)
    if len(lengths) == len(rates) == 1 and total <= WHOLE_BELOW:
        whole = read(file.path, **shared)
        if len(whole.channels) == len(file.channels):
            return {k: whole.channel(k) for k in range(len(whole.channels))}, []
    found: dict[int, Recording | Blocks] = {}
    errors: list[ImpactsigError] = []
    opened = read if total <= WHOLE_BELOW else read_blocks
    for k in range(len(file.channels)):
        try:
            found[k] = opened(file.path, **shared, channel=k)
        except ImpactsigError as error:
            errors.append(error)
    if not found:
        raise errors[0] if errors else InvalidInput("path", file.path, "a file with channels")
    return found, [str(error) for error in errors]


def _changed(
    file: FileInfo, source: Recording | Blocks, shared: Mapping[str, Any], own: Mapping[str, Any]
) -> Recording | Blocks:
    """Read a channel again with its own options, unless only its sensor differs."""
    if isinstance(source, Recording) and set(own) == {"sensor"}:
        return replace(source, sensor=own["sensor"])
    return open_recording(file, **shared, **own)


def _role(name: str, unit: str, source: Recording | Blocks, audible: bool) -> Role:
    """What a channel records: by its labels, else by its samples."""
    labelled = role_by_label(name, unit)
    if labelled.kind not in (UNKNOWN, *SHOW_IMPACTS):
        return labelled
    pieces: Iterable[Recording] = [source] if isinstance(source, Recording) else source
    first = next(iter(pieces))
    role = role_by_look(first.channel(0).samples[:LOOKED_AT])
    if labelled.kind != UNKNOWN:
        return labelled._replace(steady=role.steady)
    if audible and source.sensor == "sound" and not role.by:
        return Role(SOUND, "as in a file of sound")
    return role
