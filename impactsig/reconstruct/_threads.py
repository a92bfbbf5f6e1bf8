"""Threads for kernels that let go of the interpreter."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def threads_of(workers: int | None) -> int:
    """As many as asked for, or as there are cores."""
    return workers or os.cpu_count() or 1


def in_threads(part: Callable[[int], object], parts: int, workers: int | None) -> list:
    """part(0), part(1), ... in that order, worked out by so many threads."""
    threads = threads_of(workers)
    if threads == 1:
        return [part(k) for k in range(parts)]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(part, range(parts)))
