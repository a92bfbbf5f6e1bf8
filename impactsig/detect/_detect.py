"""The detector's front door: one function for load cells and microphones, files and blocks."""

from __future__ import annotations

import math
import re
from typing import Any, Literal

import numpy as np

from ..errors import InvalidInput, finite_number
from ..impacts import Impacts
from ..recording import Sensor
from ._merge import Columns, keep_first, merge
from ._source import Gaps, Source, open_source
from ._watching import compiling

Polarity = Literal["auto", "positive", "negative"]
_SIGNS = {"auto": 0.0, "positive": 1.0, "negative": -1.0}
_SIGMAS = re.compile(r"\s*([0-9.eE+-]+)\s*(?:σ|sigmas?)\s*")


def detect_impacts(
    source: Any,
    *,
    sensor: Sensor | None = None,
    channel: str | int | None = None,
    threshold: float | str | None = None,
    polarity: Polarity = "auto",
    contact_level: float = 0.0,
    merge_within: float = 0.0,
    dead_time: float = 0.0,
    gaps: Gaps = "refuse",
    skip_quiet: bool = True,
) -> Impacts:
    """Find every impact of a recording and measure it.

    Parameters
    ----------
    source : Recording, path, or blocks of Recordings
        What to search. Blocks must follow each other in time and be such that they can be gone
        through twice (`impactsig.read_blocks`, or a list). The result does not depend on how
        the record is cut into blocks.
    sensor : {"force", "sound"}, optional
        By default the source's own. "force" finds pulses and measures their contact; "sound"
        finds the instants of attack.
    channel : str or int, optional
        Which channel, where there are several.
    threshold : float or str, optional
        Force: level that the matched response must reach (see Notes), in the recording's unit, or
        as a multiple of its noise, ``"6 sigma"``. By default at least 5 sigma, and such that
        Gaussian noise would be taken for an impact once in twenty recordings, or once in 500
        impacts.
        Sound: how many times the noise an impact must reach in every octave, given either way.
        By default it need not; what counts is the rise of power.
    polarity : {"auto", "positive", "negative"}
        Direction of the pulses of a force record; "auto" takes that of the strongest ones.
    contact_level : float
        Level above the baseline [unit] between whose crossings the contact time is taken. By
        default 0: from first to last touch.
    merge_within : float
        Impacts at most this long after the first of a group [s] become one with it: its instant,
        the greatest peak, contact times and impulses added. For the press and release of a key,
        or the ringing of a structure.
    dead_time : float
        Impacts at most this long after one [s] are ignored.
    gaps : {"refuse", "split"}
        What to do about samples that are missing or not finite.
    skip_quiet : bool
        Pass over stretches that cannot hold an impact. The result is the same without it.

    Returns
    -------
    Impacts
        With `reason` where there are none.

    Raises
    ------
    InvalidInput
        If an argument cannot be used; if several channels are there and none was chosen; if
        samples are missing or not finite and `gaps` is "refuse".
    UnreadableFile
        If `source` is the path of a file that cannot be read.

    Notes
    -----
    Force: the matched response is the mean of x over a width w less the mean over both flanks,
    with w from the strongest pulses, scaled such that a half-sine pulse gives its height. An
    impact begins where it reaches the threshold and is over where it falls below half of it.
    `Impacts.noise` is the standard deviation of the samples between impacts. How a pulse is
    measured is told in `impactsig.detect._pulse`.

    Sound: see `impactsig.detect._sound`. Where at least half of the impacts sound alike, those that
    do are timed by their waveform, to about a hundredth of a sample; others by their attack, to a
    sample. ``settings["alike"]`` is the share of the former.

    Examples
    --------
    >>> impacts = impactsig.detect_impacts("beam.wav")                     # doctest: +SKIP
    >>> impacts = impactsig.detect_impacts("hammer.tdms", channel="F", contact_level=5.0)
    ...                                                                    # doctest: +SKIP
    """
    if polarity not in tuple(_SIGNS):
        raise InvalidInput("polarity", polarity, '"auto", "positive" or "negative"')
    if sensor not in (None, "force", "sound"):
        raise InvalidInput("sensor", sensor, '"force" or "sound"')
    for name, value in (
        ("contact_level", contact_level),
        ("merge_within", merge_within),
        ("dead_time", dead_time),
    ):
        if finite_number(name, value, "a finite number, 0 or greater") < 0:
            raise InvalidInput(name, value, "a finite number, 0 or greater")
    chosen = parse_threshold(threshold)
    opened = open_source(source, channel, sensor, gaps)
    kind = sensor or opened.head.sensor
    settings: dict[str, Any] = {
        "sensor": kind,
        "threshold": threshold,
        "merge_within": merge_within,
        "dead_time": dead_time,
        "gaps": gaps,
    }
    find = _find_sound if kind == "sound" else _find_force
    with compiling():
        columns, run = find(opened, chosen, _SIGNS[polarity], contact_level, skip_quiet)
    if dead_time > 0:
        columns = keep_first(columns, dead_time)
    if merge_within > 0:
        columns = merge(columns, merge_within)
    head = opened.head
    known: dict[str, Any] = {**columns, **run}
    settings |= known.pop("settings")
    return Impacts(
        **known,
        start=head.start,
        duration=opened.samples / head.rate,
        unit=head.unit,
        gaps=np.array(opened.spans).reshape(-1, 2),
        sensor=kind,
        source=head.source,
        recorded_at=head.recorded_at,
        settings={**settings, "channel": head.channels[0]},
    )


def parse_threshold(threshold: float | str | None) -> tuple[str, float] | None:
    """("unit", level) or ("sigma", multiple) from what the user gave.

    Raises
    ------
    InvalidInput
        If it is neither a positive number nor one followed by "sigma".
    """
    if threshold is None:
        return None
    kind, text = "unit", threshold
    if isinstance(threshold, str):
        match = _SIGMAS.fullmatch(threshold)
        if match:
            kind, text = "sigma", match[1]
    try:
        value = float(text)
    except (TypeError, ValueError):
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise InvalidInput(
            "threshold", threshold, 'a positive level, or a multiple of the noise such as "6 sigma"'
        )
    return kind, value


def _find_force(
    source: Source, threshold: tuple[str, float] | None, sign: float, level: float, skip: bool
) -> tuple[Columns, dict[str, Any]]:
    from ._force import detect_force

    def choose(noise: float) -> float | None:
        if threshold is None:
            return None
        if threshold[0] == "unit":
            return threshold[1]
        if noise == 0:
            raise InvalidInput(
                "threshold",
                f"{threshold[1]:g} sigma",
                "a level in the unit",
                "This record has no noise to take a multiple of",
            )
        return threshold[1] * noise

    found = detect_force(
        source.pieces,
        threshold=choose,
        polarity=sign,
        contact_level=level,
        in_memory=source.in_memory,
        skip=skip,
    )
    rate, unit = source.head.rate, source.head.unit
    names = ("time", "contact_time", "peak", "impulse", "rise_time")
    if found is None:
        columns: Columns = {name: np.empty(0) for name in names} | {"flags": np.empty(0, np.uint8)}
        reason = "the record is constant, or too short to show its noise"
        return columns, {"reason": reason, "settings": {}}
    start, contact, peak, impulse, rise = found.columns.T
    values = (source.head.start + start / rate, contact / rate, peak, impulse / rate, rise / rate)
    columns = dict(zip(names, values, strict=True)) | {"flags": found.flags}
    levels = found.levels
    reason = ""
    if not len(start):
        shown = f" {unit}" if unit else ""
        level_text = f"the threshold of {levels.threshold:.3g}{shown}"
        noise_text = f"(noise of the response {levels.matched_noise:.3g})"
        if found.reached >= levels.threshold:
            reason = (
                f"what exceeds {level_text} is no pulse: it does not come back down on both "
                "sides (a step, a ramp)"
            )
        elif found.strongest < levels.threshold:
            strongest = f"{found.strongest:.3g}{shown}"
            reason = f"the strongest response is {strongest}, below {level_text} {noise_text}"
        else:
            # At another width than that of the search it may be above.
            reason = f"all responses are below {level_text} {noise_text}"
    return columns, {
        "threshold": levels.threshold,
        "release": levels.release,
        "noise": levels.noise,
        "contact_level": level,
        "reason": reason,
        "settings": {
            "polarity": "positive" if found.matched.gain > 0 else "negative",
            "width": found.matched.width / rate,
            "matched_noise": levels.matched_noise,
        },
    }


def _find_sound(
    source: Source, threshold: tuple[str, float] | None, sign: float, level: float, skip: bool
) -> tuple[Columns, dict[str, Any]]:
    from ._sound import detect_sound

    if sign or level:
        name, value = ("polarity", sign) if sign else ("contact_level", level)
        raise InvalidInput(name, value, "its default for sound", "A sound has no contact time")
    multiple = None if threshold is None else threshold[1]
    found = detect_sound(source.pieces, source.head.rate, threshold=multiple, skip=skip)
    columns: Columns = {
        "time": source.head.start + found.time,
        "peak": found.peak,
        "flags": found.flags,
    }
    return columns, {
        "threshold": found.threshold,
        "noise": found.noise,
        "reason": found.reason,
        "settings": {
            "least_rise": found.least_rise,
            "background": found.background,
            "alike": found.alike,
        },
    }
