"""Memory that is kept from one array for the next."""

from __future__ import annotations

import functools

import numpy as np

KEPT = 1 << 23  # bytes


@functools.cache
def keep_memory() -> None:
    """Have the C library keep the memory of arrays that are let go for those to come.

    That of GNU gives memory back to the system, which clears it before it is used anew, where more
    is free than twice the largest array that was let go so far. So one of KEPT is let go first.
    """
    np.empty(KEPT, np.uint8)
