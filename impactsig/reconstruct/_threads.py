"""Threads for kernels that let go of the interpreter."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from .._arguments import thread_count


def in_threads(part: Callable[[int], object], parts: int, workers: int | None) -> list:
    """part(0), part(1), ... in that order, worked out by so many threads."""
    threads = thread_count(workers)
    if threads == 1:
        return [part(k) for k in range(parts)]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(part, range(parts)))
