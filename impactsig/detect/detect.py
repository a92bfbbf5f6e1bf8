"""`detect_impacts`: one function for load cells and microphones, files and blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from .._arguments import choice, entries, flag, number
from ..errors import InvalidInput
from ..impacts import Impacts
from ..recording import Recording, Sensor
from ._asked import (
    parse_contact_level,
    parse_contact_time,
    parse_probability,
    parse_threshold,
    refuse_other_than_default,
)
from ._channels import detect_channels
from ._finding import find_both_ways, find_force
from ._force import Wanted
from ._merge import Columns, keep_first, merge
from ._notes import ringing_note
from .signal.source import Gaps, Source, open_source

Polarity = Literal["auto", "positive", "negative", "both"]
_SIGNS = {"auto": 0.0, "positive": 1.0, "negative": -1.0, "both": 0.0}


def detect_impacts(
    source: Any,
    *,
    sensor: Sensor | Sequence[Sensor] | None = None,
    channel: str | int | Sequence[str | int] | None = None,
    stops: Sequence[int | None] | None = None,
    threshold: float | str | None = None,
    polarity: Polarity = "auto",
    contact_level: float | str = 0.0,
    contact_time: tuple[float, float] | None = None,
    merge_within: float = 0.0,
    dead_time: float = 0.0,
    gaps: Gaps = "refuse",
    skip_quiet: bool = True,
    least_probability: float = 0.5,
) -> Impacts:
    """Detect the impacts of a recording and measure each of them.

    Parameters
    ----------
    source : Recording, path, or blocks of Recordings
        What to search. Blocks must follow each other in time and be such that they can be gone
        through twice (`impactsig.read_blocks`, or a list). The result does not depend on how
        the record is cut into blocks.
    sensor : {"force", "sound"}, or a sequence of them, optional
        By default the source's own. "force" finds pulses and measures their contact; "sound"
        finds the instants of attack. A sequence has one for each channel.
    channel : str or int, or a sequence of them, optional
        Which channel, where there are several. Those of a sequence are sensors of one machine:
        each impact is returned once, by `impactsig.combine_impacts`.
    stops : sequence of int or None, optional
        Which stop each channel of a sequence belongs to, None for one that hears them all; whole
        numbers, 0 or greater, that `stop_index` then holds.
    threshold : float or str, optional
        Force: level that the response to an impact must reach (see Notes), in the recording's unit,
        or as a multiple of its noise, ``"6 sigma"``, in place of `least_probability`. Of force
        records only.
    polarity : {"auto", "positive", "negative", "both"}
        Direction of the pulses of a force record; "auto" takes that of the strongest ones. "both"
        is for one sensor between two stops: `stop_index` is 0 where the pulse points upward, 1
        where it points downward, and peaks are positive in either.
    contact_level : float or str
        Level above the baseline between whose crossings the contact time is taken: in the
        recording's unit, or as a share of each impact's own peak, ``"10 %"``. By default 0: from
        first to last touch. An impact that does not reach the level has a contact time of 0.
    contact_time : (float, float), optional
        Shortest and longest contact [s] of a force record; pulses of other lengths are no impacts.
        By default up to 30 ms or 64 samples, whichever is more; where no pulse is as short as that,
        up to 1 s or 1024 samples.
    merge_within : float
        Impacts at most this long after the first of a group [s] become one with it: its instant
        and contact time, the greatest peak, the impulses added, and how many they were. For the
        press and release of a key, or the ringing of a structure.
    dead_time : float
        Impacts at most this long after one [s] are ignored.
    gaps : {"refuse", "split"}
        What to do about samples that are missing or not finite.
    skip_quiet : bool
        Pass over stretches of a force record that cannot hold an impact. The result is the same
        without it.
    least_probability : float
        Impacts that are less likely are left out, between 0 and 1. A lower one finds fainter
        impacts, and more that are none.

    Returns
    -------
    Impacts
        With `reason` where there are none, `notes` on what makes them doubtful, the `disturbances`
        that were kept apart from them, and the `probability` of each. Corrections
        beside a file (`Impacts.write_corrections`) are made again.

    Raises
    ------
    InvalidInput
        If an argument cannot be used; if several channels are there and none was chosen; if
        samples are missing or not finite and `gaps` is "refuse".
    UnreadableFile
        If `source` is the path of a file that cannot be read.

    See Also
    --------
    detect_many, combine_impacts, separate_stops, identify_period

    Notes
    -----
    Force: the response to a width w is the mean of the samples over w less the mean over both
    flanks, scaled such that the half-sine of the matching length gives its height; it must also
    rise above the higher flank, which no step and no ramp does. An impact is a crest of the
    response at the width at which it stands highest above its noise, of all widths up to that of
    the longest contact. Noise, mains hum and the steps of the converter are read from the samples
    between impacts within ten seconds of it, and hum is taken off by a fit; single samples that
    stand alone among longer pulses are glitches. Where pulses undershoot as behind a high-pass of
    the first order, that is undone first: what is measured is the force, and
    ``settings["ac_coupling"]`` is the time constant [s]. An impact is certain where Gaussian noise
    would exceed its response once in fifty minutes, or once in 2000 impacts. Where five are certain
    within two seconds or so, and one in sixteen of them stands little above that level, fainter
    ones of their width are looked for as well, and `probability` is the share of impacts among
    responses as high as its own: responses that point the wrong way show how often the noise makes
    one (`impactsig.detect.signal.probability`). Where fewer are certain it only orders what was
    found, and is 1/2 where certainty begins. `Impacts.noise` is the standard deviation of the
    samples between impacts, ``settings`` holds what was read of the instrument. How a pulse is
    measured is described in `impactsig.detect.pulses.pulse`.

    Where the pulses of a second are alike, each is measured with the shape that they share
    (`impactsig.detect.pulses.shape.shared_shape`). Standard errors of instants, contact times,
    peaks and impulses are those of the fit (its posterior covariance, and that of the shared
    shape) or of the edges (noise over slope). They hold the noise as it is over the width of the
    pulse, the step of the converter, the baseline that is subtracted, and what the fit cannot
    follow; see
    `impactsig.detect.pulses._errors`. The error of a shared shape is common to the impacts of a
    second: it cancels in their intervals. What a flag says is not in the record has an infinite
    error: the instant of a pulse that is open at its start, contact time and impulse of an open
    one, peak and impulse of a clipped one.

    Sound: see `impactsig.detect.sound.sound`. Where at least half of the impacts sound alike, those
    that do are timed by their waveform, to about a hundredth of a sample; others by their attack,
    to a sample. ``settings["alike"]`` is the share of the former. Behind the filter of a record of
    up to 24 kHz, which rings before an impact, others are timed by the modes that they share, to a
    tenth of a sample or two; where they share none, by the crossing of a share of their peak.
    Standard errors of instants are those of the fit of the waveform (by what it leaves) or of the
    modes (by the probability of all instants), of the crossing (by the time that the sound stays
    above it and its noise), or of the attack (by the probability of all splits, and by how long a
    filter rings before it). A delay common to all instants is no part of them. Impacts softer than
    twice the noise are now and then off by many times their standard error.

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import detect_impacts
    >>> impacts = detect_impacts("data_samples/loadcell_periodic_22.1Hz_short.csv")
    >>> len(impacts), impacts.unit
    (18, 'V')
    >>> float(np.median(impacts.intervals()).round(4))  # 1 / 22.1 Hz
    0.0452
    """
    options: dict[str, Any] = dict(
        threshold=threshold, polarity=polarity, contact_level=contact_level,
        contact_time=contact_time, merge_within=merge_within, dead_time=dead_time, gaps=gaps,
        skip_quiet=skip_quiet, least_probability=least_probability,
    )  # fmt: skip
    path = source if isinstance(source, (str, Path)) else None
    if isinstance(channel, (Sequence, np.ndarray)) and not isinstance(channel, str):
        required = "a name or an index of a channel, or several"
        channels = list(entries("channel", channel, required))
        if not all(isinstance(one, (str, int, np.integer)) for one in channels):
            raise InvalidInput("channel", channel, required)
        sources = [(source, one) for one in channels]
        found = detect_channels(detect_channel, sources, channels, sensor, stops, options, path)
    elif stops is not None:
        raise InvalidInput("stops", stops, "its default for one channel", "Give several channels")
    else:
        found = detect_channel(source, sensor=sensor, channel=channel, **options)
    return found if path is None else found.apply_corrections(path)


def detect_opened(
    sources: Sequence[Any],
    channels: Sequence[str | int],
    path: Any,
    *,
    stops: Sequence[int | None] | None = None,
    separate_stops: bool = False,
    **options: Any,
) -> Impacts:
    """As `detect_impacts`, for channels that are opened one by one.

    Parameters
    ----------
    sources : sequence of Recording or of blocks
        One channel each.
    channels : sequence of str or int
        How they were chosen.
    path : path-like
        The recording, with corrections beside it.
    separate_stops : bool
        Tell the impacts of two stops apart, as `impactsig.separate_stops` does.
    stops, **options
        As for `detect_impacts`.
    """
    first = sources[0]
    heard = len(sources) == 1 and isinstance(first, Recording) and first.sensor == "sound"
    if separate_stops and not heard:
        raise InvalidInput(
            "separate_stops", separate_stops, "its default, but for the record of one microphone",
            'Choose one channel, and say sensor="sound" (--sensor sound); it must fit into memory',
        )  # fmt: skip
    if len(sources) == 1:
        found = detect_impacts(first, stops=stops, **options).apply_corrections(path)
        return _separated(first, found) if separate_stops else found
    sensors = [source.sensor for source in sources]
    parts = [(source, None) for source in sources]
    found = detect_channels(detect_channel, parts, channels, sensors, stops, options, path)
    return found.apply_corrections(path)


def _separated(recording: Recording, impacts: Impacts) -> Impacts:
    """Assign impacts to two stops if their sounds differ; else add a note why not."""
    from .stops import separate_stops

    found = separate_stops(recording, impacts)
    if found.reason:
        note = f"the stops were not told apart: {found.reason}"
        return replace(impacts, notes=(*impacts.notes, note))
    settings = {**impacts.settings, "distance of the two sounds": found.distance}
    return replace(found.impacts, settings=settings)


def detect_channel(
    source: Any,
    *,
    sensor: Any,
    channel: str | int | None,
    threshold: float | str | None = None,
    polarity: str = "auto",
    contact_level: float | str = 0.0,
    contact_time: tuple[float, float] | None = None,
    merge_within: float = 0.0,
    dead_time: float = 0.0,
    gaps: Gaps = "refuse",
    skip_quiet: bool = True,
    least_probability: float = 0.5,
) -> Impacts:
    """The impacts of one channel, by the detector for its sensor."""
    choice("polarity", polarity, _SIGNS)
    if sensor is not None:
        choice("sensor", sensor, ("force", "sound"))
    merge_within = number("merge_within", merge_within, least=0)
    dead_time = number("dead_time", dead_time, least=0)
    chosen = parse_threshold(threshold)
    level, relative = parse_contact_level(contact_level)
    span = parse_contact_time(contact_time)
    flag("skip_quiet", skip_quiet)
    opened = open_source(source, channel, sensor, gaps)
    kind = sensor or opened.head.sensor
    settings: dict[str, Any] = {
        "sensor": kind,
        "threshold": threshold,
        "merge_within": merge_within,
        "dead_time": dead_time,
        "gaps": gaps,
    }
    if kind == "sound":
        refuse_other_than_default(
            kind,
            ("polarity", polarity, "auto"),
            ("contact_level", contact_level, 0.0),
            ("contact_time", contact_time, None),
            ("threshold", threshold, None),
        )
        columns, run = _find_sound(opened, least_probability)
    else:
        chosen = chosen._replace(least_probability=parse_probability(least_probability))
        wanted = Wanted(_SIGNS[polarity], chosen, level, relative, *span, skip_quiet)
        if polarity == "both":
            columns, run = find_both_ways(opened, wanted, contact_level)
        else:
            columns, run = find_force(opened, wanted, contact_level)
    if dead_time > 0:
        columns = keep_first(columns, dead_time)
    if merge_within > 0:
        columns = merge(columns, merge_within)
    if kind == "force":
        run["notes"] = (*run.get("notes", ()), *ringing_note(columns))
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


def _find_sound(source: Source, least_probability: float) -> tuple[Columns, dict[str, Any]]:
    from .sound.sound import detect_sound

    rate = source.head.rate
    found = detect_sound(source.pieces, rate, least_probability=least_probability)
    columns: Columns = {
        "time": source.head.start + found.time,
        "peak": found.peak,
        "time_error": found.time_error,
        "probability": found.probability,
        "flags": found.flags,
    }
    return columns, {
        "threshold": found.threshold,
        "noise": found.noise,
        "reason": found.reason,
        "notes": found.notes,
        "settings": {"least_probability": least_probability, "alike": found.alike},
    }
