"""The `impactsig` command: a recording or a machine in, impacts or a report out.

Before a command runs, only the standard library is imported, and the scenes, which need nothing
else: so ``--help`` answers at once.
"""

from __future__ import annotations

import argparse
import atexit
import contextlib
import gc
import io
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from .._compiling import garbage
from ..errors import ImpactsigError, ImpactsigWarning
from ._files import standard_input
from ._options import one_line, with_negative_numbers
from ._parser import parser

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
        0; 1 after an error, reported in one line on standard error; 130 when interrupted; 141 when
        the reader of standard output has gone. A wrong command line exits with 2.
    """
    words = sys.argv[1:] if arguments is None else arguments
    chosen, unknown = parser().parse_known_args(with_negative_numbers(words))
    if unknown:
        chosen.parser.refuse(unknown)
    run: Callable[[argparse.Namespace], None] = chosen.run
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A channel may be named in letters that the terminal's encoding does not have.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with _rare_collections(), warnings.catch_warnings(), standard_input(chosen):
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


@contextlib.contextmanager
def _rare_collections() -> Iterator[None]:
    """Collect garbage seldom, and none at the end of the process.

    A command makes some 10^6 objects in its imports, nearly all of which stay: to look through them
    again and again took a quarter of its time, and at the end a third of a second more.
    """
    thresholds = gc.get_threshold()
    atexit.register(gc.freeze)
    gc.set_threshold(20_000, 10, 10)
    try:
        with garbage.kept():
            yield
    finally:
        gc.set_threshold(*thresholds)


def _show_warnings_as_lines() -> None:
    """Print warnings for users as one line each, and drop those for developers."""

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        print(f"warning: {one_line(message)}", file=sys.stderr)

    if not os.environ.get(DEBUG):
        warnings.simplefilter("ignore")
    warnings.simplefilter("always", ImpactsigWarning)
    warnings.showwarning = show
