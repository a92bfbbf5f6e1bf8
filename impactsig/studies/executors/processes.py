"""Executor on worker processes; one that dies is replaced and its task repeated.

`concurrent.futures` and loky give up all tasks when a process dies, so the processes are our own:
each belongs to a thread, which gives it one task at a time and therefore knows what it was at when
it died. A task that has killed two processes is halved, until the cell is found that kills; that
cell is marked, and the study goes on.
"""

from __future__ import annotations

import contextlib
import pickle
import subprocess
import sys
import threading
from typing import Any

from ...errors import ImpactsigError
from .._cells import Outcome
from .._grid import Task
from .pool import Threads

ATTEMPTS = 2
"""Processes that a task may kill before it is halved."""
LEAVING = 2.0
"""Seconds that a process has to end by itself, so that its exit code is seen."""
STARTS = 3
"""Processes that may die one after another before they are ready."""


class Processes(Threads):
    """Executor with a pool of processes, one for each thread."""

    def __init__(self, payload: bytes, workers: int) -> None:
        self.children = Children(payload)
        super().__init__(self.children.work, workers)

    def close(self) -> None:
        """Kill the processes; their tasks are given up."""
        self.children.kill()
        super().close()
        self.children.reap()


class _Died(Exception):
    """A process has gone."""


class Children:
    """The worker processes, one for each thread that uses them."""

    def __init__(self, payload: bytes) -> None:
        self.payload = payload
        self.own = threading.local()
        self.lock = threading.Lock()
        self.alive: set[subprocess.Popen[bytes]] = set()
        self.closed = False

    def work(self, task: Task) -> Outcome:
        """Evaluate a task in the process of this thread."""
        for _ in range(ATTEMPTS):
            try:
                process = getattr(self.own, "process", None) or self._start()
                outcome: Outcome = self._talk(process, task)
                return outcome
            except _Died as died:
                how = str(died)
        count = len(task.cells)
        if count == 1:
            return Outcome([], {int(task.cells[0]): f"its worker process died ({how})"}, 0.0)
        half = count // 2
        return _joined(self.work(task.part(0, half)), self.work(task.part(half, count)), half)

    def kill(self) -> None:
        """End all processes, and start no new ones."""
        with self.lock:
            self.closed = True
            for process in self.alive:
                process.kill()
                process.wait()

    def reap(self) -> None:
        """Close their pipes; no thread asks them any more."""
        for process in self.alive:
            _ended(process)

    def _start(self) -> subprocess.Popen[bytes]:
        """A new process that is ready."""
        how = ""
        for _ in range(STARTS):
            process = self._open()
            try:
                self._talk(process, self.payload)
            except _Died as died:
                how = str(died)
            else:
                self.own.process = process
                return process
        raise ImpactsigError(f"worker processes die before they are ready ({how})")

    def _open(self) -> subprocess.Popen[bytes]:
        # The same modules are found there as here. Starting from this line, and not from the
        # caller's program as multiprocessing does, needs no guard in it and works in a notebook.
        line = f"import sys; sys.path[:] = {sys.path!r}; from {_WORKER} import main; main()"
        with self.lock:
            if self.closed:
                raise ImpactsigError("the sweep has been stopped")
            process = subprocess.Popen(
                [sys.executable, "-c", line], stdin=subprocess.PIPE, stdout=subprocess.PIPE
            )
            self.alive.add(process)
        return process

    def _talk(self, process: subprocess.Popen[bytes], message: Any) -> Any:
        """Say something to a process, and wait for its answer."""
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            pickle.dump(message, process.stdin)
            process.stdin.flush()
            answer = pickle.load(process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError):
            self.own.process = None
            with self.lock:
                self.alive.discard(process)
            raise _Died(_ended(process)) from None
        if isinstance(answer, (ImpactsigError, KeyboardInterrupt)):
            raise answer
        return answer


_WORKER = f"{__package__}._worker"


def _joined(first: Outcome, second: Outcome, start: int) -> Outcome:
    """Join the outcomes of the two halves of a task, the second beginning at `start`."""
    moved = [(positions + start, found) for positions, found in second.groups]
    return Outcome(
        first.groups + moved, first.errors | second.errors, first.seconds + second.seconds
    )


def _ended(process: subprocess.Popen[bytes]) -> str:
    """Ensure that a process has ended; returns how, in words."""
    with contextlib.suppress(subprocess.TimeoutExpired):  # it may be amid its exit
        process.wait(LEAVING)
    process.kill()
    for pipe in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):  # what it will not read any more
            if pipe:
                pipe.close()
    code = process.wait()
    return f"signal {-code}" if code < 0 else f"exit code {code}"
