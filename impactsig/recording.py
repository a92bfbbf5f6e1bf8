"""Recording: the samples of an instrument, with their rate and units."""

from __future__ import annotations

import html
from dataclasses import dataclass, field, replace
from datetime import datetime
from fractions import Fraction
from typing import Literal

import numpy as np

from ._arguments import choice, entries, flag, instance, number, text, texts, whole
from ._showing import drawn_by
from ._sparkline import sparkline
from .errors import InvalidInput

Sensor = Literal["force", "sound"]


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Samples of one or several channels, taken at one rate.

    Parameters
    ----------
    samples : array_like, shape (n,) or (n, channels)
        The samples, in `units`. Kept in the floating type they come in (float32 or float64);
        integers become float64. Never copied if they are already such an array.
    rate : float
        Samples per second [Hz].
    units : sequence of str or str, optional
        Unit of each channel; one string stands for all of them.
    channels : sequence of str, optional
        Channel names.
    start : float, optional
        Time of the first sample [s] since the beginning of the source.
    recorded_at : datetime, optional
        Wall-clock time of the beginning of the source.
    source : str, optional
        Where the samples come from (a file name).
    sensor : {"force", "sound"}, optional
        Load cell, accelerometer and strain gauge are "force"; a microphone is "sound". This selects
        the method of detection.
    truncated : bool, optional
        Whether the source ended earlier than its header states.

    Raises
    ------
    InvalidInput
        If the rate is not positive, the samples are not one- or two-dimensional numbers, or the
        names and units do not match the number of channels.

    See Also
    --------
    read, Impacts, plot.waveform

    Examples
    --------
    >>> from impactsig import Recording
    >>> recording = Recording([0.0, 1.0, 0.0, 0.0], rate=1000.0, units="N", sensor="force")
    >>> recording.duration
    0.004
    """

    samples: np.ndarray
    rate: float
    units: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    start: float = 0.0
    recorded_at: datetime | None = None
    source: str = ""
    sensor: Sensor = "force"
    truncated: bool = field(default=False)

    def __post_init__(self) -> None:
        try:
            samples = np.asarray(self.samples)
        except Exception:  # rows of different lengths, or an array that raises
            raise InvalidInput("samples", self.samples, "rows of equal length") from None
        if samples.ndim not in (1, 2):
            raise InvalidInput("samples", f"shape {samples.shape}", "shape (n,) or (n, channels)")
        if samples.dtype.kind not in "biuf":
            raise InvalidInput("samples", f"dtype {samples.dtype}", "real numbers")
        if samples.dtype not in (np.float32, np.float64):
            samples = samples.astype(np.float64)
        if isinstance(self.samples, np.ma.MaskedArray):
            # What lies under the mask is no measurement.
            samples = np.where(
                np.ma.getmaskarray(self.samples), samples.dtype.type(np.nan), samples
            )
        count = 1 if samples.ndim == 1 else samples.shape[1]
        if count == 0:
            raise InvalidInput("samples", f"shape {samples.shape}", "at least one channel")
        rate = number("rate", self.rate, "a positive number [Hz]", above=0)
        start = number("start", self.start, "a finite time [s]")
        text("source", self.source)
        flag("truncated", self.truncated)
        if self.recorded_at is not None:
            instance("recorded_at", self.recorded_at, datetime)
        choice("sensor", self.sensor, ("force", "sound"))
        units = self._texts("units", ("",) * count)
        numbered = ("",) if count == 1 else tuple(f"channel {i}" for i in range(count))
        names = self._texts("channels", numbered)
        for name, value in (
            ("samples", samples),
            ("rate", rate),
            ("start", start),
            ("units", units),
            ("channels", names),
        ):
            object.__setattr__(self, name, value)

    def _texts(self, name: str, default: tuple[str, ...]) -> tuple[str, ...]:
        """The texts of a field, one a channel; empty, or None, stands for the default."""
        given = getattr(self, name)
        if given is None or isinstance(given, str):
            given = (given,) * (len(default) if name == "units" else 1) if given else ()
        found = entries(name, given, f"one text a channel ({len(default)})")
        return texts(name, found, len(default), "a channel") if found else default

    # -- size and time ---------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def duration(self) -> float:
        """Length of the record [s]: number of samples over rate."""
        return len(self.samples) / self.rate

    @property
    def stop(self) -> float:
        """Time just after the last sample [s]."""
        return self.start + self.duration

    @property
    def time(self) -> np.ndarray:
        """Time of every sample [s], shape (n,); made anew at each call."""
        return self.start + np.arange(len(self.samples)) / self.rate

    @property
    def unit(self) -> str:
        """Unit of the channels; where they differ, all of them, separated by commas."""
        return ", ".join(dict.fromkeys(self.units))

    # -- choosing --------------------------------------------------------------------------

    def channel(self, which: str | int) -> Recording:
        """Select one channel, by name or index; its samples have shape (n,)."""
        index = channel_index(self.channels, which)
        if self.samples.ndim == 1:
            return self
        return replace(
            self,
            samples=self.samples[:, index],
            units=(self.units[index],),
            channels=(self.channels[index],),
        )

    def between(self, start: float | None = None, stop: float | None = None) -> Recording:
        """Select the samples with start <= time < stop [s], without copying them.

        Raises
        ------
        InvalidInput
            If the span holds no sample.
        """
        first, last = sample_span(start, stop, self.rate, len(self.samples), self.start)
        return replace(self, samples=self.samples[first:last], start=self.start + first / self.rate)

    # -- changing --------------------------------------------------------------------------

    def calibrate(
        self, scale: float = 1.0, offset: float = 0.0, unit: str | None = None
    ) -> Recording:
        """Convert to another unit: ``scale * samples + offset``.

        `fit_calibration` fits both, with errors, to readings of known loads or of an impact hammer;
        its result is applied by ``calibration.apply(recording)``.

        Raises
        ------
        InvalidInput
            If scale is zero, or either number is not finite.
        """
        check_calibration(scale, offset)
        units = self.units if unit is None else (text("unit", unit),) * len(self.units)
        samples = self.samples
        if scale != 1.0 or offset != 0.0:
            samples = samples * samples.dtype.type(scale) + samples.dtype.type(offset)
        return replace(self, samples=samples, units=units)

    def resample(self, rate: float) -> Recording:
        """Resample to another rate by a linear-phase polyphase filter.

        A Kaiser window with 80 dB of stop-band attenuation; what lies above half the lower rate
        is removed. The rates must have a ratio of whole numbers up to 10 000.

        Raises
        ------
        InvalidInput
            If the rate is not positive or its ratio to the present rate is not of that kind.
        """
        from scipy.signal import firwin, resample_poly

        number("rate", rate, "a positive number [Hz]", above=0)
        ratio = Fraction(rate / self.rate).limit_denominator(10_000)
        if ratio == 0 or ratio.numerator > 10_000 or abs(self.rate * ratio / rate - 1) > 1e-9:
            raise InvalidInput(
                "rate",
                rate,
                f"a ratio of whole numbers up to 10 000 to {self.rate:g} Hz",
                "Choose a rate near it that has one",
            )
        if ratio == 1:
            return self
        widest = max(ratio.numerator, ratio.denominator)
        taps = firwin(64 * widest + 1, 0.94 / widest, window=("kaiser", 8.0))
        samples = resample_poly(self.samples, ratio.numerator, ratio.denominator, window=taps)
        return replace(self, samples=samples, rate=float(rate))

    # -- showing ---------------------------------------------------------------------------

    def envelope(self, bins: int = 2000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Minimum and maximum in each of `bins` spans, so that a plot shows every spike.

        Returns
        -------
        time : ndarray, shape (m,)
            Start of each span [s].
        low, high : ndarray, shape (m,) or (m, channels)
        """
        whole("bins", bins, 1)
        count = len(self.samples)
        edges = np.unique(np.linspace(0, count, min(bins, count) + 1).astype(np.intp)[:-1])
        if count == 0:
            empty = self.samples[:0]
            return np.empty(0), empty, empty
        # fmin and fmax pass over NaN: a missing sample must not hide the spike beside it.
        low = np.fmin.reduceat(self.samples, edges, axis=0)
        high = np.fmax.reduceat(self.samples, edges, axis=0)
        return self.start + edges / self.rate, low, high

    plot = drawn_by("waveform", "the waveform")

    def __repr__(self) -> str:
        shape = "x".join(str(size) for size in self.samples.shape)
        parts = [f"{shape} samples", f"{self.rate:g} Hz", f"{self.duration:.6g} s"]
        if self.unit:
            parts.append(self.unit)
        names = [name for name in self.channels if name]
        if names:
            parts.append(", ".join(names[:4]) + (", ..." if len(names) > 4 else ""))
        parts.append(self.sensor)
        if self.source:
            parts.append(self.source)
        if self.truncated:
            parts.append("TRUNCATED")
        return f"Recording({'; '.join(parts)})"

    def _repr_html_(self) -> str:
        text = html.escape(repr(self))
        return f"<div><code>{text}</code><br>{sparkline(self)}</div>"


def chosen_channel(
    recording: Recording, which: str | int | None, argument: str = "channel"
) -> Recording:
    """The channel asked for, or the only one there is.

    Raises
    ------
    InvalidInput
        If there are several and none is asked for; the message lists them.
    """
    if which is None and len(recording.channels) > 1:
        listed = ", ".join(f"{i}: {name!r}" for i, name in enumerate(recording.channels))
        raise InvalidInput(argument, None, f"one of {listed}")
    return recording.channel(0 if which is None else which)


def channel_index(names: tuple[str, ...], which: str | int, argument: str = "channel") -> int:
    """Index of a channel by exact name, by index, or by a digit string that is no name.

    Raises
    ------
    InvalidInput
        If there is no such channel, or its name stands more than once; the message lists them.
    """
    listed = ", ".join(f"{i}: {name!r}" for i, name in enumerate(names))
    if isinstance(which, str):
        found = [i for i, name in enumerate(names) if name == which]
        if len(found) == 1:
            return found[0]
        if len(found) > 1:
            raise InvalidInput(
                argument,
                which,
                f"an unambiguous channel of {listed}",
                f"Several have this name; give one of the indices {found}",
            )
        if not which.isdecimal():
            raise InvalidInput(argument, which, f"one of {listed}")
        which = int(which)
    if isinstance(which, bool) or not isinstance(which, (int, np.integer)):
        raise InvalidInput(argument, which, "a name or an index")
    if not 0 <= which < len(names):
        raise InvalidInput(argument, which, f"one of {listed}")
    return int(which)


def sample_span(
    start: float | None, stop: float | None, rate: float, count: int, origin: float = 0.0
) -> tuple[int, int]:
    """Indices [first, last) of the samples with start <= time < stop.

    Raises
    ------
    InvalidInput
        If a bound is not finite, or no sample lies between them.
    """
    end = origin + count / rate
    bounds = []
    for name, value, default in (("start", start, origin), ("stop", stop, end)):
        bound = default if value is None else number(name, value, "a finite time [s]")
        # A bound that names a sample's own time must hit it in spite of rounding.
        index = np.ceil((bound - origin) * rate - 1e-6)
        bounds.append(int(np.clip(index, 0, count)))
    first, last = bounds
    if first >= last and not (count == 0 and start is None and stop is None):
        raise InvalidInput(
            "start, stop",
            f"{start}, {stop}",
            f"a span with at least one sample inside {origin:g} to {end:g} s",
        )
    return first, last


def check_calibration(scale: float, offset: float) -> None:
    """Raise InvalidInput unless `scale` is finite and not zero, and `offset` finite."""
    required = "a finite number other than 0"
    if isinstance(scale, (list, tuple, np.ndarray)):
        remedy = "fit_calibration(readings, loads) fits one to pairs"
        raise InvalidInput("scale", scale, required, remedy)
    if number("scale", scale, required) == 0:
        raise InvalidInput("scale", scale, required)
    number("offset", offset, "a finite number")
