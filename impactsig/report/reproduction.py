"""How to reproduce a report: the command line, and the lines of Python."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from .._files.standard_input import NAME, is_standard_input
from .._trains.corrections import in_words
from .analysing.dynamics import READ, SEED, TESTED

if TYPE_CHECKING:
    from .analysing.analysis import Analysis
    from .analysing.dynamics import Dynamics


def command(analysis: Analysis) -> str:
    """The command line that reproduces this report."""
    given = {**_as_options(analysis.reading), **analysis.detecting}
    if analysis.forcing_period is not None:
        given["forcing_frequency"] = _hertz(analysis.forcing_period)
    options = [word for name, value in given.items() for word in _words(name, value)]
    if analysis.dynamics.asked:
        options.append("--dynamics")
    path = str(analysis.file.path)
    if is_standard_input(path):
        return " ".join(shlex.quote(word) for word in ["impactsig", "report", *options, "-"])
    words = ["impactsig", "report", *options, *(["--"] if path.startswith("-") else []), path]
    return " ".join(shlex.quote(word) for word in words)


def _words(name: str, value: Any) -> list[str]:
    """An option in the form of the command line."""
    option = f"--{name.replace('_', '-')}"
    if name == "stops":
        value = ",".join("none" if one is None else str(one) for one in value)
    elif name == "separate_stops":
        return [option] if value else []
    elif name == "contact_time":
        return [option, *map(str, value)]
    # An equals sign keeps a value that begins with a minus from being taken for an option.
    return [f"{option}={one}" for one in (value if isinstance(value, (list, tuple)) else [value])]


def _hertz(period: float) -> str:
    """The shortest frequency [Hz] whose inverse is the period."""
    texts = (f"{1 / period:.{digits}g}" for digits in range(1, 17))
    return next((text for text in texts if 1 / float(text) == period), repr(1 / period))


def _as_options(reading: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `read` as options of the command line."""
    options = dict(reading)
    if raw := options.pop("raw", None):
        options["raw"] = raw.sample.name
        if raw.channels != 1:
            options["raw_channels"] = raw.channels
        if raw.sample.str[0] == ">":
            options["raw_byte_order"] = "big"
        if raw.skip:
            options["raw_skip"] = raw.skip
    return options


def python_lines(analysis: Analysis) -> str:
    """The lines of Python that reproduce impacts, period and dynamics."""
    reading = _arguments(analysis.reading)
    separated = analysis.detecting.get("separate_stops", False)
    given = {name: one for name, one in analysis.detecting.items() if name != "separate_stops"}
    detecting = _arguments(given)
    forced = analysis.forcing_period
    period = f", forcing_period=1 / {_hertz(forced)}" if forced is not None else ""
    path = repr(NAME if is_standard_input(analysis.file.path) else str(analysis.file.path))
    if len(analysis.overviews) > 1:
        found = [f"impacts = impactsig.report.analyse({path}{reading}{detecting}).impacts"]
    else:
        found = [
            f"recording = impactsig.read({path}{reading})",
            f"impacts = impactsig.detect_impacts(recording{detecting})",
        ]
        if in_words(analysis.impacts):
            found.append(f"impacts = impacts.apply_corrections({path})")
        if separated:
            found.append("impacts = impactsig.separate_stops(recording, impacts).impacts")
    lines = [
        "import impactsig",
        *found,
        f"impactsig.identify_period(impacts{period})",
        *_lines_of_dynamics(analysis.dynamics),
    ]
    return "\n".join(lines)


def _lines_of_dynamics(dynamics: Dynamics) -> Iterator[str]:
    read = "impacts" if dynamics.intervals <= READ else f"impacts[:{READ + 1}]"
    tested = "impacts" if dynamics.intervals <= TESTED else f"impacts.intervals()[:{TESTED}]"
    if dynamics.dimension is not None and not dynamics.periodic:
        yield f"impactsig.correlation_dimension({read})"
    if dynamics.exponent is not None:
        yield f"impactsig.lyapunov_exponent({read}, dimension={dynamics.exponent.dimension})"
    if dynamics.surrogates is not None:
        yield f"impactsig.surrogate_test({tested}, seed={SEED})"


def _arguments(given: Any) -> str:
    # A layout is the only one that is neither number nor text.
    home = {"raw": "impactsig."}
    return "".join(f", {name}={home.get(name, '')}{value!r}" for name, value in given.items())
