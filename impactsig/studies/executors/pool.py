"""Executors on this machine: the caller's own thread, a pool of threads, and of processes.

An executor takes tasks and gives them back with their outcomes, in the order they end. Whichever it
is, a task is worked out by `run_cells`.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Protocol, Self, TypeVar

from .._cells import Job, Outcome, run_cells
from .._grid import Task

Label = TypeVar("Label")
Labelled = Iterable[tuple[Label, Task]]
Ended = Iterator[tuple[Label, Task, Outcome]]


class Executor(AbstractContextManager["Executor"], Protocol):
    """Protocol of an executor: evaluates tasks and returns their outcomes."""

    @property
    def workers(self) -> int:
        """Tiles that are worked out at the same time."""

    @property
    def least(self) -> int:
        """Cells to a tile below which it takes no less time."""

    @property
    def most(self) -> int:
        """Cells to a tile that fit memory."""

    def run(self, tasks: Labelled[Label]) -> Ended[Label]:
        """Work out tasks, each with a label to know it by."""
        ...

    def close(self) -> None:
        """Stop at once, as at the end of a with block; give up tasks under way where possible."""
        ...


class Closing:
    """Base of executors that close at the end of a with block."""

    least = 1
    """Cells to a tile below which it takes no less time."""
    most = sys.maxsize
    """Cells to a tile that fit memory."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Nothing is held."""


class Serial(Closing):
    """Executor that evaluates one task after another in the caller's thread."""

    workers = 1

    def __init__(self, job: Job) -> None:
        self.job = job

    def run(self, tasks: Labelled[Label]) -> Ended[Label]:
        """In the order given."""
        for label, task in tasks:
            yield label, task, run_cells(self.job, task)


class Threads(Closing):
    """Executor with a pool of threads, each of which evaluates one task at a time."""

    def __init__(self, work: Callable[[Task], Outcome], workers: int) -> None:
        self.work, self.workers = work, workers
        self.pool = ThreadPoolExecutor(workers, thread_name_prefix="impactsig-sweep")

    def run(self, tasks: Labelled[Label]) -> Ended[Label]:
        """As they end; tasks are taken when they are needed, so that a long study fits memory."""
        waiting: dict[Future[Outcome], tuple[Label, Task]] = {}
        source = iter(tasks)
        while True:
            for label, task in itertools.islice(source, 2 * self.workers - len(waiting)):
                waiting[self.pool.submit(self.work, task)] = label, task
            if not waiting:
                return
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                yield *waiting.pop(future), future.result()

    def close(self) -> None:
        """Wait for what is under way: a thread cannot be stopped."""
        self.pool.shutdown(wait=True, cancel_futures=True)
