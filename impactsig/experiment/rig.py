"""Rig: channels, detection and parameter of an experiment, as data that every command reads."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

from .._arguments import path as path_of
from .._arguments import text
from ..errors import InvalidInput, UnreadableFile
from ._rig_lines import line_of
from ._rig_tables import BRANCHES, TABLES, channel_tables, table, which

RIG = "rig.toml"
"""The file that is found beside recordings."""
Table = Mapping[str, Any]


@dataclass(frozen=True)
class Rig:
    """How the recordings of an experiment are read, analysed and ordered.

    The parameters are the tables of a ``rig.toml``, with the same keys; ``impactsig rig FILE``
    writes one with all keys explained.

    Parameters
    ----------
    channel : sequence of mapping
        The channels that are used, each with its ``name`` or ``number``, its ``use`` ("impacts",
        "forcing" or "tacho"), ``sensor``, ``scale``, ``offset``, ``unit`` and ``stop``.
    parameter : mapping
        The parameter that differs between runs: its ``name`` and ``unit``, and the source of its
        value, ``from``: the "file name" (``pattern``, a regular expression with a group "value" and
        optionally one named "branch"), a "table" (a CSV file with the columns file, value and
        optionally branch), a "channel" (its mean, or the frequency of the forcing), or "metadata"
        of the file (``key``). ``branch``, "up" or "down", is that of runs without a branch;
        "rising", "increasing" and similar words mean "up", their opposites "down".
    forcing : mapping
        ``frequency``: "parameter" if the parameter is the forcing frequency [Hz], or a number.
    reading, raw : mapping
        As for `read` and `RawLayout`.
    detection : mapping
        As for `detect_impacts`.
    sweep : mapping
        For recordings with a swept forcing frequency. ``from`` is the "channel" of the forcing, a
        stated "law" (``start`` [Hz], ``rate`` [Hz/s]) or the "impacts" (with both as a first
        guess); ``window`` is the number of impacts per window. With ``start = "parameter"`` the
        sweep starts at the parameter of each run, downwards for runs of the branch "down", so that
        one rig can have sweeps in both directions.
    report : mapping
        ``dimension``: whether to compute the correlation dimension; ``periods``: greatest n of
        period(m, n).
    files : str
        Pattern of the recordings in a folder, as for `pathlib.Path.glob`; by default all files with
        the extension of a known format.

    Raises
    ------
    InvalidInput
        If a key is unknown or a value invalid; the error names its table and key.

    See Also
    --------
    Experiment

    Examples
    --------
    >>> from impactsig import Rig
    >>> rig = Rig(
    ...     channel=[{"number": 0, "sensor": "force", "unit": "N"}],
    ...     parameter={"name": "frequency", "unit": "Hz", "from": "file name",
    ...                "pattern": "(?P<value>[0-9.]+)Hz"},
    ...     forcing={"frequency": "parameter"},
    ... )
    >>> rig.parameter["name"]
    'frequency'
    """

    channel: Sequence[Table] = ()
    parameter: Table = field(default_factory=dict)
    forcing: Table = field(default_factory=dict)
    reading: Table = field(default_factory=dict)
    raw: Table = field(default_factory=dict)
    detection: Table = field(default_factory=dict)
    sweep: Table = field(default_factory=dict)
    report: Table = field(default_factory=dict)
    files: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "channel", channel_tables(self.channel))
        for name, keys in TABLES.items():
            object.__setattr__(self, name, table(name, getattr(self, name), keys))
        text("files", self.files)
        if self.files.startswith("/") or ".." in self.files:
            raise InvalidInput("files", self.files, "a pattern within the folder")
        self._check_parameter()
        self._check_forcing()
        if self.raw and "type" not in self.raw:
            raise InvalidInput("raw", dict(self.raw), "the type of the numbers", 'type = "int16"')

    def _check_parameter(self) -> None:
        found, needed = self.parameter, {"file name": "pattern", "metadata": "key"}
        if not found:
            return
        if "from" not in found:
            raise InvalidInput("parameter", dict(found), 'a key "from" that says where it is found')
        origin = found["from"]
        need = needed.get(origin, origin)
        if need not in found:
            raise InvalidInput("parameter", dict(found), f'a key "{need}", as from is "{origin}"')
        for key in ("pattern", "table", "channel", "key"):
            if key in found and key != need:
                raise InvalidInput(
                    f"parameter.{key}", found[key], f'no such key where from is "{origin}"'
                )

    def _check_forcing(self) -> None:
        frequency = self.forcing.get("frequency")
        if isinstance(frequency, str):
            if frequency != "parameter":
                raise InvalidInput("forcing.frequency", frequency, '"parameter" or a number [Hz]')
            self._check_told("forcing.frequency", frequency)
        elif frequency is not None and not frequency > 0:
            raise InvalidInput("forcing.frequency", frequency, "a positive frequency [Hz]")
        if not self.sweep:
            return
        origin = self.sweep.get("from")
        if origin is None:
            raise InvalidInput(
                "sweep", dict(self.sweep), 'a key "from" that says where it is found'
            )
        if origin == "channel" and self.forcing_channel is None:
            raise InvalidInput("sweep.from", origin, 'a channel with use = "forcing" or "tacho"')
        if origin != "channel" and not {"start", "rate"} <= set(self.sweep):
            raise InvalidInput("sweep", dict(self.sweep), "start [Hz] and rate [Hz/s]")
        if self.sweep.get("start") == "parameter":
            self._check_told("sweep.start", "parameter")

    def _check_told(self, key: str, value: str) -> None:
        if self.parameter.get("from") not in BRANCHES:
            raise InvalidInput(
                key, value, 'a parameter from the "file name" or a "table"',
                "A channel of the forcing determines its frequency",
            )  # fmt: skip

    # -- from files ------------------------------------------------------------------------

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Rig:
        """Read a ``rig.toml``.

        Raises
        ------
        UnreadableFile
            If the file is not TOML, or has an unknown key or an invalid value; the error gives the
            line.
        """
        place = path_of("path", path)
        try:
            written = place.read_text(encoding="utf-8")
            tables = tomllib.loads(written)
        except OSError as error:
            reason = f"cannot be read ({error.strerror or error})"
            raise UnreadableFile(place, reason) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise UnreadableFile(place, f"is no TOML: {error}", "See toml.io") from None
        names = ("channel", *TABLES, "files")
        try:
            for name in tables:
                if name not in names:
                    raise InvalidInput(name, tables[name], f"one of {', '.join(names)}")
            return cls(**tables)
        except InvalidInput as error:
            line = line_of(written, error.argument)
            raise UnreadableFile(
                place, f"line {line}: {str(error).removesuffix(error.remedy).rstrip()}",
                error.remedy or "impactsig rig FILE writes one with all keys explained",
            ) from None  # fmt: skip

    @classmethod
    def beside(cls, recording: Path) -> Rig | None:
        """The rig in the folder of a recording, or None."""
        place = recording.parent / RIG
        return cls.read(place) if place.is_file() else None

    # -- as options of the functions -------------------------------------------------------

    @property
    def forcing_channel(self) -> Table | None:
        """The channel of the forcing or of a tacho."""
        others = [channel for channel in self.channel if channel.get("use", "impacts") != "impacts"]
        return others[0] if others else None

    def reading_options(self) -> dict[str, Any]:
        """Arguments of `detect_many` and `write_report` for reading."""
        options = dict(self.reading)
        if self.raw:
            from ..io import RawLayout

            rest = {name: value for name, value in self.raw.items() if name != "type"}
            options["raw"] = RawLayout(self.raw["type"], **rest)
        sensors = self._sensors()
        if len(sensors) == 1:
            keys = ("scale", "offset", "unit", "sensor")
            given = {key: sensors[0][key] for key in keys if key in sensors[0]}
            return options | given | {"channel": which(sensors[0])}
        if sensors:
            options["channel"] = [which(channel) for channel in sensors]
            for key, usual in (("scale", 1.0), ("offset", 0.0), ("unit", None), ("sensor", None)):
                if any(key in channel for channel in sensors):
                    options[key] = [channel.get(key, usual) for channel in sensors]
        return options

    def detecting_options(self) -> dict[str, Any]:
        """Arguments of `detect_impacts`."""
        options, sensors = dict(self.detection), self._sensors()
        if any("stop" in channel for channel in sensors):
            options["stops"] = [channel.get("stop") for channel in sensors]
        return options

    def _sensors(self) -> list[Table]:
        return [one for one in self.channel if one.get("use", "impacts") == "impacts"]
