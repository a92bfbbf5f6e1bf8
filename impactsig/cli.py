"""The `impactsig` command: a recording or a machine in, impacts or a report out.

Before a command runs, only the standard library is imported, and the scenes, which need nothing
else: so ``--help`` answers at once.
"""

from __future__ import annotations

import argparse
import io
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import __version__
from ._command_files import (
    FIGURES,
    TABLES,
    check_ending,
    detected,
    impacts_of,
    standard_input,
    write_figure,
    write_table,
)
from ._completion_command import SHELLS, completion_script
from ._dimension_command import add_dimension_options, dimension_in_words
from ._options import (
    Parser,
    detecting_options,
    file_options,
    given,
    one_line,
    period,
    raw_layout,
    reading_and_detecting,
    reading_options,
    rig_of,
    with_negative_numbers,
)
from ._simulate_options import add_scenes, in_words, simulated
from ._sweep_options import add_plot_options, add_sweep, drawn, swept
from .errors import ImpactsigError, ImpactsigWarning, InvalidInput, UnreadableFile

if TYPE_CHECKING:
    from .io import RawLayout

DEBUG = "IMPACTSIG_DEBUG"
INTERRUPTED, PIPE_CLOSED = 128 + 2, 128 + 13
"""Exit codes a shell gives to a command ended by SIGINT and by SIGPIPE."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : sequence of str, optional
        The command line without the program name; that of the process by default.

    Returns
    -------
    int
        0; 1 after an error, told in one line on standard error; 130 when interrupted; 141 when
        the reader of standard output has gone. A wrong command line exits with 2.
    """
    words = sys.argv[1:] if arguments is None else arguments
    chosen, unknown = _parser().parse_known_args(with_negative_numbers(words))
    if unknown:
        chosen.parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    run: Callable[[argparse.Namespace], None] = chosen.run
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A channel may be named in letters that the terminal's encoding does not have.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings(), standard_input(chosen):
            _show_warnings_as_lines()
            run(chosen)
            sys.stdout.flush()
    except BrokenPipeError:
        # The interpreter flushes again at exit; give it somewhere to write to.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_CLOSED
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except ImpactsigError as error:
        if os.environ.get(DEBUG):
            raise
        print(f"error: {one_line(error)}", file=sys.stderr)
        return 1
    except Exception as error:
        if os.environ.get(DEBUG):
            raise
        what = f"{type(error).__name__}: {one_line(error)}"
        print(f"error: unexpected {what} (set {DEBUG}=1 for a traceback)", file=sys.stderr)
        return 1
    return 0


# -- commands ------------------------------------------------------------------------------


def report(chosen: argparse.Namespace) -> None:
    """Analyse files and write an HTML report of each."""
    from .report import analyse_to_page

    each = [_report_options(path, chosen) for path in chosen.files]
    if len(chosen.files) > 1:
        _report_all(chosen.files, chosen.output or Path(_REPORTS), chosen.workers, each)
        return
    analysis, path = analyse_to_page(chosen.files[0], chosen.output, **each[0])
    print(one_line(analysis.summary()))
    if chosen.dynamics:
        print(f"dynamics: {analysis.dynamics}")
    print(f"report: {one_line(path)}")


def _report_options(path: Path, chosen: argparse.Namespace) -> dict[str, Any]:
    """How the report of a file is made: by its rig, but for what the command line says."""
    read, searched = reading_and_detecting(path, chosen)
    options = read | searched | given(chosen, ("forcing_period", "dynamics"))
    if "forcing_period" not in options and (rig := rig_of(path, chosen)) is not None:
        from .experiment.parameter import stated_frequency

        frequency = stated_frequency(rig, path)
        options |= {} if frequency is None else {"forcing_period": 1 / frequency}
    return options


def _report_all(
    files: list[Path], folder: Path, workers: int | None, each: list[dict[str, Any]]
) -> None:
    """The reports of several files, and the page that lists them."""
    from .report.batches import write_each_report

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
    """Set the impacts of two files side by side: recordings, or tables of impacts."""
    from .comparison import compare as side_by_side

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
    """Read the correlation dimension off the intervals of a recording, or of a table of impacts."""
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
    """Simulate a machine on a grid of its parameters; goes on where it was stopped."""
    for line in swept(chosen):
        print(one_line(line))


def plot(chosen: argparse.Namespace) -> None:
    """Draw a study that sweep has kept, over one or two parameters."""
    for line in drawn(chosen):
        print(one_line(line))


def info(chosen: argparse.Namespace) -> None:
    """Say what files hold, without reading their samples where their format allows that."""
    if chosen.rate is not None and chosen.rate <= 0:
        raise InvalidInput("rate", chosen.rate, "a positive number [Hz]")
    layout, failed = raw_layout(chosen), 0
    for path in chosen.files:
        try:
            _tell(path, layout, chosen.rate)
        except ImpactsigError as error:
            if len(chosen.files) == 1:
                raise
            print(f"error: {one_line(error)}", file=sys.stderr)
            failed += 1
    if failed:
        raise ImpactsigError(f"{failed} of {len(chosen.files)} files could not be read")


def _tell(path: Path, layout: RawLayout | None, rate: float | None) -> None:
    """What one file holds."""
    from .io import info as read_info

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
        pace = rate or channel.rate
        span = f"{channel.length / pace:.6g}" if pace else ""
        told = f"{pace:g}" if pace else "unknown"
        row = f"{index:>4}  {name:<{widest}}  {one_line(channel.unit):<8} {told:>12}"
        print(f"{row} {channel.length:>12} {span:>12}".rstrip())


def rig(chosen: argparse.Namespace) -> None:
    """Write a rig.toml, every key explained, from what a recording says of itself."""
    from ._atomic import atomic_path
    from .experiment.rig import Rig
    from .experiment.writing import rig_of_recording

    text = rig_of_recording(chosen.file)
    if chosen.output is None:
        print(text, end="")
        return
    with atomic_path(chosen.output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    Rig.read(chosen.output)
    print(f"rig: {one_line(chosen.output)}")


def experiment(chosen: argparse.Namespace) -> None:
    """Work out the recordings of a folder as one experiment, and write a page with figures."""
    from .experiment.experiment import Experiment
    from .report.experiment import write_experiment

    found = Experiment.read(chosen.folder, chosen.rig, workers=chosen.workers)
    print(one_line(found))
    for path, error in found.errors.items():
        print(f"error: {one_line(path)}: {one_line(error)}", file=sys.stderr)
    page = write_experiment(
        found, chosen.output or Path(_EXPERIMENT), workers=chosen.workers, reports=chosen.reports
    )
    for jump in found.jumps():
        print(one_line(jump.describe(found.unit)))
    print(f"page: {one_line(page)}")


def demo(chosen: argparse.Namespace) -> None:
    """Analyse a recording that comes with the package; its report is written to this folder."""
    from .report import analyse_to_page

    analysis, path = analyse_to_page(
        sample("loadcell_periodic_22.1Hz.wav"),
        "impactsig-demo.html",
        sensor="force",
        unit="V",
        forcing_period=1 / 22.1,
    )
    print(analysis.summary())
    print(f"report: {one_line(path.resolve())}")


def sample(name: str) -> Path:
    """A sample recording: inside an installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parent
    places = (package / "_samples" / name, package.parent / "data_samples" / name)
    for path in places:
        if path.is_file():
            return path
    raise UnreadableFile(places[0], "the sample recording is missing", "Install impactsig again")


def warmup(chosen: argparse.Namespace) -> None:
    """Compile what the commands need, once, so that the first of each is as fast as the next."""
    from ._warmup_command import warmed_up

    for line in warmed_up(chosen.workers):
        print(line)


def completion(chosen: argparse.Namespace) -> None:
    """Print a script by which a shell completes the words of this command."""
    print(completion_script(_parser(), chosen.shell))


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


# -- the command line ----------------------------------------------------------------------


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="impactsig",
        allow_abbrev=False,
        description="Find the impacts in a recording, measure them, and say what period they have.",
        epilog="Start with: impactsig demo",
    )
    parser.add_argument("--version", action="version", version=f"impactsig {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    untold, read, searched = file_options(), reading_options(), detecting_options()
    for name, run in COMMANDS.items():
        text = (run.__doc__ or "").strip()
        parents = [untold] if name == "info" else []
        if name in _SEARCHING:
            parents = [read, untold, searched]
        command = commands.add_parser(
            name, help=text, description=text, parents=parents, allow_abbrev=False
        )
        command.set_defaults(run=run)
        if name == "simulate":
            add_scenes(command)
        elif name == "sweep":
            add_sweep(command)
        elif name == "plot":
            add_plot_options(command)
        elif name in ("report", "info"):
            command.add_argument(
                "files",
                type=Path,
                nargs="+",
                metavar="FILE",
                help="recordings, one or more; - is standard input",
            )
        elif name == "experiment":
            _add_experiment(command)
        elif name == "warmup":
            command.add_argument("--workers", type=int, metavar="N", help=_PROCESSES)
        elif name == "completion":
            command.add_argument("shell", choices=SHELLS, help=_SHELL)
        elif name == "compare":
            command.add_argument("files", type=Path, nargs=2, metavar="FILE", help=_EITHER)
        elif name != "demo":
            told = _EITHER if name == "dimension" else "the recording; - is standard input"
            command.add_argument("file", type=Path, metavar="FILE", help=told)
        if name == "report":
            command.add_argument("--dynamics", action="store_true", help=_DYNAMICS)
            command.add_argument("--workers", type=int, metavar="N", help=_WORKERS)
        if name == "dimension":
            add_dimension_options(command)
        if name in _FORCING:
            command.add_argument(
                "--forcing-frequency",
                dest="forcing_period",
                type=period,
                metavar="HZ",
                help=_FORCING[name],
            )
        if name in _OUTPUT:
            command.add_argument("-o", "--output", type=Path, metavar="OUT", help=_OUTPUT[name])
    return parser


def _add_experiment(command: argparse.ArgumentParser) -> None:
    command.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the recordings")
    command.add_argument(
        "--rig", type=Path, metavar="FILE", help="how they are read (default: rig.toml in it)"
    )
    command.add_argument("--workers", type=int, metavar="N", help=_PROCESSES)
    command.add_argument(
        "--no-reports",
        dest="reports",
        action="store_false",
        help="leave out the report of each recording",
    )


_FORCING = {
    "report": "frequency of the forcing; without it periods count the motion's own period",
    "compare": "frequency of the forcing, by which the period of each is identified",
}
_DYNAMICS = "add dimension, Lyapunov exponent and surrogate test of the intervals (seconds)"
_REPORTS, _EXPERIMENT = "impactsig-reports", "impactsig-experiment"
_PROCESSES = "processes (default: as many as cores)"
_WORKERS = "processes, where there are several files (default: as many as cores)"
_SHELL = "the shell that the script is for"
_EITHER = (
    "a recording, or a .csv or .parquet table of impacts as detect writes them; - is standard input"
)
_SEARCHING = ("report", "detect", "compare", "dimension")
_OUTPUT = {
    "report": "the .html file to write (default: impactsig-report-FILE.html in this folder); of "
    f"several files the folder for their pages and a page that lists them (default: {_REPORTS})",
    "detect": "a .csv or .parquet file (default: CSV to standard output)",
    "compare": "a .png, .pdf or .svg file for the figure (default: none)",
    "dimension": "a .png, .pdf or .svg file for the figure (default: none)",
    "rig": "the .toml file to write (default: to standard output)",
    "experiment": "the folder for the page, its tables and the reports of the recordings "
    f"(default: {_EXPERIMENT})",
}


def _show_warnings_as_lines() -> None:
    """What the user should know, a line each; what only a developer can mend, not at all."""

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        print(f"warning: {one_line(message)}", file=sys.stderr)

    if not os.environ.get(DEBUG):
        warnings.simplefilter("ignore")
    warnings.simplefilter("always", ImpactsigWarning)
    warnings.showwarning = show
