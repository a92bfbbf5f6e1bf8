"""The `impactsig` command: a recording in, impacts or a report out.

Only the standard library is imported before a command runs, so that ``--help`` answers at once.
"""

from __future__ import annotations

import argparse
import io
import math
import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from . import __version__
from .errors import ImpactsigError, ImpactsigWarning, InvalidInput, UnreadableFile

READING = ("channel", "start", "stop", "rate", "scale", "offset", "unit", "sensor")
DETECTING = ("threshold", "polarity", "contact_level", "merge_within", "dead_time", "gaps")

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
    chosen = _parser().parse_args(_with_negative_numbers(words))
    run: Callable[[argparse.Namespace], None] = chosen.run
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A channel may be named in letters that the terminal's encoding does not have.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings():
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
    """Analyse a file and write the HTML report."""
    from .report import analyse_to_page

    analysis, path = analyse_to_page(
        chosen.file,
        chosen.output,
        forcing_frequency=chosen.forcing_frequency,
        **_given(chosen, READING + DETECTING),
    )
    print(one_line(analysis.summary()))
    print(f"report: {one_line(path)}")


def detect(chosen: argparse.Namespace) -> None:
    """Find the impacts of a file and write them as a table."""
    from .detect import detect_impacts
    from .io import info as read_info
    from .report.analysis import open_recording

    if chosen.output is not None and chosen.output.suffix.lower() not in _TABLES:
        raise InvalidInput("output", chosen.output, f"a name ending in {' or '.join(_TABLES)}")
    source = open_recording(read_info(chosen.file), **_given(chosen, READING))
    impacts = detect_impacts(source, **_given(chosen, DETECTING))
    if chosen.output is None:
        impacts.to_csv(sys.stdout)
    else:
        getattr(impacts, _TABLES[chosen.output.suffix.lower()])(chosen.output)
    if not len(impacts):
        warnings.warn(f"no impacts: {impacts.reason}", ImpactsigWarning, stacklevel=1)


_TABLES = {".csv": "to_csv", ".parquet": "to_parquet"}


def info(chosen: argparse.Namespace) -> None:
    """Say what a file holds, without reading its samples where its format allows that."""
    from .io import info as read_info

    found = read_info(chosen.file)
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
        rate = f"{channel.rate:g}" if channel.rate else "unknown"
        span = f"{channel.length / channel.rate:.6g}" if channel.rate else ""
        row = f"{index:>4}  {name:<{widest}}  {one_line(channel.unit):<8} {rate:>12}"
        print(f"{row} {channel.length:>12} {span:>12}".rstrip())


def demo(chosen: argparse.Namespace) -> None:
    """Analyse a recording that comes with the package; its report is written to this folder."""
    from .report import analyse_to_page

    analysis, path = analyse_to_page(
        _sample("loadcell_periodic_22.1Hz.wav"),
        "impactsig-demo.html",
        sensor="force",
        unit="V",
        forcing_frequency=22.1,
    )
    print(analysis.summary())
    print(f"report: {one_line(path.resolve())}")


def _sample(name: str) -> Path:
    """A sample recording: inside an installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parent
    places = (package / "_samples" / name, package.parent / "data_samples" / name)
    for path in places:
        if path.is_file():
            return path
    raise UnreadableFile(places[0], "the sample recording is missing", "Install impactsig again")


COMMANDS: dict[str, Callable[[argparse.Namespace], None]] = {
    "report": report,
    "detect": detect,
    "info": info,
    "demo": demo,
}


# -- the command line ----------------------------------------------------------------------


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="impactsig",
        allow_abbrev=False,
        description="Find the impacts in a recording, measure them, and say what period they have.",
        epilog="Start with: impactsig demo",
    )
    parser.add_argument("--version", action="version", version=f"impactsig {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    reading, detecting = _reading_options(), _detecting_options()
    for name, run in COMMANDS.items():
        text = (run.__doc__ or "").strip()
        parents = [reading, detecting] if name in ("report", "detect") else []
        command = commands.add_parser(
            name, help=text, description=text, parents=parents, allow_abbrev=False
        )
        command.set_defaults(run=run)
        if name != "demo":
            command.add_argument("file", type=Path, metavar="FILE", help="the recording")
        if name == "report":
            command.add_argument("--forcing-frequency", type=_number, metavar="HZ", help=_FORCING)
        if name in _OUTPUT:
            command.add_argument("-o", "--output", type=Path, metavar="OUT", help=_OUTPUT[name])
    return parser


_FORCING = "frequency of the forcing; without it periods count the motion's own period"
_OUTPUT = {
    "report": "the page to write (default: impactsig-report-FILE.html in this folder)",
    "detect": "a .csv or .parquet file (default: CSV to standard output)",
}


def _reading_options() -> argparse.ArgumentParser:
    options = argparse.ArgumentParser(add_help=False)
    group = options.add_argument_group("reading")
    group.add_argument("--channel", metavar="NAME", help="channel, by name or number from 0")
    group.add_argument("--start", type=_number, metavar="S", help="begin here [s]")
    group.add_argument("--stop", type=_number, metavar="S", help="end before here [s]")
    group.add_argument("--rate", type=_number, metavar="HZ", help="samples per second")
    group.add_argument("--scale", type=_number, metavar="X", help="multiply the samples by this")
    group.add_argument("--offset", type=_number, metavar="X", help="then add this")
    group.add_argument("--unit", help="unit of the result")
    group.add_argument("--sensor", choices=("force", "sound"), help="what recorded it")
    return options


def _detecting_options() -> argparse.ArgumentParser:
    options = argparse.ArgumentParser(add_help=False)
    group = options.add_argument_group("detection")
    group.add_argument(
        "--threshold",
        type=_threshold,
        metavar="LEVEL",
        help='in the unit of the recording, or in noise levels such as "6sigma" (default: chosen)',
    )
    group.add_argument(
        "--polarity",
        choices=("auto", "positive", "negative"),
        help="direction of the pulses of a force record (default: that of the strongest)",
    )
    group.add_argument(
        "--contact-level",
        type=_number,
        metavar="LEVEL",
        help="take contact times above this level, not from first to last touch",
    )
    group.add_argument(
        "--merge-within",
        type=_number,
        metavar="S",
        help="make one of impacts this close to the first of them [s]",
    )
    group.add_argument(
        "--dead-time", type=_number, metavar="S", help="ignore impacts this soon after another [s]"
    )
    group.add_argument(
        "--gaps",
        choices=("refuse", "split"),
        help="missing samples: refuse the file (default) or split the run there",
    )
    return options


def _with_negative_numbers(words: Sequence[str]) -> list[str]:
    """The words with ``--scale -2e3`` made ``--scale=-2e3``, which argparse would take amiss."""
    joined: list[str] = []
    for word in words:
        if joined and joined[-1].startswith("--") and re.match(r"-[.\d]", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return value


def _threshold(text: str) -> float | str:
    if text.endswith(("sigma", "sigmas", "σ")):
        return text
    try:
        return _number(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f'{error}, nor noise levels such as "6 sigma"') from None


def _given(chosen: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """The options the user gave; the others keep the defaults of the function they go to."""
    return {name: value for name in names if (value := getattr(chosen, name)) is not None}


def one_line(text: Any) -> str:
    """Text on one line, with what a terminal might act on made visible."""
    words = " ".join(str(text).split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in words)


def _show_warnings_as_lines() -> None:
    """What the user should know, a line each; what only a developer can mend, not at all."""

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        print(f"warning: {one_line(message)}", file=sys.stderr)

    if not os.environ.get(DEBUG):
        warnings.simplefilter("ignore")
    warnings.simplefilter("always", ImpactsigWarning)
    warnings.showwarning = show
