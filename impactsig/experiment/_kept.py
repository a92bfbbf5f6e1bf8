"""Store of finished runs: a record each, named by a digest of content and settings.

| file | holds |
|---|---|
| ``KE/KEY.run`` | the row of the table, a line of JSON, and the impacts; or why there are none |
| ``contents.jsonl`` | digests of recordings, by path, size and time, so that none is read again |

Every file is written whole or not at all, so a run whose file is there is done.
"""

from __future__ import annotations

import json
from pathlib import Path
from time import time
from typing import Any

from .._files.atomic import atomic_path
from .._trains.correction_files import beside, sha256
from .._trains.impact_tables import packed, unpacked
from ..errors import ImpactsigError, InvalidInput, UnreadableFile, UnwritableFile
from ..impacts import Impacts
from ..io.companions import settings_beside
from ..studies.fingerprint import digest, stamp
from ._run import Run

CONTENTS = "contents.jsonl"
LASTING = {"InvalidInput": InvalidInput, "UnreadableFile": UnreadableFile}
"""Errors that the same content and settings give again."""
SETTLED = 2.0
"""Age from which the time of a file tells that it has not changed [s]; clocks are coarse."""


def content_of(path: Path) -> str:
    """Digest of a recording with the settings and corrections beside it.

    Raises
    ------
    UnreadableFile
        If it cannot be read.
    """
    settings, corrections = settings_beside(path), beside(path)
    digests = sha256(path) if settings is None else f"{sha256(path)} {sha256(settings)}"
    return digest(f"{digests} {sha256(corrections) if corrections.is_file() else ''}")


def key_of(content: str, settings: str, frequency: float | None) -> str:
    """File name of a run."""
    return digest(f"{content} {settings} {frequency!r}")


class Kept:
    """A folder of finished runs."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._stamps: dict[str, tuple[list[int], str]] = {}

    def claim(self) -> None:
        """Make the folder, and read which recordings are known.

        Raises
        ------
        UnwritableFile
            If it cannot be made.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            written = (self.folder / CONTENTS).read_text(encoding="utf-8")
        except FileNotFoundError:
            written = ""
        except OSError as error:
            reason = f"cannot be used ({error.strerror or error})"
            raise UnwritableFile(self.folder, reason, "Give another directory=") from None
        for line in written.splitlines():
            try:
                name, known, content = json.loads(line)
                self._stamps[name] = (known, content)
            except (ValueError, TypeError):
                continue  # cut short by a kill

    def known_content(self, path: Path) -> str | None:
        """The digest of a recording that has not changed since it was taken."""
        known, content = self._stamps.get(str(path.absolute()), (None, ""))
        return content if known is not None and known == _stamps_of(path) else None

    def learn(self, contents: dict[Path, str]) -> None:
        """Keep the digests of recordings, of those that have been left alone for a while."""
        new = {}
        for path, content in contents.items():
            now = _stamps_of(path)
            if now is not None and time() - max(now[1::2]) * 1e-9 > SETTLED:
                new[str(path.absolute())] = (now, content)
        if not new:
            return
        with (self.folder / CONTENTS).open("a", encoding="utf-8") as file:
            file.writelines(f"{json.dumps([name, *one])}\n" for name, one in new.items())
        self._stamps |= new

    def place(self, key: str) -> Path:
        """The file of a run."""
        return self.folder / key[:2] / f"{key}.run"

    def is_done(self, key: str) -> bool:
        """Whether a run has been analysed."""
        return self.place(key).is_file()

    def write(self, key: str, run: Run) -> None:
        """Keep a run: its row and its impacts."""
        self._write(key, run.summary, packed(run.impacts))

    def write_error(self, key: str, error: ImpactsigError) -> None:
        """Keep why there is no run."""
        kind = next(name for name, one in LASTING.items() if type(error) is one)
        self._write(key, {"error": kind, "arguments": [str(one) for one in error.__reduce__()[1]]})

    def read(self, key: str) -> dict[str, Any] | ImpactsigError:
        """The row of a run, or why there is none."""
        place = self.place(key)
        try:
            with place.open("rb") as file:
                row: dict[str, Any] = json.loads(file.readline())
        except (OSError, ValueError) as error:
            return UnreadableFile(place, f"is no row of a run ({error})", "Remove it, read again")
        if "error" in row:
            return LASTING[row["error"]](*row["arguments"])
        return row

    def impacts(self, key: str) -> Impacts:
        """The impacts of a run.

        Raises
        ------
        UnreadableFile
            If its file is damaged.
        """
        place = self.place(key)
        try:
            with place.open("rb") as file:
                file.readline()
                content = file.read()
        except OSError as error:
            raise UnreadableFile(place, f"cannot be read ({error.strerror})") from None
        return unpacked(Impacts, place, content)

    def _write(self, key: str, row: dict[str, Any], impacts: bytes = b"") -> None:
        self.place(key).parent.mkdir(exist_ok=True)
        with atomic_path(self.place(key)) as temporary:
            temporary.write_bytes(json.dumps(row, sort_keys=True).encode() + b"\n" + impacts)


def _stamps_of(path: Path) -> list[int] | None:
    """Sizes and times of a recording, its corrections and its settings."""
    settings = settings_beside(path)
    found = []
    for one in (path, beside(path), *(() if settings is None else (settings,))):
        try:
            found += stamp(one)
        except OSError:
            if one == path:
                return None
            found += [0, 0]
    return found
