"""The words of the command line, command by command."""

from __future__ import annotations

import argparse
from pathlib import Path

from .. import __version__
from ._commands import COMMANDS, EXPERIMENT, REPORTS
from ._completion import SHELLS
from ._dimension import add_dimension_options
from ._options import Parser, detecting_options, file_options, reading_options
from ._simulating import add_scenes
from ._sweeping import add_plot_options, add_sweep
from ._values import period


def parser() -> argparse.ArgumentParser:
    """A new parser of the command line."""
    whole = Parser(
        prog="impactsig",
        allow_abbrev=False,
        description="Find the impacts in a recording, measure them, and say what period they have.",
        epilog="Start with: impactsig demo",
    )
    whole.add_argument("--version", action="version", version=f"impactsig {__version__}")
    commands = whole.add_subparsers(title="commands", metavar="COMMAND", required=True)
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
            help_text = _EITHER if name == "dimension" else "the recording; - is standard input"
            command.add_argument("file", type=Path, metavar="FILE", help=help_text)
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
    return whole


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
        help="do not write a report of each recording",
    )


_FORCING = {
    "report": "frequency of the forcing; without it periods are counted in repeats of the motion",
    "compare": "frequency of the forcing, for identifying the period of each",
}
_DYNAMICS = "add dimension, Lyapunov exponent and surrogate test of the intervals (takes seconds)"
_PROCESSES = "processes (default: number of cores)"
_WORKERS = "processes for several files (default: number of cores)"
_SHELL = "the shell that the script is for"
_EITHER = (
    "a recording, or a .csv or .parquet table of impacts as detect writes them; - is standard input"
)
_SEARCHING = ("report", "detect", "compare", "dimension")
_OUTPUT = {
    "report": "the .html file to write (default: impactsig-report-FILE.html in this folder); of "
    f"several files the folder for their pages and a page that lists them (default: {REPORTS})",
    "detect": "a .csv or .parquet file (default: CSV to standard output)",
    "compare": "a .png, .pdf or .svg file for the figure (default: none)",
    "dimension": "a .png, .pdf or .svg file for the figure (default: none)",
    "rig": "the .toml file to write (default: to standard output)",
    "experiment": "the folder for the page, its tables and the reports of the recordings "
    f"(default: {EXPERIMENT})",
}
