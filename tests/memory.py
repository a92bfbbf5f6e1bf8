"""The greatest memory a process has had, its own alone."""

from __future__ import annotations

import resource
from pathlib import Path

STATUS = Path("/proc/self/status")


def peak() -> float:
    """In MB. `ru_maxrss` counts what the parent had when it made the process; VmHWM does not."""
    if STATUS.exists():
        found = STATUS.read_text().partition("VmHWM:")[2].split()
        if found:
            return int(found[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def forget() -> None:
    """Let `peak` begin anew with what is held now, where the system can."""
    if STATUS.exists():
        STATUS.with_name("clear_refs").write_text("5")
