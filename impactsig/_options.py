"""Options that several commands share, and how their words are understood."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Sequence
from typing import Any, NoReturn

DETECTING = ("threshold", "polarity", "contact_level", "merge_within", "dead_time", "gaps")


class Parser(argparse.ArgumentParser):
    """A parser that tells an error in one line, as the commands do."""

    def error(self, message: str) -> NoReturn:
        """Leave with that message."""
        self.exit(2, f"error: {message} (usage: {self.prog} --help)\n")


def reading_options() -> Parser:
    """How a recording is read."""
    options = Parser(add_help=False)
    group = options.add_argument_group("reading")
    group.add_argument("--channel", metavar="NAME", help="channel, by name or number from 0")
    group.add_argument("--start", type=number, metavar="S", help="begin here [s]")
    group.add_argument("--stop", type=number, metavar="S", help="end before here [s]")
    group.add_argument("--rate", type=number, metavar="HZ", help="samples per second")
    group.add_argument("--scale", type=number, metavar="X", help="multiply the samples by this")
    group.add_argument("--offset", type=number, metavar="X", help="then add this")
    group.add_argument("--unit", help="unit of the result")
    group.add_argument("--sensor", choices=("force", "sound"), help="what recorded it")
    return options


def detecting_options() -> Parser:
    """How impacts are looked for in it."""
    options = Parser(add_help=False)
    group = options.add_argument_group("detection")
    group.add_argument(
        "--threshold",
        type=threshold,
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
        type=number,
        metavar="LEVEL",
        help="take contact times above this level, not from first to last touch",
    )
    group.add_argument(
        "--merge-within",
        type=number,
        metavar="S",
        help="make one of impacts this close to the first of them [s]",
    )
    group.add_argument(
        "--dead-time", type=number, metavar="S", help="ignore impacts this soon after another [s]"
    )
    group.add_argument(
        "--gaps",
        choices=("refuse", "split"),
        help="missing samples: refuse the file (default) or split the run there",
    )
    return options


def given(chosen: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """The options the user gave; the others keep the defaults of the function they go to."""
    return {name: value for name in names if (value := getattr(chosen, name)) is not None}


def with_negative_numbers(words: Sequence[str]) -> list[str]:
    """The words with ``--scale -2e3`` made ``--scale=-2e3``, which argparse would take amiss.

    Where several numbers follow an option, a blank before the negative ones does the same.
    """
    joined: list[str] = []
    for index, word in enumerate(words):
        negative = re.match(r"-[.\d]", word)
        before = words[index - 1] if index else ""
        option = before.startswith("--")
        if negative and (_is_number(before) or (option and _is_number(*words[index + 1 :][:1]))):
            joined.append(f" {word}")
        elif negative and option:
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _is_number(word: str = "") -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return value


def threshold(text: str) -> float | str:
    """A level, or a multiple of the noise."""
    if text.endswith(("sigma", "sigmas", "σ")):
        return text
    try:
        return number(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f'{error}, nor noise levels such as "6 sigma"') from None
