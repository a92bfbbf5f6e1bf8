"""Options that several commands share."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from .._arguments import PER_CHANNEL, READING
from .._files.standard_input import in_words
from ..errors import InvalidInput
from ._values import contact_level, number, stops, threshold

if TYPE_CHECKING:
    from ..experiment.rig import Rig
    from ..io import RawLayout

DETECTING = (
    "stops",
    "separate_stops",
    "threshold",
    "polarity",
    "contact_level",
    "contact_time",
    "merge_within",
    "dead_time",
    "gaps",
    "least_probability",
)


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, as all errors of the command are.

    Parsed arguments have the parser of the command as `parser`: the last one to set it wins.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.set_defaults(parser=self)

    def error(self, message: str) -> NoReturn:
        """Print the message and exit with code 2."""
        self.exit(2, f"error: {message} (see: {self.prog} --help)\n")

    def refuse(self, unknown: Sequence[str]) -> NoReturn:
        """Refuse words that the command does not know, with the option that was perhaps meant."""
        from difflib import get_close_matches

        message = f"unrecognized arguments: {' '.join(unknown)}"
        for word in (word.split("=")[0] for word in unknown if word.startswith("--")):
            begun = [option for option in self._option_string_actions if option.startswith(word)]
            if meant := begun or get_close_matches(word, self._option_string_actions, 1, 0.75):
                message += f"; did you mean {meant[0]}?"
        self.error(message)


def file_options() -> Parser:
    """Options for files that lack a rate or a header."""
    options = Parser(add_help=False)
    group = options.add_argument_group("missing metadata")
    group.add_argument(
        "--rate",
        type=number,
        metavar="HZ",
        help="samples per second; replaces the rate in the file, with a warning if they differ",
    )
    group.add_argument(
        "--raw",
        metavar="TYPE",
        help="file without a header: type of its numbers, int16, uint8, float32, ...",
    )
    group.add_argument(
        "--raw-channels", type=int, metavar="N", help="number of interleaved channels (default: 1)"
    )
    group.add_argument(
        "--raw-byte-order",
        choices=("little", "big"),
        help="byte order of a number (default: little)",
    )
    group.add_argument(
        "--raw-skip", type=int, metavar="BYTES", help="bytes before the first number (default: 0)"
    )
    return options


def raw_layout(chosen: argparse.Namespace) -> RawLayout | None:
    """The layout of a file without a header, if the user gave one.

    Raises
    ------
    InvalidInput
        If other options of the layout are given without the type of the numbers.
    """
    options = given(chosen, ("raw_channels", "raw_byte_order", "raw_skip"))
    if chosen.raw is None:
        if options:
            option = "--" + next(iter(options)).replace("_", "-")
            raise InvalidInput(
                "raw", None, "the type of the numbers", f"Give --raw int16, say, with {option}"
            )
        return None
    from ..io import RawLayout

    return RawLayout(chosen.raw, **{name.removeprefix("raw_"): options[name] for name in options})


def reading(chosen: argparse.Namespace) -> dict[str, Any]:
    """The arguments of `impactsig.read` that the user gave."""
    layout = raw_layout(chosen)
    options = given(chosen, READING)
    # An option given once holds for the only channel, or for all.
    options |= {
        name: options[name][0]
        for name in ("channel", *PER_CHANNEL)
        if len(options.get(name, ())) == 1
    }
    return options | ({} if layout is None else {"raw": layout})


def rig_of(path: Path, chosen: argparse.Namespace) -> Rig | None:
    """The rig given by --rig, else the one in the folder of the recording."""
    from ..experiment.rig import Rig

    return Rig.beside(path) if chosen.rig is None else Rig.read(chosen.rig)


def reading_and_detecting(
    path: Path, chosen: argparse.Namespace
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Options for reading and detection: those of the rig, overridden by the command line.

    If the command line chooses channels, the channels of the rig are ignored.
    """
    said, asked = reading(chosen), given(chosen, DETECTING)
    rig = rig_of(path, chosen)
    if rig is None:
        return said, asked
    of_rig, searched = rig.reading_options(), rig.detecting_options()
    if "channel" in said:
        of_rig = {name: one for name, one in of_rig.items() if name not in PER_CHANNEL}
        searched.pop("stops", None)
    return of_rig | said, searched | asked


def reading_options() -> Parser:
    """Options of `impactsig.read`."""
    options = Parser(add_help=False)
    group = options.add_argument_group("reading")
    group.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help="take channels, calibration and detection from this file (impactsig rig writes one; "
        "default: rig.toml beside the recording, where there is one)",
    )
    group.add_argument(
        "--channel",
        action="append",
        metavar="NAME",
        help="channel, by name or number from 0. Several channels are sensors of a machine, whose "
        "impacts are combined into one train; scale, offset, unit and sensor can then be given "
        "for each, in the order of the channels. By default a report shows all channels and "
        "analyses those that show impacts best, by their units, names and waveforms",
    )
    group.add_argument("--start", type=number, metavar="S", help="start of the span [s]")
    group.add_argument("--stop", type=number, metavar="S", help="end of the span [s]")
    each: dict[str, Any] = {"action": "append"}
    group.add_argument("--scale", type=number, metavar="X", help="factor for the samples", **each)
    group.add_argument(
        "--offset", type=number, metavar="X", help="offset added after the factor", **each
    )
    group.add_argument("--unit", help="unit of the result", **each)
    group.add_argument(
        "--resample",
        type=number,
        metavar="HZ",
        help="interpolate unevenly spaced samples, as from a phone, to this rate [Hz]",
    )
    group.add_argument("--sensor", choices=("force", "sound"), help="kind of sensor", **each)
    return options


def detecting_options() -> Parser:
    """Options of `impactsig.detect_impacts`."""
    options = Parser(add_help=False)
    group = options.add_argument_group("detection")
    group.add_argument(
        "--stops",
        type=stops,
        metavar="N[,N...]",
        help='stop of each --channel, such as 0,1; "none" for a channel that records all',
    )
    group.add_argument(
        "--separate-stops",
        action="store_const",
        const=True,
        help="distinguish two stops by their sound in one microphone",
    )
    group.add_argument(
        "--threshold",
        type=threshold,
        metavar="LEVEL",
        help="threshold of a force record, in its unit or in noise levels such as "
        '"6sigma" (default: automatic)',
    )
    group.add_argument(
        "--least-probability",
        type=number,
        metavar="P",
        help="omit impacts with a lower probability, 0 to 1 (default: 0.5); a lower value finds "
        "more",
    )
    group.add_argument(
        "--polarity",
        choices=("auto", "positive", "negative", "both"),
        help="sign of the pulses of a force record (default: that of the strongest); both: one "
        "sensor between two stops",
    )
    group.add_argument(
        "--contact-level",
        type=contact_level,
        metavar="LEVEL",
        help='measure contact times at this level, or at a percentage of each peak such as "10%%" '
        "(default: from first to last touch)",
    )
    group.add_argument(
        "--contact-time",
        type=number,
        nargs=2,
        metavar=("SHORTEST", "LONGEST"),
        help="shortest and longest contact of a force record [s] (default: 0 0.03)",
    )
    group.add_argument(
        "--merge-within",
        type=number,
        metavar="S",
        help="merge impacts within this time of the first [s]",
    )
    group.add_argument(
        "--dead-time",
        type=number,
        metavar="S",
        help="ignore impacts within this time after another [s]",
    )
    group.add_argument(
        "--gaps",
        choices=("refuse", "split"),
        help="missing samples: raise an error (default) or split the run",
    )
    return options


def given(chosen: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """The options that the user gave; the others keep the function's defaults."""
    return {name: value for name in names if (value := getattr(chosen, name)) is not None}


def with_negative_numbers(words: Sequence[str]) -> list[str]:
    """Rewrite ``--scale -2e3`` as ``--scale=-2e3``: argparse would take -2e3 for an option.

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


def one_line(text: Any) -> str:
    """Text on one line, with what a terminal might act on made visible."""
    words = in_words(" ".join(str(text).split()))
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in words)
