"""Analysis of a file for its report: impacts, period, dynamics, and the settings used."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..._arguments import number
from ..._trains.corrections import in_words
from ...detect.files import channel_readings, open_recording
from ...errors import ImpactsigWarning
from ...recording import Recording, Sensor
from .channels import around, typical
from .choosing import chosen
from .dynamics import Dynamics, read_dynamics
from .samples import Span, seen

if TYPE_CHECKING:
    from ...impacts import Impacts
    from ...intervals import Periodicity
    from ...io import Blocks, FileInfo, RawLayout

NOT_SEARCHED = "which of its channels shows them has to be said"


@dataclass(frozen=True, eq=False)
class Analysis:
    """The results of one file, and the settings they were obtained with.

    Parameters
    ----------
    file : FileInfo
        The file and its channels.
    rates : tuple of float
        Samples per second of each channel shown [Hz].
    overviews : tuple of Recording
        The channels shown, those searched for impacts first, in the clock of the first. A long
        channel is reduced to the minimum and maximum of each of 10 000 spans, in that order, with
        the corresponding rate.
    searched : int
        Number of channels that were searched for impacts.
    roles : tuple of str
        Role of each channel, by its unit, name or waveform; empty if the user chose the channels.
    spans : tuple of tuple of Span
        Samples around impacts for each channel, as many as fit on a page; none if the overview has
        every sample.
    excerpts : tuple of (int, Recording)
        Close-ups at full rate: index of an impact, and the samples around it, of the sensor of its
        stop where there is one, else of the first.
    impacts : Impacts
    periodicity : Periodicity
    dynamics : Dynamics
        Analysis of the intervals; its costly parts only if requested.
    reading, detecting : mapping
        The options given, by name.
    forcing_period : float or None
        As given [s].
    warnings : tuple of str
        Warnings during the analysis.
    """

    file: FileInfo
    rates: tuple[float, ...]
    overviews: tuple[Recording, ...]
    searched: int
    roles: tuple[str, ...]
    spans: tuple[tuple[Span, ...], ...]
    excerpts: tuple[tuple[int, Recording], ...]
    impacts: Impacts
    periodicity: Periodicity
    dynamics: Dynamics
    reading: Mapping[str, Any]
    detecting: Mapping[str, Any]
    forcing_period: float | None
    warnings: tuple[str, ...]

    def summary(self) -> str:
        """The result in one sentence."""
        impacts = self.impacts
        count = f"{len(impacts)} impact{'' if len(impacts) == 1 else 's'}"
        run = f"{impacts.duration:.6g} s"
        if not self.searched:
            return f"No impacts were looked for in {run}: {impacts.reason}."
        if not len(impacts):
            return f"No impacts in {run}: {impacts.reason}."
        parts = [f"{count} in {run}"]
        if impacts.contact_time is not None:
            mean, spread = mean_and_spread(impacts.contact_time * 1e3)
            parts.append(f"contact time {mean} ms" + (f" ± {spread}" if spread else ""))
        words = f"{self.periodicity.describe()}; {', '.join(parts)}."
        corrections = in_words(impacts)
        return f"{words} Corrected by hand: {corrections}." if corrections else words


def analyse(
    path: str | Path,
    *,
    forcing_period: float | None = None,
    dynamics: bool = False,
    channel: str | int | Sequence[str | int] | None = None,
    start: float | None = None,
    stop: float | None = None,
    scale: float | Sequence[float] | None = None,
    offset: float | Sequence[float] | None = None,
    unit: str | Sequence[str] | None = None,
    rate: float | None = None,
    resample: float | None = None,
    sensor: Sensor | Sequence[Sensor] | None = None,
    raw: RawLayout | None = None,
    stops: Sequence[int | None] | None = None,
    separate_stops: bool | None = None,
    threshold: float | str | None = None,
    polarity: Literal["auto", "positive", "negative", "both"] | None = None,
    contact_level: float | str | None = None,
    contact_time: tuple[float, float] | None = None,
    merge_within: float | None = None,
    dead_time: float | None = None,
    gaps: Literal["refuse", "split"] | None = None,
    least_probability: float | None = None,
) -> Analysis:
    """Read a file, detect its impacts, identify its period and estimate its dynamics.

    If the file has several channels and none is chosen, all are shown, and those with forces, else
    accelerations, else sounds, by their units and names, are searched for impacts. Channels without
    a telling unit or name are searched if their waveform consists of pulses, with a warning.

    A recording of more than 20 million samples is processed in blocks, in bounded memory.
    Corrections stored beside the file (`Impacts.write_corrections`) are applied.

    Parameters
    ----------
    path : path-like
        The recording.
    forcing_period : float, optional
        Period of the forcing [s]; periods are then counted in forcing periods.
    dynamics : bool, optional
        Whether to add analyses that take seconds: the correlation dimension of the intervals, their
        largest Lyapunov exponent, and the surrogate test. A train that is certainly periodic has
        the dimension 0 in any case.
    channel, start, stop, scale, offset, unit, rate, resample, sensor, raw : optional
        As for `impactsig.read`. Several channels are sensors of one machine, whose impacts are
        combined into one train; scale, offset, unit and sensor are then common to all, or sequences
        with one value per channel.
    stops : sequence of int or None, optional
        As for `impactsig.detect_impacts`.
    separate_stops : bool, optional
        Whether to distinguish two stops in the sound of one microphone, by
        `impactsig.separate_stops`.
    threshold, polarity, contact_level, contact_time, merge_within, dead_time : optional
        As for `impactsig.detect_impacts`.
    gaps, least_probability : optional
        As for `impactsig.detect_impacts`.

    Returns
    -------
    Analysis

    Raises
    ------
    InvalidInput
        If an option cannot be used.
    UnreadableFile
        If the file cannot be read.

    Warns
    -----
    ImpactsigWarning
        As reading and detection do, and if it is doubtful which channels show impacts; the warnings
        are in the result, too.
    """
    from ...detect.detect import detect_opened
    from ...intervals import identify_period
    from ...io import info

    if forcing_period is not None:
        number("forcing_period", forcing_period, "a positive period [s]", above=0)
    reading = _given(
        channel=channel,
        start=start,
        stop=stop,
        scale=scale,
        offset=offset,
        unit=unit,
        rate=rate,
        resample=resample,
        sensor=sensor,
        raw=raw,
    )
    detecting = _given(
        stops=stops,
        separate_stops=separate_stops,
        threshold=threshold,
        polarity=polarity,
        contact_level=contact_level,
        contact_time=contact_time,
        merge_within=merge_within,
        dead_time=dead_time,
        gaps=gaps,
        least_probability=least_probability,
    )
    with _collected_warnings() as messages:
        file = info(path, raw=raw)
        each = channel_readings(reading)
        roles: list[str] = []
        if channel is None and len(file.channels) > 1:
            sources, each, roles, searched, doubt = chosen(file, reading)
            if doubt:
                warnings.warn(f"{path}: {doubt}", ImpactsigWarning, stacklevel=2)
        else:
            sources = [open_recording(file, **one) for one in each]
            searched = len(sources)
        channels = [one.get("channel", 0) for one in each][:searched]
        if searched:
            impacts = detect_opened(sources[:searched], channels, path, **detecting)
        else:
            impacts = _not_searched(sources[0])
        periodicity = identify_period(impacts, forcing_period=forcing_period)
        found = read_dynamics(impacts, periodicity, forcing_period, dynamics)
        overviews, spans = seen(sources, impacts)
        excerpts = tuple(
            (index, around(impacts, index, sources, each)) for index in typical(impacts)
        )
    return Analysis(
        file=file,
        rates=tuple(source.rate for source in sources),
        overviews=overviews,
        searched=searched,
        roles=tuple(roles),
        spans=spans,
        excerpts=excerpts,
        impacts=impacts,
        periodicity=periodicity,
        dynamics=found,
        reading=reading,
        detecting=detecting,
        forcing_period=forcing_period,
        warnings=tuple(messages),
    )


def _not_searched(source: Recording | Blocks) -> Impacts:
    """An empty train, if no channel is known to show impacts."""
    from ...impacts import Impacts

    duration = source.duration
    return Impacts(np.empty(0), start=source.start, duration=duration, reason=NOT_SEARCHED)


def _given(**options: Any) -> dict[str, Any]:
    """The options that were given; others keep the defaults of the functions called."""
    return {name: value for name, value in options.items() if value is not None}


@contextmanager
def _collected_warnings() -> Iterator[list[str]]:
    """Collect the warnings of the block, each once; they are passed on at its end."""
    messages: list[str] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ImpactsigWarning)
            yield messages
    finally:
        for warning in caught:
            message, kind = str(warning.message), warning.category
            if message not in messages:
                warnings.warn(message, kind, stacklevel=4)
                if issubclass(kind, ImpactsigWarning):
                    messages.append(message)


def mean_and_spread(values: np.ndarray) -> tuple[str, str]:
    """Mean and standard deviation, rounded to the second digit of the deviation."""
    mean = float(np.mean(values))
    if len(values) < 2:
        return f"{mean:.3g}", ""
    spread = float(np.std(values, ddof=1))
    if spread <= 1e-6 * abs(mean):
        return f"{mean:.4g}", "0"
    decimals = int(np.clip(1 - np.floor(np.log10(spread)), 0, 9))
    return f"{mean:.{decimals}f}", f"{spread:.{decimals}f}"
