"""Locks between processes that need the same result: one computes it, the others wait."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: each process does the work itself
    fcntl = None  # type: ignore[assignment]

PATIENCE = 600.0
"""For how long a process waits for another, which may have been stopped [s]."""
_PAUSE = 0.02


class Turn:
    """A lock on a file, held by one process at a time.

    The system ends the turn of a process that dies. Where files cannot be locked, nobody waits.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: int | None = None
        self._depth = 0

    @contextmanager
    def ended(self) -> Iterator[None]:
        """A turn that is taken within ends with the outermost of these contexts."""
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
            if self._depth == 0 and self._file is not None:
                os.close(self._file)
                self._file = None

    def take(self) -> None:
        """Wait for the lock, unless this process holds it."""
        if fcntl is None or self._depth == 0 or self._file is not None:
            return
        try:
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError:
            return
        last = time.monotonic() + PATIENCE
        while time.monotonic() < last:
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                time.sleep(_PAUSE)
            except OSError:
                return
            else:
                return
