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
from ._force_stretch import Wanted
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
        The recording. Blocks must be consecutive in time, and an iterable that can be iterated over
        twice (`impactsig.read_blocks`, or a list). The result does not depend on how the record is
        divided into blocks.
    sensor : {"force", "sound"}, or a sequence of them, optional
        Kind of sensor, by default that of the source. "force" detects pulses and measures the
        contacts; "sound" detects the instants of attack. A sequence has one for each channel.
    channel : str or int, or a sequence of them, optional
        The channel, if there are several. The channels of a sequence are sensors of one machine:
        each impact is returned once, by `impactsig.combine_impacts`.
    stops : sequence of int or None, optional
        The stop that each channel of a sequence belongs to, an integer of 0 or more, which is
        stored in `stop_index`; None for a channel that records all stops.
    threshold : float or str, optional
        Level that the response to an impact must reach (see Notes), in the unit of the recording or
        as a multiple of its noise, ``"6 sigma"``; replaces `least_probability`. Only for force
        records.
    polarity : {"auto", "positive", "negative", "both"}
        Sign of the pulses of a force record; "auto" takes that of the strongest ones. "both" is for
        one sensor between two stops: `stop_index` is 0 for positive pulses and 1 for negative ones,
        and peaks are positive for both.
    contact_level : float or str
        Level above the baseline between whose crossings the contact time is measured: in the unit
        of the recording, or as a percentage of each peak, ``"10 %"``. By default 0: from first to
        last touch. An impact that does not reach the level has a contact time of 0.
    contact_time : (float, float), optional
        Shortest and longest contact [s] of a force record; pulses of other lengths are not impacts.
        By default up to 30 ms or 64 samples, whichever is more; if no pulse is that short, up to 1
        s or 1024 samples.
    merge_within : float
        Impacts at most this long after the first of a group [s] are merged with it. The result has
        the instant and contact time of the first, the greatest peak, the sum of the impulses, and
        the number of pulses. Use it for the press and release of a key, or for the ringing of a
        structure.
    dead_time : float
        Impacts at most this long after another one [s] are ignored.
    gaps : {"refuse", "split"}
        How to treat missing or non-finite samples: raise an error, or detect in the spans between
        them.
    skip_quiet : bool
        Whether to skip stretches of a force record that cannot contain an impact. The result does
        not depend on it.
    least_probability : float
        Impacts with a lower probability are omitted, between 0 and 1. A lower value finds weaker
        impacts and more false ones.

    Returns
    -------
    Impacts
        The impacts, with the `probability` of each, `notes` on what makes them doubtful, the
        `disturbances` that were separated from them, and the `reason` if there are none.
        Corrections stored beside a file (`Impacts.write_corrections`) are applied.

    Raises
    ------
    InvalidInput
        If an argument is invalid; if there are several channels and none was chosen; if samples are
        missing or not finite and `gaps` is "refuse".
    UnreadableFile
        If `source` is the path of a file that cannot be read.

    See Also
    --------
    detect_many, combine_impacts, separate_stops, identify_period

    Notes
    -----
    Force: the response to a width w is the mean of the samples over w minus the mean over both
    flanks, scaled such that it equals the height of the half-sine of matching length; the samples
    must also exceed the higher flank, which excludes steps and ramps. An impact is a local maximum
    of the response, at the width with the greatest signal-to-noise ratio, among all widths up to
    that of the longest contact. Noise, mains hum and the quantization step are estimated from the
    samples between impacts within ten seconds, and hum is subtracted; single samples that stand out
    among longer pulses are glitches. If pulses undershoot as after a first-order high-pass filter,
    the filter is inverted first, so that the force is measured; ``settings["ac_coupling"]`` is its
    time constant [s]. An impact is certain if Gaussian noise would exceed its response once in
    fifty minutes, or once in 2000 impacts. If at least five impacts are certain within about two
    seconds, and one in sixteen of them is little above that level, weaker ones of their width are
    searched for, and `probability` is the fraction of impacts among responses of that height:
    responses of the opposite sign show how often noise causes one
    (`impactsig.detect.signal.probability`). If fewer are certain, `probability` only orders the
    impacts, and is 1/2 at the level of certainty. `Impacts.noise` is the standard deviation of the
    samples between impacts; ``settings`` has the estimated properties of the instrument. The
    measurement of a pulse is described in `impactsig.detect.pulses.pulse`.

    If the pulses of a second are alike, each is measured with their common shape
    (`impactsig.detect.pulses.shape.shared_shape`). Standard errors of instants, contact times,
    peaks and impulses are those of the fit (its posterior covariance, and that of the common shape)
    or of the edges (noise divided by slope). They include the noise over the width of the pulse,
    the quantization step, the subtracted baseline, and the misfit of the model; see
    `impactsig.detect.pulses._errors`. The error of a common shape is the same for the impacts of a
    second: it cancels in their intervals. The delay of an anti-aliasing filter, common to all
    instants, is not included. A quantity that is not in the record, according to a flag, has an
    infinite error: the instant of a pulse that is open at its start, contact time and impulse of an
    open one, peak and impulse of a clipped one.

    Sound: see `impactsig.detect.sound.sound`. If at least half of the impacts sound alike, these
    are timed by their common waveform, to about a hundredth of a sample, and the others by their
    attack, to a sample. ``settings["alike"]`` is the fraction of the former. At rates up to 24 kHz,
    where the anti-alias filter rings before an impact, the others are timed by their common modes,
    to one or two tenths of a sample; if there are none, by the crossing of a fraction of their
    peak. Standard errors of the instants are those of the fit of the waveform (from its residuals)
    or of the modes (from the posterior of the instant), of the crossing (from the time that the
    sound stays above it and its noise), or of the attack (from the posterior of the change point,
    and the duration of the ringing before it). A delay common to all instants is not included.
    Instants of impacts weaker than twice the noise are occasionally off by many times their
    standard error.

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
