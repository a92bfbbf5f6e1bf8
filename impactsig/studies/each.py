"""Map a function over objects in parallel processes: a sweep whose cells return objects."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from .._arguments import thread_count
from ..errors import ImpactsigError, ImpactsigWarning
from .sweeping import sweep


def each(
    function: Callable[[Any], Any],
    things: Sequence[Any],
    *,
    workers: int | None = None,
    progress: bool | None = None,
) -> list[Any]:
    """What a function returns of every thing, or the error that it raised, in their order.

    Parameters
    ----------
    function : callable
        Of a module, so that other processes find it. What it prints is lost.
    things : sequence
        Must be picklable, as what is returned.
    workers : int, optional
        Processes; as many as there are cores unless given. One works in the caller's.
    progress : bool, optional
        As for `sweep`.

    Returns
    -------
    list
        An ImpactsigError stands for a thing of which the function raised it. Any other error, or
        the death of a process, becomes an ImpactsigError as well; the rest goes on.

    Raises
    ------
    InvalidInput
        If `workers` is not a whole number from 1 on.
    """
    threads = thread_count(workers)
    if not things:
        return []
    with TemporaryDirectory(prefix="impactsig-") as folder:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ImpactsigWarning)  # failed cells are reported below
            study = sweep(
                _Kept(function, tuple(things), folder),
                {"thing": range(len(things))},
                executor="processes" if min(threads, len(things)) > 1 else "serial",
                workers=min(threads, len(things)),
                tile=1,
                progress=progress,
            )
        return [
            ImpactsigError(study.errors[k,])
            if (k,) in study.errors
            else pickle.loads(Path(folder, str(k)).read_bytes())
            for k in range(len(things))
        ]


@dataclass(frozen=True)
class _Kept:
    """Calls the function in a worker, and writes the result to a temporary folder."""

    function: Callable[[Any], Any]
    things: tuple[Any, ...]
    folder: str

    def __call__(self, thing: float) -> float:
        try:
            found = self.function(self.things[int(thing)])
        except ImpactsigError as error:
            found = error
        Path(self.folder, str(int(thing))).write_bytes(pickle.dumps(found))
        return thing
