"""`impactsig dimension FILE`: options and output."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..errors import InvalidInput
from ._files import FIGURES, check_ending, impacts_of, write_figure

if TYPE_CHECKING:
    from ..impacts import Impacts
    from ..intervals import Periodicity


def add_dimension_options(command: argparse.ArgumentParser) -> None:
    """Give the command the options of the reconstruction."""
    group = command.add_argument_group("reconstruction")
    group.add_argument(
        "--dimension",
        type=_whole,
        metavar="M",
        help="embedding dimension (default: the least above twice the slope, at least 3)",
    )
    group.add_argument(
        "--theiler",
        type=_whole,
        metavar="STEPS",
        help="exclude pairs no further apart in time than this (default: two mean periods)",
    )
    group.add_argument(
        "--timing-error",
        type=float,
        metavar="S",
        help="standard error of the instants in seconds (default: that of the file, or estimated)",
    )
    group.add_argument(
        "--missed",
        type=float,
        default=0.0,
        metavar="SHARE",
        help="fraction of impacts missed (default: 0)",
    )
    group.add_argument(
        "--spurious", type=float, metavar="SHARE", help="fraction of spurious impacts"
    )
    group.add_argument(
        "--contraction",
        type=float,
        metavar="C",
        help="contraction of areas from impact to impact, in e-folds: adds D1 by Kaplan and Yorke",
    )
    group.add_argument("--seed", type=_whole, default=0, metavar="N", help="of the surrogates (0)")
    group.add_argument(
        "--surrogates",
        action="store_true",
        help="test whether the intervals are more than linear noise",
    )
    group.add_argument(
        "--exponent", action="store_true", help="estimate the largest Lyapunov exponent"
    )


def dimension_in_words(chosen: argparse.Namespace) -> Iterator[str]:
    """The output of the command, line by line, each as soon as it is known."""
    from ..intervals import identify_period

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
    from ..reconstruct.dimensions.dimension import correlation_dimension

    found = correlation_dimension(
        impacts,
        chosen.dimension,
        theiler=chosen.theiler,
        timing_error=chosen.timing_error,
        missed=chosen.missed,
        spurious=chosen.spurious,
        contraction=chosen.contraction,
    )
    # Measured intervals never recur exactly: what is left then is jitter, not the motion.
    about_period = period.recurs and found.slope is not None
    yield f"scatter about that period: {found.describe()}" if about_period else found.describe()
    if chosen.output is not None:
        write_figure(found.plot, chosen.output, (9.0, 3.9))
        yield f"figure: {chosen.output}"
    if chosen.surrogates:
        from ..reconstruct.testing.surrogate_testing import surrogate_test

        yield f"surrogates: {surrogate_test(impacts, seed=chosen.seed).describe()}"
    if chosen.exponent:
        yield _exponent(impacts, chosen)


def _exponent(impacts: Impacts, chosen: argparse.Namespace) -> str:
    from ..report.analysing.dynamics import DIMENSIONS, exponent_of

    tried = DIMENSIONS if chosen.dimension is None else [chosen.dimension]
    found, share = exponent_of(impacts, tried, chosen.theiler)
    how = f"embedding dimension {found.dimension}, {share:.1%} of the neighbours false"
    return f"exponent: {found.describe()} ({how})"


def _whole(text: str) -> int:
    if not text.strip().isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of 0 or more")
    return int(text)
