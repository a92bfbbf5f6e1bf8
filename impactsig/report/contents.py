"""What a report says in words and numbers, as plain text for the page to escape and lay out."""

from __future__ import annotations

import base64
import gzip
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from .._correction_files import sha256
from .._corrections import in_words
from .._impact_columns import ERRORS, MEASURED
from ..impacts import FLAG_NAMES, KINDS, flag_names
from .analysis import Analysis, mean_and_spread
from .dynamics import SEED

if TYPE_CHECKING:
    from ..impacts import Impacts

PLAIN_TABLE, PACKED_TABLE = 400_000, 800_000
"""Bytes up to which the table is held as it is, and up to which it is held compressed."""
LEAST_PACKED_ROW = 10
"""Bytes of a compressed row at least: its digits are noise. More rows are not even tried."""

SAID_ELSEWHERE = {
    "sensor", "channel", "threshold", "stops", "delay", "delay_error", "of_channel", "corrections",
}  # fmt: skip
"""Settings that the parameters of a page do not list by their names."""
_TIMES = ("merge_within", "dead_time", "width")

LIBRARIES = ("numpy", "scipy", "numba", "pandas", "soundfile", "npTDMS", "matplotlib", "bokeh")


@dataclass(frozen=True)
class Download:
    """The table of all impacts inside the page; `source` is empty where it would be too large."""

    source: str
    filename: str


@dataclass(frozen=True)
class Table:
    """Heads and cells, all text."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def printable(text: str) -> str:
    """Text that UTF-8 can hold; a file name may contain bytes that it cannot."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def notes(analysis: Analysis) -> list[str]:
    """What the reader must know before trusting the numbers."""
    impacts = analysis.impacts
    told = [*impacts.notes, *analysis.warnings]
    cut = analysis.file.truncated or any(one.truncated for one in analysis.overviews)
    if cut and not any("cut short" in text for text in told):
        told.append("The recording is cut short: the file ends before its own header says.")
    if len(impacts.gaps):
        lost = float(np.diff(impacts.gaps, axis=1).sum())
        told.append(
            f"{counted(len(impacts.gaps), 'gap')}, {lost:.4g} s in all, without valid samples; "
            "no interval is taken across one."
        )
    for bit, name in FLAG_NAMES.items():
        count = int(np.count_nonzero(impacts.flags & bit))
        if count:
            told.append(f"{count} of {len(impacts)} impacts flagged: {name}, {_MEANING[bit]}.")
    if not len(impacts):
        dial = "--least-probability 0.1"
        if impacts.sensor == "force":
            dial = f"{dial} or a threshold (--threshold)"
        told.append(
            "No impacts were found. If there should be some, look at the waveform and give "
            f"{dial}, another channel, or what recorded it (--sensor)."
        )
    return list(dict.fromkeys(printable(text) for text in told))


def counted(count: int, noun: str) -> str:
    """The number and its noun, in the plural where it takes one."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


_MEANING = {
    1: "the pulse had begun before the record did",
    2: "the pulse had not ended when the record did",
    4: "the peak reached the limit of the instrument, peak and impulse are lower bounds",
    8: "the pulse overlaps a neighbour, its contact time lies between crossings of a level",
    16: "put in where one was missed, nothing was measured there",
    32: "put in or moved by hand",
}


def tiles(analysis: Analysis) -> list[tuple[str, str, str]]:
    """The key figures: what, how much, and a word on it."""
    from ..intervals import coefficient_of_variation

    impacts = analysis.impacts
    rate = f"{len(impacts) / impacts.duration:.4g} per second" if impacts.duration else ""
    shown = [("impacts", f"{len(impacts):,}", rate)]
    found = analysis.periodicity
    if found.kind not in ("too few impacts", "too short a run"):
        named = found.recurs and found.periods is not None
        word = f"({found.impacts}, {found.periods})" if named else found.kind
        sure = min(found.confidence, 0.99)
        how = f"probability {'over ' if sure == 0.99 else ''}{sure:.2f}"
        if found.kind == "drifting":
            how = f"drifting, {how}"
        shown.append(("period" if found.recurs else "motion", word, how))
    intervals = impacts.intervals()
    if len(intervals):
        median = np.median(intervals) * 1e3
        shown.append(("median interval", f"{median:.5g} ms", f"{1e3 / median:.5g} Hz"))
    if len(intervals) > 1:
        variation = coefficient_of_variation(impacts)
        shown.append(("interval CV", f"{variation:.3g}", "coefficient of variation"))
    if impacts.contact_time is not None and len(impacts):
        mean, spread = mean_and_spread(impacts.contact_time * 1e3)
        shown.append(("contact time", f"{mean} ms", f"± {spread} ms, {_level(impacts)}"))
        if impacts.duration:
            share = 100 * impacts.time_in_contact()
            shown.append(("time in contact", f"{share:.3g} %", "of the run"))
    if impacts.peak is not None and len(impacts):
        low, middle, high = np.percentile(impacts.peak, (5, 50, 95))
        shown.append(
            (
                "median peak",
                f"{middle:.4g} {impacts.unit}".rstrip(),
                f"{low:.3g} to {high:.3g} (5 to 95 %)",
            )
        )
    shown += _of_dynamics(analysis)
    return [(a, printable(b), printable(c)) for a, b, c in shown]


def _of_dynamics(analysis: Analysis) -> Iterator[tuple[str, str, str]]:
    dimension, exponent = analysis.dynamics.dimension, analysis.dynamics.exponent
    if analysis.dynamics.periodic:
        yield "dimension", "0", "the intervals recur"
        return
    # a number that noise would have as well is no key figure
    if not analysis.dynamics.significant:
        return
    if dimension is not None and dimension.dimension is not None:
        assert dimension.interval is not None
        low, high = dimension.interval
        sure = f"{low:.2f} to {high:.2f} (95 %)" if high > low else "quasi-periodic"
        yield "dimension", f"{dimension.dimension:.2f}", sure
    elif dimension is not None and dimension.slope is not None:
        low, high = dimension.slope.interval
        slope = f"{dimension.slope.value:.2f}"
        yield "slope between two scales", slope, f"{low:.2f} to {high:.2f} (95 %)"
    if exponent is not None and exponent.exponent is not None:
        rate = "" if exponent.per_second is None else f"{exponent.per_second:.3g} per second"
        yield "Lyapunov exponent", f"{exponent.exponent:.3g} per impact", rate


def table(impacts: Impacts, count: int) -> Table:
    """The first impacts, in the units that read best, each column beside its standard errors."""
    columns = [("time [s]", impacts.time, 1.0, ".6f")]
    columns += _errors(impacts.time_error, "µs", 1e6)
    if impacts.contact_time is not None:
        columns.append(("contact time [ms]", impacts.contact_time, 1e3, ".4f"))
        columns += _errors(impacts.contact_time_error, "µs", 1e6)
    unit = f" [{impacts.unit}]" if impacts.unit else ""
    if impacts.peak is not None:
        columns.append((f"peak{unit}", impacts.peak, 1.0, ".4g"))
        columns += _errors(impacts.peak_error)
    if impacts.impulse is not None:
        name = f"impulse [{impacts.unit} s]" if unit else "impulse [s]"
        columns.append((name, impacts.impulse, 1.0, ".4g"))
        columns += _errors(impacts.impulse_error)
    if impacts.rise_time is not None:
        columns.append(("rise time [ms]", impacts.rise_time, 1e3, ".4f"))
    if impacts.probability is not None:
        columns.append(("probability", impacts.probability, 1.0, ".3f"))
    if impacts.stop_index is not None:
        columns.append(("stop", impacts.stop_index, 1, "stop"))
    if impacts.stop_probability is not None:
        columns.append(("stop probability", impacts.stop_probability, 1.0, ".3f"))
    heads = ("impact", *(printable(head) for head, *_ in columns), "flags")
    rows = tuple(
        (
            str(i + 1),
            *(_cell(values[i] * factor, form) for _, values, factor, form in columns),
            flag_names(int(impacts.flags[i])),
        )
        for i in range(min(count, len(impacts)))
    )
    return Table(heads, rows)


def _cell(value: float, form: str) -> str:
    """One number of the table."""
    if form == "stop":
        return str(value) if value >= 0 else "\N{EN DASH}"
    return format(value, form) if form else rounded(value)


def _errors(
    values: np.ndarray | None, unit: str = "", factor: float = 1.0
) -> list[tuple[str, np.ndarray, float, str]]:
    """The column of standard errors, in the unit of the column before it unless one is given."""
    return [] if values is None else [(f"± [{unit}]" if unit else "±", values, factor, "")]


def rounded(error: float) -> str:
    """A standard error to one significant digit; a dash where nothing is measured."""
    if not np.isfinite(error):
        return "\N{EN DASH}"
    text = f"{error:.0e}"
    return f"{float(text):.5g}" if 1e-4 <= error < 1e5 or error == 0 else text


def download(impacts: Impacts, stem: str) -> Download:
    """All impacts as CSV in a data URI.

    Times to the nanosecond, standard errors to three digits, the rest to seven.
    """
    if len(impacts) * LEAST_PACKED_ROW > PACKED_TABLE:
        return Download("", "")
    columns = {"time": [f"{value:.9f}" for value in impacts.time]}
    for name in MEASURED:
        values = getattr(impacts, name)
        if values is not None:
            digits = 3 if name in ERRORS else 7
            columns[name] = [f"{value:.{digits}g}" for value in values]
    columns["flags"] = [str(flags) for flags in impacts.flags]
    lines = (",".join(row) for row in (columns, *zip(*columns.values(), strict=True)))
    plain = "".join(f"{line}\r\n" for line in lines).encode()
    if len(plain) <= PLAIN_TABLE:
        return Download(_data_uri("text/csv", plain), f"{stem}-impacts.csv")
    packed = gzip.compress(plain, mtime=0)
    if len(packed) <= PACKED_TABLE:
        return Download(_data_uri("application/gzip", packed), f"{stem}-impacts.csv.gz")
    return Download("", "")


def parameters(analysis: Analysis) -> list[tuple[str, list[tuple[str, str]]]]:
    """Groups of names and values: the recording, the detection, the software."""
    file, impacts = analysis.file, analysis.impacts
    recording = [
        ("file", Path(file.path).name),
        ("SHA-256", sha256(file.path)),
        ("size", f"{file.bytes:,} bytes"),
        ("format", file.format),
        ("recorded at", file.recorded_at.isoformat(sep=" ") if file.recorded_at else "not stored"),
        *_channels(analysis),
        ("span analysed", f"{impacts.start:.6g} to {impacts.stop:.6g} s"),
    ]
    sound = impacts.sensor == "sound"
    chosen = "" if impacts.settings.get("threshold") is None else " (given)"
    detection = [
        (name, f"{value:.6g} {impacts.unit}".rstrip() + note)
        for name, value, note in (
            ("noise level", impacts.noise, ""),
            ("least sound that counts" if sound else "threshold", impacts.threshold, chosen),
        )
        if value is not None
    ]
    if impacts.contact_time is not None:
        detection.append(("contact time", _level(impacts)))
    detection += [
        (name.replace("_", " "), _setting(name, value))
        for name, value in impacts.settings.items()
        if name not in SAID_ELSEWHERE
    ]
    detection += _of_channels(impacts)
    if words := in_words(impacts):
        detection.append(("corrected by hand", words))
    kinds = [one.kind for one in impacts.disturbances]
    detection += [(KINDS[kind], f"{kinds.count(kind)}") for kind in dict.fromkeys(kinds)]
    if analysis.forcing_period is not None:
        detection.append(("forcing frequency", f"{1 / analysis.forcing_period:g} Hz"))
    dynamics = _settings_of_dynamics(analysis)
    software = [("impactsig", __version__), ("Python", platform.python_version())]
    software += [(name, version) for name in LIBRARIES if (version := _version(name))]
    groups = (
        ("Recording", recording),
        ("Detection", detection),
        ("Dynamics", dynamics),
        ("Software", software),
    )
    return [(title, [(a, printable(b)) for a, b in rows]) for title, rows in groups if rows]


def _channels(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """What each channel is; of several with its stop, and how late it is against the first."""
    of, settings = len(analysis.file.channels), analysis.impacts.settings
    several = len(analysis.overviews) > 1
    for k, (overview, rate) in enumerate(zip(analysis.overviews, analysis.rates, strict=True)):
        name = overview.channels[0] or "unnamed"
        rows = [
            ("sensor", overview.sensor),
            ("unit", overview.unit or "not stored"),
            ("rate", f"{rate:.10g} Hz"),
        ]
        if not several:
            yield "channel", f"{name} (one of {of})"
            yield from rows
            continue
        words = [f"{label} {value}" if label != "sensor" else value for label, value in rows]
        if settings.get("stops"):
            stop = settings["stops"][k]
            words.append("hears all stops" if stop is None else f"stop {stop}")
        if k:
            words.append(_delay(*(list(settings[one].values())[k] for one in _DELAY)))
        yield f"channel {k + 1} of {len(analysis.overviews)}", f"{name}: {', '.join(words)}"


_DELAY = ("delay", "delay_error")


def _delay(delay: float, error: float) -> str:
    if not np.isfinite(error):
        return "delay not known and taken for 0, as too few impacts are in both"
    return f"{1e6 * delay:.5g} ± {1e6 * error:.1g} µs after the first"


def _of_channels(impacts: Impacts) -> Iterator[tuple[str, str]]:
    """How the impacts of each of several channels were found."""
    for channel, settings in impacts.settings.get("of_channel", {}).items():
        told = [
            f"{name.replace('_', ' ')} {_setting(name, value)}"
            for name, value in settings.items()
            if name not in SAID_ELSEWHERE - {"threshold"} and value is not None
        ]
        yield channel, ", ".join(told)


def _settings_of_dynamics(analysis: Analysis) -> list[tuple[str, str]]:
    """How dimension, exponent and surrogate test were worked out."""
    dynamics = analysis.dynamics
    rows = []
    found = dynamics.dimension
    if found is not None and found.slope is not None:
        rows = [
            ("embedding of the slope", str(found.slope.embedding)),
            ("Theiler window", counted(found.theiler, "interval")),
        ]
    exponent, test = dynamics.exponent, dynamics.surrogates
    if exponent is not None:
        rows.append(("embedding of exponent", str(exponent.dimension)))
        rows.append(("false neighbours there", f"{dynamics.false_share:.1%}"))
    if test is not None:
        rows.append(("surrogates", f"{len(test.surrogates)} {test.method}"))
    if rows:
        rows.append(("seed", str(SEED)))
    return rows


def _level(impacts: Impacts) -> str:
    if impacts.contact_level is None:
        return "level not stored"
    if impacts.contact_level == 0:
        return "first to last touch"
    if isinstance(impacts.contact_level, str):
        return f"above {impacts.contact_level} of each peak"
    return f"above {impacts.contact_level:.3g} {impacts.unit}".rstrip()


def _setting(name: str, value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{one:.3g} at {key}" for key, one in value.items())
    number = f"{value:.6g}" if isinstance(value, float) else str(value)
    return f"{number} s" if name in _TIMES else number


def _data_uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return ""
