"""A directory for temporary files that no other user can write to."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path


def private_directory() -> Path | None:
    """A directory of this user's among the temporary files; None if others can write to it.

    Others may have made a directory, or a link, of its name before: it must be a directory that
    belongs to the user and that only the user can read and write. Nor may others rename it, which
    the sticky bit of a shared temporary directory prevents.
    """
    try:
        temporary = Path(tempfile.gettempdir())
        if not hasattr(os, "getuid"):  # Windows has a temporary directory for each user
            directory = temporary / "impactsig"
            directory.mkdir(exist_ok=True)
            return directory
        directory = temporary / f"impactsig-{os.getuid()}"
        directory.mkdir(mode=0o700, exist_ok=True)
        inner, outer = directory.lstat(), temporary.stat()
    except OSError:
        return None
    mine = stat.S_ISDIR(inner.st_mode) and inner.st_uid == os.getuid()
    shared = inner.st_mode & (stat.S_IRWXG | stat.S_IRWXO)
    replaceable = outer.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and not outer.st_mode & stat.S_ISVTX
    trusted = outer.st_uid in (0, os.getuid())
    return directory if mine and trusted and not shared and not replaceable else None
