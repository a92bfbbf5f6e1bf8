"""Texts and numbers of a report, as plain text that the page escapes and lays out."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from .._files import standard_input
from .._trains.correction_files import sha256
from .._trains.corrections import in_words
from ..impacts import FLAG_NAMES, KINDS
from .analysing.analysis import Analysis
from .analysing.dynamics import SEED

if TYPE_CHECKING:
    from markupsafe import Markup

    from ..impacts import Impacts

SAID_ELSEWHERE = {
    "sensor", "channel", "threshold", "stops", "delay", "delay_error", "of_channel", "corrections",
}  # fmt: skip
"""Settings that the parameters of a page do not list by their names."""
_TIMES = ("merge_within", "dead_time", "width")

LIBRARIES = ("numpy", "scipy", "numba", "pandas", "soundfile", "npTDMS", "matplotlib")


def printable(text: str) -> str:
    """Text that can be encoded in UTF-8; bytes of a file name that cannot are replaced."""
    return standard_input.in_words(text).encode("utf-8", "backslashreplace").decode("utf-8")


def breakable(name: str) -> Markup:
    """A file name that a narrow column may break after "_" or "-"."""
    from markupsafe import Markup, escape

    parts = re.split(r"(?<=[_\-])(?=[^_\-])", printable(name))
    return Markup("<wbr>").join(escape(part) for part in parts)


def notes(analysis: Analysis) -> list[str]:
    """Warnings that affect how far the numbers can be trusted."""
    impacts = analysis.impacts
    texts = [*impacts.notes, *analysis.warnings]
    cut = analysis.file.truncated or any(one.truncated for one in analysis.overviews)
    if cut and not any("cut short" in text for text in texts):
        texts.append("The recording is cut short: the file ends before its own header says.")
    if len(impacts.gaps):
        lost = float(np.diff(impacts.gaps, axis=1).sum())
        texts.append(
            f"{counted(len(impacts.gaps), 'gap')}, {lost:.4g} s in all, without valid samples; "
            "no interval is taken across one."
        )
    for bit, name in FLAG_NAMES.items():
        count = int(np.count_nonzero(impacts.flags & bit))
        if count:
            texts.append(f"{count} of {len(impacts)} impacts flagged: {name}, {_MEANING[bit]}.")
    if not len(impacts) and analysis.searched:
        dial = "--least-probability 0.1"
        if impacts.sensor == "force":
            dial = f"{dial} or a threshold (--threshold)"
        texts.append(
            "No impacts were found. If there should be some, look at the waveform and give "
            f"{dial}, another channel, or what recorded it (--sensor)."
        )
    return list(dict.fromkeys(printable(text) for text in texts))


def samples_held(analysis: Analysis, held: int) -> list[str]:
    """How the waveform is drawn: where by samples, where by envelopes."""
    steps = {
        2e3 / overview.rate
        for overview, rate in zip(analysis.overviews, analysis.rates, strict=True)
        if overview.rate != rate
    }
    if not steps:
        return ["Every sample is drawn."]
    texts = [f"Drawn by the minimum and maximum of each {max(steps):.3g} ms"]
    count = len(analysis.impacts)
    if not held:
        return [f"{texts[0]}: every spike is visible, but not the shape of a pulse."]
    around = f"all {count} impacts" if held == count else f"{held} of {count} impacts"
    texts = [f"{texts[0]}, and by every sample around {around}."]
    if held < count:
        texts.append(
            "Impacts that are flagged or doubtful were selected first, then those far from the "
            "median in peak, contact time or interval."
        )
    return texts


def counted(count: int, noun: str) -> str:
    """A number with its noun, in the plural if needed."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


_MEANING = {
    1: "the pulse had begun before the record did",
    2: "the pulse had not ended when the record did",
    4: "the peak reached the limit of the instrument, peak and impulse are lower bounds",
    8: "the pulse overlaps a neighbour, its contact time lies between crossings of a level",
    16: "put in where one was missed, nothing was measured there",
    32: "put in or moved by hand",
}


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
        detection.append(("contact time", level(impacts)))
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
    """Description of each channel; of several, with stop and delay."""
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
        searched = k < analysis.searched
        words = [role(analysis, k)] if analysis.roles else []
        words += [overview.sensor] if searched else []
        words += [f"{label} {value}" for label, value in rows[1:]]
        if searched and settings.get("stops"):
            stop = settings["stops"][k]
            words.append("hears all stops" if stop is None else f"stop {stop}")
        if searched and k:
            words.append(_delay(*(list(settings[one].values())[k] for one in _DELAY)))
        yield f"channel {k + 1} of {len(analysis.overviews)}", f"{name}: {', '.join(words)}"


def role(analysis: Analysis, k: int) -> str:
    """Whether a channel was searched, and what it was taken for."""
    searched = "searched for impacts" if k < analysis.searched else "not searched"
    return f"{searched} ({analysis.roles[k]})"


def channels_in_words(analysis: Analysis) -> str:
    """What each channel was taken for, if the user chose none; else empty."""
    each = [
        f"{one.channels[0] or 'unnamed'}, {role(analysis, k)}"
        for k, one in enumerate(analysis.overviews[: len(analysis.roles)])
    ]
    return printable("; ".join(each))


_DELAY = ("delay", "delay_error")


def _delay(delay: float, error: float) -> str:
    if not np.isfinite(error):
        return "delay not known and taken for 0, as too few impacts are in both"
    return f"{1e6 * delay:.5g} ± {1e6 * error:.1g} µs after the first"


def _of_channels(impacts: Impacts) -> Iterator[tuple[str, str]]:
    """Settings of the detection for each of several channels."""
    for channel, settings in impacts.settings.get("of_channel", {}).items():
        texts = [
            f"{name.replace('_', ' ')} {_setting(name, value)}"
            for name, value in settings.items()
            if name not in SAID_ELSEWHERE - {"threshold"} and value is not None
        ]
        yield channel, ", ".join(texts)


def _settings_of_dynamics(analysis: Analysis) -> list[tuple[str, str]]:
    """Settings of dimension, exponent and surrogate test."""
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


def level(impacts: Impacts) -> str:
    """Description of the level that contact times refer to."""
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


def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return ""
