"""What each command does."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import (
    ImpactsigError,
    ImpactsigWarning,
    InvalidInput,
    UnwritableFile,
)
from ._completion import completion_script
from ._dimension import dimension_in_words
from ._files import (
    FIGURES,
    TABLES,
    check_ending,
    detected,
    impacts_of,
    sample,
    write_figure,
    write_table,
)
from ._options import (
    given,
    one_line,
    raw_layout,
    reading_and_detecting,
    rig_of,
)
from ._simulating import in_words, simulated
from ._sweeping import drawn, swept

if TYPE_CHECKING:
    from ..io import RawLayout

REPORTS, EXPERIMENT = "impactsig-reports", "impactsig-experiment"
"""Folders that are made where none is given."""


def report(chosen: argparse.Namespace) -> None:
    """Analyse files and write an HTML report of each."""
    from ..report import analyse_to_page
    from ..report.contents import channels_in_words

    each = [report_options(path, chosen) for path in chosen.files]
    if len(chosen.files) > 1:
        _report_all(chosen.files, chosen.output or Path(REPORTS), chosen.workers, each)
        return
    analysis, path = analyse_to_page(chosen.files[0], chosen.output, **each[0])
    print(one_line(analysis.summary()))
    if analysis.roles:
        print(f"channels: {one_line(channels_in_words(analysis))}")
    if chosen.dynamics:
        print(f"dynamics: {analysis.dynamics}")
    print(f"report: {one_line(path)}")


def report_options(path: Path, chosen: argparse.Namespace) -> dict[str, Any]:
    """Options of a file's report: those of its rig, overridden by the command line."""
    read, searched = reading_and_detecting(path, chosen)
    options = read | searched | given(chosen, ("forcing_period", "dynamics"))
    if "forcing_period" not in options and (rig := rig_of(path, chosen)) is not None:
        from ..experiment.parameter import stated_frequency

        frequency = stated_frequency(rig, path)
        options |= {} if frequency is None else {"forcing_period": 1 / frequency}
    return options


def _report_all(
    files: list[Path], folder: Path, workers: int | None, each: list[dict[str, Any]]
) -> None:
    """The reports of several files, and the page that lists them."""
    from ..report.batches import write_each_report

    entries = write_each_report(files, folder, each, workers=workers)
    for entry in entries:
        if entry.page is not None:
            print(f"{one_line(entry.path)}: {one_line(entry.summary)}")
        else:
            print(f"error: {one_line(entry.path)}: {one_line(entry.summary)}", file=sys.stderr)
    print(f"reports: {one_line(folder / 'index.html')}")
    failed = sum(entry.page is None for entry in entries)
    if failed:
        raise ImpactsigError(f"{failed} of {len(entries)} files could not be analysed")


def detect(chosen: argparse.Namespace) -> None:
    """Find the impacts of a file and write them as a table."""
    check_ending(chosen.output, TABLES)
    impacts = detected(chosen.file, chosen)
    write_table(impacts, chosen.output)
    for note in impacts.notes:
        warnings.warn(note, ImpactsigWarning, stacklevel=1)
    if not len(impacts):
        warnings.warn(f"no impacts: {impacts.reason}", ImpactsigWarning, stacklevel=1)


def compare(chosen: argparse.Namespace) -> None:
    """Compare the impacts of two files: recordings, or tables of impacts."""
    from ..comparison import compare as side_by_side

    check_ending(chosen.output, FIGURES)
    a, b = (impacts_of(path, chosen) for path in chosen.files)
    first, second = chosen.files
    if first.name != second.name:
        first, second = first.name, second.name
    result = side_by_side(
        a,
        b,
        forcing_period=chosen.forcing_period,
        names=(one_line(first), one_line(second)),
    )
    print(result)
    if chosen.output is not None:
        write_figure(result.plot, chosen.output, (8.4, 7.6))
        print(f"figure: {one_line(chosen.output)}")


def dimension(chosen: argparse.Namespace) -> None:
    """Estimate the correlation dimension of the intervals of a recording or a table of impacts."""
    for line in dimension_in_words(chosen):
        print(one_line(line))


def simulate(chosen: argparse.Namespace) -> None:
    """Simulate a machine that hits a stop and write its impacts as a table."""
    check_ending(chosen.output, TABLES)
    check_ending(chosen.figure, FIGURES, "figure")
    motion = simulated(chosen)
    assert motion.impacts is not None  # all is kept
    write_table(motion.impacts, chosen.output)
    # Standard output may hold the table.
    print(in_words(motion), file=sys.stderr)
    if chosen.figure is not None:
        write_figure(lambda figure: motion.plot(figure.subplots()), chosen.figure, (4.8, 4.4))


def sweep(chosen: argparse.Namespace) -> None:
    """Simulate a machine on a grid of its parameters; an interrupted study continues."""
    for line in swept(chosen):
        print(one_line(line))


def plot(chosen: argparse.Namespace) -> None:
    """Draw a stored study over one or two parameters."""
    for line in drawn(chosen):
        print(one_line(line))


def info(chosen: argparse.Namespace) -> None:
    """List the channels of files, reading samples only if the format requires it."""
    if chosen.rate is not None and chosen.rate <= 0:
        raise InvalidInput("rate", chosen.rate, "a positive number [Hz]")
    layout, failed = raw_layout(chosen), 0
    for path in chosen.files:
        try:
            _print_info(path, layout, chosen.rate)
        except ImpactsigError as error:
            if len(chosen.files) == 1:
                raise
            print(f"error: {one_line(error)}", file=sys.stderr)
            failed += 1
    if failed:
        raise ImpactsigError(f"{failed} of {len(chosen.files)} files could not be read")


def _print_info(path: Path, layout: RawLayout | None, rate: float | None) -> None:
    """Print the channels of one file."""
    from ..io import info as read_info

    found = read_info(path, raw=layout)
    print(f"{one_line(found.path)}: {found.format}, {found.bytes:,} bytes")
    if found.recorded_at is not None:
        print(f"recorded at {found.recorded_at.isoformat(sep=' ')}")
    if found.truncated:
        print("TRUNCATED: the file ends before its header says it does")
    names = [one_line(channel.name) or "(no name)" for channel in found.channels]
    widest = max(map(len, ["channel", *names]))
    head = f"{'':>4}  {'channel':<{widest}}  {'unit':<8} {'rate [Hz]':>12} {'samples':>12}"
    print(f"{head} {'span [s]':>12}")
    for index, (name, channel) in enumerate(zip(names, found.channels, strict=True)):
        hertz = rate or channel.rate
        span = f"{channel.length / hertz:.6g}" if hertz else ""
        rate_text = f"{hertz:g}" if hertz else "unknown"
        row = f"{index:>4}  {name:<{widest}}  {one_line(channel.unit):<8} {rate_text:>12}"
        print(f"{row} {channel.length:>12} {span:>12}".rstrip())


def rig(chosen: argparse.Namespace) -> None:
    """Write a rig.toml for a recording, with every key explained."""
    from .._files.atomic import atomic_path
    from ..experiment.rig import Rig
    from ..experiment.writing import rig_of_recording

    text = rig_of_recording(chosen.file)
    if chosen.output is None:
        print(text, end="")
        return
    if chosen.output.exists():  # it is written to be changed by hand
        raise UnwritableFile(
            chosen.output,
            "is there already, perhaps changed by hand",
            "Remove it, or give another -o",
        )
    with atomic_path(chosen.output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    Rig.read(chosen.output)
    print(f"rig: {one_line(chosen.output)}")


def experiment(chosen: argparse.Namespace) -> None:
    """Analyse the recordings of a folder as one experiment, and write a page with figures."""
    from ..experiment.experiment import Experiment

    found = Experiment.read(chosen.folder, chosen.rig, workers=chosen.workers)
    print(one_line(found))
    for path, error in found.errors.items():
        reason = str(error).removeprefix(f"{path}: ")
        print(f"error: {one_line(path)}: {one_line(reason)}", file=sys.stderr)
    page = found.write_report(
        chosen.output or Path(EXPERIMENT), workers=chosen.workers, reports=chosen.reports
    )
    for jump in found.jumps():
        print(one_line(jump.describe(found.unit)))
    print(f"page: {one_line(page)}")


def demo(chosen: argparse.Namespace) -> None:
    """Analyse a recording that comes with the package; write its report to this folder."""
    from ..report import analyse_to_page

    analysis, path = analyse_to_page(
        sample("loadcell_periodic_22.1Hz.wav"),
        "impactsig-demo.html",
        sensor="force",
        unit="V",
        forcing_period=1 / 22.1,
    )
    print(analysis.summary())
    print(f"report: {one_line(path.resolve())}")


def warmup(chosen: argparse.Namespace) -> None:
    """Compile all kernels in advance, so that the first command is as fast as the next."""
    from ._warmup import warmed_up

    for line in warmed_up(chosen.workers):
        print(line)


def completion(chosen: argparse.Namespace) -> None:
    """Print a script for tab completion in a shell."""
    from ._parser import parser

    print(completion_script(parser(), chosen.shell))


COMMANDS: dict[str, Callable[[argparse.Namespace], None]] = {
    "report": report,
    "detect": detect,
    "compare": compare,
    "dimension": dimension,
    "simulate": simulate,
    "sweep": sweep,
    "plot": plot,
    "info": info,
    "rig": rig,
    "experiment": experiment,
    "demo": demo,
    "warmup": warmup,
    "completion": completion,
}
