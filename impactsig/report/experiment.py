"""The page of an experiment: diagrams over the parameter, jumps, and links to reports."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from .. import plot
from .._files.atomic import atomic_path
from ..errors import InvalidInput, UnwritableFile
from ._template import page_of
from .batches import INDEX, Entry, write_each_report
from .contents import breakable, printable
from .figures import Picture, draw

if TYPE_CHECKING:
    from ..dynamics.diagrams.diagrams import BifurcationDiagram
    from ..experiment.experiment import Experiment

RUNS, JUMPS, RECORDINGS = "runs.csv", "jumps.csv", "recordings"
SHOWN = 2000
"""Runs that the page lists; the table of all is beside it."""
NAMED = 5
"""Runs of one note that are named."""
UNCUT = 60
"""Runs up to which their table is shown whole, rather than in a window that is scrolled."""
_HEADS = (
    ("branch", "", 1.0), ("period", "", 1.0), ("confidence", "", 1.0), ("impacts", "", 1.0),
    ("impacts_per_period", "", 1.0), ("interval", "ms", 1e3), ("contact_time", "µs", 1e6),
    ("peak", "", 1.0), ("dimension", "", 1.0),
)  # fmt: skip
_CAPTIONS = {
    "period": "The motion of every run: period(m, n) is m impacts in n forcing periods.",
    "interval": "Intervals between impacts",
    "peak": "Peaks of the impacts.",
    "contact_time": "Contact times.",
    "phase": "Phases of the impacts in the forcing period: from the zero of the forcing where it "
    "was recorded, else from the mean of the run.",
    "impacts_per_period": "Impacts per forcing period.",
    "time_in_contact": "Share of the time in contact.",
    "dimension": "Correlation dimension of the intervals, with its 95 % confidence interval.",
}
_STROKES = (
    ": strokes to the left of their value are of the way up, to the right of the way down, here "
    "and below"
)
_WIDE = ("period", "interval")


def write_experiment(
    experiment: Experiment,
    directory: Path,
    *,
    runs: Sequence[str],
    reports: bool = True,
    simulated: BifurcationDiagram | Sequence[BifurcationDiagram] = (),
    workers: int | None = None,
    progress: bool | None = None,
) -> Path:
    """As `Experiment.write_report`; `runs` are the names under which its runs are kept."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        if reports and len(experiment):
            (directory / RECORDINGS).mkdir(exist_ok=True)
    except OSError as error:
        raise UnwritableFile(directory, f"cannot be made ({error.strerror})") from None
    entries: dict[Path, Entry] = {}
    if reports and len(experiment):
        options = [_options(experiment, run) for run in range(len(experiment))]
        made = write_each_report(
            experiment.files,
            directory / RECORDINGS,
            options,
            runs=runs,
            workers=workers,
            progress=progress,
        )
        entries = {entry.path: entry for entry in made}
    _write_tables(experiment, directory)
    with atomic_path(directory / INDEX) as temporary:
        temporary.write_text(_page(experiment, entries, simulated), encoding="utf-8")
    return directory / INDEX


def _options(experiment: Experiment, run: int) -> dict[str, Any]:
    """Options of the report of a run."""
    rig = experiment.rig
    options = rig.reading_options() | rig.detecting_options()
    frequency = rig.forcing.get("frequency")
    if frequency == "parameter":
        frequency = float(experiment.values[run])
    if frequency is not None and not rig.sweep:
        options["forcing_period"] = 1 / frequency
    return options


def _write_tables(experiment: Experiment, directory: Path) -> None:
    with atomic_path(directory / RUNS) as temporary:
        experiment.to_frame().to_csv(temporary, index=False)
    with (
        atomic_path(directory / JUMPS) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(("branch", "value", "error", "before", "after", "low", "high", "delay"))
        writer.writerows(experiment.jumps())


def _page(
    experiment: Experiment,
    entries: dict[Path, Entry],
    simulated: BifurcationDiagram | Sequence[BifurcationDiagram],
) -> str:
    unit = experiment.unit
    heads, rows = _rows(experiment, entries)
    return page_of("experiment.html.j2", images="data:")(
        title=f"{len(experiment)} recordings over the {experiment.parameter}",
        summary=_summary(experiment),
        pictures=list(_pictures(experiment, simulated)),
        jumps=[_unbroken(one.describe(unit)) for one in experiment.jumps()],
        widths=[
            _unbroken(
                f"between {one.below} and {one.above}: {one.width:.4g} ± {one.error:.2g} {unit}"
            )
            for one in experiment.hysteresis()
        ],
        heads=heads,
        rows=rows,
        left=max(0, len(experiment) - SHOWN),
        tall=len(rows) <= UNCUT,
        errors=_reasons(
            (path.name, str(error).removeprefix(f"{path}: "))
            for path, error in experiment.errors.items()
        ),
        reportless=_reasons(
            (entry.path.name, entry.summary) for entry in entries.values() if entry.page is None
        ),
        notes=_reasons(_notes(experiment)),
        runs=RUNS,
        table_of_jumps=JUMPS,
    )


def _summary(experiment: Experiment) -> str:
    """Summary of the experiment in a sentence or two."""
    points = experiment.points()
    if not points:
        return "No recording could be analysed."
    periods = {one.motion for one in points if one.motion.startswith("period(")}
    shares = [
        (sum(one.motion == kind for one in points), word)
        for kind, word in (("aperiodic", "aperiodic"), ("no impacts", "without impacts"))
    ]
    regular = sum(one.motion in periods for one in points)
    parts = [f"{regular} of {len(points)} values periodic, in {len(periods)} kinds"]
    parts += [f"{count} {word}" for count, word in shares if count]
    known = experiment.values[np.isfinite(experiment.values)]
    unit = f" {experiment.unit}" if experiment.unit else ""
    span = f", {known.min():g} to {known.max():g}{unit}" if len(known) else ""
    runs = f"{len(experiment)} run{'' if len(experiment) == 1 else 's'}"
    return f"{runs}{span}: {'; '.join(parts)}."


def _pictures(experiment: Experiment, simulated: Any) -> Iterator[Picture]:
    """Diagrams of all measured quantities."""
    directed = any(point.branch in plot.experiments.BRANCH_MARKS for point in experiment.points())
    for observe, caption in _CAPTIONS.items():
        if observe == "interval":
            caption += f"{_STROKES if directed else ''}."
        beside = simulated if observe in plot.experiments.SIMULATED else ()
        wide = observe in _WIDE
        height = 2.4 if observe == "period" else 3.4
        reduced = 2.8 if observe == "period" else 3.0

        def paint(ax: Any, observe: Any = observe, beside: Any = beside) -> None:
            plot.experiment(experiment, observe, ax, simulated=beside)

        try:
            source = draw(paint, 9.6 if wide else 4.9, height)
            narrow = draw(paint, 3.9, reduced)
        except InvalidInput:
            continue  # it was not measured
        yield Picture(source, caption, caption, "wide" if wide else "half", narrow=narrow)


def _rows(
    experiment: Experiment, entries: dict[Path, Entry]
) -> tuple[list[str], list[dict[str, Any]]]:
    """Heads and cells of the table of runs; empty columns are left out."""
    table = experiment.to_frame().head(SHOWN)
    for point in experiment.points():
        if point.run < len(table):
            motion = point.motion if np.isinf(point.stop) else "swept"
            table.loc[point.run, "period"] = motion
    unit = f" [{experiment.unit}]" if experiment.unit else ""
    shown = [
        one for one in _HEADS if not table[one[0]].isna().all() and (table[one[0]] != "").any()
    ]
    heads = [f"{experiment.parameter}{unit}"]
    heads += [name.replace("_", " ") + (f" [{unit}]" if unit else "") for name, unit, _ in shown]
    rows = []
    for run in range(len(table)):
        path = experiment.files[run]
        entry = entries.get(path)
        linked = entry is not None and entry.page is not None
        rows.append(
            {
                "name": breakable(path.name),
                "link": f"{RECORDINGS}/{quote(entry.page.name)}" if entry and entry.page else None,
                "missing": entry is not None and not linked,
                "cells": [
                    _cell(experiment.values[run], 1.0),
                    *(_cell(table[name].iloc[run], factor) for name, _, factor in shown),
                ],
            }
        )
    return heads, rows


def _notes(experiment: Experiment) -> Iterator[tuple[str, str]]:
    """What is to be known of runs: which have a note, and the note."""
    noted: dict[str, list[str]] = {}
    for path, notes in zip(experiment.files, experiment.to_frame()["notes"], strict=True):
        if notes:
            noted.setdefault(notes, []).append(path.name)
    for notes, names in noted.items():
        more = len(names) - NAMED
        yield ", ".join(names[:NAMED]) + (f" and {more} more" if more > 0 else ""), notes


def _reasons(failed: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Names of failed recordings with the reason, one line each."""
    return [(breakable(name), printable(re.sub(r"\s+", " ", reason))) for name, reason in failed]


def _unbroken(text: str) -> str:
    """Keep a number, its error and its unit on one line."""
    words, _, number = text.strip().partition(" ± ")
    head, _, value = words.rpartition(" ")
    return f"{head} {value}\u00a0±\u00a0{number.replace(' ', chr(0xA0))}"


def _cell(value: Any, factor: float) -> str:
    if isinstance(value, str):
        return printable(value)
    try:
        number = float(value) * factor
    except (TypeError, ValueError):
        return ""
    return f"{number:.4g}" if np.isfinite(number) else ""
