"""Analyse the recordings of a folder in parallel, except those with a stored result."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .._arguments import thread_count
from ..errors import ImpactsigError, ImpactsigWarning, InvalidInput
from ..io.companions import without_settings
from ..io.formats import FORMATS
from ..studies.fingerprint import digest, own_code
from ..studies.sweeping import sweep
from ._kept import LASTING, Kept, content_of, key_of
from ._run import worked_out
from ._sweep import law_of
from .parameter import Place, places
from .rig import RIG, Rig

KEPT = ".impactsig"
"""The folder of the runs, in that of the recordings."""


@dataclass(frozen=True)
class Task:
    """A recording and its place in the experiment."""

    path: Path
    place: Place
    frequency: float | None
    rig: Rig
    settings: str = ""
    key: str = ""


def recordings_of(folder: Path, rig: Rig) -> list[Path]:
    """The recordings of a folder, in the order of their names.

    Raises
    ------
    InvalidInput
        If there are none.
    """
    if not folder.is_dir():
        raise InvalidInput("folder", folder, "a folder of recordings")
    endings = {ending for one in FORMATS for ending in one.extensions}
    table = rig.parameter.get("table")
    found = without_settings(
        path
        for path in sorted(folder.glob(rig.files or "**/*"))
        if path.is_file()
        and (rig.files or path.suffix.lower() in endings)
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and not path.name.endswith(".corrections.csv")
        and path.name != RIG
        and path != folder / (table or RIG)
    )
    if not found:
        pattern = rig.files or "the usual endings"
        raise InvalidInput("folder", folder, f"a folder with recordings ({pattern})")
    return found


def settings_of(rig: Rig) -> str:
    """Digest of all settings, besides the content, that the result of a run depends on."""
    settings = {
        name: value for name, value in asdict(rig).items() if name not in ("files", "parameter")
    }
    # Of the parameter only what the recording tells is part of a run; the rest is its place.
    if rig.parameter.get("from") in ("channel", "metadata"):
        settings["parameter"] = {
            name: value
            for name, value in rig.parameter.items()
            if name in ("from", "channel", "key")
        }
    code = own_code(frozenset({f"{__package__}._run"}), frozenset())
    return digest(f"{code} {sorted((name, repr(value)) for name, value in settings.items())}")


@dataclass(frozen=True)
class Work:
    """Analyse one recording in a worker process and store the run."""

    tasks: bytes  # pickled: of 1e5 objects the digest of this job would take 1.2 GB and a minute
    kept: Path

    def __call__(self, run: float) -> dict[str, np.ndarray]:
        """Of that number; the name under which it is kept."""
        task, kept = _tasks(self.tasks)[int(run)], Kept(self.kept)
        content = content_of(task.path)
        key = key_of(content, task.settings, task.frequency)
        if not kept.is_done(key):
            try:
                kept.write(key, worked_out(task.path, task.rig, task.frequency))
            except ImpactsigError as error:
                if type(error) not in LASTING.values():
                    raise
                kept.write_error(key, error)
        names = np.frombuffer(bytes.fromhex(content + key), np.uint64)
        return {"names": names}


@lru_cache(maxsize=1)
def _tasks(packed: bytes) -> list[Task]:
    tasks: list[Task] = pickle.loads(packed)
    return tasks


def read_runs(
    rig: Rig,
    folder: Path,
    kept: Kept,
    workers: int | None,
    client: Any,
    progress: bool | None,
) -> Iterator[tuple[Task, dict[str, Any] | ImpactsigError]]:
    """Every recording with its row, or with the error that prevented one."""
    threads = thread_count(workers)
    usual, place = settings_of(rig), places(rig, folder)
    tasks: list[Task] = []
    failed: dict[int, ImpactsigError] = {}
    for index, path in enumerate(recordings_of(folder, rig)):
        where = place(path)
        if isinstance(where, ImpactsigError):
            failed[index] = where
            tasks.append(Task(path, Place(np.nan, ""), None, rig))
            continue
        frequency = rig.forcing.get("frequency")
        if frequency == "parameter":
            frequency = where.value
            if not frequency > 0:
                failed[index] = InvalidInput("frequency", frequency, "a positive number [Hz]")
        try:
            own = law_of(rig, where)
        except InvalidInput as error:
            own, failed[index] = rig, error
        settings = usual if own is rig else settings_of(own)
        content = kept.known_content(path)
        key = "" if content is None else key_of(content, settings, frequency)
        tasks.append(Task(path, where, frequency, own, settings, key))
    left = [
        k
        for k, task in enumerate(tasks)
        if k not in failed and not (task.key and kept.is_done(task.key))
    ]
    if left:
        packed = pickle.dumps([tasks[k] for k in left])
        work = Work(packed, kept.folder.absolute())
        found, errors = _swept(work, len(left), threads, client, progress)
        failed |= {left[k]: error for k, error in errors.items()}
        kept.learn({tasks[left[k]].path: content for k, (content, _) in found.items()})
        for k, (_, key) in found.items():
            tasks[left[k]] = replace(tasks[left[k]], key=key)
    for k, task in enumerate(tasks):
        yield task, failed[k] if k in failed else kept.read(task.key)


def _swept(
    work: Work, count: int, threads: int, client: Any, progress: bool | None
) -> tuple[dict[int, tuple[str, str]], dict[int, ImpactsigError]]:
    """Contents and keys of the runs that were worked out, and what went wrong with the others."""
    several = min(threads, count) > 1 and client is None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImpactsigWarning)  # failures are named in the experiment
        study = sweep(
            work,
            {"run": range(count)},
            executor="processes" if several else "serial",
            workers=min(threads, count) if several else None,
            client=client,
            tile=1,
            progress=progress,
        )
    errors = {k: ImpactsigError(text) for (k,), text in study.errors.items()}
    found = {}
    if study.observables:
        for k, names in enumerate(study["names"]):
            if k not in errors:
                written = np.ascontiguousarray(names).tobytes().hex()
                found[k] = (written[:32], written[32:])
    return found, errors
