"""Thread pool for kernels that release the interpreter lock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from .._arguments import thread_count
from .._watched import counted


def in_threads(part: Callable[[int], object], parts: int, workers: int | None) -> list:
    """part(0), part(1), ... in that order, computed by a number of threads."""
    threads = thread_count(workers)
    if threads == 1:
        return list(counted(map(part, range(parts)), parts, " parts"))
    with ThreadPoolExecutor(threads) as pool:
        return list(counted(pool.map(part, range(parts)), parts, " parts"))
