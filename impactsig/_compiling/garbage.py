"""Garbage that numba leaves: instructions and types that refer to each other."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterator

_kept = [False]


@contextlib.contextmanager
def kept() -> Iterator[None]:
    """Within this, do not look through what a compilation leaves: for a process that ends soon.

    To look took a twentieth of a first detection, and found 80 MB.
    """
    before, frozen = _kept[0], gc.get_freeze_count()
    _kept[0] = True
    try:
        yield
    finally:
        _kept[0] = before
        if not frozen:
            gc.unfreeze()


@contextlib.contextmanager
def without_collections() -> Iterator[None]:
    """Switch off garbage collection, which took a tenth of the time of compiling."""
    were_made = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if were_made:
            if _kept[0]:
                gc.freeze()
            gc.enable()
