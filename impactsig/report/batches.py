"""Many recordings: detection, and reports with an index page."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from .._arguments import READING, path_list
from .._arguments import path as path_of
from .._files.atomic import atomic_path
from .._showing import Shown
from ..errors import ImpactsigError, InvalidInput, UnwritableFile
from ..studies.each import each
from ._drawn import Wanted, digest_of_page

if TYPE_CHECKING:
    from ..impacts import Impacts

INDEX = "index.html"


@dataclass(frozen=True, eq=False)
class Detected(Shown):
    """The impacts of many recordings.

    Attributes
    ----------
    impacts : dict of Path to Impacts
        Impacts of every file that could be read, in the given order.
    errors : dict of Path to ImpactsigError
        Errors of the other files.

    See Also
    --------
    detect_many, write_reports

    Examples
    --------
    >>> from impactsig import detect_many
    >>> found = detect_many(["data_samples/loadcell_periodic_22.1Hz_short.csv"], workers=1)
    >>> [len(impacts) for impacts in found.impacts.values()], found.errors
    ([18], {})
    """

    impacts: dict[Path, Impacts] = field(repr=False)
    errors: dict[Path, ImpactsigError]


@dataclass(frozen=True)
class Entry:
    """One recording of a batch.

    Attributes
    ----------
    path : Path
        The recording.
    page : Path or None
        Its report, or None.
    summary : str
        The result in a sentence, or the error.
    figures : tuple of (str, str, str)
        Key figures: name, value and comment.
    """

    path: Path
    page: Path | None
    summary: str
    figures: tuple[tuple[str, str, str], ...] = field(default=(), repr=False)


def detect_many(
    files: Iterable[str | PathLike[str]],
    *,
    workers: int | None = None,
    progress: bool | None = None,
    **options: Any,
) -> Detected:
    """Detect the impacts of many recordings, in parallel processes.

    Parameters
    ----------
    files : iterable of path-like
        The recordings. Those too long for memory are processed in blocks.
    workers : int, optional
        Number of processes, by default the number of cores. The result does not depend on it.
    progress : bool, optional
        Whether to show a progress bar; by default only in a terminal or notebook.
    **options
        As for `read` (channel, start, stop, rate, scale, offset, unit, sensor, raw) and for
        `detect_impacts`, the same for all files.

    Returns
    -------
    Detected
        The result. A file that cannot be read, or that kills its process, is listed in `errors`.

    Raises
    ------
    InvalidInput
        If there are no files, or a file is given twice.

    See Also
    --------
    detect_impacts, read_many, write_reports

    Examples
    --------
    >>> from impactsig import detect_many
    >>> found = detect_many(["data_samples/loadcell_periodic_22.1Hz_short.csv"], workers=1)
    >>> for path, impacts in found.impacts.items():
    ...     print(path.name, len(impacts))
    loadcell_periodic_22.1Hz_short.csv 18
    """
    paths = _paths(files)
    found = each(partial(_detect, options=options), paths, workers=workers, progress=progress)
    pairs = list(zip(paths, found, strict=True))
    return Detected(
        {path: one for path, one in pairs if not isinstance(one, ImpactsigError)},
        {path: one for path, one in pairs if isinstance(one, ImpactsigError)},
    )


def write_reports(
    files: Iterable[str | PathLike[str]],
    directory: str | PathLike[str],
    *,
    workers: int | None = None,
    progress: bool | None = None,
    **options: Any,
) -> tuple[Entry, ...]:
    """Write a report of each of many recordings, and a page that lists them.

    Parameters
    ----------
    files : iterable of path-like
        The recordings.
    directory : path-like
        Folder for the pages, each named after its recording, and ``index.html``; created if
        necessary.
    workers : int, optional
        Number of processes, by default the number of cores. The result does not depend on it.
    progress : bool, optional
        Whether to show a progress bar; by default only in a terminal or notebook.
    **options
        As for `write_report`, the same for all files.

    Returns
    -------
    tuple of Entry
        Entries in the order of the files; for a file that cannot be analysed, with the reason.

    Raises
    ------
    InvalidInput
        If there are no files, or a file is given twice.
    UnwritableFile
        If the directory cannot be created, or the index cannot be written.

    See Also
    --------
    write_report, detect_many

    Examples
    --------
    >>> import tempfile
    >>> from impactsig import write_reports
    >>> files = ["data_samples/loadcell_periodic_22.1Hz_short.csv"]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     entries = write_reports(files, folder, workers=1)
    ...     print(len(entries))
    1
    """
    paths, folder = _paths(files), path_of("directory", directory)
    return write_each_report(
        paths, folder, [options] * len(paths), workers=workers, progress=progress
    )


def write_each_report(
    files: Iterable[Path],
    folder: Path,
    options: Sequence[dict[str, Any]],
    *,
    runs: Sequence[str] = (),
    workers: int | None = None,
    progress: bool | None = None,
) -> tuple[Entry, ...]:
    """As `write_reports`, with separate options for each recording.

    Where `runs` names the results of the recordings, pages that are current are left as they are.
    """
    paths = _paths(files)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnwritableFile(folder, f"cannot be made ({error.strerror})") from None
    pages = _pages(paths, folder)
    made: dict[Path, Entry | ImpactsigError] = {}
    wanted = []
    for number, (path, page) in enumerate(zip(paths, pages, strict=True)):
        target = Wanted(page, digest_of_page(runs[number], path, options[number])) if runs else None
        kept = None if target is None else target.current()
        if kept is None:
            wanted.append((path, page, options[number], target))
        else:
            figures = tuple((name, value, word) for name, value, word in kept["figures"])
            made[path] = Entry(path, page, kept["summary"], figures)
    found = each(_report, wanted, workers=workers, progress=progress)
    made |= {task[0]: one for task, one in zip(wanted, found, strict=True)}
    entries = tuple(
        Entry(path, None, str(one).removeprefix(f"{path}: "))
        if isinstance(one := made[path], ImpactsigError)
        else one
        for path in paths
    )
    with atomic_path(folder / INDEX) as temporary:
        temporary.write_text(_index(entries), encoding="utf-8")
    return entries


def _detect(path: Path, options: dict[str, Any]) -> Impacts:
    from ..detect.files import detect_file

    reading = {name: value for name, value in options.items() if name in READING}
    detecting = {name: value for name, value in options.items() if name not in READING}
    return detect_file(path, reading, detecting)


def _report(task: tuple[Path, Path, dict[str, Any], Wanted | None]) -> Entry:
    from .cards import tiles
    from .page import analyse_to_page

    path, page, options, wanted = task
    analysis, page = analyse_to_page(path, page, **options)
    entry = Entry(path, page, analysis.summary(), tuple(tiles(analysis)))
    if wanted is not None:
        wanted.keep(summary=entry.summary, figures=entry.figures)
    return entry


def _paths(files: Iterable[str | PathLike[str]]) -> list[Path]:
    paths = path_list(files)
    if not paths:
        raise InvalidInput("files", paths, "one path or more")
    twice = {str(path) for path in paths if paths.count(path) > 1}
    if twice:
        raise InvalidInput("files", ", ".join(sorted(twice)), "every file once")
    return paths


def _pages(paths: list[Path], folder: Path) -> list[Path]:
    """File name of each page in the folder; equal names are numbered."""
    taken, pages = {INDEX.casefold()}, []
    for path in paths:
        name, number = f"{path.name}.html", 1
        while name.casefold() in taken:
            number += 1
            name = f"{path.name}-{number}.html"
        taken.add(name.casefold())
        pages.append(folder / name)
    return pages


def _index(entries: tuple[Entry, ...]) -> str:
    """The page that lists them."""
    from ._template import page_of
    from .contents import breakable, printable

    heads = list(dict.fromkeys(name for entry in entries for name, _, _ in entry.figures))
    return page_of("index.html.j2")(
        heads=heads,
        rows=[
            {
                "name": breakable(entry.path.name),
                "link": quote(entry.page.name) if entry.page else None,
                "summary": printable(re.sub(r"\s+", " ", entry.summary)),
                "cells": [
                    {name: value for name, value, _ in entry.figures}.get(head, "")
                    for head in heads
                ],
            }
            for entry in entries
        ],
        failed=sum(entry.page is None for entry in entries),
    )
