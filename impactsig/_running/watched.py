"""Progress bars, shown where a terminal or a notebook is there to show them."""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from threading import Event, Thread
from typing import Any, TypeVar

from .._arguments import flag

Result = TypeVar("Result")

DELAY = 1.0
"""Seconds of work before a bar is shown that nobody asked for."""

_LOOK = 0.2  # seconds between two looks at a kernel


def watched() -> bool:
    """Whether output goes to a terminal or a notebook, in the main process."""
    if multiprocessing.parent_process() is not None:
        return False
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


def progress(
    total: int | None, unit: str, wanted: bool | None = None, *, done: int = 0, leave: bool = True
) -> AbstractContextManager[Callable[[int], Any]]:
    """A progress bar that its caller advances; by default shown after a second, if watched.

    The time remaining is judged by what is done from here on, not by what was `done` before.
    """
    if not (watched() if wanted is None else flag("progress", wanted)):
        return _UNSEEN
    return _bar(total, unit, DELAY if wanted is None else 0.0, done, leave)


_UNSEEN: AbstractContextManager[Callable[[int], Any]] = nullcontext(lambda count: None)


@contextmanager
def _bar(
    total: int | None, unit: str, delay: float, done: int, leave: bool
) -> Iterator[Callable[[int], Any]]:
    from tqdm import tqdm

    with tqdm(
        total=total, initial=done, unit=unit, unit_scale=True, delay=delay, leave=leave
    ) as bar:
        yield bar.update


def counted(results: Iterable[Result], total: int, unit: str) -> Iterator[Result]:
    """Yield results as they come, and show how many have; by default if watched."""
    with progress(total, unit, leave=False) as advance:
        for result in results:
            advance(1)
            yield result


@contextmanager
def following(total: float, unit: str, done: Callable[[], float]) -> Iterator[None]:
    """Show a bar while a kernel runs in this thread; by default if watched.

    `done` is called by another thread. It must only look at what the kernel writes, so that the
    result does not depend on whether somebody watches.
    """
    if not watched():
        yield
        return
    ended = Event()

    def follow() -> None:
        if ended.wait(DELAY):
            return
        from tqdm import tqdm

        begin = min(done(), total)
        with tqdm(total=total, initial=begin, unit=unit, unit_scale=True, leave=False) as bar:
            while not ended.wait(_LOOK):
                bar.update(min(done(), total) - bar.n)

    follower = Thread(target=follow, daemon=True)
    follower.start()
    try:
        yield
    finally:
        ended.set()
        follower.join()
