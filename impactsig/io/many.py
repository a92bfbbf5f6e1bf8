"""Many recordings, one after another, read ahead."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from os import PathLike
from pathlib import Path
from typing import Any

from .._arguments import path_list, thread_count
from .._running.watched import progress as bar
from ..errors import ImpactsigError
from ..recording import Recording
from .reading import read


def read_many(
    files: Iterable[str | PathLike[str]],
    *,
    workers: int | None = None,
    progress: bool | None = None,
    **options: Any,
) -> Iterator[tuple[Path, Recording | ImpactsigError]]:
    """Read many recordings one after another, with read-ahead.

    Parameters
    ----------
    files : iterable of path-like
        The recordings.
    workers : int, optional
        Number of threads, by default the number of cores. The result does not depend on it. As many
        recordings are read ahead.
    progress : bool, optional
        Whether to show a progress bar; by default only in a terminal or notebook.
    **options
        As for `read`, the same for all files.

    Yields
    ------
    path : Path
    recording : Recording or ImpactsigError
        The recording, in the order of the files, or the error if the file cannot be read.

    Raises
    ------
    InvalidInput
        If `files` is a single path, or `workers` is not a whole number from 1 on.

    See Also
    --------
    read, detect_many

    Examples
    --------
    >>> from impactsig import ImpactsigError, read_many
    >>> for path, recording in read_many(["data_samples/loadcell_periodic_22.1Hz.wav"], workers=1):
    ...     if not isinstance(recording, ImpactsigError):
    ...         print(path.name, recording.duration)
    loadcell_periodic_22.1Hz.wav 10.0
    """
    return _ahead(path_list(files), thread_count(workers), progress, options)


def _ahead(
    paths: list[Path], threads: int, progress: bool | None, options: dict[str, Any]
) -> Iterator[tuple[Path, Recording | ImpactsigError]]:
    waiting: deque[tuple[Path, Future[Recording]]] = deque()
    upcoming = iter(paths)
    with ThreadPoolExecutor(threads) as pool, bar(len(paths), " files", progress) as advance:
        try:
            for _ in paths:
                while len(waiting) < threads and (path := next(upcoming, None)) is not None:
                    waiting.append((path, pool.submit(read, path, **options)))
                path, future = waiting.popleft()
                try:
                    found: Recording | ImpactsigError = future.result()
                except ImpactsigError as error:
                    found = error
                advance(1)
                yield path, found
        finally:
            for _, future in waiting:
                future.cancel()
