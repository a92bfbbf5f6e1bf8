"""Executor on a dask cluster; tiles of a worker that dies are evaluated by another.

A dask worker hands its tiles to a process of its own. A cell that kills costs that process and not
the worker: dask's nannies do not always replace workers that die in quick succession (measured on
distributed 2026.8: after a dozen deaths, none was left and the study waited for ever).
"""

from __future__ import annotations

import contextlib
import itertools
import threading
import uuid
from typing import Any

from ..._extras import library
from ...errors import ImpactsigError, InvalidInput
from .._cells import Outcome, brief
from .._grid import Task
from .pool import Closing, Ended, Label, Labelled
from .processes import Children

PATIENCE = "10s"
"""How long to look for a scheduler."""
GATHERING = 5.0
"""Seconds after which to see whether a result is still on its way."""
AHEAD = 4
"""Tasks given to the cluster for every thread it has, so that none runs dry."""
DEATHS = 3
"""Times that a tile is given again although, dask says, it has killed several workers."""


class Cluster(Closing):
    """Executor on a dask cluster."""

    def __init__(self, client: Any, payload: bytes) -> None:
        distributed = library("distributed", "studies", "A sweep on a dask cluster")
        self.payload = payload
        self.sweep = uuid.uuid4().hex
        self.own = isinstance(client, str)
        if self.own:
            try:
                client = distributed.Client(client, timeout=PATIENCE, set_as_default=False)
            except (OSError, ValueError) as error:
                raise InvalidInput(
                    "client", client, "the address of a dask scheduler that answers",
                    f"{brief(error)}. Start one with: dask scheduler",
                ) from None  # fmt: skip
        if not isinstance(client, distributed.Client) or client.asynchronous:
            raise InvalidInput("client", client, "a dask Client, not asynchronous, or an address")
        if client.status != "running":
            raise InvalidInput("client", client, "a client that is connected")
        self.client = client
        self.waiting: dict[Any, tuple[Any, Task, int]] = {}

    @property
    def workers(self) -> int:
        """Current number of threads; workers may join and leave."""
        return max(1, sum(self.client.nthreads().values()))

    def run(self, tasks: Labelled[Label]) -> Ended[Label]:
        """As they end."""
        from distributed import KilledWorker, as_completed

        ended = as_completed(loop=self.client.loop)
        source = iter(tasks)
        while True:
            room = AHEAD * self.workers - len(self.waiting)
            for label, task in itertools.islice(source, max(0, room)):
                ended.add(self._give(label, task, DEATHS))
            if not self.waiting:
                return
            future = next(ended)
            label, task, left = self.waiting.pop(future)
            try:
                outcome = _result(future)
            except InvalidInput:
                raise
            except Exception as error:
                if not isinstance(error, KilledWorker) or not left:
                    raise _failed(error) from error
                outcome, left = None, left - 1
            if isinstance(outcome, KeyboardInterrupt):
                raise outcome
            if outcome is None:
                ended.add(self._give(label, task, left))
            else:
                yield label, task, outcome

    def _give(self, label: Any, task: Task, left: int) -> Any:
        try:
            future = self.client.submit(work, self.sweep, self.payload, task, pure=False)
        except Exception as error:
            raise _failed(error) from error
        self.waiting[future] = label, task, left
        return future

    def close(self) -> None:
        """Take back what is not done, and end the workers' processes."""
        # If the cluster has gone, there is nothing to take back from.
        with contextlib.suppress(Exception):
            self.client.cancel(list(self.waiting))
            self.client.run(release, self.sweep, on_error="ignore")
        if self.own:
            self.client.close()


def _failed(error: Exception) -> ImpactsigError:
    return ImpactsigError(
        f"the dask cluster has failed: {brief(error)}. Finished tiles are kept if there is a "
        "directory: run the same sweep again"
    )


def _result(future: Any) -> Outcome | KeyboardInterrupt | None:
    """Result of a finished future; None if it was lost with its worker.

    Dask works out lost results again, but is not waited for: after several deaths it may forget.
    """
    while future.status != "lost":
        try:
            outcome: Outcome | KeyboardInterrupt = future.result(timeout=GATHERING)
            return outcome
        except TimeoutError:
            if future.status != "finished":
                break
    future.release()
    return None


# -- in a dask worker ------------------------------------------------------------------------------

_children: dict[str, Children] = {}
_over: set[str] = set()
_lock = threading.Lock()


def work(sweep: str, payload: bytes, task: Task) -> Outcome | KeyboardInterrupt:
    """Have a task worked out, in a process of the thread's own.

    A KeyboardInterrupt is returned, since dask ends a worker in which one is raised.
    """
    with _lock:
        if sweep in _over:  # the task came before word that it is not wanted
            raise ImpactsigError("the sweep has been stopped")
        children = _children.setdefault(sweep, Children(payload))
    try:
        return children.work(task)
    except KeyboardInterrupt as stop:
        return stop


def release(sweep: str) -> None:
    """The sweep is over, or given up."""
    with _lock:
        _over.add(sweep)
        children = _children.pop(sweep, None)
    if children is not None:
        children.kill()
