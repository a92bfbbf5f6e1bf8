"""From a file to all that the report says: impacts, period, dynamics, and how it was done."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..errors import ImpactsigWarning, InvalidInput, finite_number
from ..recording import Recording, Sensor
from .dynamics import Dynamics, read_dynamics

if TYPE_CHECKING:
    from ..impacts import Impacts
    from ..intervals import Periodicity
    from ..io import Blocks, FileInfo, RawLayout

WHOLE_BELOW = 20_000_000
"""Samples up to which a recording is held in memory; longer ones go through in blocks."""

OVERVIEW_BINS = 10_000
"""Spans the overview is reduced to: the least and the greatest sample of each are kept."""

EXCERPT = 20e-3
"""Time shown on either side of an impact whose contact time was not measured [s]."""


@dataclass(frozen=True, eq=False)
class Analysis:
    """What was found in one file, and how.

    Parameters
    ----------
    file : FileInfo
        The file and its channels.
    rate : float
        Samples per second of the channel analysed [Hz].
    overview : Recording
        The channel analysed; a long one reduced to the least and the greatest sample of each of
        10 000 spans, in that order, at the rate which that makes.
    excerpts : tuple of (int, Recording)
        Close-ups at full rate: index of an impact, and the samples around it.
    impacts : Impacts
    periodicity : Periodicity
    dynamics : Dynamics
        What the intervals say of the motion; its costly parts only where they were asked for.
    reading, detecting : mapping
        The options given, by name.
    forcing_frequency : float or None
        [Hz]
    warnings : tuple of str
        What was warned of on the way.
    """

    file: FileInfo
    rate: float
    overview: Recording
    excerpts: tuple[tuple[int, Recording], ...]
    impacts: Impacts
    periodicity: Periodicity
    dynamics: Dynamics
    reading: Mapping[str, Any]
    detecting: Mapping[str, Any]
    forcing_frequency: float | None
    warnings: tuple[str, ...]

    def summary(self) -> str:
        """The result in one sentence of words."""
        impacts = self.impacts
        count = f"{len(impacts)} impact{'' if len(impacts) == 1 else 's'}"
        run = f"{impacts.duration:.6g} s"
        if not len(impacts):
            return f"No impacts in {run}: {impacts.reason}."
        parts = [f"{count} in {run}"]
        if impacts.contact_time is not None:
            mean, spread = mean_and_spread(impacts.contact_time * 1e3)
            parts.append(f"contact time {mean} ms" + (f" ± {spread}" if spread else ""))
        return f"{self.periodicity.describe()}; {', '.join(parts)}."


def analyse(
    path: str | Path,
    *,
    forcing_frequency: float | None = None,
    dynamics: bool = False,
    channel: str | int | None = None,
    start: float | None = None,
    stop: float | None = None,
    scale: float | None = None,
    offset: float | None = None,
    unit: str | None = None,
    rate: float | None = None,
    sensor: Sensor | None = None,
    raw: RawLayout | None = None,
    threshold: float | str | None = None,
    polarity: Literal["auto", "positive", "negative"] | None = None,
    contact_level: float | str | None = None,
    contact_time: tuple[float, float] | None = None,
    merge_within: float | None = None,
    dead_time: float | None = None,
    gaps: Literal["refuse", "split"] | None = None,
    least_probability: float | None = None,
) -> Analysis:
    """Read one channel of a file, find its impacts, identify its period and read its dynamics.

    A recording of more than 20 million samples is taken in blocks, in bounded memory.

    Parameters
    ----------
    path : path-like
        The recording.
    forcing_frequency : float, optional
        Frequency of the forcing [Hz]; periods are then counted in forcing periods.
    dynamics : bool, optional
        Whether to add what takes seconds: the correlation dimension of the intervals, their largest
        Lyapunov exponent, and the test against surrogates. A train that is periodic for certain has
        the dimension 0 in any case.
    channel, start, stop, scale, offset, unit, rate, sensor, raw : optional
        As for `impactsig.read`.
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
        If the file has several channels and none was chosen, or an option cannot be used.
    UnreadableFile
        If the file cannot be read.

    Warns
    -----
    ImpactsigWarning
        As reading and detection do; the texts are kept in the result too.
    """
    from ..detect import detect_impacts
    from ..intervals import identify_period
    from ..io import info

    required = "a positive frequency [Hz]"
    if forcing_frequency is not None and (
        finite_number("forcing_frequency", forcing_frequency, required) <= 0
    ):
        raise InvalidInput("forcing_frequency", forcing_frequency, required)
    reading = _given(
        channel=channel,
        start=start,
        stop=stop,
        scale=scale,
        offset=offset,
        unit=unit,
        rate=rate,
        sensor=sensor,
        raw=raw,
    )
    detecting = _given(
        threshold=threshold,
        polarity=polarity,
        contact_level=contact_level,
        contact_time=contact_time,
        merge_within=merge_within,
        dead_time=dead_time,
        gaps=gaps,
        least_probability=least_probability,
    )
    with _collected_warnings() as told:
        file = info(path, raw=raw)
        source = open_recording(file, **reading)
        impacts = detect_impacts(source, **detecting)
        period = None if forcing_frequency is None else 1 / forcing_frequency
        periodicity = identify_period(impacts, forcing_period=period)
        found = read_dynamics(impacts, periodicity, forcing_frequency, dynamics)
        overview = overview_of(source, impacts.duration)
        excerpts = tuple(
            (index, _around(impacts, index, source, reading)) for index in typical(impacts)
        )
    return Analysis(
        file=file,
        rate=source.rate,
        overview=overview,
        excerpts=excerpts,
        impacts=impacts,
        periodicity=periodicity,
        dynamics=found,
        reading=reading,
        detecting=detecting,
        forcing_frequency=forcing_frequency,
        warnings=tuple(told),
    )


def _given(**options: Any) -> dict[str, Any]:
    """The options that were given; for the others the defaults of the layers below hold."""
    return {name: value for name, value in options.items() if value is not None}


@contextmanager
def _collected_warnings() -> Iterator[list[str]]:
    """The texts of the warnings of the block, each once; they are passed on when it ends."""
    told: list[str] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ImpactsigWarning)
            yield told
    finally:
        for warning in caught:
            message, kind = str(warning.message), warning.category
            if message not in told:
                warnings.warn(message, kind, stacklevel=4)
                if issubclass(kind, ImpactsigWarning):
                    told.append(message)


def detect_file(path: Path, reading: Mapping[str, Any], detecting: Mapping[str, Any]) -> Impacts:
    """The impacts of one channel of a file; a long one goes through in blocks."""
    from ..detect import detect_impacts
    from ..io import info

    file = info(path, raw=reading.get("raw"))
    return detect_impacts(open_recording(file, **reading), **detecting)


def open_recording(file: FileInfo, **reading: Any) -> Recording | Blocks:
    """One channel of a file: the recording, or its blocks where it is too long for memory.

    Raises
    ------
    InvalidInput
        If there are several channels and none was chosen; the message lists those of the file,
        under the numbers by which they are chosen.
    """
    from ..io import read, read_blocks

    longest = max((channel.length for channel in file.channels), default=0)
    opened = read if longest <= WHOLE_BELOW else read_blocks
    source = opened(file.path, **reading)
    if len(source.channels) > 1:
        listed = ", ".join(f"{i}: {channel.name!r}" for i, channel in enumerate(file.channels))
        raise InvalidInput(
            "channel",
            None,
            f"one of {listed}",
            "Impacts are looked for in one channel: give channel= (--channel)",
        )
    return source


def overview_of(source: Recording | Iterable[Recording], duration: float) -> Recording:
    """The source, reduced where it is long; no spike is lost by drawing the result.

    Parameters
    ----------
    source : Recording or iterable of Recording
        One channel, whole or in successive blocks.
    duration : float
        Length of the whole [s].

    Returns
    -------
    Recording
        The source itself where it has few samples. Otherwise the least and the greatest sample
        of each span, alternating, at the rate which that makes.
    """
    if isinstance(source, Recording) and len(source) <= 2 * OVERVIEW_BINS:
        return _flat(source)
    first, pieces = None, []
    for block in [source] if isinstance(source, Recording) else source:
        first = first or _flat(block.between())
        share = block.duration / duration if duration else 1.0
        _, low, high = _flat(block).envelope(max(1, round(OVERVIEW_BINS * share)))
        pieces.append(np.column_stack((low, high)).ravel())
    if first is None:
        raise InvalidInput("source", "no blocks", "at least one block of samples")
    samples = np.concatenate(pieces)
    rate = len(samples) / duration if duration and len(samples) else first.rate
    return replace(first, samples=samples, rate=rate)


def typical(impacts: Impacts) -> list[int]:
    """The weakest, the middle and the strongest impact; without peaks the first, middle, last."""
    if not len(impacts):
        return []
    order = np.arange(len(impacts)) if impacts.peak is None else np.argsort(impacts.peak)
    chosen = order[[0, len(order) // 2, -1]]
    return [int(index) for index in dict.fromkeys(chosen.tolist())]


def mean_and_spread(values: np.ndarray) -> tuple[str, str]:
    """Mean and standard deviation, both to the digit where the deviation has its second one."""
    mean = float(np.mean(values))
    if len(values) < 2:
        return f"{mean:.3g}", ""
    spread = float(np.std(values, ddof=1))
    if spread <= 1e-6 * abs(mean):
        return f"{mean:.4g}", "0"
    decimals = int(np.clip(1 - np.floor(np.log10(spread)), 0, 9))
    return f"{mean:.{decimals}f}", f"{spread:.{decimals}f}"


def _flat(recording: Recording) -> Recording:
    return recording if recording.samples.ndim == 1 else recording.channel(0)


def _around(
    impacts: Impacts, index: int, source: Recording | Blocks, reading: Mapping[str, Any]
) -> Recording:
    touch = float(impacts.time[index])
    contact = 0.0 if impacts.contact_time is None else float(impacts.contact_time[index])
    margin = 4 * contact or EXCERPT
    low, high = max(impacts.start, touch - margin), min(impacts.stop, touch + contact + margin)
    if isinstance(source, Recording):
        return _flat(source.between(low, high))
    from ..io import read

    return _flat(read(source.source, **{**reading, "start": low, "stop": high}))
