"""Tiles on a dask cluster; a worker that dies is replaced by dask, its tiles worked out again.

A tile during which several workers have died is halved like one of local processes, but dask blames
all tiles that a dying worker held: cells left alone with the blame are therefore tried once more,
one at a time, when all else is done.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from ..errors import ImpactsigError, InvalidInput, MissingExtra
from ._cells import Outcome, brief, run_cells
from ._grid import Task
from ._payload import unpack
from ._pool import Closing, Ended, Label, Labelled
from ._processes import joined

PATIENCE = "10s"
"""How long to look for a scheduler."""
AHEAD = 4
"""Tasks given to the cluster for every thread it has, so that none runs dry."""


def run_payload(payload: bytes, task: Task) -> Outcome:
    """What a dask worker does."""
    return run_cells(unpack(payload), task)


class Cluster(Closing):
    """A dask cluster."""

    def __init__(self, client: Any, payload: bytes) -> None:
        try:
            import distributed
        except ImportError:
            raise MissingExtra("distributed", "studies", "A sweep on a dask cluster") from None
        self.payload = payload
        self.own = isinstance(client, str)
        self.futures: set[Any] = set()
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
        self.client = client

    @property
    def workers(self) -> int:
        """Threads that there are now; workers may still come and go."""
        return max(1, sum(self.client.nthreads().values()))

    def run(self, tasks: Labelled[Label]) -> Ended[Label]:
        """As they end."""
        yield from _Round(self).run(tasks)

    def submit(self, task: Task) -> Any:
        """Give a task to the cluster."""
        future = self.client.submit(run_payload, self.payload, task, pure=False)
        self.futures.add(future)
        return future

    def close(self) -> None:
        """Take back what is not done."""
        try:
            if self.futures:
                self.client.cancel(list(self.futures))
        except Exception:  # the cluster has gone; there is nothing to take back from
            pass
        finally:
            if self.own:
                self.client.close()


class _Part:
    """A task or a part of one, until its outcome is there; halves report to what they are of."""

    def __init__(self, label: Any, task: Task, whole: _Part | None = None) -> None:
        self.label, self.task, self.whole = label, task, whole
        self.halves: list[_Part] = []
        self.outcome: Outcome | None = None
        self.alone = False

    def split(self) -> list[_Part]:
        count = len(self.task.cells)
        ends = (0, count // 2, count)
        self.halves = [
            _Part(self.label, self.task.part(*pair), self) for pair in itertools.pairwise(ends)
        ]
        return self.halves

    def end(self, outcome: Outcome) -> _Part | None:
        """Take the outcome; the whole task, if that completes it."""
        self.outcome = outcome
        if self.whole is None:
            return self
        first, second = (half.outcome for half in self.whole.halves)
        if first is None or second is None:
            return None
        start = len(self.whole.halves[0].task.cells)
        return self.whole.end(joined(first, second, start))


class _Round:
    """One call of `Cluster.run`."""

    def __init__(self, cluster: Cluster) -> None:
        from distributed import as_completed

        self.cluster = cluster
        self.ended = as_completed()
        self.parts: dict[Any, _Part] = {}
        self.suspects: list[_Part] = []

    def give(self, part: _Part) -> None:
        future = self.cluster.submit(part.task)
        self.parts[future] = part
        self.ended.add(future)

    def run(self, tasks: Labelled[Label]) -> Ended[Label]:
        source = (_Part(label, task) for label, task in tasks)
        while True:
            room = AHEAD * self.cluster.workers - len(self.parts)
            for part in itertools.islice(source, max(0, room)):
                self.give(part)
            if not self.parts:
                if not self.suspects:
                    return
                self.give(self.suspects.pop())
            whole = self.take(next(self.ended))
            if whole is not None:
                assert whole.outcome is not None
                yield whole.label, whole.task, whole.outcome

    def take(self, future: Any) -> _Part | None:
        """What has ended; the whole task it completes, if it does."""
        from distributed import KilledWorker

        part = self.parts.pop(future)
        self.cluster.futures.discard(future)
        try:
            return part.end(future.result())
        except KilledWorker:
            pass
        except InvalidInput:
            raise
        except Exception as error:
            raise ImpactsigError(
                f"the dask cluster has failed: {brief(error)}. Finished tiles are kept if there is "
                "a directory: run the same sweep again"
            ) from error
        if len(part.task.cells) > 1:
            for half in part.split():
                self.give(half)
        elif not part.alone:
            part.alone = True
            self.suspects.append(part)
        else:
            cell = int(np.asarray(part.task.cells)[0])
            return part.end(Outcome([], {cell: "its dask workers died"}, 0.0))
        return None
