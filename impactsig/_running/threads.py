"""Threads for kernels that release the interpreter lock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from threading import Thread
from typing import Any

from .._arguments import thread_count
from .watched import progress


def in_threads(
    task: Callable[[Any], Any], items: Iterable[Any], workers: int | None, unit: str = " parts"
) -> list[Any]:
    """The results of a task for each item, in order; if some fail, the error of the first.

    The calling thread is one of the threads: a pool that it waited for would take a third
    of a millisecond more.
    """
    todo, threads = deque(enumerate(items)), thread_count(workers)
    count = len(todo)
    found: dict[int, Any] = {}
    failed: dict[int, BaseException] = {}

    def work(tell: Callable[[], None]) -> None:
        while todo:
            try:
                k, item = todo.popleft()
            except IndexError:  # another thread took the last one
                return
            try:
                found[k] = task(item)
            except BaseException as error:
                failed[k] = error
                todo.clear()
            tell()

    with progress(count, unit, leave=False) as advance:
        told = 0

        def tell() -> None:
            nonlocal told
            done = len(found)
            advance(done - told)
            told = done

        helpers = [
            Thread(target=work, args=(lambda: None,)) for _ in range(min(threads, count) - 1)
        ]
        for helper in helpers:
            helper.start()
        try:
            work(tell)
        finally:
            todo.clear()
            for helper in helpers:
                helper.join()
        tell()
    if failed:
        raise failed[min(failed)]
    return [found[k] for k in range(count)]
