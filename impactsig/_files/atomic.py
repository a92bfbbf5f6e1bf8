"""Files that are either written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import ImpactsigError, UnwritableFile


@contextmanager
def atomic_path(path: Any) -> Iterator[Path]:
    """A temporary path beside `path` that takes its place if the block ends well.

    Raises
    ------
    UnwritableFile
        If the folder is missing or not writable, or writing fails; `path` is then as it was.
    """
    target = Path(path)
    try:
        if target.is_dir():
            raise IsADirectoryError("it is a folder")
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        os.close(handle)
    except OSError as error:
        reason = error.strerror or str(error)
        raise UnwritableFile(
            path, f"cannot be written ({reason})", "Give a path in an existing, writable folder"
        ) from error
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(target)
    except ImpactsigError:
        # What went wrong inside, such as an unreadable source, tells more than that it did.
        raise
    except OSError as error:
        raise UnwritableFile(path, f"cannot be written ({error})") from error
    finally:
        temporary.unlink(missing_ok=True)
