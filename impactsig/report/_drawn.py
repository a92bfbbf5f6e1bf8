"""Pages of an experiment that are current, so that only reports of what changed are made again.

Beside the pages lies ``.impactsig/NAME.json`` for each: of what it was made, by which code, the
size and time of the page, and what the list of reports says of it.
"""

from __future__ import annotations

import functools
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._compiling.sources import ROOT
from .._files.atomic import atomic_path
from ..studies.fingerprint import digest, stamp

FOLDER = ".impactsig"


@dataclass(frozen=True)
class Wanted:
    """A page, and a digest of all that it shows."""

    page: Path
    digest: str

    def current(self) -> dict[str, Any] | None:
        """What was kept of the page, if it is what would be written now."""
        try:
            kept = json.loads(_beside(self.page).read_text(encoding="utf-8"))
            same = kept["digest"] == self.digest and kept["page"] == stamp(self.page)
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return kept if same else None

    def keep(self, **said: Any) -> None:
        """Keep that the page is current, with what the list says of it."""
        place = _beside(self.page)
        place.parent.mkdir(exist_ok=True)
        kept = {"digest": self.digest, "page": stamp(self.page), **said}
        with atomic_path(place) as temporary:
            temporary.write_text(json.dumps(kept), encoding="utf-8")


def digest_of_page(run: str, recording: Path, options: dict[str, Any]) -> str:
    """Digest of what a page shows: a run, where its recording lies, options and this package."""
    return digest(f"{run} {recording.absolute()} {sorted(options.items())!r} {_package()}")


@functools.cache
def _package() -> str:
    """Digest of all files of this package, as pages depend on styles and scripts too."""
    state = hashlib.blake2b()
    for path in sorted(ROOT.rglob("*")):
        if path.suffix in (".py", ".j2", ".css", ".js"):
            state.update(path.read_bytes())
    return state.hexdigest()


def _beside(page: Path) -> Path:
    return page.parent / FOLDER / f"{page.name}.json"
