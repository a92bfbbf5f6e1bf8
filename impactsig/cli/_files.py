"""Input and output files of the commands."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from .._files.standard_input import FOLDER, NAME, WORDS, is_standard_input
from ..errors import InvalidInput, UnreadableFile
from ._options import one_line, reading_and_detecting

if TYPE_CHECKING:
    from ..impacts import Impacts

TABLES = {".csv": "to_csv", ".parquet": "to_parquet"}
FIGURES = (".png", ".pdf", ".svg")
STANDARD_INPUT = Path("-")


@contextmanager
def standard_input(chosen: argparse.Namespace) -> Iterator[None]:
    """Copy standard input to a temporary file while a command that reads `-` runs.

    Raises
    ------
    InvalidInput
        If it is to be read twice.
    """
    files = getattr(chosen, "files", None) or [getattr(chosen, "file", None)]
    if files.count(STANDARD_INPUT) > 1:
        raise InvalidInput("files", "- and -", "standard input once at most")
    if STANDARD_INPUT not in files:
        yield
        return
    with TemporaryDirectory(prefix=FOLDER) as folder:
        data = sys.stdin.buffer.read()
        # The format is recognised by content; tables of impacts, as detect writes them, by name.
        path = Path(folder, f"{NAME}{'.csv' if data.startswith(b'# impactsig') else ''}")
        path.write_bytes(data)
        files = [path if one == STANDARD_INPUT else one for one in files]
        if hasattr(chosen, "files"):
            chosen.files = files
        else:
            (chosen.file,) = files
        yield


def impacts_of(path: Path, chosen: argparse.Namespace) -> Impacts:
    """Read impacts from a table, or detect them in a recording."""
    return _tabulated(path) if _holds_impacts(path) else detected(path, chosen)


def detected(path: Path, chosen: argparse.Namespace) -> Impacts:
    """The impacts found in a recording, with the options of the command line."""
    from .._trains.corrections import in_words
    from ..detect.files import detect_file

    impacts = detect_file(path, *reading_and_detecting(path, chosen))
    if words := in_words(impacts):
        # Standard output may hold the table.
        print(f"corrections: {one_line(words)}", file=sys.stderr)
    return replace(impacts, source=WORDS) if is_standard_input(path) else impacts


def _holds_impacts(path: Path) -> bool:
    """Whether a file is a table of impacts: written by `detect`, or with columns of impacts."""
    from .._trains.impact_columns import COLUMNS
    from .._trains.impact_tables import HEAD

    known = set(COLUMNS)
    if path.suffix == ".parquet":
        return _is_parquet_of(path, known)
    if path.suffix != ".csv":
        return False
    try:
        with path.open(encoding="utf-8") as file:
            head = file.readline(10_000)
    except (OSError, UnicodeDecodeError):
        return False  # the reader of recordings says what is wrong
    names = [name.strip() for name in head.split(",")]
    return head.startswith(HEAD) or ("time" in names and known.issuperset(names))


def _is_parquet_of(path: Path, known: set[str]) -> bool:
    """Whether a Parquet file is marked as impacts, or has only columns of impacts."""
    try:
        from pyarrow import ArrowException, parquet
    except ImportError:
        return False  # the reader of recordings says what is missing, or wrong
    try:
        schema = parquet.read_schema(path)
    except (OSError, ArrowException):
        return False
    marked = b"impactsig" in (schema.metadata or {})
    return marked or ("time" in schema.names and known.issuperset(schema.names))


def _tabulated(path: Path) -> Impacts:
    from ..impacts import Impacts

    return Impacts.read_parquet(path) if path.suffix == ".parquet" else Impacts.read_csv(path)


def write_table(impacts: Impacts, path: Path | None) -> None:
    """Write impacts in the format of the path's ending; as CSV to standard output by default."""
    if path is None:
        impacts.to_csv(sys.stdout)
    else:
        getattr(impacts, TABLES[path.suffix.lower()])(path)


def write_figure(draw: Callable[[Any], Any], path: Path, size: tuple[float, float]) -> None:
    """Draw a figure of a given size [inch] and write it in the format of the ending."""
    from matplotlib.figure import Figure

    from .._files.atomic import atomic_path

    figure = Figure(figsize=size, layout="constrained")
    draw(figure)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format=path.suffix[1:].lower(), dpi=150)


def check_ending(output: Path | None, endings: Iterable[str], option: str = "output") -> None:
    """Refuse an unknown ending of the output file before any work is done."""
    if output is not None and output.suffix.lower() not in endings:
        raise InvalidInput(option, output, f"a name ending in {' or '.join(endings)}")


def sample(name: str) -> Path:
    """Path of a sample recording: inside an installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[1]
    places = (package / "_samples" / name, package.parent / "data_samples" / name)
    for path in places:
        if path.is_file():
            return path
    raise UnreadableFile(places[0], "the sample recording is missing", "Install impactsig again")
