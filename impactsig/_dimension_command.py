"""`impactsig dimension FILE`: its options, and what it says of the intervals of a run."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ._command_files import FIGURES, check_ending, impacts_of, write_figure
from .errors import InvalidInput

if TYPE_CHECKING:
    from .impacts import Impacts
    from .intervals import Periodicity

DIMENSIONS = (1, 2, 3, 4, 5)


def add_dimension_options(command: argparse.ArgumentParser) -> None:
    """Give the command the options of the reconstruction."""
    group = command.add_argument_group("reconstruction")
    group.add_argument(
        "--dimensions",
        type=_dimensions,
        default=DIMENSIONS,
        metavar="M[,M...]",
        help="embedding dimensions, such as 2,3,4; one number stands for 1 up to it (5)",
    )
    group.add_argument(
        "--theiler",
        type=_whole,
        metavar="STEPS",
        help="leave out pairs no further apart in time than this (default: two mean periods)",
    )
    group.add_argument(
        "--seed", type=_whole, default=0, metavar="N", help="of the resamples and surrogates (0)"
    )
    group.add_argument(
        "--surrogates",
        action="store_true",
        help="test whether the intervals are more than linear noise",
    )
    group.add_argument(
        "--exponent", action="store_true", help="estimate the largest Lyapunov exponent"
    )


def dimension_in_words(chosen: argparse.Namespace) -> Iterator[str]:
    """What the command says, line by line, each as soon as it is known."""
    from .intervals import identify_period

    check_ending(chosen.output, FIGURES)
    impacts = impacts_of(chosen.file, chosen)
    period = identify_period(impacts)
    yield _train(chosen.file.name, impacts, period)
    try:
        yield from _reconstructed(impacts, period, chosen)
    except InvalidInput as error:
        if error.argument != "x":
            raise
        # Nobody at a command line has given an x.
        what = f"intervals of {chosen.file.name}"
        raise InvalidInput(what, error.value, error.required, error.remedy) from None


def _train(name: str, impacts: Impacts, period: Periodicity) -> str:
    intervals = impacts.intervals()
    words = f"{name}: {len(intervals)} interval{'s' * (len(intervals) != 1)}"
    if not len(intervals):
        return words
    words += f", mean {1e3 * intervals.mean():.4g} ms, SD {1e3 * intervals.std():.4g} ms"
    return f"{words}; {period.describe()}" if period.recurs else words


def _reconstructed(
    impacts: Impacts, period: Periodicity, chosen: argparse.Namespace
) -> Iterator[str]:
    from .reconstruct import correlation_dimension

    found = correlation_dimension(
        impacts, chosen.dimensions, theiler=chosen.theiler, seed=chosen.seed
    )
    # Measured intervals never recur exactly: what is left then is jitter, not the motion.
    about_period = period.recurs and found.correlation is not None
    yield f"scatter about that period: {found.describe()}" if about_period else found.describe()
    known = {name: one for name, one in (found.estimates or {}).items() if one is not None}
    if known:
        yield "estimates: " + ", ".join(f"{name} {one:.2f}" for name, one in known.items())
    if chosen.output is not None:
        write_figure(found.plot, chosen.output, (11.0, 3.9))
        yield f"figure: {chosen.output}"
    if chosen.surrogates:
        from .reconstruct import surrogate_test

        yield f"surrogates: {surrogate_test(impacts, seed=chosen.seed).describe()}"
    if chosen.exponent:
        yield _exponent(impacts, chosen)


def _exponent(impacts: Impacts, chosen: argparse.Namespace) -> str:
    from .report.dynamics import exponent_of

    found, share = exponent_of(impacts, chosen.dimensions, chosen.theiler)
    how = f"embedding dimension {found.dimension}, {share:.1%} of the neighbours false"
    return f"exponent: {found.describe()} ({how})"


def _dimensions(text: str) -> tuple[int, ...]:
    numbers = tuple(_whole(word) for word in text.split(","))
    return tuple(range(1, numbers[0] + 1)) if len(numbers) == 1 else numbers


def _whole(text: str) -> int:
    if not text.strip().isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of 0 or more")
    return int(text)
